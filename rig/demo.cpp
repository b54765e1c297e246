// SPDX-License-Identifier: Apache-2.0
#include "rig/demo.h"

#include <algorithm>
#include <cmath>
#include <string_view>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/in_parallel.h"
#include "drivers/virtual/virtual_clock.h"
#include "recon/calibrate/rig.h"
#include "recon/pipeline/certify.h"
#include "recon/pipeline/scene.h"
#include "rig/align/record.h"
#include "session/async_writer.h"

namespace emberlock::rig {
namespace {

constexpr Rows kByHandTolerance{100};
constexpr Rows kTimedTolerance{10};
constexpr int kPaperIterations = 70;  // at which the paper's figures end

Seconds since(TimePoint start) { return SteadyClock{}.now() - start; }

Status check(const DemoOptions& o) {
  const auto out_of_range = [](const char* option, const char* range) {
    return Error{ErrorKind::bad_input, std::string("out of range"), option, std::string("Choose ") + range};
  };
  if (o.cameras < 3 || o.cameras > 64) return out_of_range("--cameras", "3 to 64");
  if (o.image.width < 160 || o.image.width > 4096 || o.image.height < 160 || o.image.height > 730) {
    return out_of_range("--image", "160x160 to 4096x730: a frame must be read within its period");
  }
  if (o.flame_frames < 1 || o.flame_frames > 60) return out_of_range("--frames", "1 to 60");
  if (o.voxels < 8 || o.voxels > 512) return out_of_range("--voxels", "8 to 512");
  return {};
}

bool asked(const StopAsked& stop) { return stop && stop(); }

/// The opened rig, as an alignment uses it.
struct Rig {
  std::shared_ptr<drivers::VirtualClock> clock = std::make_shared<drivers::VirtualClock>();
  std::unique_ptr<drivers::VirtualRig> rig;
  std::vector<smear::CcdTiming> timing;  // n, K, T, d as configured; t_row is measured

  [[nodiscard]] AlignRig devices() const {
    AlignRig view{{}, &rig->strobe(), clock.get()};
    for (int i = 0; i < rig->size(); ++i) view.cameras.push_back(&rig->camera(i));
    return view;
  }
};

Result<Rig> open_rig(const DemoOptions& options) {
  drivers::VirtualRigDraw draw;
  draw.cameras = options.cameras;
  draw.seed = options.seed;
  draw.layout = {options.image, PixelFormat::bayer_rggb8, 8};
  // A sensor with fewer rows has the same read time, with a longer row time.
  draw.row_time = microseconds_per_row(54) * (720.0 / options.image.height);
  Rig opened;
  EMBERLOCK_ASSIGN_OR_RETURN(opened.rig,
                             drivers::VirtualRig::create(drivers::draw_virtual_rig(draw), opened.clock));
  for (int i = 0; i < opened.rig->size(); ++i) {
    // From a datasheet: the alignment must find out how cameras differ.
    smear::CcdTiming timing = opened.rig->truth(i).timing;
    timing.frame_period = period(draw.rate);
    timing.row_time = draw.row_time;
    opened.timing.push_back(timing);
  }
  return opened;
}

SmearSnapshot snapshot(const AlignRoundReport& report) {
  SmearSnapshot shot;
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    SmearSnapshot::Camera camera{report.cameras[i].id, report.frames[i].back(), report.readings[i].back(),
                                 report.round.cameras[i].phase, std::nullopt};
    if (const auto error = report.decision.cameras[i].error) camera.error = *error / report.options.row_time;
    shot.cameras.push_back(std::move(camera));
  }
  shot.target_tau = report.decision.target;
  return shot;
}

/// Aligns; writes a recording to `record`, if given, so that `emberlock align --replay` shows the same
/// decisions.
Result<AlignStage> align(const Rig& rig, AlignStage stage, AlignRunOptions options,
                         const std::optional<std::filesystem::path>& record, const Progress& progress,
                         const StopAsked& stop) {
  options.align.policy = stage.policy;
  options.align.tolerance.amount = stage.tolerance;
  options.timing = rig.timing;
  const TimePoint start = SteadyClock{}.now();
  const auto observe = [&](const AlignRoundReport& report) {
    stage.last = snapshot(report);
    if (!stage.first.target_tau) stage.first = stage.last;
    std::vector<std::optional<Rows>> errors;
    for (const auto& camera : stage.last.cameras) errors.push_back(camera.error);
    stage.errors.push_back(std::move(errors));
  };
  EMBERLOCK_ASSIGN_OR_RETURN(stage.result,
                             record ? record_align(*record, rig.devices(), options, observe, progress, stop)
                                    : run_align(rig.devices(), options, observe, progress, stop));
  stage.seconds = since(start);
  if (stage.result.last.verdict != smear::AlignVerdict::aligned && !asked(stop)) {
    return Error{ErrorKind::device, "not aligned: " + stage.result.words.reason, stage.title,
                 "Try another --seed"};
  }
  return stage;
}

/// Aligns to 100 rows like an operator, then to 10 rows by timed resets; the latter is recorded.
Status align_twice(Rig& rig, DemoResult& result, const std::filesystem::path& folder,
                   const ProgressFactory& progress, const StopAsked& stop) {
  AlignRunOptions options;
  options.seed = result.options.seed;
  rig.rig->set_reset(ShutterReset::by_hand);
  EMBERLOCK_ASSIGN_OR_RETURN(AlignStage by_hand,
                             align(rig,
                                   {.title = "within 100 rows, buttons pressed by hand",
                                    .policy = smear::AlignPolicy::densest,
                                    .tolerance = kByHandTolerance},
                                   options, std::nullopt, progress("align by hand, 100 rows"), stop));
  if (asked(stop)) return {};
  for (const auto& clock : by_hand.result.row_clocks) {
    if (!clock)
      return Error{ErrorKind::device, "a camera's row time was not measured", "comb", "Try another --seed"};
    result.row_clocks.push_back(*clock);
  }
  rig.rig->set_reset(ShutterReset::on_command);
  rig.timing = by_hand.result.timing;
  options.measure_row_time = false;
  options.delays = by_hand.result.delays;
  EMBERLOCK_ASSIGN_OR_RETURN(AlignStage timed, align(rig,
                                                     {.title = "within 10 rows, timed resets",
                                                      .policy = smear::AlignPolicy::timed,
                                                      .tolerance = kTimedTolerance},
                                                     options, folder / "alignment",
                                                     progress("align by timed resets, 10 rows"), stop));
  result.kept.push_back(fmt::format("alignment/: {} rounds", timed.result.last.round));
  result.stages = {std::move(by_hand), std::move(timed)};
  return {};
}

/// The largest difference between two cameras' true starts of read-out.
Seconds true_worst_pair(const Rig& rig) {
  const TimePoint now = rig.clock->now();
  Seconds worst;
  for (int a = 0; a < rig.rig->size(); ++a) {
    for (int b = 0; b < a; ++b) {
      const Seconds apart = rig.rig->read_start_after(a, now) - rig.rig->read_start_after(b, now);
      worst = std::max(worst, abs(wrap_symmetric(apart, rig.timing[0].frame_period)));
    }
  }
  return worst;
}

/// Films with one camera: `count` frames that were exposed after `from`, or fewer if it is stopped.
Status film(drivers::Camera& camera, std::size_t index, TimePoint from, int count,
            session::AsyncWriter& writer, const StopAsked& stop) {
  for (int recorded = 0; recorded < count && !asked(stop);) {
    EMBERLOCK_ASSIGN_OR_RETURN(Frame frame, camera.next_frame(Seconds(3)));
    if (frame.stamp.monotonic_time < from) continue;
    if (!writer.push(index, std::move(frame))) {
      return Error{ErrorKind::io, "the recorder's queue is full", camera.info().id, "Use a faster disk"};
    }
    ++recorded;
  }
  return {};
}

/// Switches the strobe off and the flame on; the cameras film it in parallel.
Status record_flame(Rig& rig, const Stage& stage, DemoResult& result, const std::filesystem::path& folder,
                    const Progress& progress, const StopAsked& stop) {
  EMBERLOCK_RETURN_IF_ERROR(rig.rig->strobe().apply({.output = drivers::StrobeOutput::off}));
  recon::FlameOptions flame;
  flame.seed = result.options.seed;
  EMBERLOCK_RETURN_IF_ERROR(rig.rig->set_scene(
      drivers::flame_scene(std::make_shared<FlameLight>(stage, flame, result.options.truth_voxels))));
  v1::Manifest manifest;
  manifest.set_session_id("demo-flame");
  manifest.set_purpose("flame");
  *manifest.mutable_box() = recon::message_of(stage.box);
  const auto cameras = static_cast<std::size_t>(rig.rig->size());
  for (std::size_t i = 0; i < cameras; ++i) {
    *manifest.add_cameras() = describe(rig.rig->camera(static_cast<int>(i)).info(), stage.cameras[i]);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionWriter session,
                             session::SessionWriter::create(folder / "flame", manifest));
  session::AsyncWriter writer(std::move(session), {.when_full = session::WhenFull::wait});
  const TimePoint from = rig.clock->now() + 3 * rig.timing[0].frame_period;
  const Observer observer = [&](double fraction, std::string_view what) {
    tell(progress, kNearlyDone * fraction, what);
    return true;
  };
  EMBERLOCK_RETURN_IF_ERROR(in_parallel(cameras, observer, [&](std::size_t i, const Observer& part) {
    part(0, "filming the flame");
    return film(rig.rig->camera(static_cast<int>(i)), i, from, result.options.flame_frames, writer, stop);
  }));
  EMBERLOCK_ASSIGN_OR_RETURN(result.flame_session, writer.finish());
  std::uint64_t frames = 0;
  for (const v1::CameraStream& camera : result.flame_session.cameras()) frames += camera.counts().recorded();
  result.kept.push_back(fmt::format("flame/: {} frames of {} cameras", frames, cameras));
  tell(progress, 1, "recorded");
  return {};
}

Status reconstruct_flame(DemoResult& result, const std::filesystem::path& folder,
                         const ProgressFactory& progress, const StopAsked& stop) {
  EMBERLOCK_ASSIGN_OR_RETURN(result.scene, recon::load_scene(folder / "flame"));
  result.held_out = result.options.cameras / 2;
  EMBERLOCK_RETURN_IF_ERROR(recon::hold_out(result.scene, {result.held_out}));
  recon::ReconstructOptions options;
  options.voxels = result.options.voxels;
  options.solve.compute.threads = result.options.threads;
  options.solve.stop = stop;
  SteadyClock clock;
  EMBERLOCK_ASSIGN_OR_RETURN(result.outcome,
                             recon::reconstruct(result.scene, options, clock, progress("reconstruct")));
  result.outcome.report.input = "flame";
  recon::FileHashes hashes;
  recon::Certification certification;
  EMBERLOCK_ASSIGN_OR_RETURN(certification.certificate, recon::origin_of(folder / "flame", {}, {}, &hashes));
  EMBERLOCK_RETURN_IF_ERROR(
      recon::write_outcome(result.outcome, folder / "reconstruction", {}, {}, certification));
  result.kept.emplace_back("reconstruction/: volume.vdb, views/, report.json");
  if (asked(stop)) return {};
  options.solve.solver = recon::Solver::paper;
  options.solve.iterations = kPaperIterations;
  // The paper's solver refuses pictures with marked saturated pixels, which it doesn't support: it gets them
  // unmarked.
  recon::Scene unmarked = result.scene;
  for (recon::View& view : unmarked.views) view.bounds.reset();
  EMBERLOCK_ASSIGN_OR_RETURN(
      result.paper, recon::reconstruct(unmarked, options, clock, progress("the paper's solver beside it")));
  result.whole = true;
  return {};
}

}  // namespace

Result<DemoResult> run_demo(const DemoOptions& options, const std::filesystem::path& folder,
                            const ProgressFactory& progress, const StopAsked& stop) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  const TimePoint start = SteadyClock{}.now();
  DemoResult result;
  result.options = options;
  EMBERLOCK_ASSIGN_OR_RETURN(Rig rig, open_rig(options));
  for (int i = 0; i < rig.rig->size(); ++i)
    result.true_row_times.push_back(rig.rig->truth(i).timing.row_time);
  EMBERLOCK_RETURN_IF_ERROR(align_twice(rig, result, folder, progress, stop));
  if (asked(stop)) return result;
  result.true_worst_pair = true_worst_pair(rig);
  const TimePoint recording = SteadyClock{}.now();
  const Stage stage = demo_stage(options.cameras, options.image);
  EMBERLOCK_RETURN_IF_ERROR(record_flame(rig, stage, result, folder, progress("record the flame"), stop));
  if (asked(stop)) return result;
  result.record_seconds = since(recording);
  EMBERLOCK_RETURN_IF_ERROR(reconstruct_flame(result, folder, progress, stop));
  result.total_seconds = since(start);
  return result;
}

}  // namespace emberlock::rig
