// SPDX-License-Identifier: Apache-2.0
#include "paper/run.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "paper/passes.h"
#include "paper/run_errors.h"
#include "recon/preprocess/radiance.h"
#include "recon/render/render.h"

namespace emberlock::paper {
namespace {

/// The first input and the first two tests stand for all.
std::vector<RunPicture> pictures_of(const recon::Scene& scene,
                                    const std::vector<recon::RadianceImage>& shown) {
  std::vector<RunPicture> pictures;
  int inputs = 1;
  int tests = 2;
  for (std::size_t v = 0; v < shown.size(); ++v) {
    const bool input = scene.views[v].role == recon::ViewRole::input;
    int& left = input ? inputs : tests;
    if (left-- <= 0) continue;
    pictures.push_back({fmt::format("{}-{}", input ? "input" : "test", v), recon::to_rgb8(shown[v])});
  }
  return pictures;
}

}  // namespace

recon::Scene input_views(const recon::Scene& scene) {
  recon::Scene inputs = scene;
  std::erase_if(inputs.views, [](const recon::View& v) { return v.role != recon::ViewRole::input; });
  return inputs;
}

Result<MethodRun> run_method(const Protocol& protocol, const Case& of, const Method& method,
                             const KnownGas& gas, const recon::Scene& scene, const RunSettings& settings,
                             const Clock& clock) {
  MethodRun run;
  run.protocol = protocol.name;
  run.of = of.name;
  run.method = method.facts.name;
  run.device = recon::name(settings.compute.device);
  MethodOptions options;
  options.voxels = settings.voxels;
  options.seed = settings.seed;
  options.compute = settings.compute;
  options.stop = settings.stop;
  options.response = gas.response;
  options.emitter = recon::Emitter::soot;  // known_gas.h
  options.temperatures = protocol.temperatures && gas.subject == Subject::flame;
  const recon::Scene inputs = input_views(scene);
  const TimePoint begin = clock.now();
  const Result<MethodResult> result = method.run(inputs, options);
  run.time = clock.now() - begin;
  if (settings.stop && settings.stop())
    return Error{ErrorKind::refused, "ended early, as asked", std::string(method.facts.name)};
  if (!result.ok()) {
    // What a device or a disk refuses now it may do the next time.
    if (result.error().kind == ErrorKind::device || result.error().kind == ErrorKind::io)
      return result.error();
    run.failed = result.error().message();
    return run;
  }
  const std::vector<recon::RadianceImage> shown = show(*result, scene, settings.compute);
  const RunErrors errors = errors_of(*result, shown, scene, gas);
  if (const Status finite = check_finite(errors); !finite.ok()) {
    run.failed = finite.error().message();
    return run;
  }
  run.errors = errors;
  run.iterations = result->iterations;
  run.chose = result->chose;
  if (options.temperatures && !result->kelvin.empty()) {
    run.temperature = temperature_errors(result->volume.grid, result->kelvin, gas);
    run.slice = temperature_slice(result->volume.grid, result->kelvin, gas);
  }
  run.pictures = pictures_of(scene, shown);
  if (!protocol.iterations.empty()) add_passes(protocol, method, gas, scene, settings, clock, run);
  if (settings.stop && settings.stop())
    return Error{ErrorKind::refused, "ended early, as asked", std::string(method.facts.name)};
  return run;
}

}  // namespace emberlock::paper
