// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/lens_start.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/calib3d.hpp>

#include "recon/calibrate/pose.h"

namespace emberlock::recon {
namespace {

constexpr std::size_t kFewestViews = 3;
constexpr std::size_t kViewsForStart = 25;  // more only cost time, since the bundle adjustment follows
constexpr double kFarCorner = 0.85;         // of the half diagonal
constexpr double kParallel = 0.1;           // radians: boards closer than that are parallel
constexpr double kWorstFocal = 0.05;
constexpr double kWorstNoise = 0.005;  // of the half diagonal: a voxel of a volume of 200 across
constexpr double kWorstCenter = 0.1;   // of the width
constexpr double kSignificant = 3;     // standard deviations

/// OpenCV counts pixels from the centre of the first one.
constexpr double kOpencvShift = 0.5;

cv::Point3f object_point(const Board& board, int id) {
  const Eigen::Vector3d p = board.point(id);
  return {static_cast<float>(p.x()), static_cast<float>(p.y()), static_cast<float>(p.z())};
}

cv::Point2f image_point(const BoardCorner& corner) {
  return {static_cast<float>(corner.pixel.x() - kOpencvShift),
          static_cast<float>(corner.pixel.y() - kOpencvShift)};
}

Rigid3 rigid_of(const cv::Mat& turn, const cv::Mat& translation) {
  cv::Mat rotation;
  cv::Rodrigues(turn, rotation);
  Rigid3 pose;
  for (int r = 0; r < 3; ++r) {
    for (int c = 0; c < 3; ++c) pose.rotation(r, c) = rotation.at<double>(r, c);
    pose.translation[r] = translation.at<double>(r);
  }
  return pose;
}

Error lens_error(const BoardSightings& sightings, std::size_t camera, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), "camera " + sightings.cameras[camera].id, std::move(remedy)};
}

/// Views at even intervals.
std::vector<std::size_t> chosen_views(const std::vector<std::size_t>& all) {
  if (all.size() <= kViewsForStart) return all;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < kViewsForStart; ++i) chosen.push_back(all[i * all.size() / kViewsForStart]);
  return chosen;
}

std::optional<Intrinsics> zhang(const BoardSightings& sightings, std::size_t camera,
                                const std::vector<std::size_t>& views) {
  std::vector<std::vector<cv::Point3f>> objects;
  std::vector<std::vector<cv::Point2f>> images;
  for (const std::size_t v : chosen_views(views)) {
    auto& object = objects.emplace_back();
    auto& image = images.emplace_back();
    for (const BoardCorner& corner : sightings.sightings[v].corners) {
      object.push_back(object_point(sightings.board, corner.id));
      image.push_back(image_point(corner));
    }
  }
  const ImageSize size = sightings.cameras[camera].size;
  cv::Mat matrix;
  cv::Mat distortion;
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> translations;
  try {
    cv::calibrateCamera(objects, images, {size.width, size.height}, matrix, distortion, turns, translations,
                        cv::CALIB_FIX_K2 | cv::CALIB_FIX_K3 | cv::CALIB_ZERO_TANGENT_DIST);
  } catch (const cv::Exception&) {
    return std::nullopt;  // degenerate views
  }
  const Intrinsics lens{size,
                        matrix.at<double>(0, 0),
                        matrix.at<double>(1, 1),
                        matrix.at<double>(0, 2) + kOpencvShift,
                        matrix.at<double>(1, 2) + kOpencvShift,
                        {distortion.at<double>(0), 0, 0, 0, 0}};
  const double widest = 100.0 * std::max(size.width, size.height);
  if (!(lens.fx > 1 && lens.fy > 1 && lens.fx < widest && lens.fy < widest)) return std::nullopt;
  return lens;
}

double widest_tilt(const Bundle& bundle) {
  std::vector<Eigen::Vector3d> normals;
  for (const BundleView& view : bundle.views)
    if (view.used() > 0) normals.push_back(bundle.boards[view.board].world_from_board.rotation.col(2));
  double widest = 0;
  for (std::size_t i = 0; i < normals.size(); ++i)
    for (std::size_t j = 0; j < i; ++j)
      widest = std::max(widest, std::acos(std::clamp(normals[i].dot(normals[j]), -1.0, 1.0)));
  return widest;
}

/// Largest distance of a corner from the picture's middle, in half diagonals.
double reach_of_corners(const Bundle& bundle) {
  const ImageSize size = bundle.cameras[0].model.intrinsics.size;
  const Eigen::Vector2d middle(0.5 * size.width, 0.5 * size.height);
  double reach = 0;
  for (const BundleView& view : bundle.views)
    for (std::size_t i = 0; i < view.corners.size(); ++i)
      if (view.use[i] == CornerUse::used) reach = std::max(reach, (view.corners[i].pixel - middle).norm());
  return reach / middle.norm();
}

/// Whether the last free radial coefficient exceeds its uncertainty.
bool last_term_is_significant(const Bundle& bundle) {
  if (bundle.cameras[0].radial_terms == 0) return false;
  const auto spread = covariance(bundle);
  if (!spread) return false;
  const Distortion& d = bundle.cameras[0].model.intrinsics.distortion;
  const auto last = static_cast<std::size_t>(bundle.cameras[0].radial_terms - 1);
  const Eigen::Index unknown = kRadialUnknowns[last];
  return std::abs(std::array{d.k1, d.k2, d.k3}[last]) > kSignificant * std::sqrt((*spread)(unknown, unknown));
}

/// Frees k3 if corners are far enough out, and keeps it free if it is significant.
Status choose_k3(Bundle& bundle) {
  if (reach_of_corners(bundle) < kFarCorner) return {};
  Bundle freed = bundle;
  freed.cameras[0].radial_terms = kRadialTerms;
  EMBERLOCK_RETURN_IF_ERROR(adjust(freed, BundleLoss::squares));
  if (last_term_is_significant(freed) && distortion_inverts(freed.cameras[0].model.intrinsics))
    bundle = std::move(freed);
  return {};
}

/// Fixes k2, then k1, where the lens folds the picture and they aren't significant.
Status hold_undetermined(Bundle& bundle) {
  while (!distortion_inverts(bundle.cameras[0].model.intrinsics)) {
    bundle.cameras[0].inflation = jackknife_inflation(bundle);
    if (last_term_is_significant(bundle) || !hold_radial_term(bundle.cameras[0])) break;
    EMBERLOCK_RETURN_IF_ERROR(adjust(bundle, BundleLoss::squares));
  }
  return {};
}

Status check_determined(const BoardSightings& sightings, std::size_t camera, const LensStart& start) {
  const auto spread = covariance(start.bundle);
  const Intrinsics& lens = start.bundle.cameras[0].model.intrinsics;
  const double degrees = start.tilt * 180 / M_PI;
  if (start.tilt < kParallel) {
    return lens_error(
        sightings, camera,
        fmt::format("all boards are parallel (within {:.1f} degrees): the focal length can't be told "
                    "from the distance",
                    degrees),
        "Take more pictures with the board tilted by 20 to 45 degrees, to the left, right, up and down");
  }
  const std::string misfit = spread ? lens_misfit(start.bundle.cameras[0], spread->diagonal().cwiseSqrt())
                                    : "the views leave the lens open";
  if (!misfit.empty()) {
    return lens_error(sightings, camera, misfit,
                      fmt::format("Take more pictures with the board near, tilted more (now up to {:.0f} "
                                  "degrees), and in all parts "
                                  "of the picture",
                                  degrees));
  }
  if (!distortion_inverts(lens)) {
    return lens_error(sightings, camera, "the distortion that fits the corners folds the rest of the picture",
                      "Take more pictures with the board in the picture's corners");
  }
  return {};
}

}  // namespace

std::string lens_misfit(const BundleCamera& camera, const Eigen::VectorXd& sigma) {
  const Intrinsics& lens = camera.model.intrinsics;
  const double limit = kWorstNoise * 0.5 * std::hypot(lens.size.width, lens.size.height);
  if (!(camera.noise <= limit))
    return fmt::format("its corners miss by {:.1f} pixels, at most {:.1f} are allowed: no lens fits them",
                       camera.noise, limit);
  const bool known = sigma[0] < kWorstFocal * lens.fx && sigma[1] < kWorstFocal * lens.fy &&
                     sigma.segment<2>(2).maxCoeff() < kWorstCenter * lens.size.width;
  if (known) return {};
  return fmt::format("the views leave the lens open: focal length {:.0f} +- {:.0f} pixels", lens.fx,
                     sigma[0]);
}

bool hold_radial_term(BundleCamera& camera) {
  if (camera.radial_terms == 0) return false;
  --camera.radial_terms;
  Distortion& d = camera.model.intrinsics.distortion;
  *std::array{&d.k1, &d.k2, &d.k3}[static_cast<std::size_t>(camera.radial_terms)] = 0;
  return true;
}

std::optional<Rigid3> board_pose(const Intrinsics& lens, const Board& board,
                                 const std::vector<BoardCorner>& corners) {
  std::vector<cv::Point3d> object;
  std::vector<cv::Point2d> image;
  for (const BoardCorner& corner : corners) {
    const Eigen::Vector3d p = board.point(corner.id);
    object.emplace_back(p.x(), p.y(), p.z());
    // Without lens: the direction of a pixel, as imaged by a pinhole with this focal length.
    Eigen::Vector2d n((corner.pixel.x() - lens.cx) / lens.fx, (corner.pixel.y() - lens.cy) / lens.fy);
    if (!lens.distortion.none()) lens.distortion.undistort(n.x(), n.y());
    image.emplace_back(n.x() * lens.fx, n.y() * lens.fx);
  }
  const cv::Mat matrix = (cv::Mat_<double>(3, 3) << lens.fx, 0, 0, 0, lens.fx, 0, 0, 0, 1);
  // A homography fitted robustly shows which corners are right.
  std::vector<cv::Point2d> flat;
  flat.reserve(object.size());
  for (const cv::Point3d& p : object) flat.emplace_back(p.x, p.y);
  cv::Mat right;
  const double reach = 3.0 + 0.002 * std::max(lens.size.width, lens.size.height);  // pixels
  if (cv::findHomography(flat, image, cv::RANSAC, reach, right).empty()) return std::nullopt;
  std::vector<cv::Point3d> kept_object;
  std::vector<cv::Point2d> kept_image;
  for (std::size_t i = 0; i < object.size(); ++i) {
    if (right.at<std::uint8_t>(static_cast<int>(i)) == 0) continue;
    kept_object.push_back(object[i]);
    kept_image.push_back(image[i]);
  }
  if (kept_object.size() < 4) return std::nullopt;
  cv::Mat turn;
  cv::Mat translation;
  try {
    if (!cv::solvePnP(kept_object, kept_image, matrix, cv::noArray(), turn, translation, false,
                      cv::SOLVEPNP_IPPE))
      return std::nullopt;
    cv::solvePnPRefineLM(kept_object, kept_image, matrix, cv::noArray(), turn, translation);
  } catch (const cv::Exception&) {
    return std::nullopt;
  }
  const Rigid3 pose = rigid_of(turn, translation);
  for (const BoardCorner& corner : corners)
    if (!((pose * board.point(corner.id)).z() > 0)) return std::nullopt;
  return pose;
}

Result<LensStart> start_lens(const BoardSightings& sightings, std::size_t camera,
                             const CleanOptions& options) {
  LensStart start;
  for (std::size_t v = 0; v < sightings.sightings.size(); ++v)
    if (sightings.sightings[v].camera == camera) start.sightings.push_back(v);
  const auto too_few = [&](std::size_t count) {
    return lens_error(
        sightings, camera,
        fmt::format("the board was found in {} of its pictures, at least {} are needed", count, kFewestViews),
        "Take 10 to 20 with the board in all parts of the picture, tilted by 20 to 45 degrees");
  };
  if (start.sightings.size() < kFewestViews) return too_few(start.sightings.size());
  const auto lens = zhang(sightings, camera, start.sightings);
  if (!lens) {
    return lens_error(sightings, camera, "the views leave the lens open: boards parallel, or too far away",
                      "Take more pictures with the board near, tilted by 20 to 45 degrees, to all sides");
  }
  Bundle& bundle = start.bundle;
  bundle.board = sightings.board;
  bundle.cameras.push_back({{*lens, {}}, Held::pose});
  std::vector<std::size_t> kept;
  for (const std::size_t v : start.sightings) {
    const auto& sighting = sightings.sightings[v];
    const auto pose = board_pose(*lens, sightings.board, sighting.corners);
    if (!pose) {
      continue;
    }
    kept.push_back(v);
    bundle.views.push_back({0, bundle.boards.size(), sighting.corners,
                            std::vector<CornerUse>(sighting.corners.size(), CornerUse::used)});
    bundle.boards.push_back({*pose, Held::none});
  }
  start.sightings = std::move(kept);
  if (start.sightings.size() < kFewestViews) return too_few(start.sightings.size());
  EMBERLOCK_ASSIGN_OR_RETURN(start.rejected, clean(bundle, options));
  if (start.sightings.size() - start.rejected.size() < kFewestViews)
    return too_few(start.sightings.size() - start.rejected.size());
  start.tilt = widest_tilt(bundle);
  EMBERLOCK_RETURN_IF_ERROR(choose_k3(bundle));
  EMBERLOCK_RETURN_IF_ERROR(hold_undetermined(bundle));
  bundle.cameras[0].inflation = jackknife_inflation(bundle);
  EMBERLOCK_RETURN_IF_ERROR(check_determined(sightings, camera, start));
  return start;
}

}  // namespace emberlock::recon
