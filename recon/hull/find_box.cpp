// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/find_box.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include <Eigen/Geometry>

#include "recon/hull/hull.h"

namespace emberlock::recon {
namespace {

constexpr double kFar = 20;        // times the cameras' spread: further away the region counts as unbounded
constexpr int kCoarseVoxels = 48;  // along the longest side
constexpr int kRounds = 6;         // of carving, maximum
constexpr double kSettled =
    0.97;  // of the last round's longest side: for a smaller reduction no further round is made
constexpr double kMarginShare = 0.05;

const char* const kRemedy = "Give --box cx,cy,cz,sx,sy,sz in metres, or a box in the input";

Error no_box(std::string where, std::string what, const std::string& first) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), first + ", or tell the box: " + kRemedy};
}

/// Points x with normal . x <= most.
struct HalfSpace {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double most = 0;
};

struct Bounds {
  Eigen::Vector3d low = Eigen::Vector3d::Zero();
  Eigen::Vector3d high = Eigen::Vector3d::Zero();
  [[nodiscard]] bool empty() const { return !((high - low).minCoeff() > 0); }
};

/// The region in front of the camera and between the planes through its centre and the sides of its mask's
/// bounding box.
void add_cone(const CameraModel& camera, const PixelBox& box, std::vector<HalfSpace>& cone) {
  const Eigen::Vector3d center = camera.center();
  const Eigen::Vector3d forward = camera.camera_from_world.rotation.row(2);
  cone.push_back({-forward, -forward.dot(center)});
  const std::array<Eigen::Vector2d, 4> corners = {
      Eigen::Vector2d(box.x0, box.y0), {box.x1, box.y0}, {box.x1, box.y1}, {box.x0, box.y1}};
  const Eigen::Vector3d middle = camera.ray({0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1)}).direction;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    Eigen::Vector3d normal =
        camera.ray(corners[i]).direction.cross(camera.ray(corners[(i + 1) % 4]).direction);
    if (normal.dot(middle) > 0) normal = -normal;
    if (normal.norm() > 0) cone.push_back({normal.normalized(), normal.normalized().dot(center)});
  }
}

/// Limits each coordinate by each half-space, given the ranges of the others; repeated until nothing changes.
/// Never removes a point of the intersection.
void tighten(const std::vector<HalfSpace>& cones, Bounds& bounds) {
  constexpr int kMostPasses = 200;
  for (int pass = 0; pass < kMostPasses && !bounds.empty(); ++pass) {
    const Bounds before = bounds;
    for (const HalfSpace& side : cones) {
      Eigen::Vector3d least;
      for (int a = 0; a < 3; ++a)
        least[a] = std::min(side.normal[a] * bounds.low[a], side.normal[a] * bounds.high[a]);
      for (int a = 0; a < 3; ++a) {
        if (std::abs(side.normal[a]) < 1e-9) continue;
        const double bound = (side.most - (least.sum() - least[a])) / side.normal[a];
        if (side.normal[a] > 0)
          bounds.high[a] = std::min(bounds.high[a], bound);
        else
          bounds.low[a] = std::max(bounds.low[a], bound);
      }
    }
    const double moved = std::max((bounds.low - before.low).cwiseAbs().maxCoeff(),
                                  (bounds.high - before.high).cwiseAbs().maxCoeff());
    if (moved < 1e-3 * (bounds.high - bounds.low).maxCoeff()) return;
  }
}

/// The view without which the cones of the others meet; nothing where that isn't one view.
std::optional<std::string> odd_view(const Scene& scene, const std::vector<FlameMask>& masks,
                                    const Bounds& region) {
  std::optional<std::string> odd;
  for (std::size_t left_out = 0; left_out < scene.views.size(); ++left_out) {
    std::vector<HalfSpace> cones;
    for (std::size_t v = 0; v < scene.views.size(); ++v)
      if (v != left_out && !masks[v].box.empty()) add_cone(scene.views[v].camera, masks[v].box, cones);
    Bounds bounds = region;
    tighten(cones, bounds);
    if (masks[left_out].box.empty() || bounds.empty()) continue;
    if (odd) return std::nullopt;
    odd = scene.views[left_out].name;
  }
  return odd;
}

/// The bounds of the remaining voxels within the cones, to a voxel.
Bounds bounds_of(const Hull& hull, const std::vector<HalfSpace>& cones) {
  const Grid& g = hull.grid;
  const auto edge = static_cast<double>(g.edge);
  const Eigen::Vector3d origin = Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>();
  Bounds bounds{Eigen::Vector3d::Constant(INFINITY), Eigen::Vector3d::Constant(-INFINITY)};
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i) {
        if (hull.inside[voxel++] == 0) continue;
        const Eigen::Vector3d low = origin + edge * Eigen::Vector3d(i, j, k);
        const Eigen::Vector3d middle = low + Eigen::Vector3d::Constant(0.5 * edge);
        if (std::any_of(cones.begin(), cones.end(), [&](const HalfSpace& side) {
              return side.normal.dot(middle) > side.most + 0.87 * edge;  // half of a voxel's diagonal
            }))
          continue;
        bounds.low = bounds.low.cwiseMin(low);
        bounds.high = bounds.high.cwiseMax(low + Eigen::Vector3d::Constant(edge));
      }
  return bounds;
}

Box box_of(const Bounds& bounds) { return {0.5 * (bounds.low + bounds.high), bounds.high - bounds.low}; }

}  // namespace

Result<Box> find_box(const Scene& scene, const std::vector<FlameMask>& masks, const ComputeOptions& compute) {
  if (scene.views.size() < 2)
    return no_box("box", "one view alone can't tell where the flame is", "Add a second view from elsewhere");
  std::vector<HalfSpace> cones;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto seeing =
      std::count_if(masks.begin(), masks.end(), [](const FlameMask& mask) { return !mask.box.empty(); });
  Scene all;  // of the views that see flame
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    const bool sees = !masks[v].box.empty();
    if (!sees && seeing < 2)
      return no_box(view.name, "no pixel shows flame, so the box can't be found from the pictures",
                    "Take another frame, or leave the view out");
    all.views.push_back({view.name, view.camera, {}, sees ? ViewRole::input : ViewRole::left_out});
    if (!sees) continue;
    add_cone(view.camera, masks[v].box, cones);
    middle += view.camera.center() / static_cast<double>(seeing);
  }
  double spread = 0;
  for (const View& view : all.views)
    if (view.role == ViewRole::input) spread = std::max(spread, (view.camera.center() - middle).norm());
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(kFar * std::max(spread, 1e-3));
  Bounds bounds{middle - far, middle + far};
  tighten(cones, bounds);
  const auto apart = [&] {
    const auto odd = odd_view(scene, masks, {middle - far, middle + far});
    return no_box("box",
                  "the views' flames don't meet anywhere in space" +
                      (odd ? ", but without " + *odd + " they do" : std::string()),
                  "Check that the cameras' poses are right and that all pictures show the same flame");
  };
  if (bounds.empty()) return apart();
  double edge = 0;
  for (int round = 0; round < kRounds; ++round) {
    const double before = (bounds.high - bounds.low).maxCoeff();
    const Grid grid = grid_over(box_of(bounds), kCoarseVoxels);
    const auto hull = carve(all, masks, grid, compute);
    if (!hull) return hull.error().where == "scene" ? hull.error() : apart();
    Bounds left = bounds_of(*hull, cones);
    if (left.empty()) return apart();
    bounds = {left.low.cwiseMax(bounds.low), left.high.cwiseMin(bounds.high)};
    edge = static_cast<double>(grid.edge);
    if ((bounds.high - bounds.low).maxCoeff() > kSettled * before) break;
  }
  if ((bounds.low - (middle - far)).minCoeff() < 2 * edge ||
      ((middle + far) - bounds.high).minCoeff() < 2 * edge)
    return no_box("box", "the views look along each other, and what they see has no end in depth",
                  "Add a view from the side");
  Box box = box_of(bounds);
  for (int a = 0; a < 3; ++a)
    box.size[a] = 1e-3 * std::ceil(1e3 * (box.size[a] * (1 + 2 * kMarginShare) + 2 * edge));
  return box;
}

}  // namespace emberlock::recon
