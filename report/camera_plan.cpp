// SPDX-License-Identifier: Apache-2.0
#include "report/camera_plan.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "report/volume_axes.h"

namespace emberlock::report {
namespace {

constexpr double kPlanWidth = 420;   // of a picture, in pixels
constexpr double kPlanMargin = 68;   // around the cameras, for numbers and ticks
constexpr double kSightLength = 26;  // of the line that shows where a camera looks
constexpr double kSameSpot = 11;     // numbers of cameras nearer than this are written as one
constexpr double kDegreesOfOne = 180 / M_PI;
constexpr const char* kAxisNames[] = {"x", "y", "z"};

/// "185 mm" or "1.24 m".
std::string length_words(double metres) {
  return metres < 1 ? fmt::format("{:.0f} mm", 1e3 * metres) : fmt::format("{:.2f} m", metres);
}

ShownAxes axes_of(const std::vector<PlanCamera>& cameras) {
  std::vector<Eigen::Vector3d> positions;
  std::vector<Eigen::Vector3d> ups;
  for (const PlanCamera& camera : cameras) {
    positions.push_back(camera.position);
    ups.push_back(camera.up);
  }
  return shown_axes(positions, ups);
}

/// How the world is drawn: which axes run to the right and up the page, and their scale.
struct PlanView {
  int right = 0;
  int up = 1;
  double sense = 1;  ///< of the axis up the page
  Eigen::Vector2d low =
      Eigen::Vector2d::Zero();  ///< metres: the corner at the bottom left, up counted upwards
  double scale = 1;             ///< pixels per metre
  double height = 0;

  [[nodiscard]] Eigen::Vector2d flat(const Eigen::Vector3d& world) const {
    return {world[right], sense * world[up]};
  }
  [[nodiscard]] Eigen::Vector2d pixel(const Eigen::Vector2d& at) const {
    return {kPlanMargin + scale * (at.x() - low.x()), height - kPlanMargin - scale * (at.y() - low.y())};
  }
  [[nodiscard]] Eigen::Vector2d operator()(const Eigen::Vector3d& world) const { return pixel(flat(world)); }
};

std::vector<Eigen::Vector3d> box_corners(const recon::Box& box) {
  std::vector<Eigen::Vector3d> corners;
  for (int i = 0; i < 8; ++i) {
    const Eigen::Vector3d sign((i & 1) != 0 ? 0.5 : -0.5, (i & 2) != 0 ? 0.5 : -0.5,
                               (i & 4) != 0 ? 0.5 : -0.5);
    corners.emplace_back(box.center + box.size.cwiseProduct(sign));
  }
  return corners;
}

/// Everything that the pictures must hold.
std::vector<Eigen::Vector3d> extent(const std::vector<PlanCamera>& cameras,
                                    const std::optional<recon::Box>& box) {
  std::vector<Eigen::Vector3d> points = box ? box_corners(*box) : std::vector<Eigen::Vector3d>();
  for (const PlanCamera& camera : cameras) points.push_back(camera.position);
  return points;
}

/// The plan and the side view: one scale, so that lengths compare.
std::pair<PlanView, PlanView> plan_views(const std::vector<PlanCamera>& cameras,
                                         const std::optional<recon::Box>& box) {
  const ShownAxes axes = axes_of(cameras);
  PlanView plan{(axes.up + 1) % 3, (axes.up + 2) % 3, axes.sign};
  PlanView side{(axes.up + 1) % 3, axes.up, axes.sign};
  Eigen::Vector3d size = Eigen::Vector3d::Zero();
  for (PlanView* view : {&plan, &side}) {
    view->low = Eigen::Vector2d::Constant(INFINITY);
    Eigen::Vector2d high = -view->low;
    for (const Eigen::Vector3d& point : extent(cameras, box)) {
      view->low = view->low.cwiseMin(view->flat(point));
      high = high.cwiseMax(view->flat(point));
    }
    size[view->right] = high.x() - view->low.x();
    size[view->up] = high.y() - view->low.y();
  }
  const double widest = std::max(size.maxCoeff(), 1e-6);
  const double slack = 0.5 * (widest - size[plan.right]);  // narrow rigs stand in the middle
  for (PlanView* view : {&plan, &side}) {
    view->scale = (kPlanWidth - 2 * kPlanMargin) / widest;
    view->height = 2 * kPlanMargin + view->scale * size[view->up];
    view->low.x() -= slack;
  }
  return {plan, side};
}

/// 1, 2 or 5 times a power of ten, so that a length has about five of them.
double tick_step(double length) {
  const double power = std::pow(10, std::floor(std::log10(length / 5)));
  const double fraction = length / 5 / power;
  return power * (fraction < 1.5 ? 1 : fraction < 3.5 ? 2 : fraction < 7.5 ? 5 : 10);
}

std::string grid_svg(const PlanView& view) {
  const double left = 0.58 * kPlanMargin;  // room for "-0.04"
  const double right = kPlanWidth - left;
  const double top = left;
  const double bottom = view.height - left;
  const double step = tick_step((right - left) / view.scale);
  std::string svg;
  const double x0 = view.low.x() - (kPlanMargin - left) / view.scale;
  const double y0 = view.low.y() - (kPlanMargin - left) / view.scale;
  for (double i = std::ceil(x0 / step); i * step < x0 + (right - left) / view.scale; ++i) {
    const double x = view.pixel({i * step, 0}).x();
    svg += fmt::format(R"(<line class="grid" x1="{0:.1f}" x2="{0:.1f}" y1="{1:.1f}" y2="{2:.1f}"/>)", x, top,
                       bottom);
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{:g}</text>)", x, bottom + 13,
                       i * step + 0.0);
  }
  for (double i = std::ceil(y0 / step); i * step < y0 + (bottom - top) / view.scale; ++i) {
    const double y = view.pixel({0, i * step}).y();
    svg += fmt::format(R"(<line class="grid" x1="{1:.1f}" x2="{2:.1f}" y1="{0:.1f}" y2="{0:.1f}"/>)", y, left,
                       right);
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="end">{:g}</text>)", left - 3, y + 4,
                       view.sense * i * step + 0.0);
  }
  svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="end">{}, m</text>)", kPlanWidth - 2,
                     bottom + 24, kAxisNames[view.right]);
  return svg + fmt::format(R"(<text x="2" y="12">{}, m</text>)", kAxisNames[view.up]);
}

std::string box_svg(const PlanView& view, const recon::Box& box) {
  const Eigen::Vector2d a = view(box.center - 0.5 * box.size);
  const Eigen::Vector2d b = view(box.center + 0.5 * box.size);
  return fmt::format(
      R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#009e73" fill-opacity=".2" stroke="#009e73"/>)",
      std::min(a.x(), b.x()), std::min(a.y(), b.y()), std::abs(a.x() - b.x()), std::abs(a.y() - b.y()));
}

/// Text that stands out from lines under it.
std::string haloed(const Eigen::Vector2d& at, const std::string& text, int weight) {
  return fmt::format(
      R"svg(<text x="{:.1f}" y="{:.1f}" text-anchor="middle" style="font-weight:{};stroke:var(--paper);stroke-width:4;paint-order:stroke">{}</text>)svg",
      at.x(), at.y() + 4, weight, text);
}

/// The baselines, with lengths where there is room and `other` has none yet. The tables have all.
std::string baselines_svg(const PlanView& view, const PlanView* other,
                          const std::vector<PlanCamera>& cameras) {
  constexpr double kRoom = 56;  // pixels along a line
  std::string lines;
  std::string lengths;
  for (const Baseline& pair : baselines(cameras)) {
    const Eigen::Vector3d& from = cameras[pair.a].position;
    const Eigen::Vector3d& to = cameras[pair.b].position;
    const Eigen::Vector2d a = view(from);
    const Eigen::Vector2d b = view(to);
    lines += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", a.x(), a.y(), b.x(), b.y());
    const bool written = other != nullptr && ((*other)(from) - (*other)(to)).norm() >= kRoom;
    if (!written && (a - b).norm() >= kRoom) lengths += haloed(0.5 * (a + b), length_words(pair.length), 400);
  }
  return fmt::format(R"(<path d="{}" fill="none" stroke="#7f7f7f" stroke-dasharray="5 4"/>)", lines) +
         lengths;
}

std::string cameras_svg(const PlanView& view, const std::vector<PlanCamera>& cameras) {
  std::string svg;
  struct Number {
    Eigen::Vector2d camera;
    Eigen::Vector2d at;
    std::string text;
  };
  std::vector<Number> numbers;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const PlanCamera& camera = cameras[i];
    const Eigen::Vector2d at = view(camera.position);
    const Eigen::Vector2d sight = view(camera.position + camera.direction.normalized()) - at;
    const Eigen::Vector2d to = at + kSightLength / view.scale * sight;
    const char* colour = camera.role == recon::ViewRole::held_out ? "#d55e00" : "#0072b2";
    svg += fmt::format(
        R"(<g stroke="{4}" fill="{4}"><title>{5}</title><path d="M{0:.1f} {1:.1f}L{2:.1f} {3:.1f}" stroke-width="2.5"/>)"
        R"(<circle cx="{0:.1f}" cy="{1:.1f}" r="5"/></g>)",
        at.x(), at.y(), to.x(), to.y(), colour, html_escape(camera.name));
    const auto there = std::find_if(numbers.begin(), numbers.end(),
                                    [&](const Number& n) { return (n.camera - at).norm() < kSameSpot; });
    if (there != numbers.end()) {
      there->text += fmt::format(", {}", i);
      continue;
    }
    // Behind the camera, where nothing else is.
    const Eigen::Vector2d behind = sight.norm() > 0.1 * view.scale
                                       ? Eigen::Vector2d(at - 17 * sight.normalized())
                                       : Eigen::Vector2d(at.x(), at.y() - 17);
    numbers.push_back({at, behind, fmt::format("{}", i)});
  }
  for (const Number& number : numbers) svg += haloed(number.at, number.text, 700);
  return svg;
}

std::string plan_svg(const PlanView& view, const PlanView* other, const std::vector<PlanCamera>& cameras,
                     const std::optional<recon::Box>& box, const char* label) {
  std::string svg = fmt::format(
      R"(<svg viewBox="0 0 {0:.0f} {1:.0f}" width="{0:.0f}" style="height:auto" role="img" aria-label="{2}">)",
      kPlanWidth, view.height, label);
  svg += grid_svg(view);
  if (box) svg += box_svg(view, *box);
  return svg + baselines_svg(view, other, cameras) + cameras_svg(view, cameras) + "</svg>";
}

}  // namespace

PlanCamera plan_camera(std::string name, const recon::CameraModel& camera, recon::ViewRole role) {
  const Eigen::Matrix3d& rotation = camera.camera_from_world.rotation;
  return {std::move(name), camera.center(), rotation.row(2), -rotation.row(1), role};
}

std::vector<Baseline> baselines(const std::vector<PlanCamera>& cameras) {
  const auto distance = [&](std::size_t a, std::size_t b) {
    return (cameras[a].position - cameras[b].position).norm();
  };
  std::vector<Baseline> result;
  for (std::size_t a = 0; a < cameras.size(); ++a) {
    for (std::size_t b = a + 1; b < cameras.size(); ++b) {
      const double length = distance(a, b);
      const double nearer = 0.999 * length;  // a ring's equal distances differ by rounding
      bool between = false;
      for (std::size_t c = 0; c < cameras.size() && !between; ++c)
        between = c != a && c != b && distance(a, c) < nearer && distance(b, c) < nearer;
      if (between) continue;
      const double cosine = cameras[a].direction.normalized().dot(cameras[b].direction.normalized());
      result.push_back({a, b, length, std::acos(std::clamp(cosine, -1.0, 1.0))});
    }
  }
  return result;
}

std::vector<HtmlPage::Picture> camera_plan_pictures(const std::vector<PlanCamera>& cameras,
                                                    const std::optional<recon::Box>& box) {
  if (cameras.empty()) return {};
  const auto [plan, side] = plan_views(cameras, box);
  return {{plan_svg(plan, nullptr, cameras, box, "Where the cameras stand, from above"), "from above"},
          {plan_svg(side, &plan, cameras, box, "Where the cameras stand, from the side"), "from the side"}};
}

void add_camera_plan(HtmlPage& page, const std::vector<PlanCamera>& cameras,
                     const std::optional<recon::Box>& box) {
  if (cameras.empty()) return;
  const bool held_out = std::any_of(cameras.begin(), cameras.end(), [](const PlanCamera& camera) {
    return camera.role == recon::ViewRole::held_out;
  });
  page.heading("Where the cameras stand");
  page.paragraph(
      fmt::format("Cameras{} by number, from 0, and the directions in which they look; dashed: the "
                  "distances of neighbours{}. Axes are the world's, in metres.",
                  held_out ? " (orange: held out)" : "", box ? "; green: the flame's volume" : ""));
  page.gallery(camera_plan_pictures(cameras, box));
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const PlanCamera& camera : cameras) middle += camera.position / static_cast<double>(cameras.size());
  if (box) middle = box->center;
  std::vector<std::vector<std::string>> places;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    const Eigen::Vector3d& at = cameras[i].position;
    places.push_back({fmt::format("{}: {}", i, cameras[i].name), fmt::format("{:.3f}", at.x()),
                      fmt::format("{:.3f}", at.y()), fmt::format("{:.3f}", at.z()),
                      length_words((at - middle).norm())});
  }
  page.table({"camera", "x, m", "y, m", "z, m", box ? "to the volume" : "to the middle"}, places);
  std::vector<std::vector<std::string>> pairs;
  for (const Baseline& pair : baselines(cameras)) {
    pairs.push_back({fmt::format("{} - {}", pair.a, pair.b), length_words(pair.length),
                     fmt::format("{:.1f}°", kDegreesOfOne * pair.angle)});
  }
  if (!pairs.empty()) page.table({"neighbours", "baseline", "angle between their views"}, pairs);
}

}  // namespace emberlock::report
