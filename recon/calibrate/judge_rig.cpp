// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/judge_rig.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/lens_start.h"

namespace emberlock::recon {
namespace {

/// Two cameras agree if poses of single views carry corners from one to the other with errors below this
/// share of the half diagonal. Such poses are far less accurate than the common solution.
constexpr double kAgreement = 0.05;

double half_diagonal(const Intrinsics& lens) { return 0.5 * std::hypot(lens.size.width, lens.size.height); }

struct BoardView {
  std::vector<BoardCorner> corners;
  Rigid3 camera_from_board;
};

/// What one camera sees.
struct SeenBoards {
  Intrinsics lens;
  std::map<std::size_t, BoardView> views;  ///< by instant
};

SeenBoards boards_of(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                     const std::vector<PlacedSighting>& placed, std::size_t camera) {
  SeenBoards seen{lenses[camera], {}};
  for (const PlacedSighting& view : placed)
    if (view.camera == camera)
      seen.views[view.instant] = {sightings.sightings[view.sighting].corners, view.camera_from_board};
  return seen;
}

/// The corners of a chessboard in the mirror image of a picture. find_board() counts a mirrored board's
/// corners as those of a board that isn't, from the end whose inner square is black.
std::vector<BoardCorner> mirror_corners(std::vector<BoardCorner> corners, const Board& board, int width) {
  for (BoardCorner& corner : corners) {
    const int column = corner.id % board.columns;
    const int row = corner.id / board.columns;
    corner.id = board.rows % 2 == 0 ? (board.rows - 1 - row) * board.columns + column
                                    : row * board.columns + board.columns - 1 - column;
    corner.pixel.x() = width - corner.pixel.x();
  }
  return corners;
}

SeenBoards mirror_boards(const SeenBoards& seen, const Board& board) {
  SeenBoards mirrored{seen.lens, {}};
  mirrored.lens.cx = seen.lens.size.width - seen.lens.cx;
  mirrored.lens.distortion.p2 = -seen.lens.distortion.p2;
  for (const auto& [instant, view] : seen.views) {
    auto corners = mirror_corners(view.corners, board, seen.lens.size.width);
    if (const auto pose = board_pose(mirrored.lens, board, corners))
      mirrored.views[instant] = {std::move(corners), *pose};
  }
  return mirrored;
}

/// Pixels by which b misses its corners where a's views and one motion from a to b put them: the median of
/// the shared instants. nullopt for fewer than 3 instants.
std::optional<double> disagreement(const Board& board, const SeenBoards& a, const SeenBoards& b) {
  constexpr std::size_t kFewestInstants = 3;
  std::vector<Rigid3> steps;
  for (const auto& [instant, view] : b.views)
    if (const auto other = a.views.find(instant); other != a.views.end())
      steps.push_back(chained(view.camera_from_board, other->second.camera_from_board.inverse()));
  if (steps.size() < kFewestInstants) return std::nullopt;
  const Rigid3 step = medoid(steps);
  const double far = 2 * half_diagonal(b.lens);  // corners that come to lie behind the camera
  std::vector<double> misses;
  for (const auto& [instant, view] : b.views) {
    const auto other = a.views.find(instant);
    if (other == a.views.end()) continue;
    const CameraModel camera{b.lens, chained(step, other->second.camera_from_board)};
    double sum = 0;
    for (const BoardCorner& corner : view.corners) {
      const Eigen::Vector3d place = board.point(corner.id);
      const bool in_front = (camera.camera_from_world * place).z() > 0;
      sum += in_front ? std::min(far, (camera.project(place) - corner.pixel).norm()) : far;
    }
    misses.push_back(sum / static_cast<double>(view.corners.size()));
  }
  const auto middle = misses.begin() + static_cast<std::ptrdiff_t>(misses.size() / 2);
  std::nth_element(misses.begin(), middle, misses.end());
  return *middle;
}

/// The largest set of cameras that agree in pairs; of equally large ones that of the first camera.
std::vector<std::size_t> largest_agreeing(const std::vector<SeenBoards>& seen, const Board& board) {
  std::vector<std::size_t> group(seen.size());
  for (std::size_t i = 0; i < seen.size(); ++i) group[i] = i;
  for (std::size_t b = 0; b < seen.size(); ++b) {
    for (std::size_t a = 0; a < b; ++a) {
      const auto miss = disagreement(board, seen[a], seen[b]);
      if (miss && *miss < kAgreement * half_diagonal(seen[b].lens))
        std::replace(group.begin(), group.end(), std::size_t{group[b]}, std::size_t{group[a]});
    }
  }
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < seen.size(); ++i) {
    std::vector<std::size_t> members;
    for (std::size_t k = 0; k < seen.size(); ++k)
      if (group[k] == group[i]) members.push_back(k);
    if (members.size() > best.size()) best = std::move(members);
  }
  return best;
}

/// How many of a camera's placed views stand at instants that other cameras see too. The others fit whatever
/// the camera's pose is.
std::ptrdiff_t shared_views(const std::vector<PlacedSighting>& placed, std::size_t camera) {
  std::map<std::size_t, int> cameras;  // by instant
  for (const PlacedSighting& view : placed) ++cameras[view.instant];
  return std::count_if(placed.begin(), placed.end(), [&](const PlacedSighting& view) {
    return view.camera == camera && cameras[view.instant] > 1;
  });
}

/// How many of a camera's views the solution uses together with another camera's view of the same board.
std::ptrdiff_t views_used_together(const Bundle& bundle, std::size_t at) {
  std::vector<int> used(bundle.boards.size());
  for (const BundleView& view : bundle.views) used[view.board] += view.used() > 0 ? 1 : 0;
  return std::count_if(bundle.views.begin(), bundle.views.end(), [&](const BundleView& view) {
    return view.camera == at && view.used() > 0 && used[view.board] > 1;
  });
}

/// Why a camera isn't described, in a few words; empty if it is.
std::string fault_of(const RigCalibration& result, const std::vector<PlacedSighting>& placed,
                     std::size_t camera) {
  constexpr double kFewestUsed = 0.5;  // of the views, as of a view's corners
  const auto member = std::find(result.bundle_camera.begin(), result.bundle_camera.end(), camera);
  if (member == result.bundle_camera.end()) return "none of its views fits the other cameras'";
  const auto at = static_cast<std::size_t>(member - result.bundle_camera.begin());
  const auto views = shared_views(placed, camera);
  const auto used = views_used_together(result.bundle, at);
  if (static_cast<double>(used) < kFewestUsed * static_cast<double>(views))
    return fmt::format("only {} of the {} views that it shares fit the other cameras'", used, views);
  const Eigen::VectorXd sigma =
      result.covariance.diagonal().segment<kCameraUnknowns>(static_cast<Eigen::Index>(at) * kCameraUnknowns);
  return lens_misfit(result.bundle.cameras[at], sigma.cwiseSqrt());
}

Misfit misfit_of(const BoardSightings& sightings, const std::vector<SeenBoards>& seen,
                 const std::vector<std::size_t>& sound, const std::vector<std::size_t>& group, std::size_t at,
                 const std::string& fault) {
  const std::size_t camera = group[at];
  const SeenBoards mirrored = mirror_boards(seen[at], sightings.board);
  for (const std::size_t other : sound) {
    const auto miss = disagreement(sightings.board, seen[other], seen[at]);
    const auto flipped = disagreement(sightings.board, seen[other], mirrored);
    if (!miss || !flipped || *flipped >= kAgreement * half_diagonal(mirrored.lens)) continue;
    return {
        camera, true,
        fmt::format("its pictures are mirror images: flipped they fit those of {} to {:.1f} pixels, as they "
                    "are to {:.0f}. {}",
                    sightings.cameras[group[other]].id, *flipped, *miss, kSwitchMirroringOff)};
  }
  return {
      camera, false,
      (fault.empty() ? "its views disagree with the other cameras'" : fault) +
          ". Check that pictures of one name or number were taken at one instant, with one focus and zoom"};
}

}  // namespace

std::vector<Misfit> find_misfits(const BoardSightings& sightings, const std::vector<Intrinsics>& lenses,
                                 const std::vector<PlacedSighting>& placed, const RigCalibration& result) {
  const std::vector<std::size_t> group = largest_group(placed, sightings.cameras.size());
  std::vector<std::string> faults;
  faults.reserve(group.size());
  for (const std::size_t camera : group) faults.push_back(fault_of(result, placed, camera));
  if (group.size() < 2 || std::all_of(faults.begin(), faults.end(), [](const auto& f) { return f.empty(); }))
    return {};
  std::vector<SeenBoards> seen;
  seen.reserve(group.size());
  for (const std::size_t camera : group) seen.push_back(boards_of(sightings, lenses, placed, camera));
  const std::vector<std::size_t> sound = largest_agreeing(seen, sightings.board);
  std::vector<Misfit> misfits;
  for (std::size_t at = 0; at < group.size(); ++at) {
    if (std::find(sound.begin(), sound.end(), at) != sound.end()) continue;
    const bool disagrees = std::any_of(sound.begin(), sound.end(), [&](std::size_t other) {
      return disagreement(sightings.board, seen[other], seen[at]).has_value();
    });
    if (disagrees || !faults[at].empty())
      misfits.push_back(misfit_of(sightings, seen, sound, group, at, faults[at]));
  }
  if (!misfits.empty()) return misfits;
  const auto noise = [&](std::size_t at) {  // infinite if it isn't in the solution
    const auto member = std::find(result.bundle_camera.begin(), result.bundle_camera.end(), group[at]);
    return member == result.bundle_camera.end()
               ? INFINITY
               : result.bundle.cameras[static_cast<std::size_t>(member - result.bundle_camera.begin())].noise;
  };
  std::optional<std::size_t> worst;
  for (std::size_t at = 0; at < group.size(); ++at)
    if (!faults[at].empty() && (!worst || noise(at) >= noise(*worst))) worst = at;
  return {misfit_of(sightings, seen, {}, group, *worst, faults[*worst])};
}

}  // namespace emberlock::recon
