// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/live_run.h"

#include <memory>
#include <utility>

#include "recon/pipeline/single_run.h"

namespace emberlock::recon {
namespace {

/// Of this machine's memory, for a solve beside a recording.
constexpr double kShareOfMemory = 0.25;
/// A box that was found at one instant is made so much larger.
constexpr double kRoomToMove = 1.25;

ReconstructOptions live_solve_options(const LiveOptions& live) {
  ReconstructOptions options;
  options.effects = parse_effects("none").value();
  options.solve.iterations = LiveRun::kPasses;
  options.solve.compute = live.compute;
  options.solve.stop = live.stop;
  options.choose_by_front = false;
  options.correct_pointing = false;
  return options;
}

Hertz rate_of(const session::SessionReader& reader, std::size_t camera) {
  return Hertz(reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz());
}

}  // namespace

LiveRun::LiveRun(session::SessionReader reader, LiveOptions options, const Clock& clock)
    : reader_(std::move(reader)),
      options_(std::move(options)),
      clock_(clock),
      pace_{options_.every, reader_.camera_count() > 0 ? rate_of(reader_, 0) : Hertz(0)},
      frames_(options_.every) {
  scene_.threads = options_.compute.threads;
  scene_.recording = std::make_shared<SharedRecording>();
}

int LiveRun::voxels() const { return options_.voxels ? *options_.voxels : choice_->voxels(); }

Result<std::optional<LiveVolume>> LiveRun::step(const std::vector<std::uint64_t>& safe) {
  EMBERLOCK_RETURN_IF_ERROR(reader_.advance(safe));
  std::vector<FramesSoFar> cameras;
  cameras.reserve(reader_.camera_count());
  for (std::size_t i = 0; i < reader_.camera_count(); ++i)
    cameras.push_back({&reader_.stamps(i), rate_of(reader_, i)});
  if (cameras.empty()) return std::optional<LiveVolume>();
  const auto next = frames_.next(cameras);
  if (!next) return std::optional<LiveVolume>();
  const TimePoint begin = clock_.now();
  Result<Volume> volume = reconstruct(*next);
  const Seconds took = clock_.now() - begin;
  const int made_of = volume ? voxels() : 0;
  if (volume) {
    times_.add(made_of, took);
    if (choice_ && choice_->done(times_)) sequence_.reset();
  } else {
    developers_.clear();
  }
  return std::optional(LiveVolume{.frame = *next,
                                  .filmed = reader_.stamps(0)[*next].monotonic_time,
                                  .took = took,
                                  .skipped = frames_.skipped(),
                                  .voxels = made_of,
                                  .typical = times_.typical(),
                                  .verdict = verdict_of(pace_, times_),
                                  .volume = std::move(volume)});
}

Result<Volume> LiveRun::reconstruct(std::size_t frame) {
  scene_.frame = frame;
  EMBERLOCK_ASSIGN_OR_RETURN(Scene scene, load_session(reader_, scene_, developers_));
  if (!scene_.box && !reader_.manifest().has_box()) scene.box.size *= kRoomToMove;
  ReconstructOptions options = live_solve_options(options_);
  if (!options_.voxels && !choice_)
    choice_.emplace(pace_.aim(), most_voxels(scene, options, kShareOfMemory * physical_memory()));
  if (!sequence_) {
    options.voxels = voxels();
    sequence_.emplace(options, clock_);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(Outcome outcome, sequence_->next(scene));
  scene_.box = scene.box;
  return std::move(outcome.reconstruction.volume);
}

}  // namespace emberlock::recon
