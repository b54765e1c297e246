// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/calibrate_rig.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <fmt/format.h>

#include "recon/calibrate/chain_poses.h"
#include "recon/calibrate/judge_rig.h"
#include "recon/calibrate/lens_start.h"
#include "recon/calibrate/pose.h"

namespace emberlock::recon {
namespace {

constexpr int kLensSteps = 8;  // share of the progress in tenths

struct Starts {
  std::vector<std::optional<LensStart>> of;  ///< by camera
  std::vector<Intrinsics> lenses;            ///< by camera
};

Starts start_lenses(const BoardSightings& sightings, const CalibrateOptions& options,
                    const Progress& progress, RigCalibration& result) {
  Starts starts;
  for (std::size_t c = 0; c < sightings.cameras.size(); ++c) {
    tell(progress, 0.1 * kLensSteps * static_cast<double>(c) / static_cast<double>(sightings.cameras.size()),
         "lens of " + sightings.cameras[c].id);
    auto start = start_lens(sightings, c, options.clean);
    CalibratedCamera& camera = result.cameras[c];
    starts.lenses.push_back(start ? start->bundle.cameras[0].model.intrinsics : Intrinsics{});
    if (!start) {
      camera.why = start.error().what + ". " + start.error().remedy;
      starts.of.emplace_back();
      continue;
    }
    camera.calibrated = true;
    camera.tilt = start->tilt;
    camera.fit = start->bundle.cameras[0];
    if (const auto spread = covariance(start->bundle)) camera.sigma = spread->diagonal().cwiseSqrt();
    starts.of.push_back(*std::move(start));
  }
  return starts;
}

/// The lens stage's usable views; the others are named.
std::vector<PlacedSighting> usable(const BoardSightings& sightings, const Starts& starts,
                                   RigCalibration& result) {
  std::vector<PlacedSighting> placed;
  for (std::size_t c = 0; c < starts.of.size(); ++c) {
    if (!starts.of[c]) continue;
    const LensStart& start = *starts.of[c];
    std::map<std::size_t, std::string> why;
    for (const RejectedView& view : start.rejected) why[view.view] = view.why;
    for (std::size_t v = 0; v < start.sightings.size(); ++v) {
      const std::size_t s = start.sightings[v];
      if (why.contains(v)) {
        result.rejected.push_back({s, why.at(v)});
      } else {
        placed.push_back({s, c, sightings.sightings[s].instant,
                          start.bundle.boards[start.bundle.views[v].board].world_from_board});
      }
    }
    for (std::size_t s = 0; s < sightings.sightings.size(); ++s) {
      const bool tried =
          std::find(start.sightings.begin(), start.sightings.end(), s) != start.sightings.end();
      if (sightings.sightings[s].camera == c && !tried)
        result.rejected.push_back({s, "its corners are no flat board's as this lens would draw it"});
    }
  }
  return placed;
}

/// The group's cameras, boards and views, all used; wrong corners are found again.
void build_bundle(const BoardSightings& sightings, const Starts& starts,
                  const std::vector<PlacedSighting>& placed, const std::vector<std::size_t>& group,
                  RigCalibration& result) {
  const ChainPoses poses = chain_poses(sightings, starts.lenses, placed, group);
  Bundle& bundle = result.bundle;
  bundle = {};
  bundle.board = sightings.board;
  result.bundle_camera = group;
  result.bundle_sighting.clear();
  for (const std::size_t c : group) {
    BundleCamera camera = starts.of[c]->bundle.cameras[0];
    camera.held = c == group.front() ? Held::pose : Held::none;
    camera.model.camera_from_world = poses.camera_from_world.at(c);
    bundle.cameras.push_back(camera);
  }
  std::map<std::size_t, std::size_t> board_of;
  for (const PlacedSighting& view : placed) {
    const auto member = std::find(group.begin(), group.end(), view.camera);
    const auto pose = poses.world_from_board.find(view.instant);
    if (member == group.end() || pose == poses.world_from_board.end()) continue;
    const auto [board, first] = board_of.try_emplace(view.instant, bundle.boards.size());
    if (first) bundle.boards.push_back({pose->second, Held::none});
    const auto& corners = sightings.sightings[view.sighting].corners;
    bundle.views.push_back({static_cast<std::size_t>(member - group.begin()), board->second, corners,
                            std::vector<CornerUse>(corners.size(), CornerUse::used)});
    result.bundle_sighting.push_back(view.sighting);
  }
}

/// Adjusts the largest group of cameras; again without the views that were rejected, if that parts the group.
Status adjust_group(const BoardSightings& sightings, const CalibrateOptions& options, const Starts& starts,
                    std::vector<PlacedSighting> placed, RigCalibration& result) {
  for (;;) {
    const std::vector<std::size_t> group = largest_group(placed, sightings.cameras.size());
    build_bundle(sightings, starts, placed, group, result);
    EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<RejectedView> rejected, clean(result.bundle, options.clean));
    std::set<std::size_t> gone;
    for (const RejectedView& view : rejected) {
      gone.insert(result.bundle_sighting[view.view]);
      result.rejected.push_back({result.bundle_sighting[view.view], view.why});
    }
    std::erase_if(placed, [&](const PlacedSighting& view) { return gone.contains(view.sighting); });
    if (largest_group(placed, sightings.cameras.size()) == group) return {};
    if (placed.empty()) {
      return Error{ErrorKind::bad_input, "no view of the board fits the others", "cameras",
                   "Check that pictures of one name or number were taken at one instant, and --board"};
    }
  }
}

/// The instant of each of the bundle's boards, and by how many cameras it is used.
struct UsedBoard {
  std::size_t instant = 0;
  std::size_t cameras = 0;
};
std::vector<UsedBoard> used_boards(const BoardSightings& sightings, const RigCalibration& result) {
  std::vector<UsedBoard> used(result.bundle.boards.size());
  for (std::size_t v = 0; v < result.bundle.views.size(); ++v) {
    const BundleView& view = result.bundle.views[v];
    used[view.board].instant = sightings.sightings[result.bundle_sighting[v]].instant;
    used[view.board].cameras += view.used() > 0 ? 1 : 0;
  }
  return used;
}

Result<std::size_t> world_board(const BoardSightings& sightings, const CalibrateOptions& options,
                                const RigCalibration& result) {
  const std::vector<UsedBoard> used = used_boards(sightings, result);
  std::optional<std::size_t> best;
  for (std::size_t b = 0; b < used.size(); ++b) {
    if (used[b].cameras == 0) continue;
    if (options.world && sightings.instants[used[b].instant] == *options.world) return b;
    const bool better = !best || used[b].cameras > used[*best].cameras ||
                        (used[b].cameras == used[*best].cameras && used[b].instant < used[*best].instant);
    if (better) best = b;
  }
  if (!options.world) return *best;
  const bool there = std::find(sightings.instants.begin(), sightings.instants.end(), *options.world) !=
                     sightings.instants.end();
  return Error{ErrorKind::bad_input,
               there ? "no connected camera's view of the board at that instant could be used"
                     : "there is no such instant",
               "--world " + *options.world,
               "Name another; the best seen is " + sightings.instants[used[*best].instant]};
}

/// Makes a board's frame the world's.
void move_world(Bundle& bundle, std::size_t board) {
  const Rigid3 old_from_new = bundle.boards[board].world_from_board;
  const Rigid3 new_from_old = old_from_new.inverse();
  for (BundleCamera& camera : bundle.cameras) {
    camera.model.camera_from_world = chained(camera.model.camera_from_world, old_from_new);
    camera.held = Held::none;
  }
  for (BundleBoard& b : bundle.boards) b.world_from_board = chained(new_from_old, b.world_from_board);
  bundle.boards[board] = {{}, Held::pose};
}

/// Uncertainty of b's pose as a sees it: along and about the worst axes.
void find_uncertainty(const RigCalibration& result, std::size_t a, std::size_t b, CameraPair& pair) {
  const Rigid3& pose_a = result.bundle.cameras[a].model.camera_from_world;
  const Rigid3& pose_b = result.bundle.cameras[b].model.camera_from_world;
  const Eigen::Vector3d place = pose_a * pose_b.inverse().translation;
  Eigen::Matrix<double, 6, 12> jacobian =
      Eigen::Matrix<double, 6, 12>::Zero();  // of a's and b's centre, turn
  jacobian.block<3, 3>(0, 0) = -pose_a.rotation;
  jacobian.block<3, 3>(0, 3) = -cross_matrix(place);
  jacobian.block<3, 3>(0, 6) = pose_a.rotation;
  jacobian.block<3, 3>(3, 3) = -pose_b.rotation * pose_a.rotation.transpose();
  jacobian.block<3, 3>(3, 9).setIdentity();
  const std::array<Eigen::Index, 2> at = {static_cast<Eigen::Index>(a) * kCameraUnknowns + kLensUnknowns,
                                          static_cast<Eigen::Index>(b) * kCameraUnknowns + kLensUnknowns};
  Eigen::Matrix<double, 12, 12> joint;
  for (int i = 0; i < 2; ++i)
    for (int j = 0; j < 2; ++j)
      joint.block<6, 6>(6 * i, 6 * j) =
          result.covariance.block<6, 6>(at[static_cast<std::size_t>(i)], at[static_cast<std::size_t>(j)]);
  const Eigen::Matrix<double, 6, 6> spread = jacobian * joint * jacobian.transpose();
  const auto worst = [](const Eigen::Matrix3d& m) {
    const Eigen::Vector3d values = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(m).eigenvalues();
    return std::sqrt(std::max(0.0, values.maxCoeff()));
  };
  pair.distance_sigma = worst(spread.topLeftCorner<3, 3>());
  pair.turn_sigma = worst(spread.bottomRightCorner<3, 3>());
}

std::vector<CameraPair> pairs_of(const RigCalibration& result) {
  std::map<std::size_t, std::set<std::size_t>> by_board;
  for (const BundleView& view : result.bundle.views)
    if (view.used() > 0) by_board[view.board].insert(view.camera);
  std::map<std::pair<std::size_t, std::size_t>, std::size_t> shared;
  for (const auto& [board, cameras] : by_board)
    for (const std::size_t a : cameras)
      for (const std::size_t b : cameras)
        if (a < b) ++shared[{a, b}];
  std::vector<CameraPair> pairs;
  for (const auto& [cameras, instants] : shared) {
    CameraPair pair{result.bundle_camera[cameras.first], result.bundle_camera[cameras.second], instants};
    find_uncertainty(result, cameras.first, cameras.second, pair);
    pairs.push_back(pair);
  }
  return pairs;
}

/// The point nearest to all optical axes; none where they don't meet in front of every camera.
std::optional<Eigen::Vector3d> looked_at(const Bundle& bundle) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d right = Eigen::Vector3d::Zero();
  for (const BundleCamera& camera : bundle.cameras) {
    const Eigen::Vector3d axis = camera.model.camera_from_world.rotation.row(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - axis * axis.transpose();
    sum += across;
    right += across * camera.model.center();
  }
  if (std::abs(sum.determinant()) < 1e-3) return std::nullopt;  // axes all but parallel
  const Eigen::Vector3d point = sum.inverse() * right;
  for (const BundleCamera& camera : bundle.cameras)
    if ((camera.model.camera_from_world * point).z() < 1e-3) return std::nullopt;
  return point;
}

bool all_see(const Bundle& bundle, const Box& box) {
  for (const BundleCamera& camera : bundle.cameras) {
    const ImageSize size = camera.model.intrinsics.size;
    for (int i = 0; i < 8; ++i) {
      const Eigen::Vector3d sign((i & 1) != 0 ? 1 : -1, (i & 2) != 0 ? 1 : -1, (i & 4) != 0 ? 1 : -1);
      const Eigen::Vector3d corner = box.center + 0.5 * box.size.cwiseProduct(sign);
      if ((camera.model.camera_from_world * corner).z() < 1e-3) return false;
      const Eigen::Vector2d pixel = camera.model.project(corner);
      if (pixel.minCoeff() < 0 || pixel.x() > size.width || pixel.y() > size.height) return false;
    }
  }
  return true;
}

/// The largest cube that all cameras see whole, around the point that they look at; at least two cameras.
std::optional<Box> common_box(const Bundle& bundle) {
  if (bundle.cameras.size() < 2) return std::nullopt;
  const auto center = looked_at(bundle);
  if (!center) return std::nullopt;
  const auto cube = [&](double edge) { return Box{*center, Eigen::Vector3d::Constant(edge)}; };
  double low = 1e-3;
  if (!all_see(bundle, cube(low))) return std::nullopt;
  double high = low;
  while (high < 100 && all_see(bundle, cube(high))) high *= 2;
  for (int i = 0; i < 20; ++i) {
    const double middle = 0.5 * (low + high);
    (all_see(bundle, cube(middle)) ? low : high) = middle;
  }
  return cube(std::floor(low * 1e3) / 1e3);
}

void tell_cameras(const BoardSightings& sightings, RigCalibration& result) {
  const std::vector<PoseCovariance> relative = relative_pose_covariances(result.bundle, result.covariance);
  for (std::size_t b = 0; b < result.bundle_camera.size(); ++b) {
    CalibratedCamera& camera = result.cameras[result.bundle_camera[b]];
    camera.placed = true;
    camera.fit = result.bundle.cameras[b];
    camera.rms = rms_of(result.bundle, b);
    camera.relative = relative[b];
    camera.sigma = result.covariance.diagonal()
                       .segment<kCameraUnknowns>(static_cast<Eigen::Index>(b) * kCameraUnknowns)
                       .cwiseSqrt();
  }
  for (const auto& sighting : sightings.sightings) {
    ++result.cameras[sighting.camera].views;
    result.cameras[sighting.camera].corners += sighting.corners.size();
  }
  for (const BundleView& view : result.bundle.views) {
    CalibratedCamera& camera = result.cameras[result.bundle_camera[view.camera]];
    camera.views_used += view.used() > 0 ? 1 : 0;
    camera.corners_used += view.used();
  }
  for (CalibratedCamera& camera : result.cameras) {
    if (!camera.calibrated || camera.placed || !camera.why.empty()) continue;
    camera.why =
        "shares no usable instant of the board with the other cameras. Take pictures in which it and a "
        "connected "
        "camera see the board at once";
  }
}

/// Solves the largest group, with its covariance in the world's frame.
Status solve_group(const BoardSightings& sightings, const CalibrateOptions& options, const Starts& starts,
                   const std::vector<PlacedSighting>& placed, RigCalibration& result) {
  EMBERLOCK_RETURN_IF_ERROR(adjust_group(sightings, options, starts, placed, result));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t world, world_board(sightings, options, result));
  result.world = sightings.instants[used_boards(sightings, result)[world].instant];
  move_world(result.bundle, world);
  EMBERLOCK_RETURN_IF_ERROR(adjust(result.bundle, BundleLoss::squares));
  auto spread = covariance(result.bundle);
  if (!spread) {
    return Error{ErrorKind::bad_input, "the views don't determine all cameras", "cameras",
                 "Take more pictures in which neighbouring cameras see the board at once, tilted"};
  }
  result.covariance = *std::move(spread);
  return {};
}

/// Fixes radial coefficients of the cameras whose lens folds the picture in the common solution; true if
/// there is one.
bool hold_folding_lenses(const RigCalibration& result, Starts& starts) {
  bool held = false;
  for (std::size_t b = 0; b < result.bundle_camera.size(); ++b) {
    if (distortion_inverts(result.bundle.cameras[b].model.intrinsics)) continue;
    BundleCamera& camera = starts.of[result.bundle_camera[b]]->bundle.cameras[0];
    held = hold_radial_term(camera) || held;
  }
  return held;
}

/// Solves the largest group of cameras that fit each other. The others are named and left out.
Status solve_fitting(const BoardSightings& sightings, const CalibrateOptions& options, Starts& starts,
                     std::vector<PlacedSighting> placed, RigCalibration& result) {
  const auto rejected = result.rejected;
  for (;;) {
    EMBERLOCK_RETURN_IF_ERROR(solve_group(sightings, options, starts, placed, result));
    const std::vector<Misfit> misfits = find_misfits(sightings, starts.lenses, placed, result);
    for (const Misfit& misfit : misfits) {
      CalibratedCamera& camera = result.cameras[misfit.camera];
      camera.calibrated = !misfit.mirrored;
      camera.why = misfit.why;
      std::erase_if(placed, [&](const PlacedSighting& view) { return view.camera == misfit.camera; });
    }
    if (misfits.empty() && !hold_folding_lenses(result, starts)) return {};
    result.rejected = rejected;  // another group may need them
  }
}

}  // namespace

bool RigCalibration::whole() const {
  return std::all_of(cameras.begin(), cameras.end(), [](const CalibratedCamera& c) { return c.placed; });
}

Result<RigCalibration> calibrate_rig(const BoardSightings& sightings, const CalibrateOptions& options,
                                     const Progress& progress) {
  if (sightings.sightings.empty()) {
    return Error{
        ErrorKind::bad_input, "the board was found in no picture", "--board " + board_words(sightings.board),
        "Check the number of inner corners (chessboard) or squares (ChArUco), and that pictures are sharp"};
  }
  if (sightings.board.ambiguous() && sightings.cameras.size() > 1) {
    return Error{
        ErrorKind::bad_input,
        "this chessboard looks the same upside down, so cameras may take its corners for each other's",
        "--board " + board_words(sightings.board),
        "Use a board with an even and an odd number of inner corners (9x6), or a ChArUco board"};
  }
  RigCalibration result;
  for (const auto& camera : sightings.cameras) result.cameras.push_back({.id = camera.id});
  Starts starts = start_lenses(sightings, options, progress, result);
  std::vector<PlacedSighting> placed = usable(sightings, starts, result);
  if (placed.empty()) {
    return Error{ErrorKind::bad_input, result.cameras.front().why, "camera " + result.cameras.front().id,
                 sightings.cameras.size() > 1 ? "No other camera could be calibrated either" : ""};
  }
  tell(progress, 0.1 * kLensSteps, "all cameras together");
  EMBERLOCK_RETURN_IF_ERROR(solve_fitting(sightings, options, starts, std::move(placed), result));
  tell(progress, 0.95, "uncertainties");
  tell_cameras(sightings, result);
  result.pairs = pairs_of(result);
  result.box = options.box ? options.box : common_box(result.bundle);
  return result;
}

v1::Rig rig_of(const RigCalibration& calibration, const std::string& created_utc) {
  v1::Rig rig;
  rig.set_format_version(session::kRigFormatVersion);
  rig.set_created_utc(created_utc);
  for (const CalibratedCamera& camera : calibration.cameras) {
    if (!camera.calibrated) continue;
    v1::RigCamera& message = *rig.add_cameras();
    message.set_camera_id(camera.id);
    message.set_width(static_cast<std::uint32_t>(camera.fit.model.intrinsics.size.width));
    message.set_height(static_cast<std::uint32_t>(camera.fit.model.intrinsics.size.height));
    v1::Calibration& c = *message.mutable_calibration();
    c = calibration_of(camera.fit.model);
    for (const double sigma : camera.sigma) c.add_sigma(sigma);
    const Eigen::LLT<PoseCovariance> root(camera.relative);
    if (camera.placed && root.info() == Eigen::Success) {
      const PoseCovariance lower = root.matrixL();
      for (int row = 0; row < kPoseUnknowns; ++row)
        for (int column = 0; column <= row; ++column) c.add_sigma(lower(row, column));
    }
    c.set_corner_sigma(camera.fit.noise);
    if (!camera.placed) c.clear_camera_from_world();
  }
  if (calibration.box) *rig.mutable_box() = message_of(*calibration.box);
  return rig;
}

}  // namespace emberlock::recon
