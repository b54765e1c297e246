// SPDX-License-Identifier: Apache-2.0
// `emberlock verify` on video files that virtual cameras made: H.264 and others, of several models, started
// at odd times; and on what people give it by mistake.
#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "cli/commands.h"
#include "films/verify_run.h"
#include "session/media/frame_file.h"
#include "tests/support/recording.h"
#include "tests/support/sound_writer.h"
#include "tests/support/strobe_clips.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// Cameras of 240 rows that read for as long as ones of 720: a ninth of the pixels to code.
drivers::VirtualRigDraw small_model() {
  drivers::VirtualRigDraw draw;
  draw.layout.size = {320, 240};
  draw.row_time = microseconds_per_row(160);
  return draw;
}

const smear::FrameCode kShortCode{.words = 8, .spacing = 60};

using Outcome = test::VerbRun;
Outcome run(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), "verify");
  return test::run_verb(add_verify, std::move(arguments));
}

class VerifyClips : public testing::Test {
 protected:
  /// Films a rig and its comb; the arguments of the verb for them.
  std::vector<std::string> film(const test::StrobeFilm& film) {
    truths_ = test::film_strobe(film, folder_.path());
    std::filesystem::create_directories(folder_ / "comb");
    const auto comb = test::film_strobe(test::comb_of(film, 0, 36), folder_ / "comb");
    std::vector<std::string> arguments;
    for (const auto& truth : truths_) arguments.push_back(truth.file);
    for (const std::string& a :
         {std::string("--flash-rate"), fmt::format("{}", film.strobe.rate.value()), std::string("--comb"),
          comb[0].file, std::string("--comb-rate"), std::string("300"), std::string("--code-words"),
          std::string("8"), std::string("--code-spacing"), std::string("60")})
      arguments.push_back(a);
    return arguments;
  }
  static void expect_truth(const nlohmann::json& camera, const test::ClipTruth& truth) {
    EXPECT_NEAR(
        wrap_symmetric(camera.at("error_ms").get<double>() - in_milliseconds(truth.error), 1000 / 23.976), 0,
        0.02)
        << truth.file;
    EXPECT_EQ(camera.at("frame_offset").get<int>(), truth.frame_offset) << truth.file;
    EXPECT_NEAR(camera.at("drift_ppm").get<double>(), truth.drift_ppm, 3) << truth.file;
  }

  test::TempFolder folder_;
  std::vector<test::ClipTruth> truths_;
};

TEST(VideoFile, BrightnessAloneIsWhatTheColoursMeanAndTheFileSaysItsRateAndLength) {
  const test::TempFolder folder;
  Image picture({.size = {64, 48}});
  for (std::size_t i = 0; i < picture.bytes().size(); ++i)
    picture.bytes()[i] = static_cast<std::byte>(i % 64 < 20 ? 0 : i % 64 < 40 ? 120 : 255);
  for (const auto& [codec, name] : {std::pair{AV_CODEC_ID_H264, "a.mp4"}, {AV_CODEC_ID_MJPEG, "a.avi"}}) {
    test::VideoFormat format;
    format.codec = codec;
    format.crf = 10;
    test::VideoWriter writer(folder / name, {64, 48}, format);
    for (int i = 0; i < 7; ++i) writer.write(picture);
    writer.close();
    const auto coloured = session::FrameFile::open(folder / name).value();
    const auto bright = session::FrameFile::open(folder / name, session::Colours::brightness).value();
    EXPECT_NEAR(bright->claims().frame_rate->value(), 24000.0 / 1001, 1e-3) << name;
    EXPECT_EQ(bright->claims().frames, 7) << name;
    const Image rgb = coloured->next().value();
    const Image gray = bright->next().value();
    ASSERT_EQ(rgb.layout().format, PixelFormat::rgb8);
    ASSERT_EQ(gray.layout().format, PixelFormat::gray8);
    for (const int x : {8, 30, 52}) {
      EXPECT_NEAR(gray.view().sample(x, 24), rgb.view().sample(x, 24, 1), 2) << name << " at " << x;
      EXPECT_NEAR(gray.view().sample(x, 24), picture.view().sample(x, 24), 6) << name << " at " << x;
    }
  }
}

TEST_F(VerifyClips, OfEveryCodecAreToldToTwentyMicrosecondsAndToTheFrame) {
  struct Case {
    std::uint64_t seed;
    AVCodecID codec;
    int crf;
    const char* suffix;
  };
  for (const Case& c : {Case{41, AV_CODEC_ID_H264, 18, ".mp4"}, Case{42, AV_CODEC_ID_H264, 28, ".mkv"},
                        Case{43, AV_CODEC_ID_MJPEG, 0, ".avi"}}) {
    test::StrobeFilm with = test::random_film(c.seed, 2, small_model(), kShortCode);
    with.format.codec = c.codec;
    with.format.crf = c.crf;
    with.suffix = c.suffix;
    with.frames = 180;
    const Outcome outcome = run([&] {
      std::vector<std::string> arguments = film(with);
      arguments.emplace_back("--json");
      return arguments;
    }());
    const nlohmann::json json = nlohmann::json::parse(outcome.out);
    ASSERT_EQ(json.at("cameras").size(), truths_.size());
    for (std::size_t i = 0; i < truths_.size(); ++i) expect_truth(json.at("cameras")[i], truths_[i]);
  }
}

TEST_F(VerifyClips, GiveTheJsonOfTheManualAndAReportThatStandsAlone) {
  test::StrobeFilm with = test::random_film(44, 2, small_model(), kShortCode);
  with.format = {};
  with.suffix = ".mp4";
  with.frames = 90;
  with.rig.cameras[0].first_phase = with.rig.cameras[1].first_phase = Seconds(0);
  with.starts = {0.5, 0.5 + 0.0002};
  std::vector<std::string> arguments = film(with);
  for (const char* a : {"--json", "--out"}) arguments.emplace_back(a);
  arguments.push_back((folder_ / "report").string());
  const Outcome outcome = run(arguments);
  EXPECT_EQ(outcome.exit_code, 0) << outcome.out << outcome.err;
  const auto json = nlohmann::ordered_json::parse(outcome.out);
  std::vector<std::string> keys;
  for (const auto& [key, value] : json.items()) keys.push_back(key);
  EXPECT_THAT(keys, ElementsAre("reference", "cameras", "worst_pair_ms", "verdict"));
  keys.clear();
  for (const auto& [key, value] : json.at("cameras")[1].items()) keys.push_back(key);
  EXPECT_THAT(keys, ElementsAre("file", "error_ms", "sigma_ms", "frame_offset", "drift_ppm", "state",
                                "offset_by", "offset_probability", "offset_reason"));
  EXPECT_EQ(json.at("cameras")[0].at("offset_by"), nullptr);
  EXPECT_THAT(json.at("cameras")[1].at("offset_by"), testing::AnyOf("code", "pattern"));
  EXPECT_GT(json.at("cameras")[1].at("offset_probability"), 0.998);
  EXPECT_EQ(json.at("reference"), truths_[0].file);
  EXPECT_EQ(json.at("verdict"), "in sync");
  EXPECT_EQ(json.at("cameras")[1].at("state"), "in sync");
  EXPECT_NEAR(json.at("worst_pair_ms").get<double>(), std::abs(in_milliseconds(truths_[1].error)), 0.02);

  std::stringstream file;
  file << std::ifstream(folder_ / "report/report.html").rdbuf();
  const std::string report = file.str();
  for (const char* evidence : {"In sync: all 2 cameras", "Where the dot stands", "What the fit leaves",
                               "data:image/png", "The row time"})
    EXPECT_NE(report.find(evidence), std::string::npos) << evidence;
  for (const char* wrong : {"http://", "https://", "<script", "\"nan", "Lnan", "Mnan", "{}"})
    EXPECT_EQ(report.find(wrong), std::string::npos) << wrong;
}

/// A flame of 2 m/s needs half a millisecond.
TEST_F(VerifyClips, AMillisecondApartIsOutOfToleranceUnlessMoreIsAllowed) {
  test::StrobeFilm with = test::random_film(44, 2, small_model(), kShortCode);
  with.format = {};
  with.suffix = ".mp4";
  with.frames = 90;
  with.rig.cameras[0].first_phase = with.rig.cameras[1].first_phase = Seconds(0);
  with.starts = {0.5, 0.5 + 0.001};
  std::vector<std::string> arguments = film(with);
  EXPECT_EQ(run(arguments).exit_code, 1);
  for (const char* a : {"--tolerance", "1.5ms"}) arguments.emplace_back(a);
  EXPECT_EQ(run(arguments).exit_code, 0);
}

TEST_F(VerifyClips, ALostFrameIsToldAndTheOthersStayPaired) {
  test::StrobeFilm with = test::random_film(45, 2, small_model(), kShortCode);
  with.format = {};
  with.suffix = ".mp4";
  with.frames = 200;
  with.drops = {{1, {30}}};
  const Outcome outcome = run([&] {
    std::vector<std::string> arguments = film(with);
    arguments.emplace_back("--json");
    return arguments;
  }());
  const nlohmann::json json = nlohmann::json::parse(outcome.out);
  expect_truth(json.at("cameras")[1], truths_[1]);
}

/// 54 us long, or 160 us.
enum class RowsAre { as_of_720, as_of_240 };

/// Four cameras of one model, of 96 frames each, that show six skipped flashes with unlike gaps under a beat
/// of 0.02 %; each flash comes some rows after the read phase began.
test::StrobeFilm slow_beat(RowsAre rows = RowsAre::as_of_720) {
  test::StrobeFilm with = test::random_film(47, 4, small_model(), kShortCode);
  drivers::VirtualRigDraw draw;
  draw.layout.size = {160, 720};
  if (rows == RowsAre::as_of_240) draw = small_model();
  draw.cameras = 4;
  draw.seed = 47;
  with.rig.cameras = drivers::draw_virtual_rig(draw).cameras;
  with.rig.strobe.rate_error = PartsPerMillion(0);
  with.rig.strobe.rate_step = Hertz(1e-6);
  with.format = {};
  with.suffix = ".mkv";
  with.frames = 96;
  with.strobe.rate = Hertz(23.976 * 1.0002);
  with.strobe.code.assign(2000, true);
  for (const int skipped : {40, 48, 63, 74, 93, 99})
    with.strobe.code[static_cast<std::size_t>(skipped)] = false;
  with.starts = {0.8, 1.3, 0.5, 1.1};
  for (std::size_t c = 0; c < 4; ++c) {
    const Seconds before_flash =
        Rows(60 + (rows == RowsAre::as_of_240 ? 3.0 : 9.0) * static_cast<double>(c)) * draw.row_time;
    with.rig.cameras[c].first_phase =
        wrap_positive(with.strobe.phase - Seconds(with.starts[c]) - before_flash, period(with.strobe.rate));
  }
  return with;
}

TEST_F(VerifyClips, OfFourSecondsAreMatchedBySixSkippedFlashesUnderASlowBeat) {
  for (const RowsAre rows : {RowsAre::as_of_720, RowsAre::as_of_240}) {
    std::vector<std::string> arguments = film(slow_beat(rows));
    arguments.emplace_back("--json");
    const Outcome outcome = run(arguments);
    const nlohmann::json json = nlohmann::json::parse(outcome.out);
    for (std::size_t i = 0; i < truths_.size(); ++i) {
      const auto& camera = json.at("cameras")[i];
      ASSERT_FALSE(camera.at("frame_offset").is_null()) << outcome.out;
      ASSERT_FALSE(camera.at("error_ms").is_null()) << outcome.out << outcome.err;
      EXPECT_NEAR(camera.at("error_ms").get<double>(), in_milliseconds(truths_[i].error), 0.02)
          << camera.dump();
      EXPECT_EQ(camera.at("frame_offset").get<int>(), truths_[i].frame_offset);
      if (i == 0) continue;
      EXPECT_EQ(camera.at("offset_by"), "pattern");
      EXPECT_GE(camera.at("offset_probability"), 0.999);
    }
  }
}

TEST_F(VerifyClips, OfPatternsThatNobodyChoseAreNeverMatchedWrongly) {
  int right = 0;
  for (std::uint64_t seed = 60; seed < 65; ++seed) {
    const test::StrobeFilm with = test::pattern_film(
        seed, 2, small_model(), test::kTellingPatterns.at(seed % test::kTellingPatterns.size()));
    const nlohmann::json json = nlohmann::json::parse(run([&] {
                                                        std::vector<std::string> arguments = film(with);
                                                        arguments.emplace_back("--json");
                                                        return arguments;
                                                      }())
                                                          .out);
    const int reference = json.at("reference") == truths_[0].file ? 0 : 1;
    const auto& camera = json.at("cameras")[static_cast<std::size_t>(1 - reference)];
    if (camera.at("frame_offset").is_null()) {
      EXPECT_FALSE(camera.at("offset_reason").get<std::string>().empty());
      continue;
    }
    const auto of = static_cast<std::size_t>(reference);
    EXPECT_EQ(camera.at("frame_offset").get<int>(), test::nearest_offset(truths_[of], truths_[1 - of]))
        << seed << camera.dump();
    ++right;
  }
  EXPECT_GE(right, 2);
}

TEST_F(VerifyClips, WhoseSoundContradictsTheirPatternGetNoOffsetAndOneThatAgreesIsNamed) {
  const test::StrobeFilm with = slow_beat();
  std::vector<std::string> arguments = film(with);
  arguments.emplace_back("--json");
  for (std::size_t c = 0; c < 4; ++c) {
    const std::string loud = (folder_ / fmt::format("loud-{}.mkv", c)).string();
    // A clap 3 s after the rig began; the last camera's track is put half a second off.
    const double clap = 3 - with.starts[c] - with.rig.cameras[c].first_phase->value() + (c == 3 ? 0.5 : 0);
    test::add_sound(truths_[c].file, loud, test::claps({clap}, 4, 16000), 16000, Seconds(0));
    arguments[c] = loud;
  }
  const nlohmann::json json = nlohmann::json::parse(run(arguments).out);
  for (const std::size_t c : {1U, 2U}) {
    const auto& camera = json.at("cameras")[c];
    EXPECT_EQ(camera.at("frame_offset"), truths_[c].frame_offset) << camera.dump();
    EXPECT_THAT(camera.at("offset_reason").get<std::string>(), HasSubstr("the sound agrees"));
  }
  const auto& off = json.at("cameras")[3];
  EXPECT_TRUE(off.at("frame_offset").is_null()) << off.dump();
  EXPECT_THAT(off.at("offset_reason").get<std::string>(), HasSubstr("contradict"));
}

TEST_F(VerifyClips, WrongInputSaysWhatToDo) {
  const auto say = [&](const std::string& name, const std::string& content) {
    std::ofstream(folder_ / name) << content;
    return (folder_ / name).string();
  };
  test::StrobeFilm with = test::random_film(46, 2, small_model(), kShortCode);
  with.format = {};
  with.suffix = ".mp4";
  with.frames = 30;
  with.strobe.code.clear();
  truths_ = test::film_strobe(with, folder_.path());
  const std::string a = truths_[0].file;
  const std::string b = truths_[1].file;
  const std::string text = say("notes.txt", "not a video at all, but quite a long text");
  const std::string picture = say("still.pgm", "P5\n2 2\n255\nabcd");
  const std::string rate = fmt::format("{}", with.strobe.rate.value());

  const auto expect_refused = [](const std::vector<std::string>& arguments, const std::string& remedy) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_THAT(outcome.err, HasSubstr(remedy));
    EXPECT_THAT(outcome.out, testing::IsEmpty());
  };
  expect_refused({a, "--flash-rate", rate, "--row-time-us", "160"}, "two cameras or more");
  expect_refused({a, b, "--flash-rate", rate}, "--comb CLIP --comb-rate HZ");
  expect_refused({a, b}, "--flash-rate is required");
  expect_refused({a, b, "--flash-rate", "-3", "--row-time-us", "160"}, "--flash-rate");
  expect_refused({a, text, "--flash-rate", rate, "--row-time-us", "160"}, "notes.txt");
  expect_refused({a, picture, "--flash-rate", rate, "--row-time-us", "160"}, "single picture");
  expect_refused({a, "absent.mp4", "--flash-rate", rate, "--row-time-us", "160"}, "absent.mp4");
  expect_refused({a, b, "--flash-rate", rate, "--comb", b}, "--comb-rate");
  expect_refused({a, b, "--flash-rate", rate, "--comb", b, "--comb-rate", "300"}, "ten flashes a frame");
  expect_refused({a, b, "--flash-rate", rate, "--row-time-us", "160", "--tolerance", "3 apples"},
                 "500us or 10rows");

  // Too little film isn't an error, but no proof.
  const Outcome short_clips = run({a, b, "--flash-rate", rate, "--row-time-us", "160", "--json"});
  EXPECT_EQ(short_clips.exit_code, 1);
  EXPECT_EQ(nlohmann::json::parse(short_clips.out).at("verdict"), "not proven");
  EXPECT_THAT(short_clips.err, HasSubstr("no frame offset"));
}

}  // namespace
}  // namespace emberlock::cli
