// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "recon/adjust/descent.h"
#include "recon/synthetic/flame.h"
#include "tests/support/ball_scene.h"

namespace emberlock::recon {

/// A scene as the solver sets it up, in the whole of its box.
struct Posed {
  Posed(Device device, Scene pictures, int voxels, int most_subsets, const Effects& effects = {})
      : scene(std::move(pictures)),
        hull(whole_grid(grid_over(scene.box, voxels))),
        pool(2, device),
        setup{{}, {}, hull, effects, options, pool} {
    for (const View& view : scene.views) {
      if (view.role != ViewRole::input) continue;
      setup.views.push_back(&view);
      setup.boxes.push_back({0, 0, view.image->size.width, view.image->size.height});
    }
    level = make_level(setup, hull, 1, most_subsets);
  }

  Scene scene;
  Hull hull;
  SolveOptions options;
  Pool pool;
  SolverSetup setup;
  Level level;
};

inline Scene ball_of(int width) {
  BallOptions ball;
  ball.views = 8;
  ball.image = {width, width * 3 / 4};
  return ball_scene(ball);
}

}  // namespace emberlock::recon
