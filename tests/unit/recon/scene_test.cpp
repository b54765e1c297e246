// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

#include "recon/calibrate/rig.h"
#include "session/reader.h"
#include "session/shutter_times.h"
#include "session/writer.h"
#include "tests/support/count_allocations.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class SceneTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("emberlock_scene_test." + std::to_string(::getpid()));
    fs::create_directories(root_);
    write_pgm("a.pgm", 255);
    write_pgm("b.pgm", 1023);
  }
  void TearDown() override { fs::remove_all(root_); }

  /// 4 x 2 pixels, black but for a pixel at white in column 3, row 1.
  void write_pgm(const char* name, int white) const {
    std::ofstream out(root_ / name, std::ios::binary);
    out << "P5\n4 2\n" << white << "\n";
    for (int i = 0; i < 8; ++i) {
      const int value = i == 7 ? white : 0;
      if (white > 255) out.put(static_cast<char>(value >> 8));
      out.put(static_cast<char>(value & 255));
    }
  }
  [[nodiscard]] static json valid() {
    return json::parse(
        R"({"fl_x": 10, "w": 4, "h": 2, "box": {"center": [0, 0, 0], "size": [1, 1, 1]}, "frames": [
      {"file_path": "a.pgm", "transform_matrix": [[1,0,0,0],[0,1,0,0],[0,0,1,5],[0,0,0,1]]},
      {"file_path": "b", "transform_matrix": [[1,0,0,1],[0,1,0,0],[0,0,1,5],[0,0,0,1]]}]})");
  }
  [[nodiscard]] Result<Scene> load(const json& document, const SceneOptions& options = {}) const {
    std::ofstream(root_ / "transforms.json") << document.dump();
    return load_scene(root_ / "transforms.json", options);
  }
  fs::path root_;
};

TEST_F(SceneTest, PicturesOfEveryDepthBecomeRadiance) {
  const auto scene = load(valid());
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_EQ(scene->views.size(), 2U);
  EXPECT_EQ(scene->views[1].name, "b.pgm") << "the extension was found";
  for (const View& view : scene->views) {
    EXPECT_EQ(view.role, ViewRole::input);
    EXPECT_EQ(view.image->size, (ImageSize{4, 2}));
    for (std::size_t i = 0; i < 21; ++i) EXPECT_EQ(view.image->rgb[i], 0);
    for (std::size_t i = 21; i < 24; ++i) EXPECT_FLOAT_EQ(view.image->rgb[i], 255);
  }
}

TEST_F(SceneTest, ABoxFromTheCommandLineStandsBeforeTheFiles) {
  const auto scene = load(valid(), {.box = Box{{1, 2, 3}, {4, 5, 6}}, .frame = {}});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_EQ(scene->box.center, Eigen::Vector3d(1, 2, 3));
}

TEST_F(SceneTest, WithoutABoxTheErrorSaysHowToGiveOne) {
  json document = valid();
  document.erase("box");
  EXPECT_THAT(load(document).error().message(), HasSubstr("--box"));
  EXPECT_TRUE(load(document, {.box = Box{{0, 0, 0}, {1, 1, 1}}, .frame = {}}).ok());
}

TEST_F(SceneTest, AMissingPictureNamesItsFrame) {
  json document = valid();
  document["frames"][1]["file_path"] = "lost.png";
  const auto scene = load(document);
  ASSERT_FALSE(scene.ok());
  EXPECT_EQ(scene.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(scene.error().message(), HasSubstr("frames[1].file_path"));
  EXPECT_THAT(scene.error().message(), HasSubstr("lost.png"));
}

TEST_F(SceneTest, ATruncatedPictureNamesItsFrame) {
  fs::resize_file(root_ / "a.pgm", fs::file_size(root_ / "a.pgm") - 3);
  EXPECT_THAT(load(valid()).error().message(), HasSubstr("frames[0].file_path"));
}

TEST_F(SceneTest, PicturesOfAnotherSizeAreRefused) {
  json document = valid();
  document["frames"][1]["w"] = 5;
  EXPECT_THAT(load(document).error().message(), HasSubstr("frames[1].w, h"));
}

TEST_F(SceneTest, WhatIsNeitherFileNorSessionIsNamed) {
  EXPECT_THAT(load_scene(root_).error().message(), HasSubstr("no session"));
  EXPECT_THAT(load_scene(root_ / "absent.json").error().message(), HasSubstr("absent.json"));
  EXPECT_FALSE(load(valid(), {.box = {}, .frame = 3}).ok()) << "one instant has no frames to choose from";
}

TEST_F(SceneTest, HoldingOutChangesRoles) {
  auto scene = load(valid());
  ASSERT_TRUE(hold_out(*scene, {1}).ok());
  EXPECT_EQ(scene->views[1].role, ViewRole::held_out);
  EXPECT_THAT(hold_out(*scene, {2}).error().message(), HasSubstr("--hold-out 2"));
  EXPECT_FALSE(hold_out(*scene, {-1}).ok());
  EXPECT_THAT(hold_out(*scene, {0}).error().message(), HasSubstr("every view"));
}

TEST(SceneViews, FewerAreSpreadAndTheHeldOutOnesStay) {
  Scene scene = small_flame_scene();
  scene.linearised = true;
  scene.preprocessing.push_back({"white balance", true, "told"});
  const Scene fewer = with_views(scene, 5);
  ASSERT_EQ(fewer.views.size(), 6);
  EXPECT_TRUE(fewer.linearised);
  EXPECT_EQ(fewer.preprocessing.size(), 1);
  double closest = 0;  // the paper's cameras stand 36 degrees apart and opposite each other
  for (const View& a : fewer.views) {
    for (const View& b : fewer.views) {
      if (&a == &b || a.role != ViewRole::input || b.role != ViewRole::input) continue;
      closest =
          std::max(closest, std::abs(a.camera.center().normalized().dot(b.camera.center().normalized())));
    }
  }
  EXPECT_LT(closest, std::cos(30 * M_PI / 180));
  EXPECT_EQ(with_views(scene, 0).views.size(), 11);
  EXPECT_EQ(with_views(scene, 99).views.size(), 11);
}

/// Three cameras of a session: grey, mosaic and colour, 8 and 12 bits, five frames 10 ms apart; the second
/// camera starts 1 ms late and lost a frame.
class SessionSceneTest : public SceneTest {
 protected:
  static constexpr PixelFormat kFormats[] = {PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                             PixelFormat::rgb8};

  [[nodiscard]] static v1::Manifest manifest() {
    v1::Manifest m;
    m.set_purpose("flame");
    m.set_session_id("test");
    for (const double v : {0.0, 0.0, 0.1}) m.mutable_box()->add_center(v);
    for (const double v : {0.2, 0.2, 0.4}) m.mutable_box()->add_size(v);
    const v1::CameraStream::PixelFormat formats[] = {v1::CameraStream::GRAY16, v1::CameraStream::BAYER_RGGB8,
                                                     v1::CameraStream::RGB8};
    for (int i = 0; i < 3; ++i) {
      auto* camera = m.add_cameras();
      camera->set_camera_id("cam" + std::to_string(i));
      camera->set_format(formats[i]);
      camera->set_width(16);
      camera->set_height(8);
      camera->set_bit_depth(i == 0 ? 12 : 8);
      camera->set_frame_rate_hz(100);
      auto* c = camera->mutable_calibration();
      c->set_fx(20);
      c->set_fy(21);
      c->set_cx(8);
      c->set_cy(4);
      for (const double v : {1., 0., 0., 0.1 * i, 0., 1., 0., 0., 0., 0., 1., 2.})
        c->add_camera_from_world(v);
    }
    return m;
  }

  [[nodiscard]] fs::path record_long(const v1::Manifest& m) const;

  /// Three cameras a third of the period from one another.
  [[nodiscard]] static v1::Manifest staggered_manifest() {
    v1::Manifest m = manifest();
    for (int i = 1; i < 3; ++i) {
      m.mutable_cameras(i)->set_late_s(0.01 / 3 * i);
      m.mutable_cameras(i)->set_late_sigma_s(1e-4);
    }
    return m;
  }
  [[nodiscard]] fs::path record_staggered(const v1::Manifest& m) const {
    return record(m, 9, {0, 3333333, 6666667});
  }

  /// The second camera lost frame `lost`. Frame f of every camera is evenly filled with 10 + f of 255 (of
  /// 4095 in the first: 16.06 times that), stamped each 10 ms and so much later.
  [[nodiscard]] fs::path record(const v1::Manifest& m, std::uint64_t lost = 3,
                                const std::array<std::int64_t, 3>& later_ns = {0, 1000000, 0}) const {
    fs::path folder = root_ / "session";
    fs::remove_all(folder);
    auto writer = session::SessionWriter::create(folder, m, {.min_free_bytes = 0});
    EXPECT_TRUE(writer.ok()) << writer.error().message();
    for (std::size_t camera = 0; camera < 3; ++camera) {
      for (std::uint64_t f = 0; f < 5; ++f) {
        if (camera == 1 && f == lost) continue;
        auto image = std::make_shared<Image>(ImageLayout{{16, 8}, kFormats[camera], camera == 0 ? 12 : 8});
        // Three rows of light above a black level of 4.
        for (int y = 0; y < 8; ++y) {
          const std::uint64_t level = y < 3 ? 10 + f : 4;
          if (camera == 0) {
            std::fill_n(image->row_as<std::uint16_t>(y), 16, static_cast<std::uint16_t>(level * 4095 / 255));
          } else {
            std::fill_n(image->row_as<std::byte>(y), image->layout().row_bytes(),
                        static_cast<std::byte>(level));
          }
        }
        Frame frame;
        frame.stamp.frame_id = f;
        frame.stamp.monotonic_time = {static_cast<std::int64_t>(10000000 * f) + later_ns[camera]};
        frame.image = image;
        EXPECT_TRUE(writer->write(camera, frame).ok());
      }
    }
    const auto finished = writer->finish();
    EXPECT_TRUE(finished.ok()) << finished.error().message();
    return folder;
  }
};

/// 24 frames of the manifest's size: a lamp of 30 levels in the last column above a level of 4, and from the
/// twelfth on 80 levels of flame in the upper three eighths.
fs::path SessionSceneTest::record_long(const v1::Manifest& m) const {
  fs::path folder = root_ / "long";
  auto writer = session::SessionWriter::create(folder, m, {.min_free_bytes = 0});
  EXPECT_TRUE(writer.ok()) << writer.error().message();
  const ImageSize size{static_cast<int>(m.cameras(0).width()), static_cast<int>(m.cameras(0).height())};
  for (std::size_t camera = 0; camera < 3; ++camera) {
    for (std::uint64_t f = 0; f < 24; ++f) {
      auto image = std::make_shared<Image>(ImageLayout{size, kFormats[camera], camera == 0 ? 12 : 8});
      const int channels = emberlock::channels(kFormats[camera]);
      for (int y = 0; y < size.height; ++y) {
        for (int i = 0; i < size.width * channels; ++i) {
          const int level =
              4 + (i / channels == size.width - 1 ? 30 : 0) + (f >= 12 && 8 * y < 3 * size.height ? 80 : 0);
          if (camera == 0)
            image->row_as<std::uint16_t>(y)[i] = static_cast<std::uint16_t>(level * 4095 / 255);
          else
            image->row_as<std::uint8_t>(y)[i] = static_cast<std::uint8_t>(level);
        }
      }
      Frame frame;
      frame.stamp.frame_id = f;
      frame.stamp.monotonic_time = {static_cast<std::int64_t>(10000000 * f)};
      frame.image = image;
      EXPECT_TRUE(writer->write(camera, frame).ok());
    }
  }
  EXPECT_TRUE(writer->finish().ok());
  return folder;
}

TEST_F(SessionSceneTest, TheFramesOfOneInstantBecomeViews) {
  const auto scene = load_scene(record(manifest()), {.box = {}, .frame = 1});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_EQ(scene->views.size(), 3U);
  EXPECT_EQ(scene->box.size, Eigen::Vector3d(0.2, 0.2, 0.4));
  for (const View& view : scene->views) {
    for (std::size_t i = 0; i < 3 * 16; ++i) EXPECT_NEAR(view.image->rgb[i], 11 - 4, 0.1) << view.name;
    EXPECT_NEAR(view.image->rgb.back(), 0, 0.1) << "the black level is taken out";
    EXPECT_EQ(view.camera.intrinsics.fy, 21);
    EXPECT_TRUE(view.image->origin.raw()) << "a GPU develops it itself";
  }
  EXPECT_EQ(scene->views[2].camera.camera_from_world.translation, Eigen::Vector3d(0.2, 0, 2));
}

TEST_F(SessionSceneTest, AManifestsColourMakesCamerasAlike) {
  v1::Manifest m = manifest();
  auto* colour = m.mutable_cameras(2)->mutable_colour();
  for (const double v : {0.0, 0.25, 1.0}) colour->add_response(v);  // half of what samples say, up to 127
  for (int c = 0; c < 3; ++c) colour->add_gain(2);
  const auto scene = load_scene(record(m), {.box = {}, .frame = 1});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_NEAR(scene->views[2].image->rgb[0], 11 - 4, 0.1);
  EXPECT_TRUE(scene->linearised);
  ASSERT_FALSE(scene->preprocessing.empty());
  EXPECT_EQ(scene->preprocessing[0].name, "linearise");
  EXPECT_TRUE(scene->preprocessing[0].on);
  EXPECT_THAT(scene->preprocessing[0].reason, HasSubstr("1 of 3 cameras, cam2: by the calibrated response"));
  colour->set_response(2, 0.5);
  EXPECT_THAT(load_scene(record(m)).error().message(), HasSubstr("camera cam2.colour.response"));
}

TEST_F(SessionSceneTest, OneCamerasResponseIsTheScenesAndChangesNoPicture) {
  v1::Manifest m = manifest();
  const auto plain = load_scene(record(m));
  ASSERT_TRUE(plain.ok()) << plain.error().message();
  EXPECT_EQ(plain->response, nullptr);
  *m.mutable_cameras(1)->mutable_colour()->mutable_spectral() = message_of(standard_response());
  const auto scene = load_scene(record(m));
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_NE(scene->response, nullptr);
  EXPECT_EQ(*scene->response, standard_response());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(scene->views[i].image->rgb, plain->views[i].image->rgb);
  *m.mutable_cameras(2)->mutable_colour()->mutable_spectral() = message_of(cie_1931_observer());
  const auto differ = load_scene(record(m));
  ASSERT_FALSE(differ.ok());
  EXPECT_THAT(differ.error().message(), testing::AllOf(HasSubstr("cam1"), HasSubstr("cam2")));
}

TEST_F(SessionSceneTest, FramesWithoutFlameTellTheBackground) {
  const fs::path folder = record_long(manifest());
  const auto scene = load_scene(folder, {.box = {}, .frame = 20});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  for (const View& view : scene->views) {
    EXPECT_NEAR(view.image->rgb[0], 80, 0.1) << view.name;
    EXPECT_NEAR(view.image->rgb[3 * 15], 80, 0.1) << "a lamp stands there";
    EXPECT_NEAR(view.image->rgb.back(), 0, 0.1);
  }
  const auto background = std::find_if(scene->preprocessing.begin(), scene->preprocessing.end(),
                                       [](const PreprocessStep& step) { return step.name == "background"; });
  ASSERT_NE(background, scene->preprocessing.end());
  EXPECT_TRUE(background->on);
  EXPECT_THAT(background->reason, HasSubstr("8 frames without flame"));

  SceneOptions level;
  level.frame = 20;
  ASSERT_TRUE(parse_background("level", level.frames).ok());
  EXPECT_NEAR(load_scene(folder, level)->views[0].image->rgb[3 * 15], 110, 0.2) << "the lamp is left in";
  ASSERT_TRUE(parse_background("0-4", level.frames).ok());
  EXPECT_NEAR(load_scene(folder, level)->views[0].image->rgb[3 * 15], 80, 0.1);
  ASSERT_TRUE(parse_background("30-40", level.frames).ok());
  EXPECT_THAT(load_scene(folder, level).error().message(), HasSubstr("camera cam0: has no frame 40"));
}

TEST_F(SessionSceneTest, NoFrameIsDecodedTwiceForTheBackground) {
  v1::Manifest m = manifest();
  for (auto& camera : *m.mutable_cameras()) {
    camera.set_width(78);
    camera.set_height(58);
  }
  const fs::path folder = record_long(m);
  SceneOptions options;
  options.frame = 20;
  const auto decoding = [&] {  // of the colour camera
    return allocations_of(std::size_t{78} * 58 * 3, [&] { EXPECT_TRUE(load_scene(folder, options).ok()); });
  };
  const int flame_and_dark = decoding();
  options.frames.background = FrameOptions::Background::level;
  const int flame = decoding();
  EXPECT_GE(flame, 1);
  EXPECT_EQ(flame_and_dark, 9 * flame) << "the flame's and eight without flame";
}

TEST(FrameOptions, WordsThatMeanNothingAreRefused) {
  FrameOptions options;
  for (const char* word : {"", "dark", "5-3", "0-33", "-1", "1-", "99999999999"})
    EXPECT_THAT(parse_background(word, options).error().message(), HasSubstr("--background")) << word;
  for (const char* word : {"", "on", "-1e-4", "0.5", "1e-4:left", "1e-4:", "nan"})
    EXPECT_THAT(parse_smear(word, options).error().message(), HasSubstr("--smear")) << word;
  ASSERT_TRUE(parse_smear("2e-4:above", options).ok());
  EXPECT_EQ(options.develop.smear.path, SmearPath::rows_above);
  EXPECT_EQ(options.develop.smear.fraction[2], 2e-4);
}

TEST_F(SessionSceneTest, ALostFramesNeighbourStandsInWithinOnePeriod) {
  const auto scene = load_scene(record(manifest()), {.box = {}, .frame = 3});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_NEAR(scene->views[1].image->rgb[0], 12 - 4, 0.1) << "frame 2, 9 ms before";
}

TEST_F(SessionSceneTest, ACameraThatIsAMillisecondTooSlowIsNamed) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(120);  // a period of 8.3 ms: 9 ms is too far
  const auto scene = load_scene(record(m), {.box = {}, .frame = 3});
  ASSERT_FALSE(scene.ok());
  EXPECT_THAT(scene.error().message(), HasSubstr("camera cam1"));
}

TEST_F(SessionSceneTest, WithoutAFrameTheMiddleOneIsTaken) {
  const auto scene = load_scene(record(manifest()));
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_NEAR(scene->views[0].image->rgb[0], 12 - 4, 0.1);
}

TEST_F(SessionSceneTest, WhereACameraLostTheMiddleTheNearestInstantThatAllHaveIsTaken) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(120);  // a period of 8.3 ms: a neighbour 9 ms off is too far
  const auto scene = load_scene(record(m, 2));
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  for (const View& view : scene->views) EXPECT_NEAR(view.image->rgb[0], 13 - 4, 0.1) << view.name;
}

TEST_F(SessionSceneTest, ACameraWithoutCalibrationIsNamed) {
  v1::Manifest m = manifest();
  m.mutable_cameras(2)->clear_calibration();
  const auto scene = load_scene(record(m));
  ASSERT_FALSE(scene.ok());
  EXPECT_THAT(scene.error().message(), HasSubstr("camera cam2 is not calibrated"));
}

TEST_F(SessionSceneTest, ASingularPoseNamesItsCamera) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->mutable_calibration()->set_camera_from_world(0, 0);
  EXPECT_THAT(load_scene(record(m)).error().message(), HasSubstr("cameras[1].calibration.camera_from_world"));
}

TEST_F(SessionSceneTest, AFrameBeyondTheRecordingIsRefused) {
  EXPECT_THAT(load_scene(record(manifest()), {.box = {}, .frame = 5}).error().message(),
              HasSubstr("5 frames"));
}

TEST_F(SessionSceneTest, TimesBringLatenessAndAverages) {
  const fs::path folder = record(manifest());
  const auto plain = load_scene(folder, {.box = {}, .frame = 1});
  ASSERT_TRUE(plain.ok());
  EXPECT_EQ(plain->views[1].lateness, Seconds(0));
  EXPECT_FALSE(plain->views[1].average);
  v1::ShutterTimes times;
  for (int i = 0; i < 3; ++i) {
    auto* camera = times.add_cameras();
    camera->set_camera_id("cam" + std::to_string(i));
    camera->set_sigma_s(1e-5);
    for (int f = 0; f < (i == 1 ? 4 : 5); ++f) camera->add_late_s(1e-3 * i + 1e-4 * f);
  }
  ASSERT_TRUE(session::write_shutter_times(folder, times).ok());
  const auto scene = load_scene(folder, {.box = {}, .frame = 3});
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_NEAR(scene->views[0].lateness.value(), 3e-4, 1e-12);
  EXPECT_NEAR(scene->views[1].lateness.value(), 1.2e-3 - 10e-3, 1e-9) << "frame 2 stands in, a period early";
  EXPECT_NEAR(scene->views[2].lateness.value(), 2.3e-3, 1e-12);
  EXPECT_NEAR(scene->views[2].lateness_sigma.value(), 1e-5, 1e-12);
  ASSERT_TRUE(scene->views[2].average);
  EXPECT_NEAR(scene->views[2].average->rgb[0], 8, 0.1) << "of 6, 7, 8, 9 and 10";
}

TEST_F(SessionSceneTest, StaggeredCamerasBringTheirNearestFrameAndItsLateness) {
  const fs::path folder = record_staggered(staggered_manifest());
  const auto frame = load_scene(folder, {.box = {}, .frame = 2});
  ASSERT_TRUE(frame.ok()) << frame.error().message();
  const double third = 0.01 / 3;
  EXPECT_NEAR(frame->views[0].lateness.value(), 0, 1e-12);
  EXPECT_NEAR(frame->views[1].lateness.value(), third, 1e-9);
  EXPECT_NEAR(frame->views[2].lateness.value(), -third, 1e-9) << "of frame 1";
  EXPECT_NEAR(frame->views[2].image->rgb[0], 7, 0.1);
  EXPECT_EQ(frame->views[2].lateness_sigma, Seconds(1e-4));
  EXPECT_TRUE(frame->views[2].average);
  EXPECT_NEAR(frame->time->value(), 0.02, 1e-12);
  // The instants of a period are all alike but for who films when.
  for (int k = 0; k < 30; ++k) {
    const double part = k / 30.0 + 1e-3;
    const auto between = load_scene(folder, {.box = {}, .frame = 2, .part = part});
    ASSERT_TRUE(between.ok()) << between.error().message();
    EXPECT_NEAR(between->time->value(), 0.02 + 0.01 * part, 1e-9);
    for (int v = 0; v < 3; ++v) {
      const View& view = between->views[static_cast<std::size_t>(v)];
      EXPECT_NEAR(view.lateness.value(),
                  wrap_symmetric(Seconds(third * v - 0.01 * part), Seconds(0.01)).value(), 1e-9);
      const double filmed = between->time->value() + view.lateness.value();
      const double frame_then = std::round((filmed - third * v) / 0.01);
      EXPECT_NEAR(view.image->rgb[0], 6 + frame_then, 0.1) << part << ", view " << v;
    }
  }
}

TEST_F(SessionSceneTest, BetweenFramesOnlyStaggeredCamerasOfOneRateTellAnything) {
  const auto message = [](const fs::path& folder, std::size_t frame, double part) {
    return load_scene(folder, {.box = {}, .frame = frame, .part = part}).error().message();
  };
  EXPECT_THAT(message(record(manifest()), 2, 0.5), HasSubstr("no camera films in 100 %"));
  v1::Manifest m = staggered_manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(90);
  EXPECT_THAT(message(record_staggered(m), 2, 0.5), HasSubstr("films at 90 frames/s"));
  m.mutable_cameras(1)->set_frame_rate_hz(0);
  EXPECT_THAT(message(record_staggered(m), 2, 0.5), HasSubstr("films at 0 frames/s"));
  const fs::path folder = record_staggered(staggered_manifest());
  EXPECT_THAT(message(folder, 0, 0), HasSubstr("within half a frame period"));
  EXPECT_THAT(message(folder, 4, 0.9), HasSubstr("camera cam0: has no complete frame within half"))
      << message(folder, 4, 0.9);
}

TEST_F(SessionSceneTest, TimesOfAnotherSessionAreRefused) {
  const fs::path folder = record(manifest());
  std::ofstream(folder / "times.json") << R"({"cameras": [{"cameraId": "cam0", "lateS": [0]}]})";
  EXPECT_THAT(load_scene(folder).error().message(), HasSubstr("times.json"));
}

TEST_F(SessionSceneTest, ASessionWithoutABoxNeedsOne) {
  v1::Manifest m = manifest();
  m.clear_box();
  EXPECT_THAT(load_scene(record(m)).error().message(), HasSubstr("--box"));
}

}  // namespace
}  // namespace emberlock::recon
