// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/result.h"
#include "recon/calibrate/board.h"
#include "recon/calibrate/camera_model.h"

namespace emberlock::recon {

/// Bundle adjustment of boards that cameras see (Triggs et al. 2000): all lenses, all cameras' poses and one
/// pose of the board an instant, so that each corner falls where its picture shows it. A lamp is a board of
/// one corner whose turn is held.

/// A camera's unknowns in the order of every covariance and of v1::Calibration.sigma: fx, fy, cx, cy, k1, k2,
/// p1, p2, k3, centre x, y, z (world, metres), turn about its own x, y, z (radians).
inline constexpr int kCameraUnknowns = 15;
inline constexpr int kLensUnknowns = 9;
inline constexpr int kPoseUnknowns = 6;

enum class Held {
  none,
  lens,  ///< its lens is known
  pose,  ///< its pose is known
  both,
};

/// What is known of a camera's pose beforehand: the covariance of its centre (world, metres) and its turn
/// about its own axes (radians).
struct PosePrior {
  Rigid3 camera_from_world;
  Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns> covariance;
};

enum class ThirdRadial {
  held,  ///< k3 stays as it is
  free,
};

struct BundleCamera {
  CameraModel model;
  Held held = Held::none;
  ThirdRadial k3 = ThirdRadial::held;
  /// Pixels: standard deviation of a corner's coordinate, by which its residuals are weighed.
  double noise = 1;
  double inflation = 1;  ///< of the standard deviations: a view's corners err together (jackknife_inflation)
  std::optional<PosePrior> prior = {};
};

struct BundleBoard {
  Rigid3 world_from_board;
  Held held = Held::none;  ///< `pose`, or none
};

enum class CornerUse : std::uint8_t {
  used,
  outlier,  ///< by itself, or with its whole view
};

/// What one camera sees of the board at one instant.
struct BundleView {
  std::size_t camera = 0;  ///< of Bundle.cameras
  std::size_t board = 0;   ///< of Bundle.boards
  std::vector<BoardCorner> corners;
  std::vector<CornerUse> use;  ///< one a corner
  [[nodiscard]] std::size_t used() const;
};

struct Bundle {
  Board board;
  std::vector<BundleCamera> cameras;
  std::vector<BundleBoard> boards;
  std::vector<BundleView> views;
};

enum class BundleLoss {
  squares,
  cauchy,  ///< scaled by 2 standard deviations of the noise: wrong corners pull little
};

/// Moves what isn't held to the least sum of weighed residuals. Error where there is no finite solution.
Status adjust(Bundle& bundle, BundleLoss loss);

/// Where corner `i` of a view is drawn less where it was seen, pixels; not finite behind the camera.
Eigen::Vector2d residual(const Bundle& bundle, const BundleView& view, std::size_t i);

/// By what factor a lens's standard deviations exceed those of independent corners: corners of one view err
/// together where a board isn't quite flat or blur shifts them. By the jackknife over views, one step each
/// (Efron 1982), on average over the lens's unknowns; 1 where chance explains it (3 standard deviations), and
/// below 6 views. Of a bundle of one camera.
double jackknife_inflation(const Bundle& bundle);

/// Covariance of all cameras' unknowns at the solution, kCameraUnknowns rows a camera, zero for what is held;
/// for residuals of the stated, inflated noise. None where the views don't determine them.
std::optional<Eigen::MatrixXd> covariance(const Bundle& bundle);

/// RMS distance of the used corners of a camera (of all of them, if none is given), pixels.
double rms_of(const Bundle& bundle, std::optional<std::size_t> camera = std::nullopt);

}  // namespace emberlock::recon
