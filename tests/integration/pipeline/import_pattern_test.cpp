// SPDX-License-Identifier: Apache-2.0
// `emberlock import` of films whose frames belong together by what nobody coded: a hand before the lamp, the
// same few flashes again and again, and claps in the sound tracks.
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "films/import_run.h"
#include "report/import_report.h"
#include "tests/support/import_clips.h"
#include "tests/support/recording.h"
#include "tests/support/sound_writer.h"

namespace emberlock::cli {
namespace {

using testing::AllOf;
using testing::HasSubstr;

constexpr Seconds kPatternEnds{7};

/// Three cameras that filmed a strobe for seven seconds and then a flame.
class ImportByPattern : public testing::Test {
 protected:
  /// Films them under flashes that are given or not as told.
  void film(const std::vector<bool>& given) {
    drivers::VirtualRigDraw model;
    model.layout.size = {320, 240};
    model.row_time = microseconds_per_row(160);
    test::FlameFilm film{test::random_film(51, 3, model), kPatternEnds};
    film.strobe.format = {};
    film.strobe.format.gop = 12;
    film.strobe.format.crf = 20;
    film.strobe.suffix = ".mp4";
    film.strobe.starts = {0.3, 0.85, 0.1};
    film.strobe.frames = 230;
    film.strobe.strobe.code = given;
    clips_ = test::film_flame(film, folder_ / "films");
    options_.folder = folder_ / "films";
    options_.out = folder_ / "session";
    options_.alignment = films::Alignment::strobe;
    options_.clip.flash_rate = film.strobe.strobe.rate;
    options_.row_time = film.strobe.rig.cameras[0].timing.row_time;
    options_.min_free_bytes = 0;
  }
  /// Gives each film a sound track with a clap, on the rig's clock, one a camera.
  void clap(const std::vector<Seconds>& at) {
    std::filesystem::create_directories(folder_ / "loud");
    for (std::size_t c = 0; c < clips_.size(); ++c) {
      const Seconds in_film = TimePoint{} + at[c] - clips_[c].read_starts[0];
      test::add_sound(clips_[c].file, folder_ / fmt::format("loud/camera-{}.mkv", c),
                      test::claps({in_film.value()}, 9, 16000), 16000, Seconds(0));
    }
    options_.folder = folder_ / "loud";
  }
  static std::vector<bool> by_a_hand() {
    RandomStream random(5, 1);
    return test::light_pattern(test::LightPattern::hand, 400, random);
  }
  /// Every instant's frames are those that the rig read nearest to one another.
  void expect_true_pairs(const films::ImportResult& result, smear::FrameWitness witness) {
    EXPECT_GT(result.instants, 15);
    const films::ImportedCamera& reference = result.cameras[result.reference];
    for (std::size_t c = 0; c < result.cameras.size(); ++c) {
      const films::ImportedCamera& camera = result.cameras[c];
      ASSERT_EQ(camera.places.size(), reference.places.size());
      for (std::size_t i = 0; i < camera.places.size(); ++i) {
        const Seconds late =
            clips_[c].read_starts[static_cast<std::size_t>(camera.places[i])] -
            clips_[result.reference].read_starts[static_cast<std::size_t>(reference.places[i])];
        ASSERT_LT(std::abs(late.value()), 0.5 / 23.976 + 1e-4) << camera.id << " " << i;
        ASSERT_NEAR(camera.late_s[i], late.value(), 5 * camera.sigma_s[i] + 1e-6) << camera.id << " " << i;
      }
      ASSERT_TRUE(camera.whole);
      if (c == result.reference) continue;
      EXPECT_EQ(camera.whole->witness, witness) << camera.whole->reason;
      EXPECT_GE(camera.whole->probability, 0.999);
    }
  }

  test::TempFolder folder_;
  std::vector<test::FlameClip> clips_;
  films::ImportOptions options_;
};

TEST_F(ImportByPattern, FramesBelongTogetherByAHandThatPassedBeforeTheLamp) {
  film(by_a_hand());
  const auto result = films::run_import(options_, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  expect_true_pairs(*result, smear::FrameWitness::pattern);
}

TEST_F(ImportByPattern, AClapThatAgreesIsNamedAndOneThatContradictsIsRefused) {
  film(by_a_hand());
  clap({Seconds(4), Seconds(4), Seconds(4)});
  const auto agrees = films::run_import(options_, {}, report::reports_of);
  ASSERT_TRUE(agrees.ok()) << agrees.error().message();
  expect_true_pairs(*agrees, smear::FrameWitness::pattern);
  for (const std::size_t c : {1U, 2U})
    EXPECT_THAT(agrees->cameras[c].whole->reason, HasSubstr("sound agrees"));

  clap({Seconds(4), Seconds(4), Seconds(4.4)});
  options_.out = folder_ / "again";
  const auto contradicts = films::run_import(options_, {}, report::reports_of);
  ASSERT_FALSE(contradicts.ok());
  EXPECT_THAT(contradicts.error().message(), AllOf(HasSubstr("camera-2"), HasSubstr("contradict")));
}

TEST_F(ImportByPattern, OfFlashesThatRepeatIsRefusedUntilAClapTellsTheirTurn) {
  std::vector<bool> given;
  for (int i = 0; i < 400; ++i) given.push_back(i % 50 % 13 != 5 && i % 50 != 20 && i % 50 != 41);
  film(given);
  const auto silent = films::run_import(options_, {}, report::reports_of);
  ASSERT_FALSE(silent.ok());
  EXPECT_THAT(silent.error().message(), HasSubstr("which of its frames belong"));
  clap({Seconds(4), Seconds(4), Seconds(4)});
  const auto result = films::run_import(options_, {}, report::reports_of);
  ASSERT_TRUE(result.ok()) << result.error().message();
  expect_true_pairs(*result, smear::FrameWitness::pattern_and_sound);
}

}  // namespace
}  // namespace emberlock::cli
