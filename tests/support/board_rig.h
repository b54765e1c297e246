// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "base/random.h"
#include "recon/calibrate/calibrate_rig.h"
#include "recon/calibrate/carried_board.h"

namespace emberlock::test {

/// Cameras on a ring (recon::ring_cameras()) that watch a board being carried around.
struct BoardRigOptions {
  int cameras = 11;
  int instants = 80;
  double noise = 0.2;   ///< pixels, each coordinate
  double wrong = 0.05;  ///< share of corners that are wrong, by up to 20 pixels in each coordinate
  std::uint64_t seed = 1;
  ImageSize image = {640, 480};
  recon::Board board = {recon::BoardKind::chessboard, 16, 11, Meters(0.014)};
};

struct BoardRig {
  std::vector<recon::CameraModel> cameras;      ///< the truth, in the world of the first board
  std::vector<recon::Rigid3> world_from_board;  ///< by instant
  recon::BoardSightings sightings;
};

inline recon::Rigid3 chain(const recon::Rigid3& outer, const recon::Rigid3& inner) {
  return {outer.rotation * inner.rotation, outer * inner.translation};
}

inline void disturb(std::vector<recon::BoardCorner>& corners, const BoardRigOptions& options,
                    RandomStream& random) {
  for (recon::BoardCorner& corner : corners) {
    corner.pixel += options.noise * Eigen::Vector2d(random.normal(), random.normal());
    if (random.uniform(0, 1) < options.wrong)
      corner.pixel += Eigen::Vector2d(random.uniform(-20, 20), random.uniform(-20, 20));
  }
}

/// The corners that find_board() finds of a chessboard in the mirror image of a picture.
inline std::vector<recon::BoardCorner> mirrored_corners(std::vector<recon::BoardCorner> corners,
                                                        const recon::Board& board, int width) {
  for (recon::BoardCorner& corner : corners) {
    const int column = corner.id % board.columns;
    const int row = corner.id / board.columns;
    corner.id = board.rows % 2 == 0 ? (board.rows - 1 - row) * board.columns + column
                                    : row * board.columns + board.columns - 1 - column;
    corner.pixel.x() = width - corner.pixel.x();
  }
  return corners;
}

/// Boards go around the ring, each seen by two to four cameras; the first board is the world.
inline BoardRig board_rig(const BoardRigOptions& options) {
  RandomStream random(options.seed, 77);
  BoardRig rig;
  rig.cameras = recon::ring_cameras(options.cameras, options.image, random);
  rig.sightings.board = options.board;
  for (int c = 0; c < options.cameras; ++c)
    rig.sightings.cameras.push_back(
        {"cam" + std::string(c < 10 ? "0" : "") + std::to_string(c), options.image});
  for (int i = 0;
       static_cast<int>(rig.world_from_board.size()) < options.instants && i < 100 * options.instants; ++i) {
    const double azimuth = 2.399963 * i;  // the golden angle: all sides alike
    const recon::Rigid3 pose = recon::carried_board(options.board, azimuth, random);
    std::vector<recon::BoardSightings::Sighting> seen;
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      auto corners = recon::seen_corners(rig.cameras[c], options.board, pose);
      if (!corners.empty()) seen.push_back({c, rig.world_from_board.size(), "", std::move(corners)});
    }
    if (seen.size() < 2 || seen.size() > 4) continue;
    for (auto& sighting : seen) {
      disturb(sighting.corners, options, random);
      sighting.picture = rig.sightings.cameras[sighting.camera].id + "/" + std::to_string(sighting.instant);
      rig.sightings.sightings.push_back(std::move(sighting));
    }
    rig.sightings.instants.push_back(std::to_string(rig.world_from_board.size()));
    rig.world_from_board.push_back(pose);
  }
  const recon::Rigid3 old_from_new = rig.world_from_board.front();
  for (recon::CameraModel& camera : rig.cameras)
    camera.camera_from_world = chain(camera.camera_from_world, old_from_new);
  for (recon::Rigid3& pose : rig.world_from_board) pose = chain(old_from_new.inverse(), pose);
  return rig;
}

/// The truth as a rig's file, with what a good calibration would state.
inline v1::Rig rig_file_of(const BoardRig& rig) {
  v1::Rig file;
  file.set_format_version(1);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    v1::RigCamera& camera = *file.add_cameras();
    const ImageSize size = rig.cameras[c].intrinsics.size;
    camera.set_camera_id(rig.sightings.cameras[c].id);
    camera.set_width(static_cast<std::uint32_t>(size.width));
    camera.set_height(static_cast<std::uint32_t>(size.height));
    *camera.mutable_calibration() = recon::calibration_of(rig.cameras[c]);
    for (int i = 0; i < 15; ++i) camera.mutable_calibration()->add_sigma(i < 12 ? 1e-4 : 2e-4);
    camera.mutable_calibration()->set_corner_sigma(0.2);
  }
  return file;
}

struct Knock {
  Eigen::Vector3d place = Eigen::Vector3d::Zero();  ///< metres, in the world
  Eigen::Vector3d turn = Eigen::Vector3d::Zero();   ///< radians, about the camera's own axes
};

/// Makes the file that of a rig one of whose cameras was knocked since.
inline void knock(v1::Rig& file, const BoardRig& rig, int camera, const Knock& by) {
  recon::CameraModel before = rig.cameras[static_cast<std::size_t>(camera)];
  const Eigen::Vector3d center = before.center() - by.place;
  const double angle = by.turn.norm();
  if (angle > 0) {
    before.camera_from_world.rotation =
        Eigen::AngleAxisd(-angle, by.turn / angle) * before.camera_from_world.rotation;
  }
  before.camera_from_world.translation = -(before.camera_from_world.rotation * center);
  v1::Calibration& c = *file.mutable_cameras(camera)->mutable_calibration();
  for (int i = 0; i < 12; ++i) c.set_camera_from_world(i, recon::calibration_of(before).camera_from_world(i));
}

/// A lamp at places near the middle of what the cameras look at, which is `rig`'s world less its first board.
inline std::vector<Eigen::Vector3d> lamp_places(const BoardRig& rig, int places, std::uint64_t seed) {
  RandomStream random(seed, 78);
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const recon::CameraModel& camera : rig.cameras) {
    const Eigen::Vector3d axis = camera.camera_from_world.rotation.row(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * camera.center();
  }
  const Eigen::Vector3d middle = sum.inverse() * right;
  std::vector<Eigen::Vector3d> result;
  result.reserve(static_cast<std::size_t>(places));
  for (int i = 0; i < places; ++i) {
    result.push_back(middle + Eigen::Vector3d(random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06),
                                              random.uniform(-0.06, 0.06)));
  }
  return result;
}

/// What all cameras see of it, with noise.
inline recon::BoardSightings lamp_sightings(const BoardRig& rig, const std::vector<Eigen::Vector3d>& places,
                                            double noise, std::uint64_t seed) {
  RandomStream random(seed, 79);
  recon::BoardSightings sightings;
  sightings.board = recon::lamp_as_board();
  sightings.cameras = rig.sightings.cameras;
  for (std::size_t i = 0; i < places.size(); ++i) {
    sightings.instants.push_back(std::to_string(i));
    for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
      const Eigen::Vector2d off(noise * random.normal(), noise * random.normal());
      sightings.sightings.push_back({c, i, "", {{0, rig.cameras[c].project(places[i]) + off}}});
    }
  }
  return sightings;
}

}  // namespace emberlock::test
