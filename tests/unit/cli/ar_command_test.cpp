// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "apply/front_files.h"
#include "cli/ar_film.h"
#include "cli/commands.h"
#include "recon/calibrate/rig.h"
#include "recon/export/exr_file.h"
#include "recon/export/volume_file.h"
#include "session/rig_file.h"
#include "session/video_writer.h"
#include "tests/support/marker_film.h"
#include "tests/support/recording.h"
#include "tests/support/small_scene.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr ImageSize kFilmed{240, 180};

/// A cube of light on a marker that a hand films.
class ArCommandTest : public testing::Test {
 protected:
  static recon::Intrinsics film_lens() { return {kFilmed, 240, 240, 119, 91, {-0.1, 0, 0, 0, 0}}; }
  static recon::CameraModel hand_at(int frame) { return test::in_a_hand(film_lens(), frame / 30.0, 0.5); }

  void SetUp() override {
    put_volume("fire", 2000);
    put_film("film.mkv", 10, 8);
    v1::Rig rig = recon::empty_rig();
    *rig.add_cameras() = recon::rig_camera_of("hand", hand_at(0));
    ASSERT_TRUE(session::write_rig(temp_ / "rig.json", rig).ok());
  }
  void put_volume(const std::string& name, float light) const {
    const recon::Volume volume =
        test::volume_of({{-0.1F, -0.1F, 0.1F}, 0.02F, 11, 11, 11}, [=](int i, int j, int k) {
          const bool inside = std::max({std::abs(i - 5), std::abs(j - 5), std::abs(k - 5)}) < 4;
          return std::array<float, 4>{inside ? light : 0, inside ? light / 2 : 0, 0, 0};
        });
    fs::create_directories(temp_ / name);
    ASSERT_TRUE(recon::write_volume(volume, temp_ / name / "volume.vdb").ok());
  }
  /// `hidden`: from this frame on the marker is covered.
  void put_film(const std::string& name, int frames, int hidden,
                const session::VideoDisplay& display = {}) const {
    using Coding = session::VideoWriter::Coding;
    const test::Plate plate(test::usual_marker());
    auto film =
        session::VideoWriter::create(temp_ / name, {kFilmed, PixelFormat::rgb8, 8}, Hertz(30), 0,
                                     name.ends_with("mp4") ? Coding::for_players : Coding::lossless, display);
    ASSERT_TRUE(film.ok());
    for (int f = 0; f < frames; ++f) {
      test::PlateLook look;
      look.samples = 3;
      look.hidden = f >= hidden;
      ASSERT_TRUE((*film)->show(plate.seen_by(hand_at(f), look)).ok());
    }
    ASSERT_TRUE((*film)->close().ok());
  }
  [[nodiscard]] test::VerbRun run(std::vector<std::string> words, const std::string& film = "film.mkv",
                                  const std::string& marker = "aruco:4X4_50:7:80mm") const {
    words.insert(words.begin(), {"ar", (temp_ / film).string(), (temp_ / "fire").string(), "--out",
                                 out_.string(), "--marker", marker});
    return test::run_verb(add_ar, std::move(words));
  }
  [[nodiscard]] test::VerbRun run_png(std::vector<std::string> words) const {
    words.insert(words.end(), {"--rig", (temp_ / "rig.json").string(), "--format", "png"});
    return run(std::move(words));
  }
  [[nodiscard]] cv::Mat picture(const std::string& name) const {
    return cv::imread((out_ / name).string(), cv::IMREAD_UNCHANGED);
  }
  [[nodiscard]] nlohmann::json poses() const {
    return nlohmann::json::parse(std::ifstream(out_ / "poses.json"));
  }
  void expect_refused(const test::VerbRun& run, const std::string& words) const {
    test::expect_refused(run, words, out_);
  }

  test::TempFolder temp_;
  fs::path out_ = temp_ / "out";
};

TEST_F(ArCommandTest, AFlameStandsOnTheMarker) {
  const auto done = run_png({"--scale", "0.3"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("seen in 8, predicted in 2, absent in 0"));
  EXPECT_EQ(poses()["frames"].size(), 10U);
  EXPECT_LT(poses()["residual_px"].get<double>(), 0.5);
  for (const int f : {0, 5, 9}) {
    const cv::Mat frame = picture("frame-000" + std::to_string(f) + ".png");
    ASSERT_EQ(frame.size(), cv::Size(kFilmed.width, kFilmed.height));
    // The cube of 0.042 m stands on the plate, so its middle is 0.021 m above it.
    const Eigen::Vector2d at = hand_at(f).project({0, 0, 0.021});
    const auto flame = frame.at<cv::Vec3b>(static_cast<int>(at.y()), static_cast<int>(at.x()));
    EXPECT_GT(flame[2], 180) << f;
    EXPECT_EQ(frame.at<cv::Vec3b>(2, 2), cv::Vec3b(149, 149, 149)) << "the table, as it was filmed";
  }
  EXPECT_EQ(poses()["frames"][9]["from"], "prediction");
}

TEST_F(ArCommandTest, AVideoHasTheFilmsRate) {
  const auto done = run({"--rig", (temp_ / "rig.json").string(), "--scale", "0.3", "--format", "ffv1"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const auto film = ArFilm::of_video(out_ / "ar.mkv");
  ASSERT_TRUE(film.ok());
  EXPECT_EQ(film->times().size(), 10U);
  EXPECT_NEAR(film->rate().value(), 30, 0.5);
}

TEST_F(ArCommandTest, AVideoIsShownAsTheFilmIs) {
  constexpr std::int32_t k1 = 1 << 16;
  const session::VideoDisplay phone{{{0, k1, 0, -k1, 0, 0, 0, 0, 1 << 30}}, 4, 3};
  put_film("phone.mp4", 3, 3, phone);
  const std::vector<std::string> lens{"--rig", (temp_ / "rig.json").string(), "--format"};
  for (const char* format : {"mp4", "ffv1", "png"}) {
    std::vector<std::string> words = lens;
    words.emplace_back(format);
    const auto done = run(words, "phone.mp4");
    ASSERT_EQ(done.exit_code, 0) << done.err;
    const bool turned_note = done.out.find("display matrix isn't copied") != std::string::npos;
    EXPECT_EQ(turned_note, format != std::string("mp4"));
    EXPECT_EQ(done.out.find("4:3") != std::string::npos, format == std::string("png"));
    if (format != std::string("png")) {
      const auto film = ArFilm::of_video(out_ / (format == std::string("mp4") ? "ar.mp4" : "ar.mkv"));
      ASSERT_TRUE(film.ok());
      EXPECT_EQ(film->display().matrix.has_value(), format == std::string("mp4"));
      EXPECT_FALSE(film->display().square());
    }
    fs::remove_all(out_);
  }
}

using ArCommandSlow = ArCommandTest;
TEST_F(ArCommandSlow, WhatIsBeforeTheFlameHidesIt) {
  ASSERT_EQ(run_png({"--scale", "0.3", "--albedo", "0"}).exit_code, 0);
  const Eigen::Vector2d at = hand_at(3).project({0, 0, 0.021});
  const auto red = [&] {
    return picture("frame-0003.png").at<cv::Vec3b>(static_cast<int>(at.y()), static_cast<int>(at.x()))[2];
  };
  const int bare = red();
  cv::imwrite((temp_ / "white.png").string(), cv::Mat(kFilmed.height, kFilmed.width, CV_8U, cv::Scalar(255)));
  ASSERT_EQ(run_png({"--scale", "0.3", "--mask", (temp_ / "white.png").string()}).exit_code, 0);
  EXPECT_LT(red(), bare - 20);
  cv::imwrite((temp_ / "near.png").string(), cv::Mat(kFilmed.height, kFilmed.width, CV_16U, cv::Scalar(300)));
  ASSERT_EQ(run_png({"--scale", "0.3", "--depth", (temp_ / "near.png").string()}).exit_code, 0);
  EXPECT_LT(red(), bare - 20);
  fs::create_directories(temp_ / "depth");
  std::vector<float> far(static_cast<std::size_t>(kFilmed.width) * kFilmed.height, 5.0F);
  for (int f = 0; f < 10; ++f)
    ASSERT_TRUE(recon::write_exr(kFilmed, {{"Z", far}}, temp_ / "depth" / (std::to_string(f) + ".exr")).ok());
  ASSERT_EQ(run_png({"--scale", "0.3", "--albedo", "0", "--depth", (temp_ / "depth").string()}).exit_code, 0);
  EXPECT_EQ(red(), bare);
}

TEST_F(ArCommandTest, WhatCannotBeDrawnLeavesNothing) {
  const std::string rig = (temp_ / "rig.json").string();
  expect_refused(run({"--rig", rig}, "film.mkv", "aruco:5X5_50:7:80mm"), "but a marker of 4X4_50, number 7");
  expect_refused(run({"--rig", rig}, "film.mkv", "aruco:4X4_50:8:80mm"), "but a marker of 4X4_50, number 7");
  expect_refused(run({"--rig", rig}, "film.mkv", "aruco:4X4:8:80mm"), "no dictionary");
  expect_refused(run({}), "--focal");
  expect_refused(run({"--rig", rig, "--camera", "foot"}), "Give --camera, one of hand");
  expect_refused(run({"--focal", "0"}), "--focal");
  expect_refused(run({"--rig", rig, "--position", "1,2"}), "--position");
  expect_refused(run({"--rig", rig, "--mask", "nothing.png"}), "nothing.png");
  expect_refused(run({"--rig", rig, "--depth", (temp_ / "film.mkv").string()}), "holds no metres");
  std::ofstream(temp_ / "cut.exr") << "v/1\1";
  expect_refused(run({"--rig", rig, "--depth", (temp_ / "cut.exr").string()}), "cut.exr");
  cv::imwrite((temp_ / "eight.png").string(), cv::Mat(kFilmed.height, kFilmed.width, CV_8U, cv::Scalar(9)));
  expect_refused(run({"--rig", rig, "--depth", (temp_ / "eight.png").string()}), "isn't grey of 16 bits");
  cv::imwrite((temp_ / "small.png").string(), cv::Mat(20, 20, CV_16U, cv::Scalar(9)));
  expect_refused(run({"--rig", rig, "--depth", (temp_ / "small.png").string()}), "has 20 x 20 pixels");
  expect_refused(run({"--rig", rig, "--mask", (temp_ / "small.png").string()}), "has 20 x 20 pixels");
  fs::create_directories(temp_ / "few");
  expect_refused(run({"--rig", rig, "--mask", (temp_ / "few").string()}), "holds 0 pictures");
  put_film("bare.mkv", 3, 0);
  expect_refused(run({"--rig", rig}, "bare.mkv"), "none of its frames shows aruco:4X4_50:7:80mm");
  std::ofstream(temp_ / "text.mp4") << "no video";
  expect_refused(run({"--rig", rig}, "text.mp4"), "text.mp4");
}

/// A recorded camera, at its own pace, and virtual ones, before which no marker lies.
TEST_F(ArCommandTest, ACameraOfARigFilms) {
  const test::Plate plate(test::usual_marker());
  auto writer = session::SessionWriter::create(
      temp_ / "take", test::manifest_of({{kFilmed, PixelFormat::rgb8, 8}}), test::small_disk_options());
  ASSERT_TRUE(writer.ok());
  for (std::uint64_t f = 0; f < 6; ++f) {
    const auto ns = static_cast<std::int64_t>(f) * 33'000'000;
    const FrameStamp stamp{f, {ns}, {1'700'000'000'000'000'000 + ns}, {ns}, FrameStatus::complete};
    const Image picture = plate.seen_by(hand_at(static_cast<int>(f)));
    ASSERT_TRUE(writer->write(0, {stamp, std::make_shared<const Image>(picture)}).ok());
  }
  ASSERT_TRUE(writer->finish().ok());
  const fs::path config = temp_ / "rig.toml";
  std::ofstream(config) << "[rig.replay]\nsession = \"take\"\n[[rig.camera]]\ndriver = \"replay\"\n";
  const std::vector<std::string> words{"ar",
                                       "cam0",
                                       (temp_ / "fire").string(),
                                       "--out",
                                       out_.string(),
                                       "--marker",
                                       "aruco:4X4_50:7:80mm",
                                       "--focal",
                                       "240",
                                       "--config",
                                       config.string()};
  const auto done = test::run_verb(add_ar, words);
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("seen in 6, predicted in 0"));
  EXPECT_NEAR(poses()["frames"][5]["time_s"].get<double>(), 5 * 0.033, 0.02);
  fs::remove_all(out_);
  std::vector<std::string> other = words;
  other[1] = "cam7";
  expect_refused(test::run_verb(add_ar, other), "Its cameras are cam0");
  std::ofstream(config) << "[[rig.camera]]\ndriver = \"virtual\"\nid = \"eye\"\nsize = \"160x120\"\n";
  other[1] = "eye";
  other.insert(other.end(), {"--seconds", "0.2"});
  expect_refused(test::run_verb(add_ar, other), "none of its frames shows");
}

}  // namespace
}  // namespace emberlock::cli
