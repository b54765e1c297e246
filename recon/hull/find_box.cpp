// SPDX-License-Identifier: Apache-2.0
#include "recon/hull/find_box.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
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

std::ptrdiff_t seeing_views(const std::vector<FlameMask>& masks) {
  return std::count_if(masks.begin(), masks.end(), [](const FlameMask& mask) { return !mask.box.empty(); });
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

/// The box of the views whose mask shows flame; nothing where their flames don't meet. Errors: no end in
/// depth, a device that fails.
Result<std::optional<Box>> box_of_flames(const Scene& scene, const std::vector<FlameMask>& masks,
                                         const ComputeOptions& compute) {
  std::vector<HalfSpace> cones;
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  const auto seeing = static_cast<double>(seeing_views(masks));
  Scene all;  // of the views that see flame
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const View& view = scene.views[v];
    const bool sees = !masks[v].box.empty();
    all.views.push_back({view.name, view.camera, {}, sees ? ViewRole::input : ViewRole::left_out});
    if (!sees) continue;
    add_cone(view.camera, masks[v].box, cones);
    middle += view.camera.center() / seeing;
  }
  double spread = 0;
  for (const View& view : all.views)
    if (view.role == ViewRole::input) spread = std::max(spread, (view.camera.center() - middle).norm());
  const Eigen::Vector3d far = Eigen::Vector3d::Constant(kFar * std::max(spread, 1e-3));
  Bounds bounds{middle - far, middle + far};
  tighten(cones, bounds);
  if (bounds.empty()) return std::optional<Box>();
  double edge = 0;
  for (int round = 0; round < kRounds; ++round) {
    const double before = (bounds.high - bounds.low).maxCoeff();
    const Grid grid = grid_over(box_of(bounds), kCoarseVoxels);
    const auto hull = carve(all, masks, grid, compute);
    if (!hull && hull.error().where == "scene") return hull.error();
    const Bounds left = hull ? bounds_of(*hull, cones) : Bounds{};
    if (left.empty()) return std::optional<Box>();
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
  return std::optional(box);
}

/// The only view without which the flames of the others meet, and their box.
struct OddView {
  const View* view;
  Box box;
};
std::optional<OddView> find_odd_view(const Scene& scene, const std::vector<FlameMask>& masks,
                                     const ComputeOptions& compute) {
  if (seeing_views(masks) < 3) return std::nullopt;
  std::vector<FlameMask> others = masks;
  std::optional<OddView> odd;
  for (std::size_t v = 0; v < masks.size(); ++v) {
    if (masks[v].box.empty()) continue;
    others[v].box = {};
    const auto box = box_of_flames(scene, others, compute);
    others[v].box = masks[v].box;
    if (!box || !*box) continue;
    if (odd) return std::nullopt;
    odd = OddView{&scene.views[v], **box};
  }
  return odd;
}

/// Whether a ray meets the box in front of its origin.
bool meets(const Ray& ray, const Box& box) {
  double enter = 0;
  double leave = std::numeric_limits<double>::infinity();
  for (int a = 0; a < 3; ++a) {
    const double offset = box.center[a] - ray.origin[a];
    const double half = box.size[a] / 2;
    if (ray.direction[a] == 0) {
      if (std::abs(offset) > half) return false;
      continue;
    }
    const double one = (offset - half) / ray.direction[a];
    const double other = (offset + half) / ray.direction[a];
    enter = std::max(enter, std::min(one, other));
    leave = std::min(leave, std::max(one, other));
  }
  return enter <= leave;
}

}  // namespace

bool sees_box(const CameraModel& camera, const Box& box) {
  constexpr int kRays = 32;  // along each side
  const ImageSize size = camera.intrinsics.size;
  if ((camera.camera_from_world * box.center).z() > 0) {
    const Eigen::Vector2d pixel = camera.project(box.center);
    if (pixel.x() >= 0 && pixel.y() >= 0 && pixel.x() <= size.width && pixel.y() <= size.height) return true;
  }
  for (int y = 0; y <= kRays; ++y)
    for (int x = 0; x <= kRays; ++x)
      if (meets(camera.ray({1.0 * size.width * x / kRays, 1.0 * size.height * y / kRays}), box)) return true;
  return false;
}

Result<Box> find_box(const Scene& scene, const std::vector<FlameMask>& masks, const ComputeOptions& compute) {
  if (scene.views.size() < 2)
    return no_box("box", "one view alone can't tell where the flame is", "Add a second view from elsewhere");
  for (std::size_t v = 0; v < scene.views.size(); ++v)
    if (masks[v].box.empty() && seeing_views(masks) < 2)
      return no_box(scene.views[v].name, "no pixel shows flame, so the box can't be found from the pictures",
                    "Take another frame, or leave the view out");
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<Box> box, box_of_flames(scene, masks, compute));
  if (box) return *box;
  const std::optional<OddView> odd = find_odd_view(scene, masks, compute);
  if (odd && !sees_box(odd->view->camera, odd->box)) return odd->box;
  return no_box("box",
                "the views' flames don't meet anywhere in space" +
                    (odd ? ", but without " + odd->view->name + " they do" : std::string()),
                "Check that the cameras' poses are right and that all pictures show the same flame");
}

}  // namespace emberlock::recon
