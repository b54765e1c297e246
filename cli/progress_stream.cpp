// SPDX-License-Identifier: Apache-2.0
#include "cli/progress_stream.h"

#include <algorithm>
#include <csignal>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/prctl.h>

#include "recon/adjust/picture_error.h"
#include "recon/export/error_words.h"
#include "recon/export/picture.h"
#include "recon/export/preview.h"
#include "recon/export/temperature_words.h"
#include "recon/pipeline/advice.h"
#include "recon/preprocess/radiance.h"
#include "recon/render/render.h"
#include "session/child_messages.h"
#include "session/files.h"

namespace emberlock::cli {
namespace {

constexpr int kWidest = 480;  // width of a picture in pixels
constexpr int kBlocks = 64;   // of a volume, along its longest edge
constexpr auto kRarely = std::chrono::milliseconds(200);
constexpr int kShare = 20;  // pictures take at most one part in this many of the time

v1::Iteration numbers(const recon::TracePoint& point, bool judged) {
  v1::Iteration iteration;
  iteration.set_iteration(static_cast<std::uint32_t>(point.iteration));
  iteration.set_seconds(point.time.value());
  iteration.set_input_rmse(recon::all_channels(point.input_rmse));
  if (judged) iteration.set_heldout_rmse(recon::all_channels(point.heldout_rmse));
  return iteration;
}

/// The view to show: a held-out one, if there is any.
std::size_t shown_view(const recon::Scene& scene) {
  const auto held_out = std::find_if(scene.views.begin(), scene.views.end(), [](const recon::View& view) {
    return view.role == recon::ViewRole::held_out;
  });
  return held_out == scene.views.end() ? 0 : static_cast<std::size_t>(held_out - scene.views.begin());
}

bool is_judged(const recon::Scene& scene) {
  return scene.views[shown_view(scene)].role == recon::ViewRole::held_out;
}

std::string jpeg(const recon::RadianceImage& image) {
  auto bytes = recon::to_jpeg(recon::to_rgb8(image).view());
  return bytes ? std::move(*bytes) : std::string();
}

void add_pictures(v1::IterationPreview& message, const recon::View& view,
                  const recon::RadianceImage& rendered) {
  message.set_camera_id(view.name);
  message.set_captured_jpeg(jpeg(recon::shrunk(*view.image, rendered.size)));
  message.set_rendered_jpeg(jpeg(rendered));
}

void add_volume(v1::VolumePreview& preview, const recon::Volume& volume) {
  const recon::CoarseBrightness coarse = recon::coarse_brightness(volume, kBlocks);
  preview.set_nx(static_cast<std::uint32_t>(coarse.nx));
  preview.set_ny(static_cast<std::uint32_t>(coarse.ny));
  preview.set_nz(static_cast<std::uint32_t>(coarse.nz));
  for (const double value : coarse.box.center) preview.mutable_box()->add_center(value);
  for (const double value : coarse.box.size) preview.mutable_box()->add_size(value);
  preview.set_brightest(coarse.brightest);
  preview.set_voxels(coarse.voxels.data(), coarse.voxels.size());
}

/// Nothing if no block tells anything.
void add_layer(v1::IterationPreview& message, const recon::CoarseLayer& layer, bool quick = false) {
  if (!(layer.high > layer.low)) return;
  using Kind = recon::CoarseLayer::Kind;
  v1::VolumeLayer& added = *message.mutable_volume()->add_layers();
  added.set_kind(layer.kind == Kind::temperature         ? v1::VolumeLayer::TEMPERATURE
                 : layer.kind == Kind::temperature_sigma ? v1::VolumeLayer::TEMPERATURE_SIGMA
                 : layer.kind == Kind::emission_sigma    ? v1::VolumeLayer::EMISSION_SIGMA
                                                         : v1::VolumeLayer::EXTINCTION_SIGMA);
  added.set_low(layer.low);
  added.set_high(layer.high);
  added.set_voxels(layer.voxels.data(), layer.voxels.size());
  added.set_quick(quick);
}

void add_looked_up(v1::IterationPreview& message, const recon::Volume& volume,
                   const recon::TemperatureLookUp& temperatures) {
  const Meters edge(static_cast<double>(volume.grid.edge));
  const std::vector<float> emission = recon::coarse_emission(volume, kBlocks);
  const std::vector<float> kelvin = temperatures.read(emission, edge);
  const recon::BarEnds middle = recon::middle_by_light(kelvin, emission);
  add_layer(message,
            recon::layer_of(recon::CoarseLayer::Kind::temperature, kelvin,
                            recon::kelvin_bar(middle.low, middle.high)),
            true);
}

/// What was measured in the finished volume; temperatures where those looked up are, too.
void add_measured(v1::IterationPreview& message, const recon::Outcome& outcome) {
  using Kind = recon::CoarseLayer::Kind;
  const recon::Grid& grid = outcome.reconstruction.volume.grid;
  const std::vector<float>& light = outcome.reconstruction.volume.emission;
  if (outcome.temperature) {
    const auto least =
        static_cast<float>(recon::kShareThatCounts) * *std::max_element(light.begin(), light.end());
    const auto add_lit = [&](Kind kind, const std::vector<float>& values, recon::BarEnds ends) {
      const auto value = [&](std::size_t p) {
        return std::max({light[3 * p], light[3 * p + 1], light[3 * p + 2]}) < least ? 0.0F : values[p];
      };
      add_layer(message, recon::coarse_layer(kind, grid, kBlocks, value, ends));
    };
    const recon::TemperatureSummary& summary = outcome.temperature->summary;
    add_lit(Kind::temperature, outcome.temperature->kelvin, recon::kelvin_bar(summary.low, summary.high));
    add_lit(Kind::temperature_sigma, outcome.temperature->sigma, recon::kelvin_sigma_bar(summary.sigma));
  }
  if (!outcome.errors) return;
  add_layer(message, recon::coarse_layer(Kind::emission_sigma, grid, kBlocks, [&](std::size_t p) {
              return static_cast<float>(outcome.errors->sigma(p).mean());
            }));
  const std::vector<float>& extinction = outcome.errors->extinction;
  if (!extinction.empty())
    add_layer(message, recon::coarse_layer(Kind::extinction_sigma, grid, kBlocks,
                                           [&](std::size_t p) { return extinction[p]; }));
}

/// A view of the volume in its present state.
recon::RadianceImage rendered_small(const recon::Volume& volume, const recon::Preview& preview,
                                    const recon::View& view, const recon::ComputeOptions& compute) {
  const ImageSize size = recon::preview_size(view.image->size, kWidest);
  recon::Effects effects = preview.effects;
  effects.scattering = {};
  effects.refraction = {};  // shifts objects by less than one of these pixels
  recon::RenderOptions options{.compute = compute};
  recon::RadianceImage behind;
  if (view.background) {
    behind = recon::shrunk(*view.background, size);
    options.background = &behind;
  }
  return recon::render_view(volume, preview.hull, effects, recon::resized(view.camera, size), options);
}

}  // namespace

Result<ProgressStream> ProgressStream::open(int fd) {
  if (::fcntl(fd, F_GETFD) < 0) {
    return Error{ErrorKind::bad_input, fmt::format("descriptor {} isn't open", fd), "--progress-fd",
                 "Start this program with a pipe there"};
  }
  ::signal(SIGPIPE, SIG_IGN);
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  return ProgressStream(fd);
}

void ProgressStream::send(const v1::ChildMessage& message) {
  if (!broken_) broken_ = !session::write_fully(fd_, session::framed(message), "--progress-fd").ok();
}

void ProgressStream::loading(recon::Device device) {
  v1::ChildMessage message;
  message.mutable_progress()->set_doing("loading the pictures");
  message.mutable_progress()->set_device(name(device));
  send(message);
}

void ProgressStream::progress(double fraction, std::string_view doing) {
  v1::ChildMessage message;
  message.mutable_progress()->set_fraction(fraction);
  message.mutable_progress()->set_doing(std::string(doing));
  send(message);
}

void ProgressStream::iteration(const recon::Preview& preview, const recon::Scene& scene,
                               const recon::ComputeOptions& compute) {
  if (broken_) return;
  v1::ChildMessage message;
  v1::IterationPreview& shown = *message.mutable_iteration();
  *shown.mutable_iteration() = numbers(preview.point, is_judged(scene));
  const Clock::time_point begin = Clock::now();
  if (begin >= pictures_due_) {
    if (const std::optional<recon::Volume> volume = preview.recent()) {
      const recon::View& view = scene.views[shown_view(scene)];
      add_pictures(shown, view, rendered_small(*volume, preview, view, compute));
      add_volume(*shown.mutable_volume(), *volume);
      if (temperatures_) add_looked_up(shown, *volume, *temperatures_);
      pictures_due_ = begin + std::max<Clock::duration>(kRarely, kShare * (Clock::now() - begin));
    }
  }
  send(message);
}

void ProgressStream::done(const recon::Outcome& outcome, const recon::Scene& scene,
                          const std::string& folder) {
  v1::ChildMessage last;
  v1::IterationPreview& shown = *last.mutable_iteration();
  const recon::Report& report = outcome.report;
  if (!report.trace.empty()) *shown.mutable_iteration() = numbers(report.trace.back(), is_judged(scene));
  const std::size_t v = shown_view(scene);
  const ImageSize size = recon::preview_size(scene.views[v].image->size, kWidest);
  add_pictures(shown, scene.views[v], recon::shrunk(outcome.renders[v], size));
  add_volume(*shown.mutable_volume(), outcome.reconstruction.volume);
  add_measured(shown, outcome);
  send(last);
  written(report, folder);
}

void ProgressStream::stylized(const v1::StylizationStatus& status, const v1::Iteration& iteration,
                              const recon::RadianceImage& edited, const recon::RadianceImage& rendered,
                              const recon::Volume* volume) {
  if (broken_) return;
  v1::ChildMessage message;
  v1::IterationPreview& shown = *message.mutable_iteration();
  *shown.mutable_stylization() = status;
  *shown.mutable_iteration() = iteration;
  shown.set_camera_id(status.view());
  shown.set_captured_jpeg(jpeg(edited));
  shown.set_rendered_jpeg(jpeg(rendered));
  if (volume != nullptr) add_volume(*shown.mutable_volume(), *volume);
  send(message);
}

void ProgressStream::edited(const v1::ChildMessage::Edited& edited) {
  v1::ChildMessage message;
  *message.mutable_edited() = edited;
  send(message);
}

void ProgressStream::written(const recon::Report& report, const std::string& folder) {
  v1::ChildMessage message;
  v1::ChildMessage::Done& done = *message.mutable_done();
  for (const recon::EffectReport& effect : report.effects)
    done.add_effects(fmt::format("{} {}: {}", effect.name, effect.on ? "on" : "off", effect.reason));
  for (const std::string& words : report.voxel_choice.words) done.add_advice(words);
  if (std::string kept = recon::what_was_kept(report); !kept.empty()) done.add_advice(std::move(kept));
  for (const std::string& advice : recon::next_steps(report)) done.add_advice(advice);
  if (report.errors)
    for (const std::string& words : recon::error_words(*report.errors)) done.add_advice(words);
  for (const std::string& warning : report.warnings) done.add_warnings(warning);
  if (report.temperature)
    for (const std::string& words : recon::temperature_words(*report.temperature))
      done.add_temperature(words);
  done.set_result(folder);
  send(message);
}

void ProgressStream::failed(const Error& error) {
  v1::ChildMessage message;
  message.mutable_failure()->set_message(error.message());
  send(message);
}

void ProgressStream::ar_picture(v1::ArPicture picture) {
  v1::ChildMessage message;
  *message.mutable_ar_picture() = std::move(picture);
  send(message);
}

void ProgressStream::live(const recon::LiveVolume& live) {
  v1::ChildMessage message;
  v1::LiveFrame& frame = *message.mutable_live_frame();
  frame.set_frame(live.frame);
  frame.set_filmed_ns(live.filmed.ns);
  frame.set_seconds(live.took.value());
  frame.set_skipped(live.skipped);
  frame.set_voxels(static_cast<std::uint32_t>(live.voxels));
  frame.set_takes_s(live.typical.value());
  frame.set_keeps_up(live.verdict.keeps_up);
  frame.set_holds_every(static_cast<std::uint32_t>(live.verdict.holds_every));
  frame.set_holds_voxels(static_cast<std::uint32_t>(live.verdict.holds_voxels));
  if (live.volume)
    add_volume(*frame.mutable_volume(), *live.volume);
  else
    frame.set_failure(live.volume.error().message());
  send(message);
}

}  // namespace emberlock::cli
