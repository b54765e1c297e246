// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/next_pictures.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <fmt/format.h>

namespace emberlock::recon {
namespace {

constexpr double kEnoughTilt = 0.5;         // radians between two of a camera's boards
constexpr std::size_t kEnoughInstants = 5;  // shared by a pair
constexpr double kDegrees = 180 / M_PI;

/// The names of the empty cells by thirds of the picture: "top left", "middle", ...
std::vector<std::string> empty_regions(const CornerCoverage& coverage) {
  constexpr std::array kVertical = {"top", "middle", "bottom"};
  constexpr std::array kHorizontal = {"left", "middle", "right"};
  std::vector<std::string> names;
  for (int row = 0; row < CornerCoverage::kRows; ++row) {
    for (int column = 0; column < CornerCoverage::kColumns; ++column) {
      if (coverage.corners[CornerCoverage::cell(column, row)] > 0) continue;
      const auto v = static_cast<std::size_t>(3 * (2 * row + 1) / (2 * CornerCoverage::kRows));
      const auto h = static_cast<std::size_t>(3 * (2 * column + 1) / (2 * CornerCoverage::kColumns));
      const std::string name = v == 1 && h == 1 ? "middle" : std::string(kVertical[v]) + " " + kHorizontal[h];
      if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    }
  }
  return names;
}

std::string joined_words(const std::vector<std::string>& words) {
  std::string text;
  for (std::size_t i = 0; i < words.size(); ++i)
    text += (i == 0 ? "" : i + 1 == words.size() ? " and " : ", ") + words[i];
  return text;
}

/// Of the pairs that connect the cameras best (the spanning tree of the most accurate ones), the least
/// accurate.
const CameraPair* weakest_link(const RigCalibration& calibration) {
  std::vector<const CameraPair*> pairs;
  for (const CameraPair& pair : calibration.pairs) pairs.push_back(&pair);
  std::sort(pairs.begin(), pairs.end(),
            [](const CameraPair* a, const CameraPair* b) { return a->distance_sigma < b->distance_sigma; });
  std::map<std::size_t, std::size_t> group;
  for (const std::size_t c : calibration.bundle_camera) group[c] = c;
  const CameraPair* last = nullptr;
  for (const CameraPair* pair : pairs) {
    const std::size_t from = group.at(pair->b);
    const std::size_t to = group.at(pair->a);
    if (from == to) continue;
    for (auto& [camera, g] : group)
      if (g == from) g = to;
    last = pair;
  }
  return last;
}

}  // namespace

std::size_t CornerCoverage::empty_cells() const {
  return static_cast<std::size_t>(std::count(corners.begin(), corners.end(), std::size_t{0}));
}

std::vector<CornerCoverage> corner_coverage(const RigCalibration& calibration) {
  const Bundle& bundle = calibration.bundle;
  std::vector<CornerCoverage> coverage(bundle.cameras.size());
  for (const BundleView& view : bundle.views) {
    const ImageSize size = bundle.cameras[view.camera].model.intrinsics.size;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.use[i] != CornerUse::used) continue;
      const Eigen::Vector2d& p = view.corners[i].pixel;
      const int column = std::clamp(static_cast<int>(p.x() / size.width * CornerCoverage::kColumns), 0,
                                    CornerCoverage::kColumns - 1);
      const int row = std::clamp(static_cast<int>(p.y() / size.height * CornerCoverage::kRows), 0,
                                 CornerCoverage::kRows - 1);
      ++coverage[view.camera].corners[CornerCoverage::cell(column, row)];
    }
  }
  return coverage;
}

double expected_factor(std::size_t views, std::size_t more) {
  if (views == 0) return 1;
  return std::sqrt(static_cast<double>(views) / static_cast<double>(views + more));
}

std::vector<std::string> next_pictures(const RigCalibration& calibration) {
  std::vector<std::string> advice;
  for (const CalibratedCamera& camera : calibration.cameras)
    if (!camera.placed) advice.push_back(camera.id + ": " + camera.why + ".");
  for (const CalibratedCamera& camera : calibration.cameras) {
    if (!camera.calibrated || camera.fit.radial_terms >= kUsualRadialTerms) continue;
    advice.push_back(
        fmt::format("{}: its corners stay too near to the picture's middle to determine {}, held at 0: the "
                    "distortion further out is unknown. Hold the board in the picture's corners.",
                    camera.id, camera.fit.radial_terms == 1 ? "k2" : "k1 and k2"));
  }
  const auto coverage = corner_coverage(calibration);
  for (std::size_t b = 0; b < coverage.size(); ++b) {
    const CalibratedCamera& camera = calibration.cameras[calibration.bundle_camera[b]];
    if (coverage[b].empty_cells() > 0) {
      advice.push_back(
          fmt::format("{}: {} of the picture's {} cells have no corner: hold the board {} of it. Out there "
                      "the distortion is extrapolated.",
                      camera.id, coverage[b].empty_cells(), coverage[b].corners.size(),
                      joined_words(empty_regions(coverage[b]))));
    }
    if (camera.tilt < kEnoughTilt) {
      advice.push_back(
          fmt::format("{}: its boards differ by {:.0f} degrees at most: tilt the board by 30 degrees to each "
                      "side; the focal length "
                      "({:.1f} +- {:.1f} pixels) and the distance hang together otherwise.",
                      camera.id, camera.tilt * kDegrees, camera.fit.model.intrinsics.fx, camera.sigma[0]));
    }
  }
  if (const CameraPair* pair = weakest_link(calibration)) {
    const std::string& a = calibration.cameras[pair->a].id;
    const std::string& b = calibration.cameras[pair->b].id;
    const std::size_t more = std::max(3 * pair->instants, kEnoughInstants);
    advice.push_back(
        fmt::format("{} and {} are the rig's weakest link: {} instants hold them together, to {:.2f} mm and "
                    "{:.3f} degrees. {} more that "
                    "both see would bring it to about {:.2f} mm.",
                    a, b, pair->instants, pair->distance_sigma * 1e3, pair->turn_sigma * kDegrees, more,
                    pair->distance_sigma * 1e3 * expected_factor(pair->instants, more)));
  }
  return advice;
}

}  // namespace emberlock::recon
