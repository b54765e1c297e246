// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstddef>

#include "recon/hull/hull.h"
#include "recon/render/render.h"
#include "recon/synthetic/flame.h"
#include "recon/temperature/emitter.h"

namespace emberlock::test {

/// What a grey body of a flame's brightness is at a height: 1400 to 2000 K over the box.
inline double tempered_kelvin(double z) { return 1700 + 3000 * z; }

/// A scene filmed anew: the drawn flame's places, in the colours of grey bodies as a response shows them. No
/// extinction.
inline void temper(recon::Scene& scene, const recon::CameraResponse& response) {
  recon::FlameOptions options;
  options.extinction = PerMeter(0);
  recon::FlameTruth truth = recon::Flame(options).at(Seconds(0), recon::grid_over(scene.box, 48));
  const recon::Grid& g = truth.volume.grid;
  for (int k = 0; k < g.nz; ++k) {
    const double z = double{g.origin[2]} + k * double{g.edge};
    const auto level = recon::levels_of(response, recon::Emitter::grey, Kelvin(tempered_kelvin(z))).value;
    for (std::size_t p = g.index(0, 0, k); p < g.index(0, 0, k) + g.index(0, 0, 1); ++p) {
      float* rgb = &truth.volume.emission[3 * p];
      const float all = rgb[0] + rgb[1] + rgb[2];
      for (std::size_t c = 0; c < 3; ++c) rgb[c] = all * static_cast<float>(level[c]);
    }
  }
  for (recon::View& view : scene.views)
    view.image = recon::share(render_view(truth.volume, truth.medium, truth.effects, view.camera));
}

}  // namespace emberlock::test
