// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/rig_formats.h"

#include <filesystem>
#include <fstream>
#include <map>
#include <string>

#include <gmock/gmock.h>
#include <opencv2/core.hpp>

#include "base/file.h"
#include "tests/support/board_rig.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;

v1::Rig some_rig() {
  const test::BoardRig rig = test::board_rig({.cameras = 3, .instants = 1});
  v1::Rig file;
  file.set_format_version(1);
  for (std::size_t c = 0; c < rig.cameras.size(); ++c) {
    v1::RigCamera& camera = *file.add_cameras();
    camera.set_camera_id(rig.sightings.cameras[c].id);
    camera.set_width(640);
    camera.set_height(480);
    CameraModel model = rig.cameras[c];
    if (c == 1) model.intrinsics.distortion.k3 = 0.01;
    *camera.mutable_calibration() = calibration_of(model);
  }
  *file.mutable_box() = message_of({{0.01, 0.02, 0.03}, {0.1, 0.2, 0.3}});
  return file;
}

void expect_same(const v1::Rig& a, const v1::Rig& b) {
  ASSERT_EQ(a.cameras_size(), b.cameras_size());
  for (int i = 0; i < a.cameras_size(); ++i) {
    const v1::Calibration& c = a.cameras(i).calibration();
    const v1::Calibration& d = b.cameras(i).calibration();
    EXPECT_EQ(a.cameras(i).camera_id(), b.cameras(i).camera_id());
    EXPECT_EQ(a.cameras(i).width(), b.cameras(i).width());
    EXPECT_EQ(a.cameras(i).height(), b.cameras(i).height());
    const double from[] = {c.fx(), c.fy(), c.cx(), c.cy(), c.k1(), c.k2(), c.p1(), c.p2(), c.k3()};
    const double to[] = {d.fx(), d.fy(), d.cx(), d.cy(), d.k1(), d.k2(), d.p1(), d.p2(), d.k3()};
    for (int k = 0; k < 9; ++k) EXPECT_NEAR(from[k], to[k], 1e-9) << i << ' ' << k;
    ASSERT_EQ(d.camera_from_world_size(), 12);
    for (int k = 0; k < 12; ++k) EXPECT_NEAR(c.camera_from_world(k), d.camera_from_world(k), 1e-12);
  }
}

class RigFormats : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(export_rig(some_rig(), folder_).ok()); }
  const test::TempFolder temp_;
  const fs::path folder_ = temp_ / "rig";
};

TEST_F(RigFormats, EveryFormatComesBack) {
  const v1::Rig rig = some_rig();
  for (const char* name : {"rig.json", "transforms.json", "opencv", "colmap", ""}) {
    SCOPED_TRACE(name);
    const auto back = value_of(import_rig(folder_ / name));
    expect_same(rig, back);
    EXPECT_EQ(back.has_box(), name != std::string("opencv") && name != std::string("colmap"));
  }
  const auto one = value_of(import_rig(folder_ / "opencv" / "cam01.yml"));
  EXPECT_EQ(one.cameras_size(), 1);
}

TEST_F(RigFormats, OpencvCountsPixelsFromTheirCentres) {
  const v1::Rig rig = some_rig();
  const std::string yaml = opencv_yaml(rig.cameras(0));
  const auto back = value_of(parse_opencv(yaml, "cam00", "cam00.yml"));
  EXPECT_NEAR(back.calibration().cx(), rig.cameras(0).calibration().cx(), 1e-12);
  // OpenCV's published calibration of the same kind.
  const auto published = value_of(import_rig("/usr/share/doc/opencv-doc/examples/data/left_intrinsics.yml"));
  EXPECT_NEAR(published.cameras(0).calibration().fx(), 535.91573396163199, 1e-12);
  EXPECT_NEAR(published.cameras(0).calibration().cx(), 342.28315473308373 + 0.5, 1e-12);
  EXPECT_EQ(published.cameras(0).calibration().camera_from_world_size(), 0);
}

TEST(RigFiles, ColmapsModelsAreRead) {
  const auto rig = value_of(parse_colmap(
      "# cameras\n1 SIMPLE_RADIAL 640 480 500 320 240 0.1\n7 PINHOLE 640 480 500 510 320 240\n",
      "# images\n1 1 0 0 0 0.1 0.2 0.3 7 left/0001.png\n1 2 3\n2 0.5 0.5 0.5 0.5 0 0 1 1 right.png\n\n",
      "model"));
  ASSERT_EQ(rig.cameras_size(), 2);
  EXPECT_EQ(rig.cameras(0).camera_id(), "left");
  EXPECT_EQ(rig.cameras(0).calibration().fy(), 510);
  EXPECT_EQ(rig.cameras(1).camera_id(), "right");
  EXPECT_EQ(rig.cameras(1).calibration().k1(), 0.1);
  EXPECT_EQ(rig.cameras(1).calibration().fy(), 500);
}

TEST(RigFiles, BadFilesNameTheLineAndTheRemedy) {
  struct Case {
    const char *cameras, *images, *words;
  };
  for (const Case& bad : {Case{"1 FISHEYE 640 480 1 2 3", "", "cameras.txt, line 1"},
                          Case{"1 PINHOLE 640 480 500 510 320", "", "PINHOLE has 4"},
                          Case{"1 PINHOLE 640 480 500 x 320 240", "", "\"x\" is no number"},
                          Case{"1 PINHOLE 0 480 500 500 320 240", "", "out of range"},
                          Case{"1 FULL_OPENCV 640 480 500 500 320 240 0 0 0 0 0 1 0 0", "", "k4, k5 and k6"},
                          Case{"1 PINHOLE 640 480 500 500 320 240", "1 2 0 0 0 0 0 0 1 a.png", "quaternion"},
                          Case{"1 PINHOLE 640 480 500 500 320 240", "1 1 0 0 0 0 0 0 2 a.png", "no camera 2"},
                          Case{"1 PINHOLE 640 480 500 500 320 240", "1 1 0 0", "is no image"},
                          Case{"1 PINHOLE 640 480 500 500 320 240", "1 1 0 0 0 0 0 0 1 ..", "camera id"},
                          Case{"", "", "no cameras"}}) {
    const auto rig = parse_colmap(bad.cameras, bad.images, "model");
    ASSERT_THAT(rig, FailsWith(bad.words)) << bad.words;
    EXPECT_FALSE(rig.error().remedy.empty());
  }
  EXPECT_THAT(parse_opencv("nothing of the kind", "c", "c.yml"), FailsWith("c.yml"));
  EXPECT_THAT(parse_opencv("%YAML:1.0\n---\na: 1\n", "c", "c.yml"), FailsWith("camera_matrix"));
  EXPECT_FALSE(import_rig("/nowhere/rig.json").ok());
  EXPECT_THAT(session::parse_rig("{}", "rig.json"), FailsWith("format_version"));
  EXPECT_THAT(
      session::parse_rig(R"({"format_version": 1, "cameras": [{"camera_id": "a", "width": 4, "height": 4,
      "calibration": {"sigma": [1]}}]})",
                         "rig.json"),
      FailsWith("sigma"));
}

TEST(ApplyRig, ASessionsCamerasGetWhatTheRigKnows) {
  v1::Rig rig = some_rig();
  rig.mutable_cameras(0)->mutable_colour()->add_gain(2);
  rig.mutable_cameras(2)->clear_calibration();
  v1::Manifest manifest;
  for (const char* id : {"cam02", "cam00"}) {
    v1::CameraStream& stream = *manifest.add_cameras();
    stream.set_camera_id(id);
    stream.set_width(640);
    stream.set_height(480);
  }
  manifest.mutable_cameras(0)->mutable_calibration()->set_fx(77);
  ASSERT_TRUE(apply_rig(manifest, rig, "rig.json").ok());
  EXPECT_EQ(manifest.cameras(0).calibration().fx(), 77) << "what the rig doesn't know stays";
  EXPECT_EQ(manifest.cameras(1).calibration().fx(), rig.cameras(0).calibration().fx());
  EXPECT_EQ(manifest.cameras(1).colour().gain(0), 2);
  EXPECT_EQ(manifest.box().size(2), 0.3);
}

TEST(ApplyRig, WhatDoesntFitNamesBothAndChangesNothing) {
  v1::Manifest manifest;
  v1::CameraStream& stream = *manifest.add_cameras();
  stream.set_camera_id("cam00");
  stream.set_width(1280);
  stream.set_height(720);
  EXPECT_THAT(apply_rig(manifest, some_rig(), "rig.json"), FailsWith("640 x 480", "1280 x 720"));
  EXPECT_FALSE(manifest.cameras(0).has_calibration());
  manifest.mutable_cameras(0)->set_camera_id("camX");
  EXPECT_THAT(apply_rig(manifest, some_rig(), "rig.json"), FailsWith("knows no camera camX"));
}

/// Parsers that call themselves for each level would end the program, as OpenCV's own does.
TEST_F(RigFormats, WhatNestsDeeplyIsRefused) {
  constexpr int kLevels = 50'000;
  std::map<std::string, std::string> files;
  const auto repeat = [](const std::string& text, int times) {
    std::string all;
    for (int i = 0; i < times; ++i) all += text;
    return all;
  };
  const std::string yaml = "%YAML:1.0\n---\n";
  files["flow.yml"] = yaml + "a: " + std::string(kLevels, '[');
  files["maps.yml"] = yaml + "a: " + repeat("{a: ", kLevels);
  files["lines.yml"] = yaml + "a: " + repeat("[\n", kLevels);
  files["hidden.yml"] = yaml + "a: " + repeat("[ \"]\",\n", kLevels);
  files["comments.yml"] = yaml + "a: " + repeat("[ # ]\n", kLevels);
  files["dashes.yml"] = yaml + "a:\n  " + repeat("- ", kLevels) + "1\n";
  files["tight.yml"] = yaml + "a:\n  " + repeat("-", kLevels) + "\n";
  files["colons.yml"] = yaml + repeat("a: ", kLevels) + "1\n";
  std::string stairs = yaml;
  for (int i = 0; i < 1000; ++i) stairs += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  files["stairs.yml"] = stairs;
  const std::string xml = "<?xml version=\"1.0\"?>\n<opencv_storage>\n";
  files["tags.xml"] = xml + repeat("<a>", kLevels);
  files["lines.xml"] = xml + repeat("<a>\n", kLevels);
  files["comments.xml"] = xml + repeat("<a><!-- </a> -->\n", kLevels);
  files["attributes.xml"] = xml + repeat("<a type_id=\"x\">", kLevels);
  files["json.yml"] = "{\"a\": " + std::string(kLevels, '[');
  files["json2.yml"] = "{" + repeat("\"a\": {", kLevels);
  for (const auto& [name, text] : files) {
    std::ofstream(folder_ / name) << text;
    const auto rig = import_rig(folder_ / name);
    ASSERT_FALSE(rig.ok()) << name;
    EXPECT_EQ(rig.error().kind, ErrorKind::bad_input) << name;
    EXPECT_FALSE(rig.error().remedy.empty()) << name;
  }
  std::ofstream(folder_ / "large.yml") << yaml << std::string(5'000'000, '\n');
  EXPECT_THAT(import_rig(folder_ / "large.yml"), FailsWith("larger than"));
  std::ofstream(folder_ / "deep.json") << "{\"frames\": " << std::string(kLevels, '[');
  EXPECT_THAT(import_rig(folder_ / "deep.json"), FailsWith("nests more than"));
}

/// What isn't deep is read, whatever it looks like.
TEST_F(RigFormats, LongFlatFilesOfOpenCvAreRead) {
  const std::string camera = *read_file(folder_ / "opencv" / "cam00.yml");
  std::string more = "views:\n";
  for (int i = 0; i < 300; ++i) more += "   - [ -1.5, -2.e-03, -.5, 4. ]\n";
  std::ofstream(folder_ / "long.yml") << camera << more << "time: \"Mon Nov 23 01:02:03 2026 [UTC]\"\n";
  const auto rig = value_of(import_rig(folder_ / "long.yml"));
  EXPECT_GT(rig.cameras(0).calibration().fx(), 0);
  cv::FileStorage xml((folder_ / "camera.xml").string(), cv::FileStorage::WRITE);
  xml << "image_width" << 640 << "image_height" << 480 << "camera_matrix"
      << cv::Mat(cv::Matx33d(600, 0, 320, 0, 600, 240, 0, 0, 1)) << "distortion_coefficients"
      << cv::Mat(cv::Mat::zeros(5, 1, CV_64F));
  for (int i = 0; i < 1000; ++i) xml << "time" + std::to_string(i) << "01:02:03, a string";
  xml.release();
  const auto read = value_of(import_rig(folder_ / "camera.xml"));
  EXPECT_EQ(read.cameras(0).calibration().fx(), 600);
}

TEST_F(RigFormats, ANumberThatIsBrokenOffIsRefused) {
  const std::string camera =
      "<?xml version=\"1.0\"?>\n<opencv_storage><image_width>640</image_width>"
      "<image_height>480</image_height><camera_matrix type_id=\"opencv-matrix\"><rows>3</rows>"
      "<cols>3</cols><dt>d</dt><data>600. 0. 320. 0. 600. 240. 0. 0. 1.</data></camera_matrix>"
      "<distortion_coefficients>";
  for (const char* const numbers : {"0.1 0.2 0 0 0.05e", "0.1 0.2 0 0 0.05 -", "0.1 0.2 0 0 1e999"}) {
    EXPECT_THAT(parse_opencv(camera + numbers + "</distortion_coefficients></opencv_storage>\n", "cam00",
                             "broken.xml"),
                FailsWith("no number"))
        << numbers;
  }
  EXPECT_TRUE(parse_opencv(camera + "0.1 0.2 0 0 -.5e-1</distortion_coefficients></opencv_storage>\n",
                           "cam00", "good.xml")
                  .ok());
}

/// Each of these ends OpenCV's own parser.
TEST_F(RigFormats, WhatIsCutOffOrHoldsNoTextIsRefused) {
  const std::string nul(70, '\0');
  for (const std::string& text :
       {std::string("<?xml version="), "<?xml version=" + nul + "\"1.0\"?>\n<opencv_storage>\n", nul,
        std::string("<opencv_storage><camera_matrix type_id=\"opencv-matrix\"><rows>"),
        std::string("%YAML:1.0\n---\ncamera_matrix: !!opencv-matrix\n   rows: 3\n   data: [ 1")}) {
    const auto rig = parse_opencv(text, "cam00", "cut.xml");
    ASSERT_FALSE(rig.ok()) << text;
    EXPECT_EQ(rig.error().kind, ErrorKind::bad_input) << text;
  }
}
TEST_F(RigFormats, AMatrixOfAnotherShapeThanItSaysIsRefused) {
  EXPECT_THAT(
      parse_opencv(
          "image_width: 640\nimage_height: 480\ncamera_matrix: {rows: 3, cols: 3, dt: d, data: [1, 0, 0]}\n",
          "a", "a.yml"),
      FailsWith("camera_matrix: holds 3 numbers, not 3 x 3"));
}

}  // namespace
}  // namespace emberlock::recon
