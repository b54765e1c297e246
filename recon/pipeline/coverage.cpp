// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/coverage.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

#include "recon/pipeline/grid_choice.h"

namespace emberlock::recon {
namespace {

constexpr std::size_t kFewViews = 4;
constexpr double kSimilarDegrees = 20;

/// The largest angle between any two lines of sight, in degrees, 0..90: opposite views lie on one line.
double spread_degrees(const std::vector<Eigen::Vector3d>& directions) {
  double smallest_cosine = 1;
  for (const auto& a : directions) {
    for (const auto& b : directions) smallest_cosine = std::min(smallest_cosine, std::abs(a.dot(b)));
  }
  return std::acos(smallest_cosine) * 180 / std::numbers::pi;
}

}  // namespace

std::vector<std::string> coverage_warnings(const Scene& scene) {
  std::vector<std::string> warnings;
  std::vector<Eigen::Vector3d> directions;
  bool held_out = false;
  for (const View& view : scene.views) {
    if (view.role == ViewRole::held_out) {
      held_out = true;
    } else if (view.role == ViewRole::input) {
      directions.emplace_back((view.camera.center() - scene.box.center).normalized());
    }
  }
  if (const double spread = spread_degrees(directions); spread < kSimilarDegrees) {
    warnings.push_back(fmt::format(
        "the {} input view{} lie within {:.0f} degrees of one line: depth along it is a guess, whatever the "
        "input error says",
        directions.size(), directions.size() == 1 ? "" : "s", std::ceil(spread)));
  } else if (directions.size() <= kFewViews) {
    warnings.emplace_back("only " + std::to_string(directions.size()) +
                          " input views: many volumes give the same pictures, add views to tell them apart");
  }
  if (!held_out) {
    warnings.emplace_back(
        "no view is held out: the input error proves nothing about the volume (--hold-out i keeps a view for "
        "judging)");
  }
  return warnings;
}

std::string too_fine_warning(const Scene& scene, int voxels) {
  const int most = voxels_by_the_paper(scene);
  if (voxels <= most) return {};
  return fmt::format(
      "{} voxels along the longest edge are finer than the pictures resolve: {:.2g} pixels a voxel, where {} "
      "voxels have 1.5. {:.3g} times as many unknowns take so much more memory and time, and may show other "
      "views worse. Give --voxels {} or fewer",
      voxels, 1.5 * most / voxels, most, std::pow(static_cast<double>(voxels) / most, 3), most);
}

}  // namespace emberlock::recon
