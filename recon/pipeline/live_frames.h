// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/quantity.h"
#include "recon/pipeline/reconstruct.h"

// Volumes of a recording that goes on: which frame is next, of how many voxels, and whether the machine keeps
// up. Pure.
namespace emberlock::recon {

/// A camera's frames that are recorded by now.
struct FramesSoFar {
  const std::vector<FrameStamp>* stamps = nullptr;  ///< in the order of recording; it only grows
  Hertz rate{0};                                    ///< nominal; 0: not known
};

/// Chooses frames of a recording's first camera: each of `every`, of those the newest of which every camera
/// has its frame, and never one twice. What newer frames overtake is skipped for good.
class NewestFrames {
 public:
  explicit NewestFrames(std::uint64_t every) : every_(std::max<std::uint64_t>(every, 1)) {}

  /// Nothing while there is none newer than the last.
  std::optional<std::size_t> next(const std::vector<FramesSoFar>& cameras);
  /// Wanted frames before the last one that were never chosen: chosen + skipped = last / every + 1.
  [[nodiscard]] std::uint64_t skipped() const { return skipped_; }

 private:
  std::uint64_t every_;
  std::uint64_t due_ = 0;  ///< the first that may be chosen
  std::uint64_t skipped_ = 0;
};

/// Whether a camera has a complete frame within about half a frame period of `t`: the nearest, whatever
/// frames follow.
bool has_frame_at(const FramesSoFar& camera, TimePoint t);

/// How long a volume may take.
struct LivePace {
  std::uint64_t every = 0;  ///< as it was asked for; 0: each frame, as far as the machine keeps up
  Hertz rate{0};            ///< of the first camera; 0: not known
  /// Between two wanted frames; nothing where the machine's pace is good enough.
  [[nodiscard]] std::optional<Seconds> interval() const;
  /// That a volume is made to take where nobody tells its voxels: of the interval all but a fifth, so that a
  /// slower volume overtakes none; else half a second.
  [[nodiscard]] Seconds aim() const;
};

/// What volumes of so many voxels take, by the last few: their median, so that one that the machine was kept
/// from doesn't count.
class VolumeTimes {
 public:
  void add(int voxels, Seconds time);
  [[nodiscard]] int voxels() const { return voxels_; }
  [[nodiscard]] std::size_t count() const { return times_.size(); }
  /// 0 before the first.
  [[nodiscard]] Seconds typical() const;

 private:
  static constexpr std::size_t kLast = 5;
  int voxels_ = 0;
  std::vector<Seconds> times_;
};

inline constexpr int kFewestLiveVoxels = 16;
inline constexpr int kMostLiveVoxels = 128;  ///< that are chosen unasked; consoles show 64

/// How many voxels along the longest edge a volume may have to take `aim`, as one of `times.voxels()` takes
/// `times.typical()`: time grows as the voxels' number. A multiple of 8, kFewestLiveVoxels..`most`; nothing
/// where even those take longer.
std::optional<int> voxels_for(Seconds aim, const VolumeTimes& times, int most);

/// The voxels where nobody tells them. The first two volumes have 32 along the longest edge, and what the
/// second takes chooses the number; it is chosen anew when volumes take more than half as long again as they
/// are to, or less than a quarter of it. Each choice costs a volume from darkness.
class LiveVoxels {
 public:
  LiveVoxels(Seconds aim, int most) : aim_(aim), most_(most) {}
  [[nodiscard]] int voxels() const { return voxels_; }
  /// A volume of voxels() was done. True: the next ones have others.
  bool done(const VolumeTimes& times);

 private:
  Seconds aim_;
  int most_;
  int voxels_ = 32;
  bool chosen_ = false;
};

/// The most voxels whose solve takes at most `bytes`, kFewestLiveVoxels..kMostLiveVoxels, a multiple of 8.
int most_voxels(const Scene& scene, const ReconstructOptions& options, double bytes);

/// Whether each wanted frame gets its volume, and what would make it so.
struct LiveVerdict {
  bool keeps_up = true;
  std::uint64_t holds_every = 0;  ///< with these voxels each frame of so many gets one; 0: isn't known
  int holds_voxels = 0;           ///< with so many voxels the interval is long enough; 0: none are few enough
};
LiveVerdict verdict_of(const LivePace& pace, const VolumeTimes& times);

}  // namespace emberlock::recon
