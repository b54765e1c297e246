// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "recon/calibrate/camera_response.h"
#include "recon/compute/pool.h"
#include "recon/kernels/planck.h"
#include "recon/render/volume.h"
#include "recon/temperature/emitter.h"
#include "recon/views/camera_model.h"
#include "recon/views/radiance_image.h"

namespace emberlock::test {

/// What glows: temperature in K, absorption at 550 nm in 1/m, at key points.
struct Glowing {
  recon::Grid grid;
  std::vector<float> kelvin, absorption;
};

/// Pictures of glowing gas by another renderer than the program's: light is followed from behind each pixel's
/// ray to the camera at 41 wavelengths, each with its own absorption, in double precision and steps of half
/// an edge; the camera's response weighs them at the end.
class SpectralCamera {
 public:
  SpectralCamera(const Glowing& gas, recon::Emitter emitter, const recon::CameraResponse& response)
      : gas_(gas) {
    for (std::size_t w = 0; w < kWavelengths; ++w) {
      const double nm = kFirst + kStep * static_cast<double>(w);
      relative_[w] = recon::relative_absorption(emitter, nm);
      const auto above = std::lower_bound(response.wavelength_nm.begin(), response.wavelength_nm.end(), nm);
      const auto at = static_cast<std::size_t>(above - response.wavelength_nm.begin());
      for (std::size_t c = 0; c < 3; ++c)
        weight_[w][c] = at < response.level[c].size() ? kStep * response.level[c][at] : 0;
      for (std::size_t t = 0; t < kTemperatures; ++t)
        planck_[t].push_back(std::exp(recon::log_planck(nm, kColdest + static_cast<double>(t))));
    }
  }

  [[nodiscard]] recon::RadianceImage picture(const recon::CameraModel& camera) const {
    recon::RadianceImage image(camera.intrinsics.size);
    const int width = image.size.width;
    recon::Pool(0).run(image.size.height, [&](int y) {
      for (int x = 0; x < width; ++x) {
        const std::array<double, 3> seen = level(camera.ray({x + 0.5, y + 0.5}));
        for (std::size_t c = 0; c < 3; ++c)
          image.rgb[3 * static_cast<std::size_t>(y * width + x) + c] = static_cast<float>(seen[c]);
      }
    });
    return image;
  }

 private:
  static constexpr std::size_t kWavelengths = 41;
  static constexpr double kFirst = 380, kStep = 10;   // nm
  static constexpr double kColdest = 1000;            // K, where nothing shines yet
  static constexpr std::size_t kTemperatures = 1600;  // by 1 K

  struct Here {
    double kelvin = 0, absorption = 0;
  };
  [[nodiscard]] Here at(const Eigen::Vector3d& place) const {
    const recon::Grid& g = gas_.grid;
    const int n[3] = {g.nx, g.ny, g.nz};
    int low[3];
    double part[3];
    for (int d = 0; d < 3; ++d) {
      const double v = (place[d] - static_cast<double>(g.origin[d])) / static_cast<double>(g.edge);
      if (!(v >= 0 && v < n[d] - 1)) return {};
      low[d] = static_cast<int>(v);
      part[d] = v - low[d];
    }
    Here here;
    for (unsigned corner = 0; corner < 8; ++corner) {
      double share = 1;
      int p[3];
      for (int d = 0; d < 3; ++d) {
        const bool upper = ((corner >> d) & 1U) != 0;
        p[d] = low[d] + (upper ? 1 : 0);
        share *= upper ? part[d] : 1 - part[d];
      }
      const std::size_t q = g.index(p[0], p[1], p[2]);
      here.kelvin += share * static_cast<double>(gas_.kelvin[q]);
      here.absorption += share * static_cast<double>(gas_.absorption[q]);
    }
    return here;
  }

  [[nodiscard]] std::array<double, 3> level(const recon::Ray& ray) const {
    const recon::Grid& g = gas_.grid;
    const double edge = static_cast<double>(g.edge);
    const Eigen::Vector3d diagonal(g.nx * edge, g.ny * edge, g.nz * edge);
    const Eigen::Vector3d middle = Eigen::Vector3f::Map(g.origin).cast<double>() + diagonal / 2;
    const double there = ray.direction.dot(middle - ray.origin);
    const double step = edge / 2;
    std::array<double, kWavelengths> light = {};
    for (double s = there + diagonal.norm() / 2; s > there - diagonal.norm() / 2; s -= step) {
      const Here here = at(ray.origin + (s - step / 2) * ray.direction);
      if (!(here.absorption > 0)) continue;
      const double above = std::clamp(here.kelvin - kColdest, 0.0, kTemperatures - 2.0);
      const auto t = static_cast<std::size_t>(above);
      const double part = above - static_cast<double>(t);
      for (std::size_t w = 0; w < kWavelengths; ++w) {
        const double passes = std::exp(-here.absorption * relative_[w] * step);
        const double glow = (1 - part) * planck_[t][w] + part * planck_[t + 1][w];
        light[w] = light[w] * passes + glow * (1 - passes);
      }
    }
    std::array<double, 3> out = {};
    for (std::size_t w = 0; w < kWavelengths; ++w)
      for (std::size_t c = 0; c < 3; ++c) out[c] += weight_[w][c] * light[w];
    return out;
  }

  const Glowing& gas_;
  std::array<double, kWavelengths> relative_ = {};
  std::array<std::array<double, 3>, kWavelengths> weight_ = {};
  std::vector<std::vector<double>> planck_ = std::vector<std::vector<double>>(kTemperatures);
};

}  // namespace emberlock::test
