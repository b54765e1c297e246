// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/live_frames.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "recon/pipeline/single_run.h"

namespace emberlock::recon {
namespace {

constexpr int kVoxelStep = 8;
constexpr Seconds kUnasked{0.5};
/// Of the interval that volumes are made to take where their voxels are chosen.
constexpr double kShareOfInterval = 0.8;

}  // namespace

bool has_frame_at(const FramesSoFar& camera, TimePoint t) {
  constexpr double kReach = 0.55;  // periods: half of one, and cameras jitter
  const Seconds reach(camera.rate.value() > 0 ? kReach / camera.rate.value() : INFINITY);
  for (auto stamp = camera.stamps->rbegin(); stamp != camera.stamps->rend(); ++stamp) {
    if (stamp->monotonic_time - t < -reach) break;
    if (stamp->status == FrameStatus::complete && abs(stamp->monotonic_time - t) <= reach) return true;
  }
  return false;
}

std::optional<std::size_t> NewestFrames::next(const std::vector<FramesSoFar>& cameras) {
  const std::vector<FrameStamp>& first = *cameras.front().stamps;
  if (first.empty()) return std::nullopt;
  for (std::uint64_t at = (first.size() - 1) / every_ * every_; at >= due_; at -= every_) {
    const bool whole = std::all_of(cameras.begin(), cameras.end(), [&](const FramesSoFar& camera) {
      return has_frame_at(camera, first[at].monotonic_time);
    });
    if (whole && first[at].status == FrameStatus::complete) {
      skipped_ += (at - due_) / every_;
      due_ = at + every_;
      return at;
    }
    if (at < every_) break;
  }
  return std::nullopt;
}

std::optional<Seconds> LivePace::interval() const {
  if (every == 0 || rate.value() <= 0) return std::nullopt;
  return Seconds(static_cast<double>(every) / rate.value());
}

Seconds LivePace::aim() const {
  const auto asked = interval();
  return asked ? kShareOfInterval * *asked : kUnasked;
}

void VolumeTimes::add(int voxels, Seconds time) {
  if (voxels != voxels_) times_.clear();
  voxels_ = voxels;
  times_.push_back(time);
  if (times_.size() > kLast) times_.erase(times_.begin());
}

Seconds VolumeTimes::typical() const {
  if (times_.empty()) return Seconds(0);
  std::vector<Seconds> sorted = times_;
  std::sort(sorted.begin(), sorted.end());
  return sorted[(sorted.size() - 1) / 2];
}

std::optional<int> voxels_for(Seconds aim, const VolumeTimes& times, int most) {
  if (times.count() == 0 || !(times.typical() > Seconds(0))) return std::nullopt;
  const double edge = times.voxels() * std::cbrt(aim / times.typical());
  const int steps = static_cast<int>(std::min(edge, 1.0 * most)) / kVoxelStep;
  const int voxels = steps * kVoxelStep;
  if (voxels < kFewestLiveVoxels) return std::nullopt;
  return voxels;
}

bool LiveVoxels::done(const VolumeTimes& times) {
  constexpr double kTooSlow = 1.5;
  constexpr double kTooQuick = 0.25;
  constexpr std::size_t kFirst = 2;  // the first one starts in darkness
  constexpr std::size_t kSure = 4;
  if (times.count() < (chosen_ ? kSure : kFirst)) return false;
  const double share = times.typical() / aim_;
  if (chosen_ && share <= kTooSlow && share >= kTooQuick) return false;
  chosen_ = true;
  const int next = voxels_for(aim_, times, most_).value_or(std::min(kFewestLiveVoxels, most_));
  return std::exchange(voxels_, next) != next;
}

int most_voxels(const Scene& scene, const ReconstructOptions& options, double bytes) {
  int voxels = kMostLiveVoxels;
  while (voxels > kFewestLiveVoxels && !choose_grid(scene, options, voxels, bytes)) voxels -= kVoxelStep;
  return voxels;
}

LiveVerdict verdict_of(const LivePace& pace, const VolumeTimes& times) {
  LiveVerdict verdict;
  const auto interval = pace.interval();
  const Seconds takes = times.typical();
  if (pace.rate.value() > 0 && takes > Seconds(0))
    verdict.holds_every =
        std::max<std::uint64_t>(1, static_cast<std::uint64_t>(std::ceil(takes.value() * pace.rate.value())));
  if (!interval || !(takes > Seconds(0))) return verdict;
  verdict.keeps_up = takes <= *interval;
  verdict.holds_voxels = voxels_for(*interval, times, kMostLiveVoxels).value_or(0);
  return verdict;
}

}  // namespace emberlock::recon
