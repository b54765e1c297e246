// SPDX-License-Identifier: Apache-2.0
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

namespace emberlock::recon {
namespace {

using Vector6 = Eigen::Matrix<double, kPoseUnknowns, 1>;

constexpr double kNormalOfFalseAlarm = 3.09;  // 0.1 % on one side
constexpr double kLensNoise = 2;              // times the calibration's noise, and
constexpr double kLeastLensNoise = 0.3;       // pixels: blurred pictures are noisier too

/// Pixels: a lamp isn't a point, and its middle not the same from all sides.
constexpr double kLampNoise = 0.3;
/// Of a camera that may have moved: so loose that it costs nothing, and what isn't determined stays.
constexpr double kLoosePlace = 0.1;  // metres
constexpr double kLooseTurn = 0.2;   // radians
/// At least, also of a pose that was told without its uncertainty.
constexpr double kLeastPlace = 1e-6;  // metres
constexpr double kLeastTurn = 1e-6;   // radians

/// What chi-square exceeds by chance in 0.1 % of checks of so many cameras (Wilson and Hilferty 1931; the
/// tail's normal quantile grows by about ln(cameras) / 3.09).
double chi2_limit(int freedom, std::size_t cameras) {
  const double z =
      kNormalOfFalseAlarm + std::log(static_cast<double>(std::max<std::size_t>(1, cameras))) / 3.4;
  const double n = freedom;
  return n * std::pow(1 - 2 / (9 * n) + z * std::sqrt(2 / (9 * n)), 3);
}

struct Known {
  CameraModel model;
  PoseCovariance spread;  ///< of centre and turn
  double noise = 0;       ///< 0: unknown
};

PoseCovariance diagonal(double place, double turn) {
  Vector6 variances;
  variances << Eigen::Vector3d::Constant(place * place), Eigen::Vector3d::Constant(turn * turn);
  return variances.asDiagonal();
}

/// What the calibration states of its pose: given its lens and against the others where that is stated, else
/// the standard deviations, which are wider.
PoseCovariance spread_of(const v1::Calibration& calibration) {
  PoseCovariance root = PoseCovariance::Zero();
  if (calibration.sigma_size() == session::kCalibrationSigmas + session::kPoseRootNumbers) {
    int next = session::kCalibrationSigmas;
    for (int row = 0; row < kPoseUnknowns; ++row)
      for (int column = 0; column <= row; ++column) root(row, column) = calibration.sigma(next++);
  } else if (calibration.sigma_size() == session::kCalibrationSigmas) {
    for (int i = 0; i < kPoseUnknowns; ++i) root(i, i) = calibration.sigma(kLensUnknowns + i);
  }
  return root * root.transpose() + diagonal(kLeastPlace, kLeastTurn);
}

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
  known.spread = spread_of(found->calibration());
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

OwnViews lamp_views(const BoardSightings& sightings, std::size_t camera, const Known& known) {
  OwnViews own;
  own.bundle.board = sightings.board;
  own.bundle.cameras.push_back({known.model, Held::both});
  own.noise = own.bundle.cameras[0].noise = kLampNoise;
  for (std::size_t s = 0; s < sightings.sightings.size(); ++s) {
    const auto& sighting = sightings.sightings[s];
    if (sighting.camera != camera) continue;
    own.bundle.views.push_back({0, own.bundle.boards.size(), sighting.corners, {CornerUse::used}});
    own.bundle.boards.emplace_back();
    own.sightings.push_back(s);
  }
  return own;
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

using Seen = std::vector<std::pair<std::size_t, const BundleView*>>;  ///< by which camera

/// The point nearest to all rays; none where it isn't in front of every camera.
std::optional<Eigen::Vector3d> meeting_point(const std::vector<Known>& known, const Seen& seen) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const auto& [camera, view] : seen) {
    const Ray ray = known[camera].model.ray(view->corners[0].pixel);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - ray.direction * ray.direction.transpose();
    sum += across;
    right += across * ray.origin;
  }
  const Eigen::Vector3d point = sum.ldlt().solve(right);
  for (const auto& [camera, view] : seen)
    if (!((known[camera].model.camera_from_world * point).z() > 1e-3)) return std::nullopt;
  return point;
}

/// Where a board, or a lamp, is that cameras see at one instant.
std::optional<Rigid3> first_pose(const BoardSightings& sightings, const std::vector<Known>& known,
                                 const std::vector<OwnViews>& own, const Seen& seen) {
  if (sightings.board.kind == BoardKind::lamp) {
    const auto point = meeting_point(known, seen);
    if (!point) return std::nullopt;
    return Rigid3{Eigen::Matrix3d::Identity(), *point};
  }
  const auto& [first, view] = seen.front();
  const Rigid3& pose = own[first].bundle.boards[view->board].world_from_board;  // camera_from_board
  return chained(known[first].model.camera_from_world.inverse(), pose);
}

/// All cameras with their lenses, and their poses as far as the calibration knows them; a board each instant
/// that two of them see.
Bundle bundle_of(const BoardSightings& sightings, const std::vector<Known>& known,
                 const std::vector<OwnViews>& own, const std::vector<bool>& usable) {
  std::map<std::size_t, Seen> by_instant;
  for (std::size_t c = 0; c < known.size(); ++c) {
    if (!usable[c]) continue;
    for (std::size_t v = 0; v < own[c].sightings.size(); ++v)
      if (!own[c].bundle.views[v].corners.empty())
        by_instant[sightings.sightings[own[c].sightings[v]].instant].emplace_back(c, &own[c].bundle.views[v]);
  }
  Bundle bundle;
  bundle.board = sightings.board;
  for (std::size_t c = 0; c < known.size(); ++c) {
    BundleCamera camera{known[c].model, Held::lens};
    camera.prior = {known[c].model.camera_from_world, known[c].spread};
    if (!own[c].bundle.cameras.empty()) camera.noise = own[c].bundle.cameras[0].noise;
    bundle.cameras.push_back(camera);
  }
  for (const auto& [instant, seen] : by_instant) {
    if (seen.size() < 2) continue;
    const auto pose = first_pose(sightings, known, own, seen);
    if (!pose) continue;
    for (const auto& [camera, own_view] : seen) {
      bundle.views.push_back(*own_view);
      bundle.views.back().camera = camera;
      bundle.views.back().board = bundle.boards.size();
    }
    bundle.boards.push_back({*pose, Held::none});
  }
  return bundle;
}

Vector6 motion(const CameraModel& now, const CameraModel& calibrated) {
  const Eigen::AngleAxisd turn(now.camera_from_world.rotation *
                               calibrated.camera_from_world.rotation.transpose());
  Vector6 result;
  result << now.center() - calibrated.center(), turn.angle() * turn.axis();
  return result;
}

/// Sum of squares in standard deviations, of corners and of poses against what was known of them.
double cost_of(const Bundle& bundle) {
  double cost = 0;
  for (const BundleView& view : bundle.views)
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      if (view.use[i] == CornerUse::used)
        cost += residual(bundle, view, i).squaredNorm() / std::pow(bundle.cameras[view.camera].noise, 2);
  for (const BundleCamera& camera : bundle.cameras) {
    const Vector6 off = motion(camera.model, {camera.model.intrinsics, camera.prior->camera_from_world});
    cost += off.dot(camera.prior->covariance.ldlt().solve(off));
  }
  return cost;
}

double worst_deviation(const Eigen::Matrix3d& spread) {
  return std::sqrt(
      std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvalues().maxCoeff()));
}

/// Equations for a camera's pose that lamps leave: the lamps' own places cost the others' two apiece.
int lamp_equations(const Bundle& bundle, std::size_t camera) {
  std::map<std::size_t, int> cameras_of;
  for (const BundleView& view : bundle.views) ++cameras_of[view.board];
  int equations = 0;
  for (const BundleView& view : bundle.views)
    if (view.camera == camera) equations += std::min(2, cameras_of[view.board] - 1);
  return equations;
}

/// Frees one more camera: the bundle then, and what it says of that camera.
struct Freed {
  Bundle bundle;
  double cost = INFINITY;
  int freedom = kPoseUnknowns;
  [[nodiscard]] bool turn_alone() const { return freedom < kPoseUnknowns; }
};

std::optional<Freed> freed(const Bundle& bundle, std::size_t camera) {
  Freed result{bundle};
  if (bundle.board.kind == BoardKind::lamp)
    result.freedom = std::min(kPoseUnknowns, lamp_equations(bundle, camera));
  PoseCovariance& prior = result.bundle.cameras[camera].prior->covariance;
  const Eigen::Matrix3d place = prior.topLeftCorner<3, 3>();
  prior = diagonal(kLoosePlace, kLooseTurn);
  if (result.turn_alone()) {
    result.freedom = std::min(3, result.freedom);
    prior.topLeftCorner<3, 3>() = place;
  }
  if (!adjust(result.bundle, BundleLoss::squares).ok()) return std::nullopt;
  result.cost = cost_of(result.bundle);
  return result;
}

void describe_drift(const Freed& fit, double cost_as_calibrated, const Known& known, std::size_t camera,
                    CameraDrift& drift) {
  const auto spread = covariance(fit.bundle);
  if (!spread) {
    drift.verdict = DriftVerdict::unknown;
    drift.why = "its views don't tell its pose";
    return;
  }
  drift.verdict = DriftVerdict::still;
  const Vector6 moved = motion(fit.bundle.cameras[camera].model, known.model);
  const auto at = static_cast<Eigen::Index>(camera) * kCameraUnknowns + kLensUnknowns;
  const PoseCovariance total = spread->block<kPoseUnknowns, kPoseUnknowns>(at, at) + known.spread;
  drift.turn_alone = fit.turn_alone();
  drift.freedom = fit.freedom;
  drift.chi2 = std::max(0.0, cost_as_calibrated - fit.cost);
  drift.place = drift.turn_alone ? Eigen::Vector3d::Zero() : Eigen::Vector3d(moved.head<3>());
  drift.turn = moved.tail<3>();
  drift.place_sigma = worst_deviation(total.topLeftCorner<3, 3>());
  drift.turn_sigma = worst_deviation(total.bottomRightCorner<3, 3>());
}

void count_instants(const Bundle& bundle, DriftReport& report) {
  for (const BundleView& view : bundle.views) ++report.cameras[view.camera].instants;
  for (CameraDrift& camera : report.cameras) {
    if (camera.verdict == DriftVerdict::lens || camera.instants > 0) continue;
    camera.why = "shares no instant of the " + noun_of(bundle.board) + " with another camera";
  }
}

/// Frees cameras one after the other, while that is significant.
Status find_moved(Bundle& bundle, const std::vector<Known>& known, DriftReport& report) {
  std::set<std::size_t> free;
  std::size_t seen = 0;
  for (const CameraDrift& camera : report.cameras) seen += camera.instants > 0 ? 1 : 0;
  EMBERLOCK_RETURN_IF_ERROR(adjust(bundle, BundleLoss::squares));
  while (free.size() + 1 < seen) {
    const double cost = cost_of(bundle);
    std::optional<std::size_t> best;
    std::optional<Freed> best_fit;
    for (std::size_t c = 0; c < known.size(); ++c) {
      CameraDrift& camera = report.cameras[c];
      if (camera.instants == 0 || free.contains(c)) continue;
      auto fit = freed(bundle, c);
      if (!fit) continue;
      describe_drift(*fit, cost, known[c], c, camera);
      camera.limit = chi2_limit(fit->freedom, report.cameras.size());
      if (camera.chi2 <= camera.limit || (best_fit && best_fit->cost <= fit->cost)) continue;
      best = c;
      best_fit = std::move(fit);
    }
    if (!best) break;
    bundle = std::move(best_fit->bundle);
    report.cameras[*best].verdict = DriftVerdict::moved;
    free.insert(*best);
  }
  return {};
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
  const bool lamp = sightings.board.kind == BoardKind::lamp;
  std::vector<Known> known;
  std::vector<OwnViews> own;
  std::vector<bool> usable;
  for (std::size_t c = 0; c < sightings.cameras.size(); ++c) {
    EMBERLOCK_ASSIGN_OR_RETURN(Known camera, known_camera(rig, sightings.cameras[c], where));
    OwnViews views;
    if (lamp) {
      views = lamp_views(sightings, c, camera);
    } else {
      EMBERLOCK_ASSIGN_OR_RETURN(views, own_views(sightings, c, camera));
    }
    CameraDrift drift{.id = sightings.cameras[c].id};
    const double noise = views.noise;
    const bool lens_fits = lamp || camera.noise == 0 || views.sightings.empty() ||
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
    const std::string noun = noun_of(sightings.board);
    return Error{ErrorKind::bad_input, "no two calibrated cameras see the " + noun + " at one instant",
                 "pictures", "Take pictures in which neighbouring cameras see the " + noun + " at once"};
  }
  count_instants(bundle, report);
  if (bundle.views.empty()) return report;
  Bundle before = bundle;
  for (BundleCamera& camera : before.cameras) camera.held = Held::both;
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

}  // namespace emberlock::recon
