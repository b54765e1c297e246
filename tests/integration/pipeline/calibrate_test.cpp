// SPDX-License-Identifier: Apache-2.0
// From pictures of a board to rig.json, through the verb; and OpenCV's own stereo pairs with their published
// result.
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>
#include <opencv2/calib3d.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "cli/commands.h"
#include "recon/calibrate/board_pictures.h"
#include "recon/calibrate/carried_board.h"
#include "recon/calibrate/rig_formats.h"
#include "session/writer.h"
#include "tests/support/board_rig.h"
#include "tests/support/recording.h"
#include "tests/support/smear_frames.h"
#include "tests/support/verb.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

const fs::path kOpencvData = "/usr/share/doc/opencv-doc/examples/data";

class CalibrateVerb : public testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_ / "pictures"); }

  void save(const Image& image, const fs::path& path) const {
    fs::create_directories(path.parent_path());
    Image copy = image;
    const cv::Mat all(image.layout().size.height, image.layout().size.width, CV_8U, copy.bytes().data());
    ASSERT_TRUE(cv::imwrite(path.string(), all));
  }

  const test::TempFolder folder_;
};

test::BoardRigOptions two_cameras() {
  test::BoardRigOptions options;
  options.cameras = 2;
  options.instants = 8;
  options.seed = 5;
  options.image = {320, 240};
  options.board = *recon::parse_board("chessboard:9x6:18mm");
  return options;
}

TEST_F(CalibrateVerb, RenderedPicturesOfABoardBecomeARig) {
  const test::BoardRigOptions options = two_cameras();
  const test::BoardRig rig = test::board_rig(options);
  for (const auto& sighting : rig.sightings.sightings) {
    save(recon::board_picture(rig.cameras[sighting.camera], options.board,
                              rig.world_from_board[sighting.instant]),
         folder_ / "pictures" / rig.sightings.cameras[sighting.camera].id /
             ("board_" + std::to_string(sighting.instant) + ".png"));
  }
  const fs::path out = folder_ / "out";
  const auto run = test::run_verb(cli::add_calibrate,
                                  {"calibrate", "cameras", (folder_ / "pictures").string(), "--board",
                                   "chessboard:9x6:18mm", "--world", "0", "--out", out.string(), "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto told = nlohmann::json::parse(run.out);
  EXPECT_EQ(told["world"], "0");
  EXPECT_LT(told["rms_pixels"], 0.25);
  for (const char* file : {"index.html", "transforms.json", "colmap/cameras.txt", "opencv/cam00.yml"})
    EXPECT_TRUE(fs::exists(out / file)) << file;
  EXPECT_THAT(test::bytes_of(out / "index.html"), HasSubstr("Where the cameras stand"));
  const auto written = session::read_rig(out / "rig.json");
  ASSERT_TRUE(written.ok()) << written.error().message();
  for (int c = 0; c < 2; ++c) {
    const auto camera = recon::camera_model_of(written->cameras(c).calibration(), options.image, "", "");
    ASSERT_TRUE(camera.ok());
    const v1::Calibration& calibration = written->cameras(c).calibration();
    for (int axis = 0; axis < 3; ++axis) {
      // Rendered corners err by a tenth of a pixel, alike along a row: not noise, so five deviations and half
      // a mm.
      EXPECT_NEAR(camera->center()[axis], rig.cameras[static_cast<std::size_t>(c)].center()[axis],
                  5 * calibration.sigma(9 + axis) + 5e-4);
    }
  }
  // The same pictures, later: nothing moved.
  const auto check =
      test::run_verb(cli::add_calibrate, {"calibrate", "check", (out / "rig.json").string(),
                                          (folder_ / "pictures").string(), "--board", "chessboard:9x6:18mm"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_THAT(check.out, HasSubstr("The calibration holds"));
}

TEST_F(CalibrateVerb, AFilmOfABoardThatRestsInEachPoseBecomesARig) {
  const test::BoardRigOptions options = two_cameras();
  const test::BoardRig rig = test::board_rig(options);
  constexpr std::size_t kRest = 2;  // frames
  const ImageLayout layout{options.image, PixelFormat::gray8, 8};
  auto writer = session::SessionWriter::create(folder_ / "film", test::manifest_of({layout, layout}),
                                               test::small_disk_options(session::Encoding::huffman_nut));
  ASSERT_TRUE(writer.ok()) << writer.error().message();
  for (std::size_t c = 0; c < 2; ++c) {
    for (std::size_t i = 0; i < rig.world_from_board.size(); ++i) {
      const auto picture = std::make_shared<const Image>(
          recon::board_picture(rig.cameras[c], options.board, rig.world_from_board[i]));
      for (std::size_t n = 0; n < kRest; ++n) {
        Frame frame = test::noise_frame({{2, 2}, PixelFormat::gray8, 8}, kRest * i + n);
        frame.image = picture;
        ASSERT_TRUE(writer->write(c, frame).ok());
      }
    }
  }
  ASSERT_TRUE(writer->finish().ok());
  const std::string film = (folder_ / "film").string();
  const std::string out = (folder_ / "out").string();
  const auto run = test::run_verb(cli::add_calibrate, {"calibrate", "cameras", film, "--board",
                                                       "chessboard:9x6:18mm", "--out", out, "--json"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const auto told = nlohmann::json::parse(run.out);
  EXPECT_EQ(told["film"]["instants"], 16);
  EXPECT_EQ(told["film"]["searched"], 16);
  EXPECT_EQ(told["film"]["moving"], 7) << "the last frame of each pose but the last";
  EXPECT_EQ(told["film"]["taken"], 8);
  const auto written = session::read_rig(fs::path(out) / "rig.json");
  ASSERT_TRUE(written.ok()) << written.error().message();
  ASSERT_EQ(written->cameras_size(), 2);
  const auto first = recon::camera_model_of(written->cameras(0).calibration(), options.image, "", "");
  const auto second = recon::camera_model_of(written->cameras(1).calibration(), options.image, "", "");
  EXPECT_EQ(written->cameras(1).camera_id(), "cam1");
  EXPECT_NEAR((first->center() - second->center()).norm(),
              (rig.cameras[0].center() - rig.cameras[1].center()).norm(), 2e-3);
  const auto check = test::run_verb(
      cli::add_calibrate, {"calibrate", "check", out + "/rig.json", film, "--board", "chessboard:9x6:18mm"});
  EXPECT_EQ(check.exit_code, 0) << check.out << check.err;
  EXPECT_THAT(check.out, HasSubstr("16 of 16 instants searched"));
  EXPECT_THAT(check.out, HasSubstr("8 taken"));
  EXPECT_THAT(check.out, HasSubstr("The calibration holds"));
}

TEST_F(CalibrateVerb, ALampTellsWhichCameraTurned) {
  test::BoardRigOptions options;
  options.cameras = 4;
  options.instants = 1;
  options.board = *recon::parse_board("chessboard:9x6:18mm");
  const test::BoardRig rig = test::board_rig(options);
  const auto lamps = test::lamp_sightings(rig, test::lamp_places(rig, 4, 1), 0, 1);
  for (const auto& sighting : lamps.sightings) {
    test::SmearScene scene(options.image.width, options.image.height);
    const Eigen::Vector2d at = sighting.corners[0].pixel;
    scene.disk(at.x() - 0.5, at.y() - 0.5, 5, 200);
    save(scene.image({.noise = 1.5, .seed = sighting.camera + 10 * sighting.instant}),
         folder_ / "pictures" / lamps.cameras[sighting.camera].id /
             (lamps.instants[sighting.instant] + ".png"));
  }
  const auto check = [&](const v1::Rig& file) {
    EXPECT_TRUE(session::write_rig(folder_ / "rig.json", file).ok());
    return test::run_verb(cli::add_calibrate, {"calibrate", "check", (folder_ / "rig.json").string(),
                                               (folder_ / "pictures").string(), "--lamp", "--json"});
  };
  v1::Rig file = test::rig_file_of(rig);
  const auto still = check(file);
  EXPECT_EQ(still.exit_code, 0) << still.out << still.err;
  test::knock(file, rig, 3, {.turn = {0, 0.2 * M_PI / 180, 0}});
  const auto turned = check(file);
  EXPECT_EQ(turned.exit_code, 1) << turned.err;
  const auto told = nlohmann::json::parse(turned.out);
  for (std::size_t c = 0; c < 4; ++c)
    EXPECT_EQ(told["cameras"][c]["verdict"], c == 3 ? "moved" : "still") << c;
  EXPECT_NEAR(told["cameras"][3]["turn_degrees"], 0.2, 0.1);
  const auto neither = test::run_verb(
      cli::add_calibrate,
      {"calibrate", "check", (folder_ / "rig.json").string(), (folder_ / "pictures").string()});
  EXPECT_EQ(neither.exit_code, 2);
  EXPECT_THAT(neither.err, HasSubstr("--lamp"));
}

TEST_F(CalibrateVerb, BadPicturesAreNamed) {
  const auto run = [&] {
    return test::run_verb(cli::add_calibrate,
                          {"calibrate", "cameras", (folder_ / "pictures").string(), "--board",
                           "chessboard:9x6:25mm", "--out", (folder_ / "out").string()});
  };
  EXPECT_THAT(run().err, HasSubstr("holds no picture"));
  save(Image(ImageLayout{{64, 48}, PixelFormat::gray8, 8}), folder_ / "pictures" / "left" / "1.png");
  EXPECT_THAT(run().err, HasSubstr("found in no picture"));
  save(Image(ImageLayout{{32, 48}, PixelFormat::gray8, 8}), folder_ / "pictures" / "left" / "2.png");
  const auto mixed = run();
  EXPECT_EQ(mixed.exit_code, 2);
  EXPECT_THAT(mixed.err, HasSubstr("32 x 48"));
  EXPECT_THAT(mixed.err, HasSubstr("64 x 48"));
  EXPECT_FALSE(fs::exists(folder_ / "out")) << "nothing half done is left";
}

/// The published pairs: 13 views of a 9 x 6 board.
class OpencvPairs : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::vector<fs::path> files;
    for (const char* side : {"left", "right"}) {
      for (int i = 1; i <= 14; ++i)
        if (i != 10)
          files.push_back(kOpencvData /
                          (std::string(side) + (i < 10 ? "0" : "") + std::to_string(i) + ".jpg"));
    }
    const auto pictures = recon::list_board_pictures(files);
    ASSERT_TRUE(pictures.ok()) << pictures.error().message();
    auto reading =
        recon::find_boards(*pictures, recon::search_for(*recon::parse_board("chessboard:9x6:25mm")));
    ASSERT_TRUE(reading.ok()) << reading.error().message();
    reading_ = new recon::BoardReading(*std::move(reading));
  }
  static void TearDownTestSuite() {
    delete reading_;
    reading_ = nullptr;
  }
  static recon::BoardSightings subset(auto wanted) {
    recon::BoardSightings result = reading_->sightings;
    std::erase_if(result.sightings, [&](const recon::BoardSightings::Sighting& s) { return !wanted(s); });
    return result;
  }
  static recon::BoardReading* reading_;
};
recon::BoardReading* OpencvPairs::reading_ = nullptr;

struct PublishedWay {
  double focal = 0;
  double rms = 0;
};

/// As the published intrinsics were made (left_intrinsics.yml; OpenCV's samples/cpp/calibration.cpp):
/// classical corners, one focal length, five coefficients. Nothing of ours.
PublishedWay calibrate_as_published(const std::vector<int>& views) {
  const cv::Size board(9, 6);
  std::vector<cv::Point3f> points;
  points.reserve(static_cast<std::size_t>(board.area()));
  for (int i = 0; i < board.area(); ++i)
    points.emplace_back(0.025F * static_cast<float>(i % 9), 0.025F * static_cast<float>(i / 9), 0.F);
  std::vector<std::vector<cv::Point2f>> corners;
  cv::Size size;
  for (const int view : views) {
    const cv::Mat picture = cv::imread(
        (kOpencvData / (std::string("left") + (view < 10 ? "0" : "") + std::to_string(view) + ".jpg"))
            .string(),
        cv::IMREAD_GRAYSCALE);
    size = picture.size();
    if (!cv::findChessboardCorners(picture, board, corners.emplace_back())) return {};
    cv::cornerSubPix(picture, corners.back(), {11, 11}, {-1, -1},
                     {cv::TermCriteria::EPS | cv::TermCriteria::COUNT, 30, 0.1});
  }
  cv::Mat camera = cv::Mat::eye(3, 3, CV_64F);
  cv::Mat distortion;
  std::vector<cv::Mat> turns;
  std::vector<cv::Mat> places;
  const double rms =
      cv::calibrateCamera(std::vector<std::vector<cv::Point3f>>(corners.size(), points), corners, size,
                          camera, distortion, turns, places, cv::CALIB_FIX_ASPECT_RATIO);
  return {camera.at<double>(0, 0), rms};
}

TEST_F(OpencvPairs, TheLeftCameraIsAsPublishedButForTheViewWithWrongCorners) {
  const auto found = recon::calibrate_rig(subset([](const auto& s) { return s.camera == 0; }));
  ASSERT_TRUE(found.ok()) << found.error().message();
  const recon::CalibratedCamera& left = found->cameras[0];
  EXPECT_LE(left.rms, 0.25);
  EXPECT_GE(left.views_used, 12U);
  EXPECT_LT(left.sigma[0], 1.5) << "an uncertainty that explains everything says nothing";
  // The published way gives what was published, to what OpenCV changed since.
  const PublishedWay all = calibrate_as_published({1, 2, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14});
  EXPECT_NEAR(all.focal, 535.916, 0.1);
  EXPECT_NEAR(all.rms, 0.3926, 0.01);
  // Without left02, whose corners have 1.18 pixels RMS there and the others' 0.16 to 0.38, it gives ours.
  const PublishedWay good = calibrate_as_published({1, 3, 4, 5, 6, 7, 8, 9, 11, 12, 13, 14});
  EXPECT_LT(good.rms, 0.25);
  EXPECT_NEAR(left.fit.model.intrinsics.fx, good.focal, 2 * left.sigma[0]);
}

TEST_F(OpencvPairs, DisjointHalvesAgreeOnTheBaseline) {
  const auto baseline = [](const recon::BoardSightings& sightings) {
    const auto found = recon::calibrate_rig(sightings);
    if (!found || !found->whole()) return -1.0;
    return (found->bundle.cameras[0].model.center() - found->bundle.cameras[1].model.center()).norm();
  };
  const double all = baseline(reading_->sightings);
  const double even = baseline(subset([](const auto& s) { return s.instant % 2 == 0; }));
  const double odd = baseline(subset([](const auto& s) { return s.instant % 2 == 1; }));
  RecordProperty("all_mm", std::to_string(all * 1e3));
  RecordProperty("even_mm", std::to_string(even * 1e3));
  RecordProperty("odd_mm", std::to_string(odd * 1e3));
  EXPECT_NEAR(all, 0.0832, 0.005 * 0.0832);
  EXPECT_NEAR(even, odd, 0.005 * all) << "the two share no picture";
}

}  // namespace
}  // namespace emberlock
