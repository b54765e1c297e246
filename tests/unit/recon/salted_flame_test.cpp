// SPDX-License-Identifier: Apache-2.0
// A flame of soot, salted with sodium on one side, above a blue base.
#include <algorithm>
#include <cmath>

#include <gmock/gmock.h>

#include "recon/export/temperature_words.h"
#include "tests/support/glowing_flame.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

class SaltedFlameTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    test::GlowingFlameOptions options;
    options.film.flame.seed = 11;
    options.film.image = {240, 180};
    options.film.truth_voxels = 64;
    options.emitter = Emitter::soot;
    options.sodium = 0.4;
    options.blue_base = 0.3;
    flame_ = new test::GlowingFlame(options);
    scene_ = new Scene(flame_->film());
    Effects effects;
    effects.extinction = {Extinction::Model::field, PerMeter(0), options.film.flame.extinction};
    auto done = solve(*scene_, grid_over(scene_->box, 48), effects, {});
    ASSERT_TRUE(done.ok()) << done.error().message();
    done_ = new Reconstruction(std::move(*done));
    auto errors = errors_by_views(*scene_, *done_, {});
    ASSERT_TRUE(errors.ok()) << errors.error().message();
    errors_ = new VolumeErrors(std::move(*errors));
  }
  static void TearDownTestSuite() {
    delete errors_;
    delete done_;
    delete scene_;
    delete flame_;
  }
  static TemperatureField read(const char* lines) {
    return temperature_of(*scene_, *done_, *errors_, flame_->response(), Emitter::soot, {},
                          *parse_lines(lines));
  }
  static std::string words(const TemperatureField& field) {
    std::string all;
    for (const std::string& w : temperature_words(field.summary)) all += w + "\n";
    return all;
  }
  static const test::GlowingFlame* flame_;
  static const Scene* scene_;
  static const Reconstruction* done_;
  static const VolumeErrors* errors_;
};
const test::GlowingFlame* SaltedFlameTest::flame_ = nullptr;
const Scene* SaltedFlameTest::scene_ = nullptr;
const Reconstruction* SaltedFlameTest::done_ = nullptr;
const VolumeErrors* SaltedFlameTest::errors_ = nullptr;

TEST_F(SaltedFlameTest, ItsTemperaturesAreToldWithTheLinesNamed) {
  const TemperatureField alone = read("");
  const TemperatureField unmixed = read("sodium,c2");
  const test::TemperatureScore before = test::score_of(*flame_, *done_, alone);
  const test::TemperatureScore after = test::score_of(*flame_, *done_, unmixed);
  SCOPED_TRACE(test::words(before, alone) + "\n" + test::words(after, unmixed) + "\n" + words(unmixed));
  EXPECT_TRUE(alone.line_share.empty());
  EXPECT_LT(after.median, before.median);
  EXPECT_GT(after.within, 0.88);
  const TemperatureCounts& n = unmixed.summary.counts;
  EXPECT_GT(n.mixed, 100U);
  EXPECT_EQ(n.told + n.colder + n.hotter + n.unclear + n.other + n.saturated + n.lines + n.alike, n.emitting);
  EXPECT_LT(n.other, alone.summary.counts.other);
  EXPECT_THAT(words(unmixed), HasSubstr("sodium makes"));
}

TEST_F(SaltedFlameTest, SharesAreWhereTheLinesAre) {
  const TemperatureField field = read("sodium,c2");
  ASSERT_EQ(field.summary.lines.size(), 2U);
  const Grid& grid = done_->volume.grid;
  const test::Glowing truth = flame_->at(grid);
  const std::vector<float> lit = flame_->lit(grid).volume.emission;
  const float brightest = *std::max_element(lit.begin(), lit.end());
  std::array<double, 3> sodium = {};  // mean share where it is, where it isn't, in the base
  std::array<double, 3> c2 = {};
  std::array<double, 3> n = {};
  std::size_t told_in_base = 0;
  for (std::size_t p = 0; p < grid.size(); ++p) {
    if (*std::max_element(&lit[3 * p], &lit[3 * p] + 3) < 0.1F * brightest) continue;
    const std::size_t where = !(truth.absorption[p] > 0)                     ? 2
                              : test::GlowingFlame::right_of_middle(grid, p) ? 0
                                                                             : 1;
    ++n[where];
    sodium[where] += static_cast<double>(field.line_share[0][p]);
    c2[where] += static_cast<double>(field.line_share[1][p]);
    if (where == 2 && field.kelvin[p] > 0) ++told_in_base;
  }
  ASSERT_GT(n[2], 20);
  SCOPED_TRACE(testing::PrintToString(n) + testing::PrintToString(sodium) + testing::PrintToString(c2));
  SCOPED_TRACE(words(field));
  EXPECT_NEAR(sodium[0] / n[0], 0.4, 0.12);
  EXPECT_LT(sodium[1] / n[1], 0.08);
  EXPECT_GT(c2[2] / n[2], 0.6);
  EXPECT_LT(c2[1] / n[1], 0.08);
  EXPECT_LT(static_cast<double>(told_in_base), 0.25 * n[2]) << "there is no soot";
}

TEST_F(SaltedFlameTest, AutoNamesOneOrSaysThatItCant) {
  const TemperatureField field = read("auto");
  SCOPED_TRACE(words(field));
  EXPECT_TRUE(field.summary.lines_automatic);
  if (field.summary.lines.empty()) {
    EXPECT_THAT(words(field), HasSubstr("line emitter"));
  } else {
    EXPECT_THAT(words(field), HasSubstr("best explains"));
  }
  EXPECT_EQ(field.line_share.size(), field.summary.lines.size());
}

}  // namespace
}  // namespace emberlock::recon
