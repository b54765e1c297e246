// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "base/random.h"
#include "recon/synthetic/flame.h"
#include "tests/support/pictures.h"

namespace emberlock {

/// A scene whose pictures no renderer of ours made: a ball of light that falls off like a Gaussian, of which
/// each line of sight sees the closed form.
struct BallOptions {
  int views = 10;
  double height = 10;  ///< degrees: cameras stand alternately so far above and below
  ImageSize image{640, 480};
  double edge = 0.2;  ///< of the box, metres; cameras stand 1.5 edges away, the ball's sigma is an eighth
  double offset = 0;  ///< of box and cameras from the world's origin, edges
  double noise = 0;   ///< per cent of 255, about Gaussian
  std::uint64_t seed = 1;  ///< of the noise
};

/// The last view, between the first two, is held out.
inline recon::Scene ball_scene(const BallOptions& o) {
  const Eigen::Vector3d middle = o.offset * o.edge * Eigen::Vector3d(1, -1, 0.5);
  const double distance = 1.5 * o.edge;
  const double sigma = o.edge / 8;
  const double focal = 0.87 * o.image.width;
  recon::Scene scene{{}, {middle, Eigen::Vector3d::Constant(o.edge)}};
  for (int v = 0; v <= o.views; ++v) {
    const bool held_out = v == o.views;
    const double angle = (held_out ? 0.5 : v) * 2 * std::numbers::pi / o.views;
    const double height = (v % 2 == 0 ? 1 : -1) * o.height * std::numbers::pi / 180;
    const Eigen::Vector3d from =
        distance * Eigen::Vector3d(std::cos(angle) * std::cos(height), std::sin(angle) * std::cos(height),
                                   std::sin(height));
    recon::View view{"camera " + std::to_string(v),
                     recon::look_at({o.image, focal, focal, o.image.width / 2.0, o.image.height / 2.0, {}},
                                    middle + from, middle),
                     {},
                     held_out ? recon::ViewRole::held_out : recon::ViewRole::input};
    view.image = recon::share(radiance_of(o.image, [&](int x, int y, int c) {
      const Eigen::Vector3d along = view.camera.ray({x + 0.5, y + 0.5}).direction.normalized();
      const double nearest = from.squaredNorm() - std::pow(from.dot(along), 2);
      const double light = (1 - 0.2 * c) * 200 * std::exp(-nearest / (2 * sigma * sigma));
      if (!(o.noise > 0)) return light;
      const auto at = static_cast<std::uint64_t>(3 * (y * o.image.width + x) + c);
      const std::uint64_t bits = random_bits(o.seed, static_cast<std::uint64_t>(v), at);
      double sum = 0;  // of four uniform numbers: nearly Gaussian
      for (int word = 0; word < 4; ++word) sum += static_cast<double>(bits >> (16 * word) & 0xffff);
      return std::max(0.0, light + 2.55 * o.noise * (sum - 131070) / 37837.2);
    }));
    scene.views.push_back(std::move(view));
  }
  return scene;
}

}  // namespace emberlock
