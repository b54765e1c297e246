// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <list>
#include <memory>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "apply/flame.h"
#include "apply/plate_light.h"
#include "apply/scene_file.h"
#include "base/result.h"
#include "recon/compute/pool.h"

namespace emberlock::apply {

/// How a result stands on a plate.
struct StandingFlame {
  PlacedResult placed;                             ///< its rotation and scale; its translation doesn't count
  Eigen::Vector3d foot = Eigen::Vector3d::Zero();  ///< where the middle of what glows touches from above
  double plate = 0;                                ///< edge of the square that it lights, metres
  int light_voxels = 16;
};

/// A result, or a sequence of them, on a plate over time.
class FlamePlayer {
 public:
  /// A frame of it.
  struct Shown {
    std::unique_ptr<const Flame> flame;
    PlateLight light;
  };
  /// The lowest of the first frame's glowing voxels, as it is turned and scaled, stand on the plate. Errors:
  /// those of frames_of() and recon::read_shown_volume(); a volume in which nothing glows.
  static Result<FlamePlayer> load(const StandingFlame& standing, recon::Pool& pool);

  /// At a time after the video's beginning; null before and after one that runs once. Valid until the next
  /// call. Errors: those of recon::read_shown_volume().
  Result<const Shown*> at(Seconds time, recon::Pool& pool);
  [[nodiscard]] std::size_t frames() const { return files_.size(); }
  /// Around the first frame's flame, in the plate's frame.
  [[nodiscard]] const Eigen::AlignedBox3d& bounds() const { return bounds_; }

 private:
  StandingFlame standing_;
  std::vector<std::filesystem::path> files_;
  Eigen::AlignedBox3d bounds_;
  struct Kept {
    std::size_t frame = 0;
    std::shared_ptr<const Shown> shown;
  };
  std::list<Kept> kept_;  ///< the one used last is first
};

}  // namespace emberlock::apply
