// SPDX-License-Identifier: Apache-2.0
#include "paper/run_errors.h"

#include <algorithm>
#include <cmath>

#include "recon/adjust/picture_error.h"
#include "recon/render/at_key_points.h"
#include "recon/render/render.h"
#include "recon/views/flame_mask.h"

namespace emberlock::paper {
namespace {

constexpr float kShareThatCounts = 0.05F;

/// The mean square over views.
class MeanSquare {
 public:
  void add(const std::array<double, 3>& rmse) {
    for (std::size_t c = 0; c < 3; ++c) sum_[c] += rmse[c] * rmse[c];
    ++count_;
  }
  [[nodiscard]] std::array<double, 3> root() const {
    std::array<double, 3> root{};
    for (std::size_t c = 0; c < 3 && count_ > 0; ++c) root[c] = std::sqrt(sum_[c] / count_);
    return root;
  }

 private:
  std::array<double, 3> sum_ = {};
  int count_ = 0;
};

std::array<double, 3> volume_errors(const MethodResult& result, const KnownGas& gas) {
  const recon::Volume& found = result.volume;
  const std::vector<float> truth = recon::at_key_points(found.grid, gas.light.grid, gas.light.emission, 3);
  std::array<double, 3> off{};
  std::array<double, 3> all{};
  for (std::size_t p = 0; p < found.grid.size(); ++p) {
    for (std::size_t c = 0; c < 3; ++c) {
      off[c] += std::pow(static_cast<double>(found.emission[3 * p + c] - truth[3 * p + c]), 2);
      all[c] += std::pow(static_cast<double>(truth[3 * p + c]), 2);
    }
  }
  for (std::size_t c = 0; c < 3; ++c) off[c] = all[c] > 0 ? std::sqrt(off[c] / all[c]) : 0;
  return off;
}

/// The truth's light and temperature at key points, and what counts as lit.
struct LitTruth {
  std::vector<float> light, kelvin;
  float least = 0;
};

LitTruth lit_truth(const recon::Grid& grid, const KnownGas& gas) {
  LitTruth truth;
  const std::vector<float> rgb = recon::at_key_points(grid, gas.light.grid, gas.light.emission, 3);
  truth.light.resize(grid.size());
  for (std::size_t p = 0; p < grid.size(); ++p)
    truth.light[p] = std::max({rgb[3 * p], rgb[3 * p + 1], rgb[3 * p + 2]});
  truth.kelvin = recon::at_key_points(grid, gas.gas.grid, gas.gas.temperature, 1);
  truth.least = kShareThatCounts * *std::max_element(truth.light.begin(), truth.light.end());
  return truth;
}

}  // namespace

std::vector<recon::RadianceImage> show(const MethodResult& result, const recon::Scene& scene,
                                       const recon::ComputeOptions& compute) {
  std::vector<const recon::CameraModel*> cameras;
  cameras.reserve(scene.views.size());
  for (const recon::View& view : scene.views) cameras.push_back(&view.camera);
  const std::vector<const recon::RadianceImage*> black(cameras.size());
  recon::RenderOptions march;
  march.compute = compute;
  return recon::render_views(result.volume, result.medium, result.effects, cameras, black, march);
}

RunErrors errors_of(const MethodResult& result, const std::vector<recon::RadianceImage>& shown,
                    const recon::Scene& scene, const KnownGas& gas) {
  MeanSquare input;
  MeanSquare test;
  MeanSquare all;
  for (std::size_t v = 0; v < shown.size(); ++v) {
    const recon::View& view = scene.views[v];
    const std::array<double, 3> rmse = recon::rmse(view, shown[v], recon::noise_mask(*view.image).box);
    (view.role == recon::ViewRole::input ? input : test).add(rmse);
    all.add(rmse);
  }
  return {input.root(), test.root(), all.root(), volume_errors(result, gas)};
}

Status check_finite(const RunErrors& errors) {
  for (const auto& rgb : {errors.input, errors.test, errors.all, errors.volume})
    for (const double value : rgb)
      if (!std::isfinite(value))
        return Error{ErrorKind::not_converged, "what it shows isn't finite", "the method's volume"};
  return {};
}

TemperatureErrors temperature_errors(const recon::Grid& grid, const std::vector<float>& kelvin,
                                     const KnownGas& gas) {
  const LitTruth truth = lit_truth(grid, gas);
  struct Off {
    double kelvin, weight;
  };
  std::vector<Off> off;
  std::size_t lit = 0;
  double weights = 0;
  TemperatureErrors errors;
  for (std::size_t p = 0; p < grid.size(); ++p) {
    if (truth.light[p] < truth.least || !(truth.light[p] > 0)) continue;
    ++lit;
    if (!(kelvin[p] > 0)) continue;
    const double error = static_cast<double>(kelvin[p] - truth.kelvin[p]);
    const auto weight = static_cast<double>(truth.light[p]);
    off.push_back({std::abs(error), weight});
    weights += weight;
    errors.bias += weight * error;
  }
  if (off.empty()) return errors;
  errors.bias /= weights;
  errors.told = static_cast<double>(off.size()) / static_cast<double>(lit);
  std::sort(off.begin(), off.end(), [](const Off& a, const Off& b) { return a.kelvin < b.kelvin; });
  // The first error up to which that share of the light lies.
  const auto quantile = [&](double share) {
    double sum = 0;
    for (const Off& o : off) {
      sum += o.weight;
      if (sum >= share * weights) return o.kelvin;
    }
    return off.back().kelvin;
  };
  errors.median = quantile(0.5);
  errors.most = quantile(0.95);
  return errors;
}

TemperatureSlice temperature_slice(const recon::Grid& grid, const std::vector<float>& kelvin,
                                   const KnownGas& gas) {
  const LitTruth truth = lit_truth(grid, gas);
  TemperatureSlice slice{{grid.nx, grid.nz}, {}, {}};
  for (int k = grid.nz - 1; k >= 0; --k)
    for (int i = 0; i < grid.nx; ++i) {
      const std::size_t p = grid.index(i, grid.ny / 2, k);
      const bool lit = truth.light[p] >= truth.least && truth.light[p] > 0;
      slice.found.push_back(lit ? kelvin[p] : 0);
      slice.truth.push_back(lit ? truth.kelvin[p] : 0);
    }
  return slice;
}

}  // namespace emberlock::paper
