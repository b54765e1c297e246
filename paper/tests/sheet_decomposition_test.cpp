// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/sheet_decomposition/sheet_decomposition.h"

#include <cmath>
#include <utility>

#include <gtest/gtest.h>

#include "base/random.h"
#include "paper/tests/parallel_baselines.h"

namespace emberlock::paper {
namespace {

/// A profile of a slice's middle: 100 grey levels of light, dark here and there.
ParallelPicture random_picture(const ParallelSlices& slices, double angle, std::uint64_t seed) {
  ParallelPicture picture{{std::cos(angle), std::sin(angle)}, std::vector<float>(slices.profile(), 0.F)};
  const int middle = slices.offsets / 2;
  double sum = 0;
  for (int b = middle - 8; b <= middle + 8; ++b) {
    const double value = b % 4 == 0 ? 0 : random_uniform(seed, 0, static_cast<std::uint64_t>(b));
    picture.light[3 * static_cast<std::size_t>(b)] = static_cast<float>(value);
    sum += value;
  }
  for (float& value : picture.light) value *= static_cast<float>(100 / sum);
  return picture;
}

/// How much of a sheet's light lies left of an offset as a view sees it.
double light_left_of(const std::vector<SheetDot>& sheet, const ParallelPicture& picture, double offset) {
  double sum = 0;
  for (const SheetDot& dot : sheet) sum += picture.across.dot(dot.place) < offset ? dot.light : 0;
  return sum;
}

TEST(SheetDecompositionTest, ASheetShowsBothPicturesInTheirOrder) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.1, 0.1}}, 60));
  for (const double angle : {1.5707963267948966, 0.6, -2.0}) {
    const ParallelPicture first = random_picture(slices, 0, 1);
    const ParallelPicture second = random_picture(slices, angle, 2);
    const std::vector<SheetDot> sheet = density_sheet(slices, first, second, 0, 0);
    for (const ParallelPicture* picture : {&first, &second}) {
      double should_be = 0;
      for (int b = 0; b < slices.offsets; ++b) {
        should_be += static_cast<double>(picture->light[3 * static_cast<std::size_t>(b)]) / 100;
        EXPECT_NEAR(light_left_of(sheet, *picture, b - slices.offsets / 2 + 0.5), should_be, 1e-6);
      }
      for (std::size_t n = 1; n < sheet.size(); ++n)
        EXPECT_GE(picture->across.dot(sheet[n].place - sheet[n - 1].place), -1e-9);
    }
    EXPECT_TRUE(density_sheet(slices, first, second, 0, 2).empty());  // a dark channel
  }
}

TEST(SheetDecompositionTest, PermutedPartsShowBothPicturesToo) {
  const ParallelSlices slices = slices_over(recon::grid_over({{}, {0.1, 0.1, 0.1}}, 60));
  const ParallelPicture first = random_picture(slices, 0, 3);
  const ParallelPicture second = random_picture(slices, 1.1, 4);
  std::vector<SheetDot> all;
  for (const auto& [i, j] : {std::pair{0, 2}, {1, 0}, {2, 3}, {3, 1}})
    for (SheetDot dot : density_sheet(slices, first, second, 0, 0, {0.25 * i, 0.25 * j, 0.25})) {
      dot.light *= 0.25;
      all.push_back(dot);
    }
  for (const ParallelPicture* picture : {&first, &second}) {
    double should_be = 0;
    for (int b = 0; b < slices.offsets; ++b) {
      should_be += static_cast<double>(picture->light[3 * static_cast<std::size_t>(b)]) / 100;
      EXPECT_NEAR(light_left_of(all, *picture, b - slices.offsets / 2 + 0.5), should_be, 1e-6);
    }
  }
}

TEST(SheetDecompositionTest, WeightsAreConvexAndTheBest) {
  Eigen::MatrixXd a(12, 5);
  for (Eigen::Index i = 0; i < a.size(); ++i)
    a.data()[i] = random_uniform(3, 0, static_cast<std::uint64_t>(i));
  const Eigen::SparseMatrix<double> seen = a.sparseView();
  const Eigen::VectorXd inside = (Eigen::VectorXd(5) << 0.1, 0.2, 0.3, 0.25, 0.15).finished();
  EXPECT_LT((convex_weights(seen, a * inside, 0) - inside).norm(), 1e-4);
  // What no mixture reaches: the optimum's conditions (Karush, Kuhn and Tucker).
  const Eigen::VectorXd far = 3 * a.col(0) - 2 * a.col(1);
  const Eigen::VectorXd weights = convex_weights(seen, far, 0);
  EXPECT_NEAR(weights.sum(), 1, 1e-9);
  EXPECT_GE(weights.minCoeff(), 0);
  const Eigen::VectorXd slope = a.transpose() * (a * weights - far);
  for (Eigen::Index i = 0; i < 5; ++i) EXPECT_GE(slope[i], slope.dot(weights) - 1e-5);
}

TEST(SheetDecompositionTest, TakesTwoThreeAndTenViews) {
  for (const int cameras : {2, 3, 10}) {
    recon::Scene taken = small_flame(cameras == 2 ? 4 : cameras);
    if (cameras == 2) taken.views[2].role = taken.views[3].role = recon::ViewRole::held_out;
    const auto result = sheet_decomposition(taken, at_voxels(16));
    ASSERT_TRUE(result.ok()) << result.error().message();
    const ShownErrors input = shown_errors(taken, *result, recon::ViewRole::input);
    EXPECT_LT(input.shown, 0.25 * input.dark) << cameras;
    const ShownErrors held_out = shown_errors(taken, *result, recon::ViewRole::held_out);
    EXPECT_LT(held_out.shown, 0.4 * held_out.dark) << cameras;
  }
}

TEST(SheetDecompositionTest, AThinBoxIsTaken) {
  recon::Scene scene = small_flame(4);
  scene.box.size.x() = 0.01;  // two key points across
  EXPECT_TRUE(sheet_decomposition(scene, at_voxels(16)).ok());
}

TEST(SheetDecompositionTest, ThreadsDoNotChangeABit) {
  const recon::Scene scene = small_flame(5);
  MethodOptions options = at_voxels(16);
  options.compute.threads = 1;
  const auto one = sheet_decomposition(scene, options);
  options.compute.threads = 4;
  const auto four = sheet_decomposition(scene, options);
  ASSERT_TRUE(one.ok() && four.ok());
  EXPECT_EQ(one->volume.emission, four->volume.emission);
}

TEST(SheetDecompositionTest, RefusesWhatItCannotTakeAndStops) {
  recon::Scene scene = small_flame(4);
  MethodOptions options = at_voxels(16);
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
}  // namespace emberlock::paper
