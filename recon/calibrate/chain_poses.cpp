// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/chain_poses.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <set>

namespace emberlock::recon {
namespace {

constexpr double kFarOff = 50;  // pixels: larger deviations count the same

using Sightings = std::vector<const PlacedSighting*>;

std::map<std::size_t, Sightings> by_instant(const std::vector<PlacedSighting>& placed) {
  std::map<std::size_t, Sightings> result;
  for (const PlacedSighting& sighting : placed) result[sighting.instant].push_back(&sighting);
  return result;
}

/// b_from_a of each shared instant, by ordered pair of cameras.
std::map<std::pair<std::size_t, std::size_t>, std::vector<Rigid3>> steps_between(
    const std::vector<PlacedSighting>& placed) {
  std::map<std::pair<std::size_t, std::size_t>, std::vector<Rigid3>> steps;
  for (const auto& [instant, seen] : by_instant(placed))
    for (const PlacedSighting* a : seen)
      for (const PlacedSighting* b : seen)
        if (a != b)
          steps[{a->camera, b->camera}].push_back(
              chained(b->camera_from_board, a->camera_from_board.inverse()));
  return steps;
}

double angle_between(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  return std::acos(std::clamp(0.5 * ((a.transpose() * b).trace() - 1), -1.0, 1.0));
}

/// Sum of the distances between projected and observed corners at an instant, for a board at
/// `world_from_board`.
double misfit(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses, const Sightings& seen,
              const std::map<std::size_t, Rigid3>& cameras, const Rigid3& world_from_board) {
  double sum = 0;
  for (const PlacedSighting* view : seen) {
    const auto pose = cameras.find(view->camera);
    if (pose == cameras.end()) continue;
    const CameraModel camera{lenses[view->camera], pose->second};
    for (const BoardCorner& corner : sightings.sightings[view->sighting].corners) {
      const Eigen::Vector3d world = world_from_board * sightings.board.point(corner.id);
      const bool in_front = (camera.camera_from_world * world).z() > 0;
      sum += in_front ? std::min(kFarOff, (camera.project(world) - corner.pixel).norm()) : kFarOff;
    }
  }
  return sum;
}

}  // namespace

Rigid3 medoid(const std::vector<Rigid3>& poses) {
  double best = INFINITY;
  std::size_t chosen = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    double sum = 0;
    for (const Rigid3& other : poses) {
      sum += (poses[i].translation - other.translation).norm() +
             other.translation.norm() * angle_between(poses[i].rotation, other.rotation);
    }
    if (sum < best) {
      best = sum;
      chosen = i;
    }
  }
  return poses[chosen];
}

Rigid3 chained(const Rigid3& outer, const Rigid3& inner) {
  return {outer.rotation * inner.rotation, outer * inner.translation};
}

std::vector<std::size_t> largest_group(const std::vector<PlacedSighting>& placed, std::size_t cameras) {
  std::vector<std::size_t> group(cameras);
  std::iota(group.begin(), group.end(), std::size_t{0});
  std::set<std::size_t> seen;
  for (const PlacedSighting& sighting : placed) seen.insert(sighting.camera);
  for (const auto& [instant, views] : by_instant(placed)) {
    for (const PlacedSighting* view : views) {
      const std::size_t from = group[view->camera];
      const std::size_t to = group[views.front()->camera];
      std::replace(group.begin(), group.end(), from, to);
    }
  }
  std::vector<std::size_t> best;
  for (const std::size_t first : seen) {
    std::vector<std::size_t> members;
    for (const std::size_t camera : seen)
      if (group[camera] == group[first]) members.push_back(camera);
    if (members.size() > best.size()) best = std::move(members);
  }
  return best;
}

ChainPoses chain_poses(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                       const std::vector<PlacedSighting>& placed, const std::vector<std::size_t>& group) {
  const auto steps = steps_between(placed);
  ChainPoses result;
  result.camera_from_world[group.front()] = {};
  while (result.camera_from_world.size() < group.size()) {
    const std::pair<const std::pair<std::size_t, std::size_t>, std::vector<Rigid3>>* best = nullptr;
    for (const auto& step : steps) {
      const auto& [from, to] = step.first;
      if (!result.camera_from_world.contains(from) || result.camera_from_world.contains(to)) continue;
      if (best == nullptr || step.second.size() > best->second.size()) best = &step;
    }
    if (best == nullptr) break;  // can't happen: the group is connected
    result.camera_from_world[best->first.second] =
        chained(medoid(best->second), result.camera_from_world.at(best->first.first));
  }
  for (const auto& [instant, seen] : by_instant(placed)) {
    double least = INFINITY;
    for (const PlacedSighting* view : seen) {
      const auto camera = result.camera_from_world.find(view->camera);
      if (camera == result.camera_from_world.end()) continue;
      const Rigid3 pose = chained(camera->second.inverse(), view->camera_from_board);
      const double off = misfit(sightings, lenses, seen, result.camera_from_world, pose);
      if (off >= least) continue;
      least = off;
      result.world_from_board[instant] = pose;
    }
  }
  return result;
}

}  // namespace emberlock::recon
