// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// A sighting with an initial estimate of its pose.
struct PlacedSighting {
  std::size_t sighting = 0;
  std::size_t camera = 0;
  std::size_t instant = 0;
  Rigid3 camera_from_board;
};

/// The largest group of cameras connected by shared instants; of equally large ones the first. Sorted.
std::vector<std::size_t> largest_group(const std::vector<PlacedSighting>& sightings, std::size_t cameras);

/// The poses of the group's cameras and of the boards at its instants, with the group's first camera at the
/// origin. They are chained along the spanning tree of cameras that share most instants; each step uses the
/// shared instant that agrees best with the others. By camera and by instant; nullopt for those outside the
/// group.
struct ChainPoses {
  std::map<std::size_t, Rigid3> camera_from_world;
  std::map<std::size_t, Rigid3> world_from_board;
};
ChainPoses chain_poses(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                       const std::vector<PlacedSighting>& placed, const std::vector<std::size_t>& group);

/// The pose with the smallest sum of distances to the others; a radian counts like the length of the
/// translations. `poses` isn't empty.
Rigid3 medoid(const std::vector<Rigid3>& poses);

/// b_from_a * a_from_world.
Rigid3 chained(const Rigid3& outer, const Rigid3& inner);

}  // namespace emberlock::recon
