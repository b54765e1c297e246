// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>
#include <numeric>

#include <gtest/gtest.h>

#include "base/random.h"
#include "evaluate/baselines/sheet_decomposition/sheet_decomposition.h"
#include "tests/support/parallel_baselines.h"

namespace emberlock::evaluate {
namespace {

/// Profiles of a slice, the same in all three channels, with 100 grey levels of light.
ParallelPicture random_picture(const ParallelSlices& slices, double angle, std::uint64_t seed) {
  ParallelPicture picture{{std::cos(angle), std::sin(angle)}, std::vector<float>(slices.profile(), 0.F)};
  const int middle = slices.offsets / 2;
  double sum = 0;
  std::vector<double> values;
  for (int b = middle - 8; b <= middle + 8; ++b) {
    values.push_back(b % 4 == 0 ? 0 : random_uniform(seed, 0, static_cast<std::uint64_t>(b)));
    sum += values.back();
  }
  for (std::size_t n = 0; n < values.size(); ++n)
    for (std::size_t c = 0; c < 3; ++c)
      picture.light[3 * (static_cast<std::size_t>(middle - 8) + n) + c] =
          static_cast<float>(100 * values[n] / sum);
  return picture;
}

TEST(SheetDecompositionTest, ASheetShowsBothPicturesOnOneCurve) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.1, 0.1}}, 60));
  const ParallelPicture first = random_picture(slices, 0, 1);
  const ParallelPicture second = random_picture(slices, 1.5707963267948966, 2);
  std::vector<float> layer(slices.layer());
  draw_density_sheet(slices, first, second, 0, 1, 100, layer.data());
  std::vector<float> seen(slices.profile());
  for (const ParallelPicture* picture : {&first, &second}) {
    ParallelProjector(slices, picture->across).project(layer.data(), seen.data());
    double up_to_here = 0;
    double should_be = 0;
    for (int b = 0; b < slices.offsets; ++b) {
      up_to_here += static_cast<double>(seen[3 * static_cast<std::size_t>(b) + 1]);
      should_be += static_cast<double>(picture->light[3 * static_cast<std::size_t>(b) + 1]);
      // A key point's tent reaches half a strip over each side.
      EXPECT_NEAR(up_to_here, should_be, 4) << "up to ray " << b;
    }
    EXPECT_NEAR(up_to_here, 100, 1e-3);
  }
  // One curve from one corner of the pictures' common square to the other: never more than its two sides.
  const auto lit = std::count_if(layer.begin(), layer.end(), [](float v) { return v > 0; });
  EXPECT_LT(lit, 2 * 2 * 17 * 2);
  EXPECT_GT(lit, 17);
  EXPECT_EQ(layer[0] + layer[2], 0);
}

TEST(SheetDecompositionTest, TwoPointsOfLightAreFoundWhereTheyAre) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.1, 0.1}}, 40));
  std::vector<float> truth(slices.layer());
  // In the order of both views: to the right for the first, to the right for the second.
  truth[3 * slices.grid.index(12, 15, 0)] = 3;
  truth[3 * slices.grid.index(25, 30, 0)] = 5;
  std::vector<ParallelPicture> pictures = {{{1, 0}, std::vector<float>(slices.profile())},
                                           {{0, 1}, std::vector<float>(slices.profile())}};
  for (ParallelPicture& picture : pictures)
    ParallelProjector(slices, picture.across).project(truth.data(), picture.light.data());
  const double total = 8 * static_cast<double>(slices.grid.edge);
  std::vector<float> layer(slices.layer());
  draw_density_sheet(slices, pictures[0], pictures[1], 0, 0, total, layer.data());
  const auto around = [&](int i, int j) {
    float sum = 0;
    for (int dj = -1; dj <= 1; ++dj)
      for (int di = -1; di <= 1; ++di) sum += layer[3 * slices.grid.index(i + di, j + dj, 0)];
    return sum;
  };
  EXPECT_NEAR(around(12, 15), 3, 1e-4);
  EXPECT_NEAR(around(25, 30), 5, 1e-4);
}

TEST(SheetDecompositionTest, WeightsAreConvexAndTheBest) {
  Eigen::MatrixXd a(12, 5);
  for (Eigen::Index i = 0; i < a.size(); ++i)
    a.data()[i] = random_uniform(3, 0, static_cast<std::uint64_t>(i));
  const Eigen::VectorXd inside = (Eigen::VectorXd(5) << 0.1, 0.2, 0.3, 0.25, 0.15).finished();
  EXPECT_LT((convex_weights(a.transpose() * a, a.transpose() * (a * inside)) - inside).norm(), 1e-4);
  // What no mixture reaches: the optimum's conditions (Karush, Kuhn and Tucker).
  const Eigen::VectorXd far = 3 * a.col(0) - 2 * a.col(1);
  const Eigen::VectorXd weights = convex_weights(a.transpose() * a, a.transpose() * far);
  EXPECT_NEAR(weights.sum(), 1, 1e-9);
  EXPECT_GE(weights.minCoeff(), 0);
  const Eigen::VectorXd slope = a.transpose() * (a * weights - far);
  for (Eigen::Index i = 0; i < 5; ++i) EXPECT_GE(slope[i], slope.dot(weights) - 1e-5);
}

TEST(SheetDecompositionTest, TakesTwoThreeAndTenViews) {
  for (const int cameras : {2, 3, 10}) {
    const recon::Scene scene = small_flame(cameras == 2 ? 4 : cameras);
    recon::Scene taken = scene;
    if (cameras == 2) taken.views[2].role = taken.views[3].role = recon::ViewRole::held_out;
    const auto result = sheet_decomposition(taken, with_voxels(32));
    ASSERT_TRUE(result.ok()) << result.error().message();
    const ShownErrors input = errors_of(taken, *result, recon::ViewRole::input);
    EXPECT_LT(input.shown, 0.5 * input.dark) << cameras;
    const ShownErrors held_out = errors_of(taken, *result, recon::ViewRole::held_out);
    EXPECT_LT(held_out.shown, 0.8 * held_out.dark) << cameras;
  }
}

TEST(SheetDecompositionTest, ThreadsDoNotChangeABit) {
  const recon::Scene scene = small_flame(5);
  MethodOptions options = with_voxels(24);
  options.compute.threads = 1;
  const auto one = sheet_decomposition(scene, options);
  options.compute.threads = 4;
  const auto four = sheet_decomposition(scene, options);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->volume.emission, four->volume.emission);
}

TEST(SheetDecompositionTest, RefusesWhatItCannotTakeAndStops) {
  recon::Scene scene = small_flame(4);
  MethodOptions options = with_voxels(24);
  options.stop = [] { return true; };
  const auto stopped = sheet_decomposition(scene, options);
  ASSERT_TRUE(stopped.ok()) << stopped.error().message();
  EXPECT_EQ(stopped->medium.count, 0u);
  options.stop = {};
  // Opposite cameras see the same lines.
  scene.views[1].role = scene.views[3].role = recon::ViewRole::held_out;
  EXPECT_EQ(sheet_decomposition(scene, options).error().kind, ErrorKind::bad_input);
  for (recon::View& view : scene.views) view.role = recon::ViewRole::held_out;
  EXPECT_EQ(sheet_decomposition(scene, options).error().kind, ErrorKind::bad_input);
}

}  // namespace
}  // namespace emberlock::evaluate
