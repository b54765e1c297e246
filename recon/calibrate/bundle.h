// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <optional>
#include <vector>

#include <Eigen/Core>

#include "base/result.h"
#include "recon/calibrate/board.h"
#include "recon/views/camera_model.h"

namespace emberlock::recon {

/// Bundle adjustment of boards seen by cameras (Triggs et al. 2000). The unknowns are all lenses, all
/// cameras' poses and one pose of the board per instant; each corner should be projected to where its picture
/// shows it. A lamp is a board with one corner and fixed orientation.

/// A camera's unknowns, in the order of all covariances and of v1::Calibration.sigma: fx, fy, cx, cy, k1, k2,
/// p1, p2, k3, centre x, y, z (world, metres), rotation about its own x, y, z (radians).
inline constexpr int kCameraUnknowns = 15;
inline constexpr int kLensUnknowns = 9;
inline constexpr int kPoseUnknowns = 6;

enum class Held {
  none,
  lens,  ///< its lens is fixed
  pose,  ///< its pose is fixed
  both,
};

/// Prior of a camera's pose: the covariance of its centre (world, metres) and of its rotation about its own
/// axes (radians).
struct PosePrior {
  Rigid3 camera_from_world;
  Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns> covariance;
};

inline constexpr int kRadialTerms = 3;       ///< k1, k2, k3
inline constexpr int kUsualRadialTerms = 2;  ///< k1, k2
/// The place of each among a lens's unknowns.
inline constexpr std::array kRadialUnknowns = {4, 5, 8};

struct BundleCamera {
  CameraModel model;
  Held held = Held::none;
  int radial_terms = kUsualRadialTerms;  ///< k1, k2, k3: the first ones are free, the others fixed
  /// Standard deviation of a corner's coordinate in pixels, for weighting its residuals.
  double noise = 1;
  double inflation = 1;  ///< factor on the standard deviations, because the corners of a view have correlated
                         ///< errors (jackknife_inflation)
  std::optional<PosePrior> prior = {};
};

struct BundleBoard {
  Rigid3 world_from_board;
  Held held = Held::none;  ///< `pose` or none
};

enum class CornerUse : std::uint8_t {
  used,
  outlier,  ///< rejected, alone or with its whole view
};

/// The corners that one camera sees at one instant.
struct BundleView {
  std::size_t camera = 0;  ///< index in Bundle.cameras
  std::size_t board = 0;   ///< index in Bundle.boards
  std::vector<BoardCorner> corners;
  std::vector<CornerUse> use;  ///< one per corner
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
  cauchy,  ///< scaled by 2 standard deviations of the noise: wrong corners have little influence
};

/// Minimises the sum of weighted residuals over all free unknowns. Error if there is no finite solution.
Status adjust(Bundle& bundle, BundleLoss loss);

/// Projection of corner `i` of a view minus its observation, pixels; not finite behind the camera.
Eigen::Vector2d residual(const Bundle& bundle, const BundleView& view, std::size_t i);

/// The factor by which a lens's standard deviations exceed those for independent corners. The errors of a
/// view's corners are correlated if the board isn't quite flat or blur shifts them. Computed by the jackknife
/// over views with one step each (Efron 1982), averaged over the lens's unknowns; 1 if it is explained by
/// chance (3 standard deviations) or for fewer than 6 views. For a bundle of one camera.
double jackknife_inflation(const Bundle& bundle);

/// Covariance of all cameras' unknowns at the solution, kCameraUnknowns rows per camera, zero for fixed ones;
/// for residuals with the stated, inflated noise. nullopt if the views don't determine them.
std::optional<Eigen::MatrixXd> covariance(const Bundle& bundle);

/// RMS distance of the used corners of a camera (default: all cameras), pixels.
double rms_of(const Bundle& bundle, std::optional<std::size_t> camera = std::nullopt);

}  // namespace emberlock::recon
