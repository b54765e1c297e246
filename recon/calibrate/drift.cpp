#include "recon/calibrate/drift.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <fmt/format.h>

#include "recon/calibrate/chain_poses.h"
#include "recon/calibrate/lens_start.h"
#include "session/files.h"

namespace emberlock {
namespace {

using Vector6 = Eigen::Matrix<double, kPoseUnknowns, 1>;
using Matrix6 = Eigen::Matrix<double, kPoseUnknowns, kPoseUnknowns>;

constexpr double kNormalOfFalseAlarm = 3.09;  // 0.1 % on one side
constexpr double kLensNoise = 2;              // times the calibration's noise, and
constexpr double kLeastLensNoise = 0.3;       // pixels: blurred pictures are noisier too

/// What chi-square of 6 degrees of freedom exceeds by chance in 0.1 % of checks of so many cameras (Wilson
/// and Hilferty 1931; the tail's normal quantile grows by about ln(cameras) / 3.09).
double chi2_limit(std::size_t cameras) {
  const double z =
      kNormalOfFalseAlarm + std::log(static_cast<double>(std::max<std::size_t>(1, cameras))) / 3.4;
  const double n = kPoseUnknowns;
  return n * std::pow(1 - 2 / (9 * n) + z * std::sqrt(2 / (9 * n)), 3);
}

struct Known {
  CameraModel model;
  Vector6 sigma = Vector6::Zero();  ///< centre, turn
  double noise = 0;                 ///< 0: unknown
};

Result<Known> known_camera(const v1::Rig& rig, const BoardSightings::Camera& camera,
                           const std::string& where) {
  const auto found = std::find_if(rig.cameras().begin(), rig.cameras().end(),
                                  [&](const v1::RigCamera& c) { return c.camera_id() == camera.id; });
  if (found == rig.cameras().end()) {
    return Error{ErrorKind::bad_input, "knows no camera " + camera.id, where,
                 "Name the folders of pictures as they were named when the rig was calibrated"};
  }
  const ImageSize size{static_cast<int>(found->width()), static_cast<int>(found->height())};
  if (size != camera.size) {
    return Error{ErrorKind::bad_input,
                 fmt::format("calibrated with pictures of {} x {} pixels, these have {} x {}", size.width,
                             size.height, camera.size.width, camera.size.height),
                 where + ": camera " + camera.id, "Take pictures in the mode that was calibrated"};
  }
  Known known;
  EMBERLOCK_ASSIGN_OR_RETURN(known.model, camera_model_of(found->calibration(), size, camera.id, where));
  if (found->calibration().sigma_size() == kCalibrationSigmas)
    for (int i = 0; i < kPoseUnknowns; ++i) known.sigma[i] = found->calibration().sigma(kLensUnknowns + i);
  known.noise = found->calibration().corner_sigma();
  return known;
}

/// Each view by itself, with the calibrated lens: the camera's noise now, which corners are wrong, where the
/// boards are.
struct OwnViews {
  Bundle bundle;
  std::vector<std::size_t> sightings;
  double noise = 0;  ///< pixels, by the median of all corners: those of a lens that fits no more are rejected
};

double noise_of_all(const Bundle& bundle) {
  std::vector<double> distances;
  for (const BundleView& view : bundle.views)
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      distances.push_back(residual(bundle, view, i).norm());
  const auto middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle / std::sqrt(2 * std::log(2));  // Rayleigh's distribution
}

Result<OwnViews> own_views(const BoardSightings& sightings, std::size_t camera, const Known& known) {
  OwnViews own;
  own.bundle.board = sightings.board;
  own.bundle.cameras.push_back({{known.model.intrinsics, {}}, Held::both});
  for (std::size_t s = 0; s < sightings.sightings.size(); ++s) {
    const auto& sighting = sightings.sightings[s];
    if (sighting.camera != camera) continue;
    const auto pose = board_pose(known.model.intrinsics, sightings.board, sighting.corners);
    if (!pose) continue;
    own.bundle.views.push_back({0, own.bundle.boards.size(), sighting.corners,
                                std::vector<CornerUse>(sighting.corners.size(), CornerUse::used)});
    own.bundle.boards.push_back({*pose, Held::none});
    own.sightings.push_back(s);
  }
  if (own.sightings.empty()) return own;
  EMBERLOCK_ASSIGN_OR_RETURN(const auto rejected, clean(own.bundle));
  own.noise = noise_of_all(own.bundle);
  for (const RejectedView& view : rejected) own.bundle.views[view.view].corners.clear();
  return own;
}

/// All cameras as calibrated, held; a board each instant that two of them see.
Bundle bundle_of(const BoardSightings& sightings, const std::vector<Known>& known,
                 const std::vector<OwnViews>& own, const std::vector<bool>& usable) {
  std::map<std::size_t, std::vector<std::pair<std::size_t, const BundleView*>>> by_instant;
  for (std::size_t c = 0; c < known.size(); ++c) {
    if (!usable[c]) continue;
    for (std::size_t v = 0; v < own[c].sightings.size(); ++v)
      if (!own[c].bundle.views[v].corners.empty())
        by_instant[sightings.sightings[own[c].sightings[v]].instant].emplace_back(c, &own[c].bundle.views[v]);
  }
  Bundle bundle;
  bundle.board = sightings.board;
  for (std::size_t c = 0; c < known.size(); ++c) {
    BundleCamera camera{known[c].model, Held::both};
    if (!own[c].bundle.cameras.empty()) camera.noise = own[c].bundle.cameras[0].noise;
    bundle.cameras.push_back(camera);
  }
  for (const auto& [instant, seen] : by_instant) {
    if (seen.size() < 2) continue;
    const auto& [first, view] = seen.front();
    const Rigid3& pose = own[first].bundle.boards[view->board].world_from_board;  // camera_from_board
    for (const auto& [camera, own_view] : seen) {
      bundle.views.push_back(*own_view);
      bundle.views.back().camera = camera;
      bundle.views.back().board = bundle.boards.size();
    }
    bundle.boards.push_back({chained(known[first].model.camera_from_world.inverse(), pose), Held::none});
  }
  return bundle;
}

/// Sum of squared residuals in standard deviations.
double cost_of(const Bundle& bundle) {
  double cost = 0;
  for (const BundleView& view : bundle.views)
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      if (view.use[i] == CornerUse::used)
        cost += residual(bundle, view, i).squaredNorm() / std::pow(bundle.cameras[view.camera].noise, 2);
  return cost;
}

Vector6 motion(const CameraModel& now, const CameraModel& calibrated) {
  const Eigen::AngleAxisd turn(now.camera_from_world.rotation *
                               calibrated.camera_from_world.rotation.transpose());
  Vector6 result;
  result << now.center() - calibrated.center(), turn.angle() * turn.axis();
  return result;
}

double worst_deviation(const Eigen::Matrix3d& spread) {
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues().maxCoeff()));
}

/// Frees one more camera: the bundle then, and what it says of that camera.
struct Freed {
  Bundle bundle;
  double cost = INFINITY;
};

std::optional<Freed> freed(const Bundle& bundle, std::size_t camera) {
  Freed result{bundle};
  result.bundle.cameras[camera].held = Held::lens;
  // At first a camera that moved must not be believed.
  if (!adjust(result.bundle, BundleLoss::cauchy).ok() || !adjust(result.bundle, BundleLoss::squares).ok())
    return std::nullopt;
  result.cost = cost_of(result.bundle);
  return result;
}

void judge(const Freed& fit, const Known& known, std::size_t camera, CameraDrift& drift) {
  const auto spread = covariance(fit.bundle);
  if (!spread) {
    drift.verdict = DriftVerdict::unknown;
    drift.why = "its views don't tell its pose";
    return;
  }
  const Vector6 moved = motion(fit.bundle.cameras[camera].model, known.model);
  const auto at = static_cast<Eigen::Index>(camera) * kCameraUnknowns + kLensUnknowns;
  Matrix6 total = spread->block<kPoseUnknowns, kPoseUnknowns>(at, at);
  total.diagonal() += known.sigma.cwiseAbs2();
  drift.place = moved.head<3>();
  drift.turn = moved.tail<3>();
  drift.place_sigma = worst_deviation(total.topLeftCorner<3, 3>());
  drift.turn_sigma = worst_deviation(total.bottomRightCorner<3, 3>());
  drift.chi2 = moved.dot(total.ldlt().solve(moved));
}

void count_instants(const Bundle& bundle, DriftReport& report) {
  for (const BundleView& view : bundle.views) ++report.cameras[view.camera].instants;
  for (CameraDrift& camera : report.cameras) {
    if (camera.verdict == DriftVerdict::lens || camera.instants > 0) continue;
    camera.why = "shares no instant of the board with another camera";
  }
}

/// Frees cameras one after the other, while that is significant.
Status find_moved(Bundle& bundle, const std::vector<Known>& known, DriftReport& report) {
  EMBERLOCK_RETURN_IF_ERROR(adjust(bundle, BundleLoss::cauchy));
  std::size_t free = 0;
  std::size_t seen = 0;
  for (const CameraDrift& camera : report.cameras) seen += camera.instants > 0 ? 1 : 0;
  while (free + 1 < seen) {
    std::optional<std::size_t> best;
    std::optional<Freed> best_fit;
    for (std::size_t c = 0; c < known.size(); ++c) {
      CameraDrift& camera = report.cameras[c];
      if (camera.instants == 0 || bundle.cameras[c].held != Held::both) continue;
      auto fit = freed(bundle, c);
      if (!fit) continue;
      camera.verdict = DriftVerdict::still;
      judge(*fit, known[c], c, camera);
      if (camera.chi2 <= report.limit || (best_fit && best_fit->cost <= fit->cost)) continue;
      best = c;
      best_fit = std::move(fit);
    }
    if (!best) break;
    bundle = std::move(best_fit->bundle);
    report.cameras[*best].verdict = DriftVerdict::moved;
    ++free;
  }
  return adjust(bundle, BundleLoss::squares);
}

}  // namespace

bool DriftReport::drifted() const {
  return std::any_of(cameras.begin(), cameras.end(), [](const CameraDrift& camera) {
    return camera.verdict == DriftVerdict::moved || camera.verdict == DriftVerdict::lens;
  });
}

Result<DriftReport> check_drift(const v1::Rig& rig, const BoardSightings& sightings,
                                const std::string& where) {
  DriftReport report;
  report.limit = chi2_limit(sightings.cameras.size());
  std::vector<Known> known;
  std::vector<OwnViews> own;
  std::vector<bool> usable;
  for (std::size_t c = 0; c < sightings.cameras.size(); ++c) {
    EMBERLOCK_ASSIGN_OR_RETURN(Known camera, known_camera(rig, sightings.cameras[c], where));
    EMBERLOCK_ASSIGN_OR_RETURN(OwnViews views, own_views(sightings, c, camera));
    CameraDrift drift{.id = sightings.cameras[c].id};
    const double noise = views.noise;
    const bool lens_fits = camera.noise == 0 || views.sightings.empty() ||
                           noise < std::max(kLensNoise * camera.noise, kLeastLensNoise);
    if (!lens_fits) {
      drift.verdict = DriftVerdict::lens;
      drift.why = fmt::format(
          "corners lie {:.2f} pixels off where its lens was calibrated to {:.2f}: zoom or focus "
          "changed, or the pictures are blurred",
          noise, camera.noise);
    }
    usable.push_back(lens_fits);
    report.cameras.push_back(std::move(drift));
    known.push_back(std::move(camera));
    own.push_back(std::move(views));
  }
  Bundle bundle = bundle_of(sightings, known, own, usable);
  if (bundle.views.empty() && !report.drifted()) {
    return Error{ErrorKind::bad_input, "no two calibrated cameras see the board at one instant", "pictures",
                 "Take pictures in which neighbouring cameras see the board at once"};
  }
  count_instants(bundle, report);
  if (bundle.views.empty()) return report;
  Bundle before = bundle;
  EMBERLOCK_RETURN_IF_ERROR(adjust(before, BundleLoss::squares));
  EMBERLOCK_RETURN_IF_ERROR(find_moved(bundle, known, report));
  report.rms_before = rms_of(before);
  report.rms_after = rms_of(bundle);
  std::size_t seen = 0;
  for (std::size_t c = 0; c < known.size(); ++c) {
    report.cameras[c].rms_before = rms_of(before, c);
    report.cameras[c].rms_after = rms_of(bundle, c);
    seen += report.cameras[c].instants > 0 ? 1 : 0;
  }
  report.one_of_two = seen == 2;
  return report;
}

}  // namespace emberlock
