// SPDX-License-Identifier: Apache-2.0
// A flame of soot, salted with sodium on one side, above a blue base.
#include <algorithm>

#include <gmock/gmock.h>

#include "recon/export/temperature_words.h"
#include "tests/support/glowing_flame.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {

using testing::HasSubstr;

class SaltedFlameTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    test::GlowingFlameOptions options;
    options.film = small_film({240, 180});
    options.film.flame.seed = 11;
    options.emitter = Emitter::soot;
    options.sodium = 0.4;
    options.blue_base = 0.3;
    flame_ = new test::GlowingFlame(options);
    scene_ = new Scene(flame_->film());
    Effects effects;
    effects.extinction = {Extinction::Model::field, PerMeter(0), options.film.flame.extinction};
    auto done = value_of(solve(*scene_, grid_over(scene_->box, 48), effects, {}));
    done_ = new Reconstruction(std::move(done));
    auto errors = value_of(errors_by_views(*scene_, *done_, {}));
    errors_ = new VolumeErrors(std::move(errors));
  }
  static void TearDownTestSuite() {
    delete errors_;
    delete done_;
    delete scene_;
    delete flame_;
  }
  static TemperatureField read(const char* lines) {
    return temperature_of(*scene_, *done_, *errors_, flame_->response(), Emitter::soot, {}, {},
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
using SaltedFlameTestSlow = SaltedFlameTest;
const test::GlowingFlame* SaltedFlameTest::flame_ = nullptr;
const Scene* SaltedFlameTest::scene_ = nullptr;
const Reconstruction* SaltedFlameTest::done_ = nullptr;
const VolumeErrors* SaltedFlameTest::errors_ = nullptr;

TEST_F(SaltedFlameTestSlow, ItsTemperaturesAreToldWithTheLinesNamed) {
  const TemperatureField alone = read("");
  const TemperatureField unmixed = read("sodium,c2");
  const test::TemperatureScore before = test::score_of(*flame_, *done_, alone);
  const test::TemperatureScore after = test::score_of(*flame_, *done_, unmixed);
  SCOPED_TRACE(test::words(before, alone) + "\n" + test::words(after, unmixed) + "\n" + words(unmixed));
  EXPECT_TRUE(alone.line_share.empty());
  EXPECT_LT(after.median, 0.7 * before.median);
  EXPECT_LT(after.most, 0.5 * before.most);
  EXPECT_GT(after.within, 0.88);
  EXPECT_GT(after.told, before.told + 0.1);
  const TemperatureCounts& n = unmixed.summary.counts;
  EXPECT_GT(n.mixed, 100U);
  EXPECT_EQ(n.told + n.colder + n.hotter + n.unclear + n.other + n.saturated + n.lines + n.alike, n.emitting);
  EXPECT_LT(n.other, alone.summary.counts.other);
  EXPECT_THAT(words(unmixed), HasSubstr("sodium makes"));
}

TEST_F(SaltedFlameTestSlow, SharesAreWhereTheLinesAre) {
  const TemperatureField field = read("sodium,c2");
  ASSERT_EQ(field.summary.lines.size(), 2U);
  const Grid& grid = done_->volume.grid;
  const test::Glowing truth = flame_->at(grid);
  const std::vector<float> lit = flame_->lit(grid).volume.emission;
  const float brightest = *std::max_element(lit.begin(), lit.end());
  // Where sodium is, where it isn't, in the base: key points, and those where each line is seen.
  std::array<double, 3> n = {};
  std::array<double, 3> sodium = {};
  std::array<double, 3> c2 = {};
  double share = 0;
  double told_in_base = 0;
  for (std::size_t p = 0; p < grid.size(); ++p) {
    if (*std::max_element(&lit[3 * p], &lit[3 * p] + 3) < 0.1F * brightest) continue;
    const std::size_t where = !(truth.absorption[p] > 0)                     ? 2
                              : test::GlowingFlame::right_of_middle(grid, p) ? 0
                                                                             : 1;
    ++n[where];
    sodium[where] += field.line_share[0][p] > 0 ? 1 : 0;
    c2[where] += field.line_share[1][p] > 0 ? 1 : 0;
    if (where == 0) share += static_cast<double>(field.line_share[0][p]);
    if (where == 2 && field.kelvin[p] > 0) ++told_in_base;
  }
  SCOPED_TRACE(testing::PrintToString(n) + testing::PrintToString(sodium) + testing::PrintToString(c2) +
               words(field));
  EXPECT_GT(sodium[0] / n[0], 0.6);
  EXPECT_NEAR(share / sodium[0], 0.4, 0.05);
  EXPECT_GT(c2[2] / n[2], 0.5);
  for (const double elsewhere : {sodium[1] / n[1], sodium[2] / n[2], c2[0] / n[0], c2[1] / n[1]})
    EXPECT_LT(elsewhere, 0.05);
  EXPECT_LT(told_in_base / n[2], 0.02) << "there is no soot";
}

TEST_F(SaltedFlameTestSlow, AutoNamesTheOneThatExplainsMost) {
  const TemperatureField field = read("auto");
  SCOPED_TRACE(words(field));
  EXPECT_TRUE(field.summary.lines_automatic);
  ASSERT_EQ(field.summary.lines.size(), 1U);
  EXPECT_EQ(field.summary.lines[0].name, "sodium") << "of two, the one with more voxels";
  EXPECT_THAT(words(field), HasSubstr("sodium, which best explains"));
  EXPECT_EQ(field.line_share.size(), 1U);
}

TEST(LineWords, SayWhatCantBeTold) {
  TemperatureSummary t;
  t.counts.emitting = t.counts.other = 10;
  t.lines_automatic = t.lines_tried = true;
  const auto said = [&] { return testing::PrintToString(temperature_words(t)); };
  EXPECT_THAT(said(), HasSubstr("no single line emitter explains"));
  EXPECT_THAT(said(), testing::Not(HasSubstr("--lines auto"))) << "that was asked for";
  t.lines_alike = {"ch", "cucl"};
  EXPECT_THAT(said(), HasSubstr("can't tell which line emitter shines: ch, cucl explain alike"));
  t.lines_alike.clear();
  t.counts.other = 0;
  t.lines_tried = false;
  t.counts.lines = t.counts.emitting;
  EXPECT_THAT(said(), HasSubstr("no line emitter was looked for"));
  t.lines_automatic = false;
  t.lines = {{"lithium", 1, 10, 740}};
  EXPECT_THAT(said(), HasSubstr("no voxel tells its temperature; not told: 10 are lithium, no soot"));
  EXPECT_THAT(said(), HasSubstr("has the colour of a glow of 740 K"));
  EXPECT_THAT(said(), HasSubstr("relative"));
}

}  // namespace
}  // namespace emberlock::recon
