// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/scene.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "recon/calibrate/rig.h"
#include "session/reader.h"
#include "session/shutter_times.h"
#include "session/writer.h"
#include "tests/support/count_allocations.h"
#include "tests/support/pictures.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"
#include "tests/support/small_flame.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;

class SceneTest : public testing::Test {
 protected:
  SceneTest() {
    write_pgm("a.pgm", 255);
    write_pgm("b.pgm", 1023);
  }

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
  const test::TempFolder folder_;
  const fs::path root_ = folder_.path();
};

TEST_F(SceneTest, PicturesOfEveryDepthBecomeRadiance) {
  const auto scene = value_of(load(valid()));
  ASSERT_EQ(scene.views.size(), 2U);
  EXPECT_EQ(scene.views[1].name, "b.pgm") << "the extension was found";
  for (const View& view : scene.views) {
    EXPECT_EQ(view.role, ViewRole::input);
    EXPECT_EQ(view.image->size, (ImageSize{4, 2}));
    for (std::size_t i = 0; i < 21; ++i) EXPECT_EQ(view.image->rgb[i], 0);
    for (std::size_t i = 21; i < 24; ++i) EXPECT_FLOAT_EQ(view.image->rgb[i], 255);
  }
}

TEST_F(SceneTest, ABoxFromTheCommandLineStandsBeforeTheFiles) {
  const auto scene = value_of(load(valid(), {.box = Box{{1, 2, 3}, {4, 5, 6}}, .frame = {}}));
  EXPECT_EQ(scene.box.center, Eigen::Vector3d(1, 2, 3));
}

TEST_F(SceneTest, WithoutABoxTheErrorSaysHowToGiveOne) {
  json document = valid();
  document.erase("box");
  EXPECT_THAT(load(document), FailsWith("--box"));
  EXPECT_TRUE(load(document, {.box = Box{{0, 0, 0}, {1, 1, 1}}, .frame = {}}).ok());
}

TEST_F(SceneTest, AMissingPictureNamesItsFrame) {
  json document = valid();
  document["frames"][1]["file_path"] = "lost.png";
  const auto scene = load(document);
  ASSERT_THAT(scene, FailsWith("frames[1].file_path", "lost.png"));
  EXPECT_EQ(scene.error().kind, ErrorKind::bad_input);
}

TEST_F(SceneTest, ATruncatedPictureNamesItsFrame) {
  fs::resize_file(root_ / "a.pgm", fs::file_size(root_ / "a.pgm") - 3);
  EXPECT_THAT(load(valid()), FailsWith("frames[0].file_path"));
}

TEST_F(SceneTest, PicturesOfAnotherSizeAreRefused) {
  json document = valid();
  document["frames"][1]["w"] = 5;
  EXPECT_THAT(load(document), FailsWith("frames[1].w, h"));
}

TEST_F(SceneTest, WhatIsNeitherFileNorSessionIsNamed) {
  EXPECT_THAT(load_scene(root_), FailsWith("no session"));
  EXPECT_THAT(load_scene(root_ / "absent.json"), FailsWith("absent.json"));
  EXPECT_FALSE(load(valid(), {.box = {}, .frame = 3}).ok()) << "one instant has no frames to choose from";
}

TEST_F(SceneTest, HoldingOutChangesRoles) {
  auto scene = load(valid());
  ASSERT_TRUE(hold_out(*scene, {1}).ok());
  EXPECT_EQ(scene->views[1].role, ViewRole::held_out);
  EXPECT_THAT(hold_out(*scene, {2}), FailsWith("--hold-out 2"));
  EXPECT_FALSE(hold_out(*scene, {-1}).ok());
  EXPECT_THAT(hold_out(*scene, {0}), FailsWith("every view"));
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
  [[nodiscard]] static v1::Manifest manifest(ImageSize size = {16, 8}) {
    v1::Manifest m = test::manifest_of(
        {{size, PixelFormat::gray16, 12}, {size, PixelFormat::bayer_rggb8, 8}, {size, PixelFormat::rgb8, 8}});
    for (const double v : {0.0, 0.0, 0.1}) m.mutable_box()->add_center(v);
    for (const double v : {0.2, 0.2, 0.4}) m.mutable_box()->add_size(v);
    for (int i = 0; i < 3; ++i) {
      auto* c = m.mutable_cameras(i)->mutable_calibration();
      c->set_fx(20);
      c->set_fy(21);
      c->set_cx(8);
      c->set_cy(4);
      for (const double v : {1., 0., 0., 0.1 * i, 0., 1., 0., 0., 0., 0., 1., 2.})
        c->add_camera_from_world(v);
    }
    return m;
  }
  /// Three cameras a third of the period from one another.
  [[nodiscard]] static v1::Manifest staggered_manifest() {
    v1::Manifest m = manifest();
    for (int i = 1; i < 3; ++i) {
      m.mutable_cameras(i)->set_late_s(0.01 / 3 * i);
      m.mutable_cameras(i)->set_late_sigma_s(1e-4);
    }
    return m;
  }

  /// Frame f of each camera, stamped each 10 ms and so much later, shows level(f, x, y) of 255; the second
  /// camera lost frame `lost`.
  template <class Level>
  [[nodiscard]] fs::path record_levels(const v1::Manifest& m, std::uint64_t frames, const Level& level,
                                       std::uint64_t lost = 99,
                                       const std::array<std::int64_t, 3>& later_ns = {}) const {
    fs::path folder = root_ / "session";
    fs::remove_all(folder);
    auto writer = value_of(session::SessionWriter::create(folder, m, {.min_free_bytes = 0}));
    for (std::size_t camera = 0; camera < 3; ++camera)
      for (std::uint64_t f = 0; f < frames; ++f) {
        if (camera == 1 && f == lost) continue;
        const ImageLayout layout = value_of(session::layout_of(m.cameras(static_cast<int>(camera))));
        Frame frame;
        frame.stamp.frame_id = f;
        frame.stamp.monotonic_time = {static_cast<std::int64_t>(10000000 * f) + later_ns[camera]};
        frame.image = std::make_shared<Image>(
            image_of(layout, [&](int x, int y, int) { return level(f, x, y) * layout.white() / 255; }));
        EXPECT_TRUE(writer.write(camera, frame).ok());
      }
    EXPECT_TRUE(writer.finish().ok());
    return folder;
  }
  /// Three rows of light, 10 + f of 255, above a black level of 4.
  [[nodiscard]] fs::path record(const v1::Manifest& m, std::uint64_t lost = 3,
                                const std::array<std::int64_t, 3>& later_ns = {0, 1000000, 0}) const {
    const auto level = [](std::uint64_t f, int, int y) { return y < 3 ? 10 + static_cast<int>(f) : 4; };
    return record_levels(m, 5, level, lost, later_ns);
  }
  [[nodiscard]] fs::path record_staggered(const v1::Manifest& m) const {
    return record(m, 9, {0, 3333333, 6666667});
  }
  /// 24 frames: a lamp of 30 levels in the last column above a level of 4, and from the twelfth on 80 levels
  /// of flame in the upper three eighths.
  [[nodiscard]] fs::path record_long(const v1::Manifest& m) const {
    const int width = static_cast<int>(m.cameras(0).width());
    const int height = static_cast<int>(m.cameras(0).height());
    return record_levels(m, 24, [&](std::uint64_t f, int x, int y) {
      return 4 + (x == width - 1 ? 30 : 0) + (f >= 12 && 8 * y < 3 * height ? 80 : 0);
    });
  }
  /// Loads an instant of the manifest's five frames.
  [[nodiscard]] Scene scene_of(const v1::Manifest& m, std::optional<std::size_t> frame = {}) const {
    return value_of(load_scene(record(m), {.box = {}, .frame = frame}));
  }
};

TEST_F(SessionSceneTest, TheFramesOfOneInstantBecomeViews) {
  const Scene scene = scene_of(manifest(), 1);
  ASSERT_EQ(scene.views.size(), 3U);
  EXPECT_EQ(scene.box.size, Eigen::Vector3d(0.2, 0.2, 0.4));
  for (const View& view : scene.views) {
    for (std::size_t i = 0; i < 3 * 16; ++i) EXPECT_NEAR(view.image->rgb[i], 11 - 4, 0.1) << view.name;
    EXPECT_NEAR(view.image->rgb.back(), 0, 0.1) << "the black level is taken out";
    EXPECT_EQ(view.camera.intrinsics.fy, 21);
    EXPECT_TRUE(view.image->origin.raw()) << "a GPU develops it itself";
  }
  EXPECT_EQ(scene.views[2].camera.camera_from_world.translation, Eigen::Vector3d(0.2, 0, 2));
}

TEST_F(SessionSceneTest, AManifestsColourMakesCamerasAlike) {
  v1::Manifest m = manifest();
  auto* colour = m.mutable_cameras(2)->mutable_colour();
  for (const double v : {0.0, 0.25, 1.0}) colour->add_response(v);  // half of what samples say, up to 127
  for (int c = 0; c < 3; ++c) colour->add_gain(2);
  const Scene scene = scene_of(m, 1);
  EXPECT_NEAR(scene.views[2].image->rgb[0], 11 - 4, 0.1);
  EXPECT_TRUE(scene.linearised);
  ASSERT_FALSE(scene.preprocessing.empty());
  EXPECT_EQ(scene.preprocessing[0].name, "linearise");
  EXPECT_TRUE(scene.preprocessing[0].on);
  EXPECT_THAT(scene.preprocessing[0].reason, HasSubstr("1 of 3 cameras, cam2: by the calibrated response"));
  colour->set_response(2, 0.5);
  EXPECT_THAT(load_scene(record(m)), FailsWith("camera cam2.colour.response"));
}

TEST_F(SessionSceneTest, OneCamerasResponseIsTheScenesAndChangesNoPicture) {
  v1::Manifest m = manifest();
  const Scene plain = scene_of(m);
  EXPECT_EQ(plain.response, nullptr);
  *m.mutable_cameras(1)->mutable_colour()->mutable_spectral() = message_of(standard_response());
  const Scene scene = scene_of(m);
  ASSERT_NE(scene.response, nullptr);
  EXPECT_EQ(*scene.response, standard_response());
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(scene.views[i].image->rgb, plain.views[i].image->rgb);
  *m.mutable_cameras(2)->mutable_colour()->mutable_spectral() = message_of(cie_1931_observer());
  EXPECT_THAT(load_scene(record(m)), FailsWith("cam1", "cam2"));
}

TEST_F(SessionSceneTest, FramesWithoutFlameTellTheBackground) {
  const fs::path folder = record_long(manifest());
  const auto scene = value_of(load_scene(folder, {.box = {}, .frame = 20}));
  for (const View& view : scene.views) {
    EXPECT_NEAR(view.image->rgb[0], 80, 0.1) << view.name;
    EXPECT_NEAR(view.image->rgb[3 * 15], 80, 0.1) << "a lamp stands there";
    EXPECT_NEAR(view.image->rgb.back(), 0, 0.1);
  }
  const auto background = std::find_if(scene.preprocessing.begin(), scene.preprocessing.end(),
                                       [](const PreprocessStep& step) { return step.name == "background"; });
  ASSERT_NE(background, scene.preprocessing.end());
  EXPECT_TRUE(background->on);
  EXPECT_THAT(background->reason, HasSubstr("8 frames without flame"));

  SceneOptions level;
  level.frame = 20;
  ASSERT_TRUE(parse_background("level", level.frames).ok());
  EXPECT_NEAR(load_scene(folder, level)->views[0].image->rgb[3 * 15], 110, 0.2) << "the lamp is left in";
  ASSERT_TRUE(parse_background("0-4", level.frames).ok());
  EXPECT_NEAR(load_scene(folder, level)->views[0].image->rgb[3 * 15], 80, 0.1);
  ASSERT_TRUE(parse_background("30-40", level.frames).ok());
  EXPECT_THAT(load_scene(folder, level), FailsWith("camera cam0: has no frame 40"));
}

TEST_F(SessionSceneTest, NoFrameIsDecodedTwiceForTheBackground) {
  const fs::path folder = record_long(manifest({78, 58}));
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
    EXPECT_THAT(parse_background(word, options), FailsWith("--background")) << word;
  for (const char* word : {"", "on", "-1e-4", "0.5", "1e-4:left", "1e-4:", "nan"})
    EXPECT_THAT(parse_smear(word, options), FailsWith("--smear")) << word;
  ASSERT_TRUE(parse_smear("2e-4:above", options).ok());
  EXPECT_EQ(options.develop.smear.path, SmearPath::rows_above);
  EXPECT_EQ(options.develop.smear.fraction[2], 2e-4);
}

TEST_F(SessionSceneTest, ALostFramesNeighbourStandsInWithinOnePeriod) {
  const Scene scene = scene_of(manifest(), 3);
  EXPECT_NEAR(scene.views[1].image->rgb[0], 12 - 4, 0.1) << "frame 2, 9 ms before";
}

TEST_F(SessionSceneTest, ACameraThatIsAMillisecondTooSlowIsNamed) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(120);  // a period of 8.3 ms: 9 ms is too far
  EXPECT_THAT(load_scene(record(m), {.box = {}, .frame = 3}), FailsWith("camera cam1"));
}

TEST_F(SessionSceneTest, WithoutAFrameTheMiddleOneIsTaken) {
  const Scene scene = scene_of(manifest());
  EXPECT_NEAR(scene.views[0].image->rgb[0], 12 - 4, 0.1);
}

TEST_F(SessionSceneTest, WhereACameraLostTheMiddleTheNearestInstantThatAllHaveIsTaken) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(120);  // a period of 8.3 ms: a neighbour 9 ms off is too far
  const auto scene = value_of(load_scene(record(m, 2)));
  for (const View& view : scene.views) EXPECT_NEAR(view.image->rgb[0], 13 - 4, 0.1) << view.name;
}

TEST_F(SessionSceneTest, ACameraWithoutCalibrationIsNamed) {
  v1::Manifest m = manifest();
  m.mutable_cameras(2)->clear_calibration();
  EXPECT_THAT(load_scene(record(m)), FailsWith("camera cam2 is not calibrated"));
}

TEST_F(SessionSceneTest, ASingularPoseNamesItsCamera) {
  v1::Manifest m = manifest();
  m.mutable_cameras(1)->mutable_calibration()->set_camera_from_world(0, 0);
  EXPECT_THAT(load_scene(record(m)), FailsWith("cameras[1].calibration.camera_from_world"));
}

TEST_F(SessionSceneTest, AFrameBeyondTheRecordingIsRefused) {
  EXPECT_THAT(load_scene(record(manifest()), {.box = {}, .frame = 5}), FailsWith("5 frames"));
}

TEST_F(SessionSceneTest, TimesBringLatenessAndAverages) {
  const fs::path folder = record(manifest());
  const auto plain = value_of(load_scene(folder, {.box = {}, .frame = 1}));
  EXPECT_EQ(plain.views[1].lateness, Seconds(0));
  EXPECT_FALSE(plain.views[1].average);
  v1::ShutterTimes times;
  for (int i = 0; i < 3; ++i) {
    auto* camera = times.add_cameras();
    camera->set_camera_id("cam" + std::to_string(i));
    camera->set_sigma_s(1e-5);
    for (int f = 0; f < (i == 1 ? 4 : 5); ++f) camera->add_late_s(1e-3 * i + 1e-4 * f);
  }
  ASSERT_TRUE(session::write_shutter_times(folder, times).ok());
  const auto scene = value_of(load_scene(folder, {.box = {}, .frame = 3}));
  EXPECT_NEAR(scene.views[0].lateness.value(), 3e-4, 1e-12);
  EXPECT_NEAR(scene.views[1].lateness.value(), 1.2e-3 - 10e-3, 1e-9) << "frame 2 stands in, a period early";
  EXPECT_NEAR(scene.views[2].lateness.value(), 2.3e-3, 1e-12);
  EXPECT_NEAR(scene.views[2].lateness_sigma.value(), 1e-5, 1e-12);
  ASSERT_TRUE(scene.views[2].average);
  EXPECT_NEAR(scene.views[2].average->rgb[0], 8, 0.1) << "of 6, 7, 8, 9 and 10";
}

TEST_F(SessionSceneTest, StaggeredCamerasBringTheirNearestFrameAndItsLateness) {
  const fs::path folder = record_staggered(staggered_manifest());
  const auto frame = value_of(load_scene(folder, {.box = {}, .frame = 2}));
  const double third = 0.01 / 3;
  EXPECT_NEAR(frame.views[0].lateness.value(), 0, 1e-12);
  EXPECT_NEAR(frame.views[1].lateness.value(), third, 1e-9);
  EXPECT_NEAR(frame.views[2].lateness.value(), -third, 1e-9) << "of frame 1";
  EXPECT_NEAR(frame.views[2].image->rgb[0], 7, 0.1);
  EXPECT_EQ(frame.views[2].lateness_sigma, Seconds(1e-4));
  EXPECT_TRUE(frame.views[2].average);
  EXPECT_NEAR(frame.time->value(), 0.02, 1e-12);
  // The instants of a period are all alike but for who films when.
  for (int k = 0; k < 30; ++k) {
    const double part = k / 30.0 + 1e-3;
    const auto between = value_of(load_scene(folder, {.box = {}, .frame = 2, .part = part}));
    EXPECT_NEAR(between.time->value(), 0.02 + 0.01 * part, 1e-9);
    for (int v = 0; v < 3; ++v) {
      const View& view = between.views[static_cast<std::size_t>(v)];
      EXPECT_NEAR(view.lateness.value(),
                  wrap_symmetric(Seconds(third * v - 0.01 * part), Seconds(0.01)).value(), 1e-9);
      const double filmed = between.time->value() + view.lateness.value();
      const double frame_then = std::round((filmed - third * v) / 0.01);
      EXPECT_NEAR(view.image->rgb[0], 6 + frame_then, 0.1) << part << ", view " << v;
    }
  }
}

TEST_F(SessionSceneTest, BetweenFramesOnlyStaggeredCamerasOfOneRateTellAnything) {
  const auto between = [](const fs::path& folder, std::size_t frame, double part) {
    return load_scene(folder, {.box = {}, .frame = frame, .part = part});
  };
  EXPECT_THAT(between(record(manifest()), 2, 0.5), FailsWith("no camera films in 100 %"));
  v1::Manifest m = staggered_manifest();
  m.mutable_cameras(1)->set_frame_rate_hz(90);
  EXPECT_THAT(between(record_staggered(m), 2, 0.5), FailsWith("films at 90 frames/s"));
  m.mutable_cameras(1)->set_frame_rate_hz(0);
  EXPECT_THAT(between(record_staggered(m), 2, 0.5), FailsWith("films at 0 frames/s"));
  const fs::path folder = record_staggered(staggered_manifest());
  EXPECT_THAT(between(folder, 0, 0), FailsWith("within half a frame period"));
  EXPECT_THAT(between(folder, 4, 0.9), FailsWith("camera cam0: has no complete frame within half"));
}

TEST_F(SessionSceneTest, TimesOfAnotherSessionAreRefused) {
  const fs::path folder = record(manifest());
  std::ofstream(folder / "times.json") << R"({"cameras": [{"cameraId": "cam0", "lateS": [0]}]})";
  EXPECT_THAT(load_scene(folder), FailsWith("times.json"));
}

TEST_F(SessionSceneTest, ASessionWithoutABoxNeedsOne) {
  v1::Manifest m = manifest();
  m.clear_box();
  EXPECT_THAT(load_scene(record(m)), FailsWith("--box"));
}

}  // namespace
}  // namespace emberlock::recon
