// SPDX-License-Identifier: Apache-2.0
#include "apply/edit_volume.h"

#include <algorithm>
#include <numeric>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "recon/hull/hull.h"
#include "tests/support/small_scene.h"

namespace emberlock::apply {
namespace {

/// Key points a centimetre apart, -4 to 4 along each axis.
const recon::Grid kGrid{{-0.04F, -0.04F, -0.04F}, 0.01F, 9, 9, 9};

recon::Volume glow() {
  return test::volume_of(kGrid, [](int i, int j, int k) {
    const auto light = static_cast<float>(10 + i + 3 * j + 5 * k);
    return std::array<float, 4>{2 * light, light, light / 4, 3};
  });
}

FlameColours flame() { return {recon::standard_response(), 74}; }

EditedVolume shown(const std::vector<Operation>& operations, Colours colours = Colours::captured) {
  std::vector<const Operation*> stand;
  for (const Operation& operation : operations) stand.push_back(&operation);
  return edited_volume(glow(), recon::whole_grid(kGrid), flame(), colours, stand);
}

double sum_at(const recon::Volume& volume, std::size_t p) {
  const float* c = &volume.emission[3 * p];
  return static_cast<double>(c[0]) + static_cast<double>(c[1]) + static_cast<double>(c[2]);
}

const Region kBall{Region::Shape::ellipsoid, {0, 0, 0}, {0.041, 0.041, 0.041}, Meters(0)};

TEST(EditedVolume, IsWhatWasReconstructedWhereNothingWasAskedFor) {
  const EditedVolume as_is = shown({});
  EXPECT_EQ(as_is.volume.emission, glow().emission);
  EXPECT_EQ(as_is.volume.extinction, glow().extinction);
}

TEST(EditedVolume, ABrightnessOfTwoDoublesTheLightOfItsRegionAlone) {
  const EditedVolume twice = shown({BrightnessEdit{kBall, 2}});
  const recon::Volume before = glow();
  for (int k = 0; k < 9; ++k)
    for (int j = 0; j < 9; ++j)
      for (int i = 0; i < 9; ++i) {
        const std::size_t p = kGrid.index(i, j, k);
        const int squares = (i - 4) * (i - 4) + (j - 4) * (j - 4) + (k - 4) * (k - 4);
        for (std::size_t c = 0; c < 3; ++c)
          EXPECT_EQ(twice.volume.emission[3 * p + c], (squares <= 4 ? 2 : 1) * before.emission[3 * p + c]);
      }
}

TEST(EditedVolume, ARegionsEdgeFadesFromOneToNothing) {
  Region box{Region::Shape::box, {0, 0, 0}, {0.02, 0.02, 0.02}, Meters(0.02)};
  double last = 1;
  for (double x = 0; x < 0.04; x += 0.002) {
    const double share = share_of(box, {x, 0, 0});
    EXPECT_LE(share, last);
    EXPECT_EQ(share == 1, x <= 0.01 + 1e-12);
    last = share;
  }
  EXPECT_EQ(last, 0);
  EXPECT_NEAR(share_of(box, {0, 0.02, 0}), 0.5, 1e-12);
}

TEST(EditedVolume, ACutRegionNeitherShinesNorAbsorbsAndKeepIsItsOpposite) {
  const EditedVolume cut = shown({RegionEdit{kBall, Part::cut}});
  const EditedVolume kept = shown({RegionEdit{kBall, Part::keep}});
  const recon::Volume before = glow();
  for (std::size_t i = 0; i < before.emission.size(); ++i)
    EXPECT_EQ(cut.volume.emission[i] + kept.volume.emission[i], before.emission[i]);
  const std::size_t middle = kGrid.index(4, 4, 4);
  EXPECT_EQ(sum_at(cut.volume, middle), 0);
  EXPECT_EQ(cut.volume.extinction[middle], 0);
  EXPECT_GT(kept.volume.extinction[middle], 0);
  EXPECT_EQ(std::accumulate(cut.hull.inside.begin(), cut.hull.inside.end(), std::size_t{0}), cut.hull.count);
  EXPECT_LT(cut.hull.count, 512U);
}

TEST(EditedVolume, AColourCurveChangesColourAlone) {
  const ColourEdit blue{{{Kelvin(1000), {1, 0, 0}, 1}, {Kelvin(2300), {0, 0, 2}, 1}}};
  for (const Colours colours : {Colours::captured, Colours::flame}) {
    const EditedVolume before = shown({}, colours);
    const EditedVolume after = shown({blue}, colours);
    EXPECT_EQ(after.volume.extinction, before.volume.extinction);
    EXPECT_EQ(after.kelvin, before.kelvin);
    for (std::size_t p = 0; p < kGrid.size(); ++p) {
      EXPECT_NEAR(sum_at(after.volume, p), sum_at(before.volume, p), 1e-5 * sum_at(before.volume, p));
      const double hot = (static_cast<double>(after.kelvin[p]) - 1000) / 1300;
      EXPECT_NEAR(static_cast<double>(after.volume.emission[3 * p + 2]), hot * sum_at(before.volume, p),
                  1e-2);
    }
  }
}

TEST(EditedVolume, TheLookUpKeepsGreenAndColoursByTemperature) {
  const EditedVolume captured = shown({});
  const EditedVolume looked_up = shown({}, Colours::flame);
  std::vector<std::pair<float, float>> red_by_kelvin;  // over green
  for (std::size_t p = 0; p < kGrid.size(); ++p) {
    EXPECT_EQ(looked_up.volume.emission[3 * p + 1], captured.volume.emission[3 * p + 1]);
    red_by_kelvin.emplace_back(looked_up.kelvin[p],
                               looked_up.volume.emission[3 * p] / looked_up.volume.emission[3 * p + 1]);
  }
  EXPECT_NEAR(std::max_element(red_by_kelvin.begin(), red_by_kelvin.end())->first, 2300, 1);  // green of 74
  std::sort(red_by_kelvin.begin(), red_by_kelvin.end());
  for (std::size_t n = 1; n < red_by_kelvin.size(); ++n)
    EXPECT_LE(red_by_kelvin[n].second, red_by_kelvin[n - 1].second + 1e-4F);  // hotter is less red
  // Wien's law: the ratio of two greens tells the difference of 1 / T.
  const double cold = 1 / static_cast<double>(looked_up.kelvin[0]);
  const double hot = 1 / static_cast<double>(looked_up.kelvin[kGrid.size() - 1]);
  EXPECT_NEAR(cold - hot, std::log(82.0 / 10) / 25900, 0.1 * (cold - hot));
}

}  // namespace
}  // namespace emberlock::apply
