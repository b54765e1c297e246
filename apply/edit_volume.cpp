// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_volume.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emberlock::apply {
namespace {

/// Metres from a place to a region; 0 inside.
double distance_to(const Region& region, const Eigen::Vector3d& place) {
  const Eigen::Vector3d half = 0.5 * region.size;
  const Eigen::Vector3d off = (place - region.center).cwiseAbs();
  if (region.shape == Region::Shape::box) return (off - half).cwiseMax(0).norm();
  // Along the line to its centre, which is exact for a sphere.
  const double radii = off.cwiseQuotient(half).norm();
  return radii > 1 ? off.norm() * (1 - 1 / radii) : 0;
}

Eigen::Vector3d place_of(const recon::Grid& grid, int i, int j, int k) {
  const auto along = [&](int axis, int index) {
    return static_cast<double>(grid.origin[axis]) + static_cast<double>(grid.edge) * index;
  };
  return {along(0, i), along(1, j), along(2, k)};
}

/// Those that a region reaches, its edge included.
template <class Act>
void each_key_point(const recon::Grid& grid, const Region& region, const Act& act) {
  const int count[3] = {grid.nx, grid.ny, grid.nz};
  int first[3];
  int last[3];
  for (int a = 0; a < 3; ++a) {
    const double half = 0.5 * region.size[a] + region.edge.value();
    const auto index = [&](double at) {
      const double edges = (at - static_cast<double>(grid.origin[a])) / static_cast<double>(grid.edge);
      return static_cast<int>(std::clamp(edges, -1.0, static_cast<double>(count[a])));
    };
    first[a] = std::max(0, index(region.center[a] - half));
    last[a] = std::min(count[a] - 1, index(region.center[a] + half) + 1);
  }
  for (int k = first[2]; k <= last[2]; ++k)
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) act(grid.index(i, j, k), place_of(grid, i, j, k));
}

recon::CameraResponse relative(recon::CameraResponse response) {
  response.absolute = false;
  return response;
}

/// Linear between the curve's points, and as at its ends beyond.
struct Tint {
  std::array<double, 3> share = {};  // of the channels' sum
  double gain = 1;
};
Tint tint_at(const std::vector<ColourStop>& curve, double kelvin) {
  const auto above = std::find_if(curve.begin(), curve.end(),
                                  [&](const ColourStop& s) { return s.kelvin.value() >= kelvin; });
  const ColourStop& high = above == curve.end() ? curve.back() : *above;
  const ColourStop& low = above == curve.begin() ? high : *(above - 1);
  const double span = (high.kelvin - low.kelvin).value();
  const double part = span > 0 ? std::clamp((kelvin - low.kelvin.value()) / span, 0.0, 1.0) : 0.0;
  Tint tint;
  const auto sum_of = [](const ColourStop& s) { return s.colour[0] + s.colour[1] + s.colour[2]; };
  for (std::size_t c = 0; c < 3; ++c)
    tint.share[c] = (1 - part) * low.colour[c] / sum_of(low) + part * high.colour[c] / sum_of(high);
  tint.gain = (1 - part) * low.gain + part * high.gain;
  return tint;
}

void recolour(recon::Volume& volume, const std::vector<float>& kelvin, const ColourEdit& edit) {
  for (std::size_t p = 0; p < kelvin.size(); ++p) {
    float* c = &volume.emission[3 * p];
    const double sum = static_cast<double>(c[0]) + static_cast<double>(c[1]) + static_cast<double>(c[2]);
    if (!(sum > 0)) continue;
    const Tint tint = tint_at(edit.curve, static_cast<double>(kelvin[p]));
    for (std::size_t n = 0; n < 3; ++n) c[n] = static_cast<float>(tint.gain * sum * tint.share[n]);
  }
}

void brighten(recon::Volume& volume, const BrightnessEdit& edit) {
  each_key_point(volume.grid, edit.region, [&](std::size_t p, const Eigen::Vector3d& place) {
    const double share = share_of(edit.region, place);
    if (!(share > 0)) return;
    const auto factor = static_cast<float>(1 + share * (edit.factor - 1));
    for (std::size_t c = 0; c < 3; ++c) volume.emission[3 * p + c] *= factor;
  });
}

/// Takes what is dark out of volume and hull: voxels all of whose corners are.
void take_out(EditedVolume& shown, const std::vector<std::uint8_t>& dark) {
  const recon::Grid& g = shown.volume.grid;
  for (std::size_t p = 0; p < dark.size(); ++p) {
    if (dark[p] == 0) continue;
    std::fill_n(&shown.volume.emission[3 * p], 3, 0.F);
    if (!shown.volume.extinction.empty()) shown.volume.extinction[p] = 0;
    shown.kelvin[p] = 0;
  }
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i, ++voxel) {
        if (shown.hull.inside[voxel] == 0) continue;
        bool lit = false;
        for (int c = 0; c < 8; ++c)
          lit = lit || dark[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] == 0;
        if (lit) continue;
        shown.hull.inside[voxel] = 0;
        --shown.hull.count;
      }
}

}  // namespace

double share_of(const Region& region, const Eigen::Vector3d& place) {
  const double distance = distance_to(region, place);
  if (!(distance > 0)) return 1;
  if (!(distance < region.edge.value())) return 0;
  const double t = 1 - distance / region.edge.value();
  return t * t * (3 - 2 * t);
}

std::vector<std::uint8_t> dark_points(const recon::Grid& grid,
                                      const std::vector<const Operation*>& operations) {
  std::vector<std::uint8_t> dark(grid.size());
  for (const Operation* operation : operations) {
    const auto* edit = std::get_if<RegionEdit>(operation);
    if (edit == nullptr) continue;
    const auto each_inside = [&](const auto& act) {
      each_key_point(grid, edit->region, [&](std::size_t p, const Eigen::Vector3d& place) {
        if (!(distance_to(edit->region, place) > 0)) act(p);
      });
    };
    if (edit->part == Part::cut) {
      each_inside([&](std::size_t p) { dark[p] = 1; });
      continue;
    }
    std::vector<std::uint8_t> outside_too(grid.size(), 1);
    each_inside([&](std::size_t p) { outside_too[p] = dark[p]; });
    dark.swap(outside_too);
  }
  return dark;
}

FlameColours::FlameColours(const recon::CameraResponse& response, float hottest)
    : look_up_(relative(response), recon::Emitter::paper),
      table_(relative(response), recon::Emitter::paper, Kelvin(recon::kPaperColdest),
             Kelvin(recon::kPaperHottest)),
      hottest_(hottest) {}

std::vector<float> FlameColours::kelvin(const recon::Volume& volume) const {
  return look_up_.read_green(volume.emission, hottest_);
}

void FlameColours::colour(recon::Volume& volume, const std::vector<float>& kelvin) const {
  for (std::size_t p = 0; p < kelvin.size(); ++p) {
    float* c = &volume.emission[3 * p];
    const auto at = static_cast<double>(kelvin[p]);
    const std::array<double, 3> levels = table_.at(at > 0 ? Kelvin(at) : table_.coldest()).value;
    if (!(levels[1] > 0)) continue;  // the camera sees no green
    const double scale = static_cast<double>(c[1]) / levels[1];
    c[0] = static_cast<float>(scale * levels[0]);
    c[2] = static_cast<float>(scale * levels[2]);
  }
}

EditedVolume edited_volume(recon::Volume volume, const recon::Hull& hull, const FlameColours& flame,
                           Colours colours, const std::vector<const Operation*>& operations) {
  EditedVolume shown{std::move(volume), hull, {}};
  shown.kelvin = flame.kelvin(shown.volume);
  if (colours == Colours::flame) flame.colour(shown.volume, shown.kelvin);
  bool any_dark = false;
  for (const Operation* operation : operations) {
    if (const auto* edit = std::get_if<ColourEdit>(operation)) recolour(shown.volume, shown.kelvin, *edit);
    if (const auto* edit = std::get_if<BrightnessEdit>(operation)) brighten(shown.volume, *edit);
    any_dark = any_dark || std::holds_alternative<RegionEdit>(*operation);
  }
  if (any_dark) take_out(shown, dark_points(shown.volume.grid, operations));
  return shown;
}

}  // namespace emberlock::apply
