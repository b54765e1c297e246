// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <numbers>

#include "recon/render/render.h"
#include "recon/synthetic/flame.h"

namespace emberlock {

struct RingOptions {
  int views = 10;
  double arc = 2 * std::numbers::pi;  ///< the angle over which they are spread evenly
  PerMeter extinction{32.8};
  ImageSize image{48, 36};
};

/// The paper's flame in a cube of 20 cm, seen from a ring of cameras 30 cm away, alternately somewhat above
/// and below; one more view, between the first two, is held out.
inline recon::Scene ring_scene(const RingOptions& options = {}) {
  recon::FlameOptions flame;
  flame.extinction = options.extinction;
  const recon::Box box{Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)};
  const recon::FlameTruth truth = recon::Flame(flame).at(Seconds(0), recon::grid_over(box, 32));
  const ImageSize size = options.image;
  const double focal = 0.87 * size.width;
  recon::Scene scene{{}, box};
  for (int v = 0; v <= options.views; ++v) {
    const bool held_out = v == options.views;
    const double angle = (held_out ? 0.5 : v) * options.arc / options.views;
    const Eigen::Vector3d center(0.3 * std::cos(angle), 0.3 * std::sin(angle), v % 2 == 0 ? 0.03 : -0.03);
    recon::View view{"camera " + std::to_string(v),
                     recon::look_at({size, focal, focal, size.width / 2.0, size.height / 2.0, {}}, center,
                                    Eigen::Vector3d::Zero()),
                     {},
                     held_out ? recon::ViewRole::held_out : recon::ViewRole::input};
    view.image = recon::share(recon::render_view(truth.volume, truth.medium, truth.effects, view.camera));
    scene.views.push_back(view);
  }
  return scene;
}

}  // namespace emberlock
