// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <vector>

#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// A sighting with a first idea of its pose.
struct PlacedSighting {
  std::size_t sighting = 0;
  std::size_t camera = 0;
  std::size_t instant = 0;
  Rigid3 camera_from_board;
};

/// The largest group of cameras that shared instants connect; the first of equally large ones. Sorted.
std::vector<std::size_t> largest_group(const std::vector<PlacedSighting>& sightings, std::size_t cameras);

/// Where the group's cameras and its instants' boards stand, the group's first camera at the origin: along
/// the spanning tree of cameras that share most instants, each step by the one of their shared instants that
/// agrees best with the others. By camera and by instant; none for those that the group doesn't reach.
struct ChainPoses {
  std::map<std::size_t, Rigid3> camera_from_world;
  std::map<std::size_t, Rigid3> world_from_board;
};
ChainPoses chain_poses(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                       const std::vector<PlacedSighting>& placed, const std::vector<std::size_t>& group);

/// b_from_a * a_from_world.
Rigid3 chained(const Rigid3& outer, const Rigid3& inner);

}  // namespace emberlock::recon
