// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <OpenEXR/ImfFrameBuffer.h>
#include <OpenEXR/ImfInputFile.h>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "session/media/frame_file.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// A cube of light in the middle of a box, red and half as green.
class RenderCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    constexpr int kPoints = 17;
    recon::Volume volume;
    volume.grid = {{-0.08F, -0.08F, -0.08F}, 0.01F, kPoints, kPoints, kPoints};
    volume.emission.resize(3 * volume.grid.size());
    volume.extinction.resize(volume.grid.size());
    std::vector<float> kelvin(volume.grid.size());
    for (int k = 5; k < 12; ++k)
      for (int j = 5; j < 12; ++j)
        for (int i = 5; i < 12; ++i) {
          const std::size_t p = volume.grid.index(i, j, k);
          volume.emission[3 * p] = 2000;
          volume.emission[3 * p + 1] = 1000;
          volume.extinction[p] = 5;
          kelvin[p] = 1700;
        }
    fs::create_directories(folder_ / "result");
    ASSERT_TRUE(
        recon::write_volume(volume, folder_ / "result" / "volume.vdb", {{"temperature", "K", kelvin}}).ok());
    ASSERT_TRUE(recon::write_volume(volume, folder_ / "colours.vdb").ok());
  }
  [[nodiscard]] test::VerbRun run(std::vector<std::string> words) const {
    std::vector<std::string> all = {
        "render", (folder_ / "result").string(), "--out", out_.string(), "--image", "64x48", "--device",
        "cpu"};
    all.insert(all.end(), words.begin(), words.end());
    return test::run_verb(add_render, std::move(all));
  }
  [[nodiscard]] cv::Mat picture(const std::string& name) const {
    return cv::imread((out_ / name).string(), cv::IMREAD_UNCHANGED);
  }
  /// The result with a medium that scatters.
  void tell(const recon::Lighting& lighting) const {
    const fs::path file = folder_ / "result" / "volume.vdb";
    const auto volume = recon::read_volume(file);
    ASSERT_TRUE(volume.ok()) << volume.error().message();
    ASSERT_TRUE(recon::write_volume(*volume, file, {}, lighting).ok());
  }
  void expect_refused(const test::VerbRun& result, const std::string& why) const {
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(out_));
  }
  const test::TempFolder folder_;
  const fs::path out_ = folder_ / "out";
};

TEST_F(RenderCommandTest, AnOrbitIsAFolderOfPictures) {
  const auto result = run({"--frames", "10"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("10 of 64 x 48"));
  EXPECT_FALSE(fs::exists(out_ / "frame-0010.png"));
  for (const char* name : {"frame-0000.png", "frame-0009.png"}) {
    const cv::Mat seen = picture(name);
    ASSERT_EQ(seen.size(), cv::Size(64, 48));
    const auto bgr = seen.at<cv::Vec3b>(24, 32);
    EXPECT_GT(bgr[2], 60);
    EXPECT_NEAR(bgr[1], bgr[2] / 2.0, 1.5);
    EXPECT_EQ(seen.at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 0));
  }
}

TEST_F(RenderCommandTest, UpIsWhereItWasForTheCameras) {
  const std::vector<std::string> plain = {"--frames", "2", "--look-at", "0.02,0.01,0.03"};
  const auto with_up = [&](const std::string& up) {
    std::vector<std::string> words = plain;
    words.insert(words.end(), {"--up", up});
    return words;
  };
  ASSERT_EQ(run(with_up("-y")).exit_code, 0);
  const cv::Mat told = picture("frame-0001.png");
  ASSERT_FALSE(told.empty());
  std::ofstream(folder_ / "result" / "report.json") << R"({"up": "-y"})";
  ASSERT_EQ(run(plain).exit_code, 0);
  EXPECT_EQ(cv::norm(told, picture("frame-0001.png")), 0);
  ASSERT_EQ(run(with_up("z")).exit_code, 0);
  EXPECT_GT(cv::norm(told, picture("frame-0001.png")), 0) << "what is told counts";
  std::ofstream(folder_ / "result" / "report.json") << R"({"up": "sideways"})";
  fs::remove_all(out_);
  expect_refused(run(plain), "sideways");
}

TEST_F(RenderCommandTest, BeforeNothingAPictureHasAnOpacity) {
  ASSERT_EQ(run({"--camera", "0.5, 0, 0", "--transparent"}).exit_code, 0);
  const cv::Mat seen = picture("frame-0000.png");
  ASSERT_EQ(seen.channels(), 4);
  EXPECT_EQ(seen.at<cv::Vec4b>(1, 1)[3], 0);
  const auto middle = seen.at<cv::Vec4b>(24, 32);
  EXPECT_GT(middle[3], 60);
  EXPECT_LT(middle[3], 255);
  EXPECT_EQ(middle[2], 255) << "as bright as its opacity allows";
}

TEST_F(RenderCommandTest, WhatIsScatteredIsShownAndSaid) {
  const std::vector<std::string> from_the_side = {"--camera", "0.5,0,0"};
  const auto without = run(from_the_side);
  ASSERT_EQ(without.exit_code, 0) << without.err;
  EXPECT_THAT(without.out, Not(HasSubstr("scattering")));
  const int plain = picture("frame-0000.png").at<cv::Vec3b>(24, 32)[2];
  tell({{recon::Scattering::Order::multiple, 0.9, 0}, {}});
  const auto with = run(from_the_side);
  ASSERT_EQ(with.exit_code, 0) << with.err;
  EXPECT_THAT(with.out, HasSubstr("scattering       multiple, albedo 0.9, g 0"));
  EXPECT_GT(picture("frame-0000.png").at<cv::Vec3b>(24, 32)[2], plain + 3);
}

TEST_F(RenderCommandTest, ALitResultIsShownInAnotherLight) {
  fs::remove_all(out_);
  expect_refused(run({"--camera", "0.5,0,0", "--light", "even"}), "--light: wasn't reconstructed as lit");
  tell({{}, {recon::Light::Source::even, {}, {}, {200, 100, 50}}});
  const auto own = run({"--camera", "0.5,0,0"});
  ASSERT_EQ(own.exit_code, 0) << own.err;
  EXPECT_THAT(own.out, HasSubstr("light            even: 200 / 100 / 50 grey levels from all sides"));
  const auto other = run({"--camera", "0.5,0,0", "--light", "distant:y=1"});
  ASSERT_EQ(other.exit_code, 0) << other.err;
  EXPECT_THAT(other.out, HasSubstr("distant, from the direction 0, 1, 0"));
  // +y is to the camera's right: an extinction of 5 / m takes 26 % over the cube's 6 cm.
  const cv::Mat seen = picture("frame-0000.png");
  EXPECT_GT(seen.at<cv::Vec3b>(24, 34)[2], seen.at<cv::Vec3b>(24, 30)[2] + 2);
  ASSERT_EQ(run({"--camera", "0.5,0,0", "--light", "none"}).exit_code, 0);
  EXPECT_EQ(cv::norm(picture("frame-0000.png"), cv::NORM_INF), 0);
  fs::remove_all(out_);
  for (const char* bad : {"sun", "distant", "found", "even,scattering=single", "nearby:x=0.01"})
    expect_refused(run({"--camera", "0.5,0,0", "--light", bad}), "--light");
}

TEST_F(RenderCommandTest, TemperaturesSayWhatTheirColoursMean) {
  const auto result = run({"--frames", "2", "--quantity", "temperature"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1700 K is dark, 1750 K bright"));
  EXPECT_NE(picture("frame-0001.png").at<cv::Vec3b>(24, 32), cv::Vec3b(0, 0, 0))
      << "the coldest is seen, too";
  EXPECT_EQ(picture("frame-0001.png").at<cv::Vec3b>(1, 1), cv::Vec3b(0, 0, 0));
  fs::remove_all(out_);
  const auto none = test::run_verb(add_render, {"render", (folder_ / "colours.vdb").string(), "--out",
                                                out_.string(), "--quantity", "temperature"});
  expect_refused(none, "has no temperatures");
}

TEST_F(RenderCommandTest, ALosslessVideoHasThePicturesBits) {
  ASSERT_EQ(run({"--frames", "3"}).exit_code, 0);
  const cv::Mat expected = picture("frame-0002.png");
  ASSERT_EQ(run({"--frames", "3", "--format", "ffv1"}).exit_code, 0);
  EXPECT_FALSE(fs::exists(out_ / "frame-0000.png")) << "the earlier result is replaced";
  auto file = session::FrameFile::open(out_ / "render.mkv");
  ASSERT_TRUE(file.ok()) << file.error().message();
  for (int skipped = 0; skipped < 2; ++skipped) ASSERT_TRUE((*file)->next().ok());
  const auto frame = (*file)->next();
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  ASSERT_EQ(frame->layout().format, PixelFormat::rgb8);
  for (int y = 0; y < 48; ++y)
    for (int x = 0; x < 64; ++x) {
      const auto bgr = expected.at<cv::Vec3b>(y, x);
      for (int c = 0; c < 3; ++c) ASSERT_EQ(frame->view().sample(x, y, c), bgr[2 - c]) << x << ' ' << y;
    }
  EXPECT_FALSE((*file)->next().ok()) << "three frames";
}

TEST_F(RenderCommandTest, AVideoForPlayersShowsThePictures) {
  ASSERT_EQ(run({"--frames", "2"}).exit_code, 0);
  const cv::Mat expected = picture("frame-0000.png");
  ASSERT_EQ(run({"--frames", "2", "--format", "mp4"}).exit_code, 0);
  auto file = session::FrameFile::open(out_ / "render.mp4");
  ASSERT_TRUE(file.ok()) << file.error().message();
  const auto frame = (*file)->next();
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  for (int c = 0; c < 3; ++c)
    EXPECT_NEAR(frame->view().sample(32, 24, c), expected.at<cv::Vec3b>(24, 32)[2 - c], 12) << c;
}

TEST_F(RenderCommandTest, AnExrHoldsEachChannelAndTheOpacity) {
  ASSERT_EQ(run({"--camera", "0.5,0,0", "--format", "exr"}).exit_code, 0);
  Imf::InputFile file((out_ / "frame-0000.exr").c_str());
  std::vector<float> channel[4];
  const char* const names[] = {"R", "G", "B", "A"};
  Imf::FrameBuffer frame;
  for (int c = 0; c < 4; ++c) {
    channel[c].resize(std::size_t{64} * 48);
    frame.insert(names[c], Imf::Slice(Imf::FLOAT, reinterpret_cast<char*>(channel[c].data()), sizeof(float),
                                      sizeof(float) * 64));
  }
  file.setFrameBuffer(frame);
  file.readPixels(0, 47);
  constexpr std::size_t kMiddle = std::size_t{24} * 64 + 32;
  EXPECT_GT(channel[0][kMiddle], 0.2F);
  EXPECT_NEAR(channel[1][kMiddle], channel[0][kMiddle] / 2, 1e-5) << "half as green";
  EXPECT_EQ(channel[2][kMiddle], 0);
  // 5 / m over the cube's 6 cm, and half of it in the voxels at either end.
  EXPECT_NEAR(channel[3][kMiddle], 1 - std::exp(-5 * 0.07), 0.02);
  EXPECT_EQ(channel[3][0], 0);
}

TEST_F(RenderCommandTest, FollowsTheCamerasThatFilmed) {
  // Two cameras half a metre away, at right angles, whose pictures nobody looks at.
  const std::string pose[] = {"[[0,0,1,0.5],[1,0,0,0],[0,1,0,0],[0,0,0,1]]",
                              "[[-1,0,0,0],[0,0,1,0.5],[0,1,0,0],[0,0,0,1]]"};
  cv::imwrite((folder_ / "dark.png").string(), cv::Mat::zeros(48, 64, CV_8UC1));
  std::ofstream(folder_ / "transforms.json")
      << R"({"fl_x": 80, "frames": [{"file_path": "dark.png", "transform_matrix": )" << pose[0]
      << R"(}, {"file_path": "dark.png", "transform_matrix": )" << pose[1] << "}]}";
  const auto result =
      run({"--path", "cameras", "--frames", "3", "--input", (folder_ / "transforms.json").string()});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const cv::Mat first = picture("frame-0000.png");
  const cv::Mat last = picture("frame-0002.png");
  EXPECT_EQ(cv::norm(first, last, cv::NORM_INF), 0) << "a cube looks alike from its sides";
  EXPECT_GT(cv::norm(first, picture("frame-0001.png"), cv::NORM_INF), 20) << "and not from its edge";
  fs::remove_all(out_);
  expect_refused(run({"--path", "cameras"}), "Give --input");
  std::ofstream(folder_ / "result" / "report.json")
      << R"({"input": ")" << (folder_ / "gone").string() << "\"}";
  expect_refused(run({"--path", "cameras"}), "gone");
}

TEST_F(RenderCommandTest, RefusesWhatCannotBeShown) {
  expect_refused(run({"--camera", "0,0,1"}), "axis that is up");
  expect_refused(run({"--camera", "0,0"}), "is no place");
  expect_refused(run({"--transparent", "--format", "mp4"}), "--transparent: changes nothing");
  expect_refused(run({"--camera", "0.5,0,0", "--frames", "7"}), "--frames: changes nothing");
  expect_refused(run({"--rate", "30"}), "--rate: changes nothing");
  expect_refused(run({"--quantity", "temperature", "--brightness", "2"}), "--brightness: changes nothing");
  for (const char* bad : {"0", "nan", "1e39"}) expect_refused(run({"--brightness", bad}), "--brightness");
  for (const char* bad : {"-1", "nan", "1e200"}) expect_refused(run({"--distance", bad}), "--distance");
  for (const char* bad : {"90", "nan"}) expect_refused(run({"--elevation", bad}), "--elevation");
  expect_refused(run({"--up", "w"}), "is no axis");
  expect_refused(test::run_verb(add_render, {"render", (folder_ / "result").string(), "--out", out_.string(),
                                             "--format", "mp4", "--image", "65x48"}),
                 "even sides");
}

/// A sequence passes once while the camera stands or moves: its brightness tells which volume a picture
/// shows.
TEST_F(RenderCommandTest, ASequencePassesOnceAlongThePath) {
  const auto one = recon::read_volume(folder_ / "colours.vdb");
  ASSERT_TRUE(one.ok());
  const fs::path sequence = folder_ / "sequence";
  for (const int frame : {2, 4, 10}) {
    recon::Volume volume = *one;
    for (float& v : volume.emission) v *= static_cast<float>(frame) / 10;
    fs::create_directories(sequence / fmt::format("frame-{}", frame));
    ASSERT_TRUE(recon::write_volume(volume, sequence / fmt::format("frame-{}/volume.vdb", frame)).ok());
  }
  const auto reds = [&](const std::vector<std::string>& words) {
    std::vector<std::string> all{"render",  sequence.string(), "--out",    out_.string(),
                                 "--image", "64x48",           "--device", "cpu"};
    all.insert(all.end(), words.begin(), words.end());
    const auto result = test::run_verb(add_render, all);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(result.err, HasSubstr("frames 6, 8 are missing"));
    std::vector<int> shares;
    for (int i = 0; fs::exists(out_ / fmt::format("frame-{:04}.png", i)); ++i)
      shares.push_back(picture(fmt::format("frame-{:04}.png", i)).at<cv::Vec3b>(24, 32)[2]);
    for (int& share : shares)
      share = shares.empty() ? 0 : static_cast<int>(10.0 * share / shares.back() + 0.5);
    return shares;
  };
  using testing::ElementsAre;
  EXPECT_THAT(reds({"--brightness", "0.5"}), ElementsAre(2, 4, 10));
  EXPECT_THAT(reds({"--brightness", "0.5", "--camera", "0.5,0,0"}), ElementsAre(2, 4, 10));
  EXPECT_THAT(reds({"--brightness", "0.5", "--frames", "7"}), ElementsAre(2, 2, 2, 4, 4, testing::Ge(8), 10));
  EXPECT_THAT(reds({"--brightness", "0.5", "--frames", "1"}), ElementsAre(10)) << "of itself";
}

}  // namespace
}  // namespace emberlock::cli
