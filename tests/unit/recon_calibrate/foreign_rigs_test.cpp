// SPDX-License-Identifier: Apache-2.0
// Calibrations as other programs write them: read, or refused by name.
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "recon/calibrate/rig_formats.h"
#include "session/name.h"
#include "tests/support/board_rig.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;
using testing::ElementsAreArray;
using testing::HasSubstr;
using Names = std::vector<std::string>;

TEST(CameraIds, AreTakenFromWhatDiffers) {
  struct Case {
    Names pictures, ids;
    NamedBy by = NamedBy::folder;
    std::size_t notes = 0;
  };
  const Case cases[] = {
      {{"left.png", "right.png"}, {"left", "right"}},
      {{"left/0001.png", "right/0001.png"}, {"left", "right"}},
      {{"left/0001.png", "right.png"}, {"left", "right"}},
      {{"left/0001.png"}, {"left"}},
      {{"left/0001.png"}, {"0001"}, NamedBy::picture},
      {{"images/c0.png", "images/c1.png"}, {"c0", "c1"}},
      {{"images\\c0.png", "images\\c1.png"}, {"c0", "c1"}},
      {{"rig1/a/1.png", "rig1/b/1.png"}, {"a", "b"}},
      {{"rig1/a/1.png", "rig1/b/1.png"}, {"a", "b"}, NamedBy::picture},
      {{"a/1.png", "a/2.png", "b/1.png"}, {"a_1", "a_2", "b_1"}},
      {{"x/a/1.png", "x/a/2.png", "x/b/1.png"}, {"a_1", "a_2", "b_1"}},
      {{"../a.png", "./b.png", "/c.png"}, {"a", "b", "c"}},
      {{"a.b.png", "a.c.png"}, {"a.b", "a.c"}},
      {{"c0.png", "c0.jpg"}, {"c0.png", "c0.jpg"}},
      {{"a.png", "a.png"}, {"a", "a"}},
      {{"my cam (1).png", "my cam (2).png"}, {"my cam _1", "my cam _2"}, NamedBy::folder, 1},
      {{"a[1].png", "a(1).png"}, {"a_1", "a_1-2"}, NamedBy::folder, 1},
      {{"a(1).png", "a_1.png"}, {"a_1-2", "a_1"}, NamedBy::folder, 1},
      {{".hidden.png", "b.png"}, {"_hidden", "b"}, NamedBy::folder, 1},
      {{"caf\xC3\xA9.png", "\xE5\x8C\x97.png"}, {"caf", "_"}, NamedBy::folder, 1},
      {{std::string(300, 'x') + "1.png", std::string(300, 'x') + "2.png"},
       {std::string(180, 'x'), std::string(180, 'x') + "-2"},
       NamedBy::folder,
       1},
      {{}, {}},
  };
  for (const Case& c : cases) {
    ImportNotes notes;
    const Names ids = camera_ids(c.pictures, c.by, &notes);
    EXPECT_THAT(ids, ElementsAreArray(c.ids));
    EXPECT_EQ(notes.size(), c.notes) << testing::PrintToString(c.pictures);
    for (const std::string& id : ids) EXPECT_TRUE(session::is_folder_name(id)) << id;
  }
}

/// A model of COLMAP's in both forms, written as COLMAP does.
struct WrittenModel {
  std::string cameras_txt, images_txt, cameras_bin, images_bin;
};

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

struct NumberedModel {
  const char* name;
  std::int32_t number;
  std::vector<double> parameters;
};
const std::vector<NumberedModel> kColmapModels = {
    {"SIMPLE_PINHOLE", 0, {500, 320, 240}},
    {"PINHOLE", 1, {500, 510, 320, 240}},
    {"SIMPLE_RADIAL", 2, {500, 320, 240, 0.1}},
    {"RADIAL", 3, {500, 320, 240, 0.1, -0.02}},
    {"OPENCV", 4, {500, 510, 320, 240, 0.1, -0.02, 1e-3, 2e-3}},
    {"FULL_OPENCV", 6, {500, 510, 320, 240, 0.1, 0, 0, 0, 0.01, 0, 0, 0}}};

enum class PointLines { none, empty, points, missing };

WrittenModel written_model(PointLines lines, const std::string& end_of_line = "\n") {
  WrittenModel model;
  append(model.cameras_bin, std::uint64_t{kColmapModels.size()});
  append(model.images_bin, std::uint64_t{kColmapModels.size()});
  RandomStream random(4, 4);
  for (std::size_t i = 0; i < kColmapModels.size(); ++i) {
    const auto id = static_cast<std::uint32_t>(10 * i + 1);
    model.cameras_txt += fmt::format("{} {} 640 480", id, kColmapModels[i].name);
    append(model.cameras_bin, id);
    append(model.cameras_bin, kColmapModels[i].number);
    append(model.cameras_bin, std::uint64_t{640});
    append(model.cameras_bin, std::uint64_t{480});
    for (const double p : kColmapModels[i].parameters) {
      model.cameras_txt += fmt::format(" {}", p);
      append(model.cameras_bin, p);
    }
    model.cameras_txt += end_of_line;
    const Eigen::Quaterniond q =
        Eigen::Quaterniond(random.normal(), random.normal(), random.normal(), random.normal()).normalized();
    const std::string name = fmt::format("images/view {}.png", i);
    model.images_txt += fmt::format("{}", i + 1);
    append(model.images_bin, static_cast<std::uint32_t>(i + 1));
    for (const double p : {q.w(), q.x(), q.y(), q.z(), 0.1, -0.2, 0.3}) {
      model.images_txt += fmt::format(" {}", p);
      append(model.images_bin, p);
    }
    model.images_txt += fmt::format(" {} {}", id, name) + end_of_line;
    append(model.images_bin, id);
    model.images_bin += name + '\0';
    const bool points = lines == PointLines::points || (lines == PointLines::none && i % 2 == 0);
    append(model.images_bin, std::uint64_t{points ? 2U : 0U});
    for (int n = 0; points && n < 2; ++n) {
      append(model.images_bin, 1.5);
      append(model.images_bin, 2.5);
      append(model.images_bin, std::int64_t{-1});
    }
    if (lines != PointLines::missing)
      model.images_txt += (points ? "1.5 2.5 -1 1.5 2.5 -1" : "") + end_of_line;
  }
  return model;
}

TEST(ColmapModels, AreTheSameInEveryForm) {
  const WrittenModel whole = written_model(PointLines::points);
  const auto expected = value_of(parse_colmap(whole.cameras_txt, whole.images_txt, "model"));
  ASSERT_EQ(expected.cameras_size(), 6);
  EXPECT_EQ(expected.cameras(3).camera_id(), "view 3");
  EXPECT_EQ(expected.cameras(5).calibration().k3(), 0.01);
  for (const PointLines lines :
       {PointLines::none, PointLines::empty, PointLines::points, PointLines::missing}) {
    for (const char* end_of_line : {"\n", "\r\n"}) {
      const WrittenModel model = written_model(lines, end_of_line);
      const auto text = value_of(parse_colmap(model.cameras_txt, model.images_txt, "model"));
      EXPECT_EQ(text.DebugString(), expected.DebugString()) << static_cast<int>(lines);
      const auto binary = value_of(parse_colmap_binary(model.cameras_bin, model.images_bin, "model"));
      EXPECT_EQ(binary.DebugString(), expected.DebugString()) << static_cast<int>(lines);
    }
  }
}

TEST(ColmapModels, BrokenOffAnywhereAreRefused) {
  const WrittenModel model = written_model(PointLines::points);
  for (std::size_t cut = 0; cut < model.cameras_bin.size(); ++cut)
    EXPECT_FALSE(parse_colmap_binary(model.cameras_bin.substr(0, cut), model.images_bin, "model").ok())
        << cut;
  for (std::size_t cut = 0; cut < model.images_bin.size(); ++cut)
    EXPECT_THAT(parse_colmap_binary(model.cameras_bin, model.images_bin.substr(0, cut), "model"),
                FailsWith("images.bin", "too early"))
        << cut;
  EXPECT_THAT(parse_colmap_binary(model.cameras_bin, model.images_bin + "x", "model"), FailsWith("longer"));
  std::string fisheye = model.cameras_bin;
  constexpr std::size_t kFifthModel = 8 + 48 + 56 + 56 + 64 + 4;  // bytes before its number
  ASSERT_EQ(fisheye[kFifthModel], 4);
  fisheye[kFifthModel] = 5;  // which has as many parameters
  EXPECT_THAT(parse_colmap_binary(fisheye, model.images_bin, "model"),
              FailsWith("OPENCV_FISHEYE", "fisheye lens", "image_undistorter"));
}

TEST(ColmapModels, AreFoundWhereColmapPutsThem) {
  const WrittenModel model = written_model(PointLines::empty);
  for (const char* inner : {"", "0", "sparse", "sparse/0"}) {
    for (const bool binary : {false, true}) {
      const test::TempFolder folder;
      const fs::path at = folder / inner;
      fs::create_directories(at);
      std::ofstream(at / (binary ? "cameras.bin" : "cameras.txt"))
          << (binary ? model.cameras_bin : model.cameras_txt);
      std::ofstream(at / (binary ? "images.bin" : "images.txt"))
          << (binary ? model.images_bin : model.images_txt);
      EXPECT_EQ(value_of(import_rig(folder.path())).cameras_size(), 6) << inner << binary;
      fs::create_directories(at.parent_path() / "1");
      ImportNotes notes;
      ASSERT_TRUE(import_rig(folder.path(), &notes).ok());
      EXPECT_EQ(notes.empty(), !std::string(inner).ends_with("0")) << inner;
    }
  }
}

const std::string kMatrixLine =
    "camera_matrix: {rows: 3, cols: 3, data: [260, 0, 63.5, 0, 261, 47.5, 0, 0, 1]}\n";
const std::string kSizeLines = "image_width: 128\nimage_height: 96\n";
const std::string kFourLine =
    "distortion_coefficients: {rows: 1, cols: 4, data: [0.03, 0.005, -0.002, 0.0004]}\n";
const std::string kPoseLines = "R: [0, 0, 0]\nT: [0.1, 0.2, 0.3]\n";

TEST(OpencvFiles, OtherLensesUnitsAndProgramsAreRefusedByName) {
  const std::string usual = kSizeLines + kMatrixLine + kFourLine;
  const auto xml = [](const std::string& more) {
    return "<opencv_storage><image_width>128</image_width><image_height>96</image_height><camera_matrix>260. "
           "0. "
           "63.5 0. 260. 47.5 0. 0. 1.</camera_matrix><distortion_coefficients>0.03 0.005 -0.002 0.0004"
           "</distortion_coefficients>" +
           more + "</opencv_storage>";
  };
  ASSERT_TRUE(parse_opencv(usual + kPoseLines, "a", "a.yml").ok());
  ASSERT_TRUE(parse_opencv(xml("<fisheye_model>0</fisheye_model>"), "a", "a.xml").ok());
  const std::pair<std::string, const char*> cases[] = {
      {usual + "distortion_model: equidistant\n", "\"equidistant\" isn't modelled: it is a fisheye"},
      {usual + "distortion_model: fisheye\n", "it is a fisheye"},
      {usual + "distortion_model: Kannala_Brandt4\n", "it is a fisheye"},
      {usual + "camera_model: fisheye\n", "it is a fisheye"},
      {usual + "model_type: MEI\n", "\"MEI\" isn't modelled"},
      {usual + "distortion_model: fov\n", "\"fov\" isn't modelled"},
      {usual + "fisheye_model: 1\n", "fisheye_model"},
      {usual + "fisheye_model: true\n", "fisheye_model"},
      {xml("<fisheye_model>1</fisheye_model>"), "fisheye_model"},
      {xml("<distortion_model>equidistant</distortion_model>"), "it is a fisheye"},
      {usual + "xi: 1.2\n", "omnidirectional"},
      {usual + "skew: 0.3\n", "skewed"},
      {usual + "binning_x: 2\n", "binning"},
      {kSizeLines + kFourLine + "camera_matrix: [260, 0.5, 63.5, 0, 261, 47.5, 0, 0, 1]\n",
       "skewed pixels (0.5)"},
      {kSizeLines + kFourLine + "camera_matrix: [260, 0, 0, 0, 261, 0, 63.5, 47.5, 1]\n", "is not fx 0 cx"},
      {kSizeLines + kMatrixLine + "distortion_coefficients: [0, 0, 0, 0, 0, 0.1, 0, 0]\n", "at most k3"},
      {kSizeLines + kMatrixLine + "my_dist: [0.1, 0, 0, 0]\n", "my_dist"},
      {usual + kPoseLines + "unit: mm\n", "T is in mm"},
      {usual + kPoseLines + "square_size: 25.\n", "square_size"},
      {usual + "R: [2, 0, 0, 0, 1, 0, 0, 0, 1]\nT: [0, 0, 0]\n", "R"},
      {"M1: [1]\nD1: [1]\n", "stereo pair by OpenCV"},
      {"R: [0, 0, 0]\nT: [0, 0, 0]\nR1: [1]\nQ: [1]\n", "rectification of a stereo pair"},
      {"Camera.fx: 260\nCamera.type: PinHole\n", "ORB-SLAM"},
      {"model_type: PINHOLE\nprojection_parameters: {fx: 1}\n", "camodocal"},
      {"height: 96\nwidth: 128\nK: [1]\nD: [1]\n", "CameraInfo"},
      {"cam0: {camera_model: pinhole}\n", "Kalibr"},
      {R"({"Calibration": {"cameras": []}})", "calib.io"},
      {R"({"sfm_data_version": "0.3"})", "OpenMVG"},
  };
  for (const auto& [text, what] : cases) {
    const auto camera = parse_opencv(text, "a", "a.yml");
    EXPECT_THAT(camera, FailsWith("a.yml", what)) << text;
    EXPECT_TRUE(camera.ok() || !camera.error().remedy.empty()) << text;
  }
}

TEST(OpencvFiles, OtherNamesAreRead) {
  const auto expected = value_of(parse_opencv(kSizeLines + kMatrixLine + kFourLine, "a", "a.yml"));
  const std::string texts[] = {
      "image_Width: 128\nimage_Height: 96\nCamera_Matrix: {rows: 3, cols: 3, data: [260, 0, 63.5, 0, 261, "
      "47.5, 0, "
      "0, 1]}\nDistortion_Coefficients: [0.03, 0.005, -0.002, 0.0004, 0]\nsquare_Size: 50\nflagValue: 0\n",
      R"({"image_width": 128, "image_height": 96, "camera_matrix": [[260, 0, 63.5], [0, 261, 47.5], [0, 0, 1]],
          "dist_coeff": [[0.03, 0.005, -0.002, 0.0004, 0.0]]})",
      kSizeLines + kMatrixLine + kFourLine + "camera_name: left\ndistortion_model: plumb_bob\n",
      kSizeLines + kMatrixLine + kFourLine + "fisheye_model: 0\nflags: 0\nsquare_size: 25\nnframes: 12\n"};
  for (const std::string& text : texts) {
    ImportNotes notes;
    EXPECT_EQ(value_of(parse_opencv(text, "a", "a.yml", &notes)).DebugString(), expected.DebugString())
        << text;
    EXPECT_TRUE(notes.empty()) << testing::PrintToString(notes);
  }
  ImportNotes notes;
  ASSERT_TRUE(parse_opencv(kSizeLines + kMatrixLine + "shutter: rolling\n", "a", "a.yml", &notes).ok());
  EXPECT_THAT(notes, testing::UnorderedElementsAre(HasSubstr("without distortion"), HasSubstr("shutter")));
}

std::string kalibr_text(const std::string& distortion, double scale = 1) {
  const std::string lens = fmt::format(
      "  camera_model: pinhole\n  distortion_model: {}\n  distortion_coeffs: [0.1, -0.02, 0.001, 0.002]\n"
      "  intrinsics: [260, 261, 63.5, 47.5]\n  resolution: [128, 96]\n  rostopic: /cam\n",
      distortion);
  const std::string step =
      fmt::format("  T_cn_cnm1:\n  - [0, -1, 0, {}]\n  - [1, 0, 0, 0]\n  - [0, 0, 1, 0]\n  - [0, 0, 0, 1]\n",
                  0.5 * scale);
  return "cam0:\n" + lens + "cam1:\n" + lens + step + "cam2:\n" + lens + step;
}

TEST(KalibrFiles, ChainTheirCameras) {
  const test::TempFolder folder;
  std::ofstream(folder / "camchain.yaml") << kalibr_text("radtan");
  const auto rig = value_of(import_rig(folder / "camchain.yaml"));
  ASSERT_EQ(rig.cameras_size(), 3);
  EXPECT_EQ(rig.cameras(2).camera_id(), "cam2");
  EXPECT_DOUBLE_EQ(rig.cameras(0).calibration().cx(), 64);
  EXPECT_DOUBLE_EQ(rig.cameras(0).calibration().p2(), 0.002);
  const auto cameras = placed_cameras(rig);
  ASSERT_EQ(cameras.size(), 3U);
  // Twice a quarter turn about z, each followed by half a metre along x.
  EXPECT_LT((cameras[2].second.camera_from_world.translation - Eigen::Vector3d(0.5, 0.5, 0)).norm(), 1e-12);
  EXPECT_LT((cameras[2].second.camera_from_world.rotation -
             Eigen::DiagonalMatrix<double, 3>(-1, -1, 1).toDenseMatrix())
                .norm(),
            1e-12);
  std::ofstream(folder / "fisheye.yaml") << kalibr_text("equidistant");
  EXPECT_THAT(import_rig(folder / "fisheye.yaml"), FailsWith("cam0", "pinhole-equidistant", "fisheye"));
  std::ofstream(folder / "mm.yaml") << kalibr_text("radtan", 1000);
  EXPECT_THAT(import_rig(folder / "mm.yaml"), FailsWith("millimetre"));
}

TEST(ForeignRigs, MillimetresAreRefusedInEveryFormat) {
  const test::BoardRig board = test::board_rig({.cameras = 3, .instants = 1});
  v1::Rig rig = test::rig_file_of(board);
  for (v1::RigCamera& camera : *rig.mutable_cameras()) {
    camera.mutable_calibration()->clear_sigma();
    for (const int i : {3, 7, 11})
      camera.mutable_calibration()->set_camera_from_world(i, 1e3 * camera.calibration().camera_from_world(i));
  }
  const test::TempFolder folder;
  ASSERT_TRUE(export_rig(rig, folder.path()).ok());
  for (const char* name : {"rig.json", "transforms.json", "opencv", "colmap"})
    EXPECT_THAT(import_rig(folder / name), FailsWith("millimetre")) << name;
}

TEST(ForeignRigs, FilesAreKnownByWhatTheyHold) {
  const test::TempFolder folder;
  const std::pair<const char*, std::string> read[] = {
      {"camera (1).YML", kSizeLines + kMatrixLine + kFourLine},
      {"ros.YAML", kSizeLines + kMatrixLine + kFourLine},
      {"python.json", R"({"image_width": 128, "image_height": 96,
          "camera_matrix": [[260, 0, 63.5], [0, 261, 47.5], [0, 0, 1]], "dist_coeff": [[0.03, 0.005, 0, 0, 0]]})"}};
  for (const auto& [name, text] : read) {
    std::ofstream(folder / name) << text;
    EXPECT_TRUE(import_rig(folder / name).ok()) << name;
  }
  const std::pair<const char*, std::string> refused[] = {{"calibration.toml", "[cam_0]\nname = 'x'\n"},
                                                         {"ost.ini", "[image]\n\nwidth\n640\n"},
                                                         {"empty.json", ""},
                                                         {"list.json", "[1, 2]"},
                                                         {"other.json", R"({"views": []})"}};
  for (const auto& [name, text] : refused) {
    std::ofstream(folder / name) << text;
    const auto rig = import_rig(folder / name);
    ASSERT_THAT(rig, FailsWith(name)) << name;
    EXPECT_EQ(rig.error().kind, ErrorKind::bad_input);
    EXPECT_FALSE(rig.error().remedy.empty()) << name;
  }
}

}  // namespace
}  // namespace emberlock::recon
