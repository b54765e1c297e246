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

/// The observations of a board: cameras, instants, and the corners seen by each camera at each instant.
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
  std::vector<Sighting> sightings;    ///< one per camera and instant at which the board was found
};

struct CalibrateOptions {
  /// The instant whose board defines the world: origin at its first corner, x along a row, y up the board, z
  /// out of it. Default: the first of those seen by most cameras.
  std::optional<std::string> world = {};
  std::optional<Box> box = {};  ///< the flame's volume; default: the largest cube that all cameras see
                                ///< completely, around the point at which they look
  CleanOptions clean = {};
};

struct CalibratedCamera {
  std::string id;
  bool calibrated = false;  ///< its lens is known
  bool placed = false;      ///< its pose is known too
  std::string why = {};     ///< if one of them isn't: the reason, and what to do
  BundleCamera fit = {};    ///< lens valid if calibrated, pose if placed
  Eigen::Matrix<double, kCameraUnknowns, 1> sigma = Eigen::Matrix<double, kCameraUnknowns, 1>::Zero();
  PoseCovariance relative =
      PoseCovariance::Zero();  ///< of its pose relative to the other cameras, for a given lens
  double rms = 0;              ///< pixels, of the used corners
  std::size_t views = 0, views_used = 0, corners = 0, corners_used = 0;
  double tilt = 0;  ///< radians: the largest angle between two of its boards
};

/// How accurately two cameras are related.
struct CameraPair {
  std::size_t a = 0, b = 0;  ///< indices in RigCalibration.cameras
  std::size_t instants = 0;  ///< number of instants seen by both
  double distance_sigma =
      0;                  ///< metres: standard deviation of b's position relative to a, along the worst axis
  double turn_sigma = 0;  ///< radians, likewise
};

struct RigCalibration {
  std::vector<CalibratedCamera> cameras;  ///< in the order of the sightings
  Bundle bundle;  ///< of the placed cameras, at the solution; contains all their views
  std::vector<std::size_t> bundle_camera;    ///< by camera of the bundle: index in `cameras`
  std::vector<std::size_t> bundle_sighting;  ///< by view of the bundle: index in the sightings
  Eigen::MatrixXd covariance;                ///< of the bundle's cameras (bundle.h), in the world's frame
  struct Rejected {
    std::size_t sighting = 0;
    std::string why;
  };
  std::vector<Rejected> rejected;
  std::string world;              ///< the instant whose board defines the world
  std::vector<CameraPair> pairs;  ///< pairs that share an instant
  std::optional<Box> box;
  [[nodiscard]] bool whole() const;  ///< every camera is placed
};

/// Calibrates lenses by Zhang's method (2000) and poses along the best-connected chains of cameras, then
/// adjusts everything together and rejects wrong corners and views. Cameras that can't be calibrated, or
/// share no instant with the largest connected group, are named and left out. Errors: no camera can be
/// calibrated (with the first one's reason); an ambiguous board with several cameras; a world instant that
/// doesn't exist or was rejected; no box can be derived.
Result<RigCalibration> calibrate_rig(const BoardSightings& sightings, const CalibrateOptions& options = {},
                                     const Progress& progress = {});

/// The result as a rig's file. Cameras that aren't placed have only a lens; those not calibrated are omitted.
/// `created_utc` is stored; it may be empty.
v1::Rig rig_of(const RigCalibration& calibration, const std::string& created_utc);

}  // namespace emberlock::recon
