// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "recon/calibrate/bundle.h"
#include "recon/calibrate/clean.h"
#include "recon/calibrate/relative_poses.h"
#include "recon/calibrate/rig.h"

namespace emberlock::recon {

/// What was seen of a board: cameras, instants, and which corners each camera saw at which instant.
struct BoardSightings {
  struct Camera {
    std::string id;
    ImageSize size;
  };
  struct Sighting {
    std::size_t camera = 0;
    std::size_t instant = 0;
    std::string picture;  ///< for messages
    std::vector<BoardCorner> corners;
  };
  Board board;
  std::vector<Camera> cameras;
  std::vector<std::string> instants;  ///< their names
  std::vector<Sighting> sightings;    ///< one a camera and instant, where the board was found
};

struct CalibrateOptions {
  /// The instant whose board is the world: origin at its first corner, x along a row, y up the board, z out
  /// of it. Else the first of those that most cameras see.
  std::optional<std::string> world = {};
  std::optional<Box> box = {};  ///< the flame's volume; else the largest cube that all cameras see whole,
                                ///< around the point that they look at
  CleanOptions clean = {};
};

struct CalibratedCamera {
  std::string id;
  bool calibrated = false;  ///< its lens is known
  bool placed = false;      ///< its pose is known too
  std::string why = {};     ///< where one of them isn't: the reason, and what to do
  BundleCamera fit = {};    ///< valid if calibrated; pose if placed
  Eigen::Matrix<double, kCameraUnknowns, 1> sigma = Eigen::Matrix<double, kCameraUnknowns, 1>::Zero();
  PoseCovariance relative = PoseCovariance::Zero();  ///< of its pose given the lens, against other cameras
  double rms = 0;                                    ///< pixels, of the used corners
  std::size_t views = 0, views_used = 0, corners = 0, corners_used = 0;
  double tilt = 0;  ///< radians: the widest angle between two of its boards
};

/// How well two cameras know of each other.
struct CameraPair {
  std::size_t a = 0, b = 0;   ///< of RigCalibration.cameras
  std::size_t instants = 0;   ///< that both see
  double distance_sigma = 0;  ///< metres: standard deviation of b's place as a sees it, along the worst axis
  double turn_sigma = 0;      ///< radians, likewise
};

struct RigCalibration {
  std::vector<CalibratedCamera> cameras;  ///< in the order of the sightings
  Bundle bundle;  ///< of the placed cameras, at the solution; its views are all of theirs
  std::vector<std::size_t> bundle_camera;    ///< of each camera of the bundle: its place in `cameras`
  std::vector<std::size_t> bundle_sighting;  ///< of each view of the bundle: its place in the sightings
  Eigen::MatrixXd covariance;                ///< of the bundle's cameras (bundle.h), in the world's frame
  struct Rejected {
    std::size_t sighting = 0;
    std::string why;
  };
  std::vector<Rejected> rejected;
  std::string world;              ///< the instant whose board is the world
  std::vector<CameraPair> pairs;  ///< that share an instant
  std::optional<Box> box;
  [[nodiscard]] bool whole() const;  ///< every camera is placed
};

/// Lenses by Zhang's method (2000), poses along the best-connected chains of cameras, then everything
/// adjusted together; wrong corners and views rejected. Cameras that can't be calibrated, or share no instant
/// with the largest connected group, are named and left out. Errors: no camera can be calibrated (the first
/// one's reason); an ambiguous board with several cameras; a world instant that isn't there or was rejected;
/// no such box.
Result<RigCalibration> calibrate_rig(const BoardSightings& sightings, const CalibrateOptions& options = {},
                                     const Progress& progress = {});

/// The result as a rig's file. Cameras that aren't placed have a lens alone; those not calibrated are absent.
/// `created_utc` as the file's; may be empty.
v1::Rig rig_of(const RigCalibration& calibration, const std::string& created_utc);

}  // namespace emberlock::recon
