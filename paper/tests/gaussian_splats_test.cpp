// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/gaussian_splats/gaussian_splats.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "base/random.h"
#include "paper/baselines/gaussian_splats/splat_fit.h"
#include "paper/baselines/linear_projector.h"
#include "paper/tests/tomography_scene.h"
#include "recon/hull/hull.h"
#include "tests/support/ball_scene.h"

namespace emberlock::paper {
namespace {

using test::errors_of;
using test::tomography_scene;
using test::with_voxels;

/// A splat in the middle of a grid of 24 voxels, longer along one slanted axis.
Splat slanted() { return {12.3F, 11.6F, 12.9F, -1.F, -0.4F, -0.7F, 0.2F, -0.1F, 0.15F, 1.F, 0.2F, -0.5F}; }

SplatView view_of(const recon::Scene& scene, int stride = 1) {
  const recon::View& view = scene.views[1];
  return splat_view(view, {0, 0, view.image->size.width, view.image->size.height},
                    recon::grid_over(scene.box, 24), stride);
}

std::size_t brightest(const SplatLight& light) {
  return static_cast<std::size_t>(std::max_element(light[0].begin(), light[0].end()) - light[0].begin());
}

/// A splat's emission at a point, as its header says.
double emission_at(const Splat& s, const Eigen::Vector3d& x) {
  const std::array<float, 6> w = sharpness_of(s);
  const Eigen::Vector3d v = x - Eigen::Vector3d(double{s[0]}, double{s[1]}, double{s[2]});
  const Eigen::Vector3d u(double{w[0]} * v.x(), double{w[1]} * v.x() + double{w[2]} * v.y(),
                          double{w[3]} * v.x() + double{w[4]} * v.y() + double{w[5]} * v.z());
  return double{light_of(s, 1)[0]} * std::exp(-0.5 * u.squaredNorm());
}

TEST(Splats, ShowTheIntegralAlongTheRay) {
  const recon::Scene scene = tomography_scene();
  const SplatView view = view_of(scene);
  const SplatPicture& picture = view.pictures[0];
  const SplatLight shown = show({{slanted()}, 1}, view, picture);
  const std::size_t middle = brightest(shown);
  const auto pitch = static_cast<std::size_t>(picture.pitch);
  for (const std::size_t pixel : {middle, middle + 3, middle - 2 * pitch, middle + pitch - 4}) {
    const Eigen::Vector3d along(double{picture.direction[0][pixel]}, double{picture.direction[1][pixel]},
                                double{picture.direction[2][pixel]});
    double sum = 0;
    constexpr double kStep = 0.05;
    for (double t = 0; t < 80; t += kStep)
      sum += kStep * emission_at(slanted(), view.camera.center() + t * along);
    EXPECT_NEAR(double{shown[0][pixel]}, sum, 1e-4 * sum);
  }
}

TEST(Splats, AddUpInAnyOrder) {
  const SplatView view = view_of(tomography_scene());
  Splat other = slanted();
  other[kCentre] += 2;
  const SplatLight both = show({{slanted(), other}, 1}, view, view.pictures[0]);
  const SplatLight reversed = show({{other, slanted()}, 1}, view, view.pictures[0]);
  EXPECT_EQ(both, reversed);
}

TEST(Splats, PicturesOfAStrideAreThePixelsOfTheWhole) {
  const recon::Scene scene = tomography_scene();
  const SplatView parts = view_of(scene, 3);
  std::size_t pixels = 0;
  double seen = 0;
  for (const SplatPicture& p : parts.pictures) {
    pixels += static_cast<std::size_t>(p.columns) * static_cast<std::size_t>(p.rows);
    seen += std::accumulate(p.seen[1].begin(), p.seen[1].end(), 0.0);
  }
  const std::vector<float> whole = view_of(scene).pictures[0].seen[1];
  EXPECT_EQ(pixels, 80U * 60U);
  EXPECT_NEAR(seen, std::accumulate(whole.begin(), whole.end(), 0.0), 1e-6 * seen);
}

TEST(Splats, GradientIsThatOfFiniteDifferences) {
  const SplatView view = view_of(tomography_scene());
  const SplatPicture& picture = view.pictures[0];
  SplatLight slope;
  for (std::size_t c = 0; c < 3; ++c)
    for (std::size_t p = 0; p < picture.seen[0].size(); ++p)
      slope[c].push_back(static_cast<float>(random_uniform(1, c, p) - 0.3));
  const auto cost = [&](const Splat& splat) {
    const SplatLight light = show({{splat}, 1.5F}, view, picture);
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t p = 0; p < light[c].size(); ++p) sum += double{slope[c][p]} * double{light[c][p]};
    return sum;
  };
  std::vector<Splat> gradient(1, Splat{});
  add_gradient({{slanted()}, 1.5F}, view, picture, slope, gradient);
  for (std::size_t n = 0; n < Splat{}.size(); ++n) {
    constexpr float kStep = 4e-3F;
    Splat less = slanted();
    Splat more = slanted();
    less[n] -= kStep;
    more[n] += kStep;
    const double difference = (cost(more) - cost(less)) / double{more[n] - less[n]};
    EXPECT_NEAR(double{gradient[0][n]}, difference, 0.01 * std::abs(difference) + 0.02) << n;
  }
}

TEST(Splats, KeepTheirIntegralOnKeyPoints) {
  const recon::Grid grid = recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, 24);
  recon::Pool pool(2, recon::Device::cpu);
  Splat narrow = slanted();
  for (std::size_t a = 0; a < 3; ++a) narrow[kSharpness + a] = std::log(2.F);
  for (const Splat& splat : {slanted(), narrow}) {
    const recon::Volume volume = on_key_points({{splat}, 1}, grid, pool);
    double sum = 0;
    for (std::size_t p = 0; p < grid.size(); ++p) sum += double{volume.emission[3 * p]};
    // Grey levels a metre, of key points that stand for a cubic voxel edge each.
    const double integral = double{light_of(splat, 1)[0]} / double{grid.edge} * double{volume_of(splat)};
    EXPECT_NEAR(sum, integral, 1e-4 * integral);
  }
}

TEST(Splats, LightNumbersComeBack) {
  for (const float light : {1e-3F, 0.5F, 7.F, 300.F}) {
    Splat splat = {};
    splat[kLight] = number_of_light(light, 2);
    EXPECT_NEAR(light_of(splat, 2)[0], light, 1e-4F * light);
  }
}

std::vector<SplatView> views_of(const TomographyInput& input) {
  std::vector<SplatView> views;
  for (const recon::View* view : input.views)
    views.push_back(
        splat_view(*view, {0, 0, view->image->size.width, view->image->size.height}, input.hull.grid, 2));
  return views;
}

/// Squares of what is shown beside what is seen, red, over one picture of each view.
double squares_off(const Splats& splats, const std::vector<SplatView>& views) {
  double sum = 0;
  for (const SplatView& view : views) {
    const SplatPicture& picture = view.pictures[0];
    const SplatLight light = show(splats, view, picture);
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.columns; ++column) {
        const auto at = static_cast<std::size_t>(row * picture.pitch + column);
        sum += std::pow(double{light[0][at]} - double{picture.seen[0][at]}, 2);
      }
  }
  return sum;
}

TEST(SplatFit, BeginsWithAQuickTomography) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 5, {48, 36});
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(16), 1).value();
  const std::vector<SplatView> views = views_of(input);
  EXPECT_LT(squares_off(splats_in(input.hull, views, 1000, pool), views), 0.1 * squares_off({}, views));
}

TEST(SplatFit, MakesMoreSplatsWithinItsBoundWhereFewShowTooLittle) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 5, {48, 36});
  recon::Pool pool(2, recon::Device::cpu);
  const TomographyInput input = find_input(scene, with_voxels(24), 1).value();
  const std::vector<SplatView> views = views_of(input);
  SplatFitOptions few;
  few.first = 20;
  const Splats start = splats_in(input.hull, views, few.first, pool);
  few.growth = 1;
  const Splats as_many = fit_splats(input.hull, views, few, pool).splats;
  few.growth = 3;
  const Splats more = fit_splats(input.hull, views, few, pool).splats;
  EXPECT_LE(as_many.all.size(), start.all.size());
  EXPECT_GT(more.all.size(), start.all.size());
  EXPECT_LE(more.all.size(), 3 * start.all.size());
  EXPECT_LT(squares_off(as_many, views), 0.5 * squares_off(start, views));
  EXPECT_LT(squares_off(more, views), 0.8 * squares_off(as_many, views));
}

/// A ball of light that falls off like a Gaussian is what splats are made for.
TEST(GaussianSplats, ShowABallOfLightFromBetweenItsViews) {
  BallOptions ball;
  ball.views = 6;
  ball.image = {48, 36};
  const recon::Scene scene = ball_scene(ball);
  const test::TomographyErrors errors = errors_of(scene, *gaussian_splats(scene, with_voxels(14)));
  EXPECT_LT(errors.input, 0.05 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.06 * errors.held_out_dark);
}

TEST(GaussianSplats, ShowAFlameThatNothingAbsorbs) {
  const recon::Scene scene = tomography_scene();
  const Result<MethodResult> result = gaussian_splats(scene, with_voxels(24));
  ASSERT_TRUE(result) << result.error().message();
  const test::TomographyErrors errors = errors_of(scene, *result);
  EXPECT_LT(errors.input, 0.1 * errors.input_dark);
  EXPECT_LT(errors.held_out, 0.15 * errors.held_out_dark);
}

TEST(GaussianSplats, HaveTheSameBitsForAnyNumberOfThreads) {
  const recon::Scene scene = tomography_scene(PerMeter(0), 4, {48, 36});
  const MethodResult one = gaussian_splats(scene, with_voxels(16, 1)).value();
  const MethodResult four = gaussian_splats(scene, with_voxels(16, 4)).value();
  EXPECT_EQ(one.volume.emission, four.volume.emission);
}

TEST(GaussianSplats, AreAskedToStop) {
  int asked = 0;
  MethodOptions options = with_voxels(20);
  options.stop = [&] { return ++asked > 3; };
  EXPECT_EQ(gaussian_splats(tomography_scene(), options).value().iterations, 3);
}

TEST(GaussianSplats, RefuseWhatTheyCantTake) { test::refuses_what_it_cant_take(gaussian_splats); }

}  // namespace
}  // namespace emberlock::paper
