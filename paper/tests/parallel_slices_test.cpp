// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/parallel_slices.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <gtest/gtest.h>

#include "base/random.h"
#include "paper/tests/parallel_baselines.h"
#include "recon/render/render.h"

namespace emberlock::paper {
namespace {

/// A ball of even emission, 4 cm wide and off the axis, seen by cameras far away in the plane.
recon::Scene ball_from_afar(double distance) {
  recon::Scene scene;
  scene.box = {Eigen::Vector3d(0.02, -0.01, 0.05), Eigen::Vector3d(0.1, 0.08, 0.1)};
  recon::Volume ball{recon::grid_over(scene.box, 50), {}, {}};
  ball.emission.resize(3 * ball.grid.size());
  for (int k = 0; k < ball.grid.nz; ++k)
    for (int j = 0; j < ball.grid.ny; ++j)
      for (int i = 0; i < ball.grid.nx; ++i) {
        const Eigen::Vector3d at(
            static_cast<double>(ball.grid.origin[0] + static_cast<float>(i) * ball.grid.edge),
            static_cast<double>(ball.grid.origin[1] + static_cast<float>(j) * ball.grid.edge),
            static_cast<double>(ball.grid.origin[2] + static_cast<float>(k) * ball.grid.edge));
        if ((at - Eigen::Vector3d(0.03, -0.01, 0.05)).norm() < 0.02)
          std::fill_n(ball.emission.begin() + static_cast<std::ptrdiff_t>(3 * ball.grid.index(i, j, k)), 3,
                      1000.F);
      }
  for (const double azimuth : {0.3, 1.7}) {
    const Eigen::Vector3d from(std::cos(azimuth), std::sin(azimuth), 0);
    const double focal = 1500 * distance;
    recon::View view{"view",
                     recon::look_at({{160, 160}, focal, focal, 80, 80, {}},
                                    scene.box.center + distance * from, scene.box.center),
                     {}};
    view.image =
        recon::share(recon::render_view(ball, recon::whole_grid(ball.grid), recon::Effects{}, view.camera));
    scene.views.push_back(view);
  }
  return scene;
}

std::vector<std::uint32_t> all_points(const ParallelSlices& slices) {
  std::vector<std::uint32_t> points(slices.layer() / 3);
  std::iota(points.begin(), points.end(), 0U);
  return points;
}

TEST(ParallelSlicesTest, ADistantBallHasTheProfilesOfItsChords) {
  const recon::Scene scene = ball_from_afar(50);
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, 25));
  const auto pictures = parallel_pictures(scene, slices);
  ASSERT_TRUE(pictures.ok()) << pictures.error().message();
  for (const ParallelPicture& picture : *pictures) {
    const double centre = picture.across.dot(Eigen::Vector2d(0.01, 0));
    for (int b = 0; b < slices.offsets; ++b) {
      const double away = (b - slices.offsets / 2) * static_cast<double>(slices.grid.edge) - centre;
      if (std::abs(std::abs(away) - 0.02) < 0.006) continue;  // where a chord falls to nothing
      const double chord = 2 * std::sqrt(std::max(0.0, 0.02 * 0.02 - away * away));
      const std::size_t at =
          static_cast<std::size_t>(slices.grid.nz / 2) * slices.profile() + 3 * static_cast<std::size_t>(b);
      EXPECT_NEAR(static_cast<double>(picture.light[at]), 1000 * chord, 1.5) << "at " << away;
    }
  }
}

TEST(ParallelSlicesTest, NoiseIsNoFlame) {
  recon::Scene scene = ball_from_afar(5);
  recon::RadianceImage noisy = *scene.views[0].image;
  for (std::size_t i = 0; i < noisy.rgb.size(); ++i)
    noisy.rgb[i] = std::max(0.F, noisy.rgb[i] + static_cast<float>(random_normal(1, 0, i)));
  scene.views[0].image = recon::share(std::move(noisy));
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, 25));
  const auto pictures = parallel_pictures(scene, slices);
  ASSERT_TRUE(pictures.ok());
  const std::vector<float>& light = (*pictures)[0].light;
  const auto lowest = static_cast<std::ptrdiff_t>(slices.profile() * 3);  // three slices below the ball
  EXPECT_EQ(*std::max_element(light.begin(), light.begin() + lowest), 0);
}

TEST(ParallelSlicesTest, ProjectingKeepsTheLightOfASlice) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.06, 0.1}}, 20));
  std::vector<float> layer(slices.layer(), 0.F);
  for (std::size_t i = 0; i < layer.size(); ++i) layer[i] = static_cast<float>(random_uniform(1, 0, i));
  std::vector<float> profile(slices.profile());
  for (const double angle : {0.0, 0.4, 2.2}) {
    ParallelProjector(slices, {std::cos(angle), std::sin(angle)})
        .project(layer.data(), all_points(slices), profile.data());
    const double edge = static_cast<double>(slices.grid.edge);
    EXPECT_NEAR(edge * std::accumulate(profile.begin(), profile.end(), 0.0),
                edge * edge * std::accumulate(layer.begin(), layer.end(), 0.0), 1e-6);
  }
}

TEST(ParallelSlicesTest, TheAdjointIsTheTranspose) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.06, 0.1}}, 20));
  const ParallelProjector projector(slices, {std::cos(0.7), std::sin(0.7)});
  std::vector<float> x(slices.layer());
  std::vector<float> y(slices.profile());
  for (std::size_t i = 0; i < x.size(); ++i) x[i] = static_cast<float>(random_normal(1, 0, i));
  for (std::size_t i = 0; i < y.size(); ++i) y[i] = static_cast<float>(random_normal(1, 1, i));
  std::vector<float> forward(y.size());
  std::vector<float> back(x.size());
  projector.project(x.data(), all_points(slices), forward.data());
  projector.back_project(y.data(), all_points(slices), back.data());
  EXPECT_NEAR(std::inner_product(forward.begin(), forward.end(), y.begin(), 0.0),
              std::inner_product(x.begin(), x.end(), back.begin(), 0.0), 1e-5);
}

TEST(ParallelSlicesTest, RefusesWhatCannotBeTakenAsParallel) {
  recon::Scene scene = ball_from_afar(2);
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, 16));
  scene.views[1].camera =
      recon::look_at(scene.views[1].camera.intrinsics, scene.box.center + Eigen::Vector3d(0, 0, 1),
                     scene.box.center, Eigen::Vector3d::UnitX());
  scene.views[1].name = "from above";
  const auto above = parallel_pictures(scene, slices);
  ASSERT_FALSE(above.ok());
  EXPECT_EQ(above.error().where, "from above");
  for (recon::View& view : scene.views) view.role = recon::ViewRole::held_out;
  EXPECT_FALSE(parallel_pictures(scene, slices).ok());
  EXPECT_FALSE(check_method(scene, at_voxels(7)).ok());
  EXPECT_FALSE(check_method(scene, at_voxels(257)).ok());
}

TEST(ParallelSlicesTest, AResultWorseThanDarknessIsRefused) {
  const recon::Scene scene = ball_from_afar(2);
  recon::Volume volume{recon::grid_over(scene.box, 16), {}, {}};
  volume.emission.assign(3 * volume.grid.size(), 0.F);
  EXPECT_TRUE(checked_result(scene, volume, {}).ok());
  std::fill(volume.emission.begin(), volume.emission.end(), 1e5F);
  EXPECT_EQ(checked_result(scene, volume, {}).error().kind, ErrorKind::not_converged);
  volume.emission[7] = NAN;
  EXPECT_EQ(checked_result(scene, volume, {}).error().kind, ErrorKind::not_converged);
}

}  // namespace
}  // namespace emberlock::paper
