// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "recon/pipeline/coverage.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/pipeline/reconstruct.h"
#include "tests/support/ring_scene.h"

namespace emberlock::recon {
namespace {
using testing::AllOf;
using testing::HasSubstr;

/// The scene, its pictures `shrunk` times as coarse and its box so many times as large.
Scene changed(double shrunk, double larger) {
  Scene scene = ring_scene();
  scene.box.size *= larger;
  for (View& view : scene.views) {
    Intrinsics& lens = view.camera.intrinsics;
    for (double* value : {&lens.fx, &lens.fy, &lens.cx, &lens.cy}) *value /= shrunk;
  }
  return scene;
}

TEST(TooFine, IsSaidOfEveryGridBeyondWhatThePicturesResolve) {
  for (const double shrunk : {0.25, 0.5, 1.0, 2.0, 4.0})
    for (const double larger : {0.5, 1.0, 1.7}) {
      const Scene scene = changed(shrunk, larger);
      const int most = voxels_by_the_paper(scene);
      EXPECT_EQ(too_fine_warning(scene, 0), "");
      EXPECT_EQ(too_fine_warning(scene, most), "") << shrunk << ", " << larger;
      EXPECT_THAT(too_fine_warning(scene, most + 1),
                  HasSubstr("Give --voxels " + std::to_string(most) + " or fewer"));
    }
}

TEST(TooFine, TwiceAsFineIsToldAsEightTimesTheUnknowns) {
  const Scene scene = ring_scene();
  EXPECT_THAT(too_fine_warning(scene, 2 * voxels_by_the_paper(scene)),
              AllOf(HasSubstr("0.75 pixels a voxel"), HasSubstr(". 8 times as many unknowns")));
}

TEST(TooFine, TheReportHoldsItAndTheRunGoesOn) {
  const Scene scene = ring_scene({.image = {16, 12}});
  const int most = voxels_by_the_paper(scene);
  ReconstructOptions options;
  options.effects = parse_effects("none").value();
  options.solve.iterations = 1;
  const auto warnings = [&](int voxels) {
    options.voxels = voxels;
    const auto outcome = reconstruct(scene, options, SteadyClock{});
    return outcome.ok() ? outcome->report.warnings : std::vector<std::string>{outcome.error().message()};
  };
  EXPECT_THAT(warnings(most + 2), testing::Contains(HasSubstr("finer than the pictures resolve")));
  EXPECT_THAT(warnings(most), testing::Not(testing::Contains(HasSubstr("finer than"))));
}

}  // namespace
}  // namespace emberlock::recon
