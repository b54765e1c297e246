// SPDX-License-Identifier: Apache-2.0
#include "cli/reconstruct_files.h"

#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "base/clock.h"
#include "cli/certificate_options.h"
#include "recon/effects/motion.h"
#include "recon/export/temperature_look_up.h"
#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "report/reconstruct_report.h"
#include "report/volume_axes.h"

namespace emberlock::cli {

void warn_if_too_fine(const recon::Scene& scene, const recon::ReconstructOptions& options, std::FILE* to) {
  const std::string warning = recon::too_fine_warning(scene, options.voxels.value_or(0));
  if (!warning.empty()) std::fprintf(to, "%-16s %s\n", "warning", warning.c_str());
}

Result<Written> reconstruct_files(const ReconstructArguments& arguments, const Watchers& watchers,
                                  const SolveScene& solve) {
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ReconstructOptions options, options_of(arguments));
  options.solve.stop = watchers.stop;
  const std::vector<std::filesystem::path> inputs = inputs_of(arguments);
  EMBERLOCK_RETURN_IF_ERROR(recon::check_output(arguments.out, inputs));
  if (watchers.stream != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::Device device, recon::resolve(options.solve.compute.device));
    watchers.stream->loading(device);
  }
  SteadyClock clock;
  const TimePoint begin = clock.now();
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Scene scene, load_views(arguments, watchers.progress));
  const Seconds loading = clock.now() - begin;
  EMBERLOCK_ASSIGN_OR_RETURN(const Certified certified, certify(arguments, watchers.progress, watchers.stop));
  warn_if_too_fine(scene, options, stderr);
  if (recon::is_stopped(options.solve))
    return Error{ErrorKind::refused, "ended early, as asked, before there was a volume to keep",
                 arguments.input};
  std::function<void(const recon::Preview&)> preview;
  if (watchers.stream != nullptr) {
    if (options.temperature)
      watchers.stream->look_up(recon::TemperatureLookUp(recon::response_for(*options.temperature, scene),
                                                        recon::taken_for(options.temperature->emitter)));
    preview = [&](const recon::Preview& state) {
      watchers.stream->iteration(state, scene, options.solve.compute);
    };
  }
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Outcome outcome,
                             solve(scene, options, clock, watchers.progress, preview));
  if (arguments.part)
    EMBERLOCK_RETURN_IF_ERROR(recon::check_carried(scene, outcome.reconstruction.effects.motion));
  outcome.report.input = arguments.input;
  outcome.report.up = report::shown_axes(scene.views).up_axis();
  const TimePoint done = clock.now();
  EMBERLOCK_RETURN_IF_ERROR(recon::write_outcome(
      outcome, arguments.out, inputs, report::reconstruct_html(scene, outcome), certified.certification));
  const Seconds writing = clock.now() - done;
  if (watchers.stream != nullptr) watchers.stream->done(outcome, scene, arguments.out);
  return Written{std::move(outcome), std::move(options.solve), loading, writing, certified.words};
}

}  // namespace emberlock::cli
