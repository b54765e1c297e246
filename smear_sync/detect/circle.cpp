// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/circle.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Dense>

namespace emberlock::smear::detail {
namespace {

constexpr double kOnCircle = 0.5;  // pixels; the points of an outline scatter by a few tenths

double tolerance(double radius) { return std::max(kOnCircle, 0.04 * radius); }

/// Gauss-Newton on the distances to the circle, with Tukey weights whose support shrinks to the tolerance.
bool refine(const std::vector<Point>& outline, Circle& circle) {
  constexpr int kIterations = 12;
  for (int i = 0; i < kIterations; ++i) {
    const double support = tolerance(circle.radius) * std::max(1.0, 4.0 - 0.5 * i);
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const Point& p : outline) {
      const double dx = p.x - circle.x;
      const double dy = p.y - circle.y;
      const double distance = std::sqrt(dx * dx + dy * dy);
      const double residual = distance - circle.radius;
      if (std::abs(residual) >= support || distance < 1e-9) continue;
      const double u = residual / support;
      const double weight = (1 - u * u) * (1 - u * u);
      const Eigen::Vector3d gradient(-dx / distance, -dy / distance, -1);
      normal += weight * gradient * gradient.transpose();
      right += weight * gradient * residual;
    }
    normal.diagonal().array() += 1e-9;
    const Eigen::Vector3d step = normal.ldlt().solve(right);
    if (!step.allFinite()) return false;
    circle.x -= step.x();
    circle.y -= step.y();
    circle.radius -= step.z();
    if (circle.radius < 0.5) return false;
    if (i > 6 && step.squaredNorm() < 1e-8) break;
  }
  return true;
}

void score(const std::vector<Point>& outline, ImageSize image, Circle& circle) {
  constexpr std::size_t kSectors = 24;
  std::array<bool, kSectors> seen{};
  double squares = 0;
  int on = 0;
  for (const Point& p : outline) {
    const double residual = std::hypot(p.x - circle.x, p.y - circle.y) - circle.radius;
    if (std::abs(residual) > tolerance(circle.radius)) continue;
    const double turn = std::atan2(p.y - circle.y, p.x - circle.x) / (2 * std::numbers::pi) + 0.5;
    seen[std::min(kSectors - 1, static_cast<std::size_t>(turn * kSectors))] = true;
    squares += residual * residual;
    ++on;
  }
  int inside = 0;
  int on_outline = 0;
  for (std::size_t i = 0; i < kSectors; ++i) {
    const double turn = ((static_cast<double>(i) + 0.5) / kSectors - 0.5) * 2 * std::numbers::pi;
    const double x = circle.x + circle.radius * std::cos(turn);
    const double y = circle.y + circle.radius * std::sin(turn);
    if (x < 0 || x > image.width - 1 || y < 0 || y > image.height - 1) continue;
    ++inside;
    if (seen[i]) ++on_outline;
  }
  constexpr int kEnough = 5;  // an arc of fewer sectors fits any circle
  circle.agreement = inside < kEnough ? 0 : static_cast<double>(on_outline) / inside;
  constexpr double kSystematic = 0.02;  // pixels: error by sampling, even without noise
  circle.sigma = std::hypot(kSystematic, on > 3 ? std::sqrt(squares / (on - 3) * 2 / on) : circle.radius);
}

}  // namespace

std::optional<Circle> fit_circle(const std::vector<Point>& outline, ImageSize image) {
  if (outline.size() < 8) return std::nullopt;
  const auto [left, right] = std::minmax_element(outline.begin(), outline.end(),
                                                 [](const Point& a, const Point& b) { return a.x < b.x; });
  const auto [top, bottom] = std::minmax_element(outline.begin(), outline.end(),
                                                 [](const Point& a, const Point& b) { return a.y < b.y; });
  const double radius = std::max(1.0, (right->x - left->x) / 2);
  const double middle = (right->x + left->x) / 2;
  std::optional<Circle> best;
  const auto start_at = [&](double y) {
    Circle circle{.x = middle, .y = y, .radius = radius};
    if (!refine(outline, circle)) return;
    score(outline, image, circle);
    if (!best || circle.agreement > best->agreement) best = circle;
  };
  start_at((top->y + bottom->y) / 2);
  constexpr double kWhole = 0.95;  // of a circumference: no other start can find more
  if (best && best->agreement >= kWhole) return best;
  const double step = std::max(0.5, radius / 3);
  for (double y = top->y; y <= bottom->y + step / 2; y += step) start_at(y);
  return best;
}

}  // namespace emberlock::smear::detail
