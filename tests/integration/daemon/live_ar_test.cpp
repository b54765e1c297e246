// SPDX-License-Identifier: Apache-2.0
// A flame in the live pictures of a camera that replays a recording: the engine, and the program that draws.
#include <filesystem>
#include <map>

#include <gmock/gmock.h>
#include <opencv2/imgcodecs.hpp>

#include "daemon/engine/engine.h"
#include "session/reader.h"
#include "tests/support/marker_session.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

constexpr ImageSize kFilmed{320, 240};

class LiveArProgramSlow : public testing::Test {
 protected:
  LiveArProgramSlow() {
    film_.lens = {kFilmed, 320, 320, 159, 121, {-0.1, 0, 0, 0, 0}};
    film_.rate = 3;
    film_.frames = 900;  // five minutes: a busy machine takes its time until the flame is shown
    film_.drawn = 60;
    film_.look.samples = 2;
    test::record_marker(temp_ / "film", film_);
    test::put_flame(temp_ / "results/candle/middle-frame", 48);
    config_.rig.cameras.emplace_back().source = rig::CameraSource::replay;
    config_.rig.replay_session = temp_ / "film";
    config_.recording.folder = temp_ / "sessions";
    config_.recording.writer = test::small_disk_options(session::Encoding::raw_nut);
    config_.reconstruction.program = EMBERLOCK_PROGRAM;
    request_.set_camera_id("hand");
    request_.set_session("candle");
    request_.set_result("middle-frame");
    request_.set_marker("aruco:4X4_50:7:80mm");
    request_.set_scale(0.5);
  }
  void start() {
    auto engine = daemon::Engine::start(config_, board_, [](const std::string&, const Frame&) {});
    ASSERT_TRUE(engine.ok()) << engine.error().message();
    engine_ = std::move(*engine);
  }
  /// Shows the flame. A busy machine may take longer than the engine waits: then again, as its error asks.
  v1::ArStatus show() {
    Result<v1::ArStatus> shown = Error{};
    test::wait_until([&] {
      shown = engine_->start_ar(request_);
      return shown.ok() || shown.error().message().find("told nothing") == std::string::npos;
    });
    EXPECT_TRUE(shown.ok()) << shown.error().message();
    return shown.ok() ? *shown : v1::ArStatus();
  }
  /// So many pictures with a pose, by frame.
  std::map<std::uint64_t, cv::Mat> pictures(std::size_t count, v1::ArStatus::Pose pose) {
    std::map<std::uint64_t, cv::Mat> seen;
    test::wait_until([&] {
      const auto all = board_.pictures();
      const auto picture = all.find("hand");
      if (picture == all.end() || board_.status()->ar().pose() != pose) return false;
      const std::string& jpeg = picture->second->jpeg();
      seen[picture->second->frame_id()] =
          cv::imdecode(std::vector<char>(jpeg.begin(), jpeg.end()), cv::IMREAD_COLOR);
      return seen.size() >= count;
    });
    return seen;
  }

  test::TempFolder temp_;
  test::MarkerSession film_;
  rig::DaemonConfig config_;
  v1::ArRequest request_;
  daemon::Board board_;
  std::unique_ptr<daemon::Engine> engine_;
};

TEST_F(LiveArProgramSlow, TheFlameStandsOnTheMarkerAndWhatIsRecordedIsAsFilmed) {
  start();
  const daemon::Subscription watcher = board_.want_pictures();
  ASSERT_EQ(show().state(), v1::ArStatus::SHOWN);
  v1::RecordRequest take;
  take.set_name("take");
  take.set_unlocked(true);
  ASSERT_TRUE(engine_->record(take).ok());
  const auto seen = pictures(12, v1::ArStatus::FOUND);
  ASSERT_GE(seen.size(), 8U);
  double least = 1e9;
  double most = 0;
  for (const auto& [frame, picture] : seen) {
    ASSERT_EQ(picture.size(), cv::Size(kFilmed.width, kFilmed.height));
    // The middle of what is redder than blue, as nothing else in the grey film is.
    double sum = 0;
    double x = 0;
    double lowest = 0;
    for (int row = 0; row < picture.rows; ++row)
      for (int column = 0; column < picture.cols; ++column) {
        const auto pixel = picture.at<cv::Vec3b>(row, column);
        if (pixel[2] - pixel[0] < 90) continue;
        sum += 1;
        x += column;
        lowest = row;
      }
    ASSERT_GT(sum, 100) << "of frame " << frame;
    const Eigen::Vector2d foot = film_.camera(static_cast<int>(frame)).project(Eigen::Vector3d::Zero());
    EXPECT_NEAR(x / sum, foot.x(), 12) << "the flame is above its foot, frame " << frame;
    EXPECT_NEAR(lowest, foot.y(), 12) << frame;
    least = std::min(least, foot.x());
    most = std::max(most, foot.x());
  }
  EXPECT_GT(most - least, 4) << "the camera moved meanwhile";
  v1::ArStatus status;
  // On a busy machine there may be moments without pictures.
  EXPECT_TRUE(test::wait_until([&] {
    status = board_.status()->ar();
    return status.rate_hz() > 0 && status.delay_s() > 0;
  }));
  EXPECT_LT(status.residual_px(), 0.5);
  EXPECT_GT(status.residual_px(), 0);
  ASSERT_TRUE(engine_->stop_recording().ok());
  ASSERT_TRUE(engine_->stop_ar().ok());
  auto original = session::SessionReader::open(temp_ / "film");
  auto recorded = session::SessionReader::open(temp_ / "sessions/take");
  ASSERT_TRUE(original.ok() && recorded.ok());
  const auto first = recorded->read(0, 0);
  const auto filmed = original->read(0, first->stamp.frame_id);
  ASSERT_TRUE(first.ok() && filmed.ok());
  EXPECT_EQ(first->image->bytes(), filmed->image->bytes());
}

TEST_F(LiveArProgramSlow, ErrorsNameWhatIsWrong) {
  start();
  const auto refused = [&](const char* words) {
    const auto answer = engine_->start_ar(request_);
    ASSERT_FALSE(answer.ok()) << words;
    EXPECT_EQ(answer.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(answer.error().message(), HasSubstr(words));
  };
  request_.set_marker("aruco:4X4:7:80mm");
  refused("no dictionary");
  request_.set_marker("a marker");
  refused("aruco:");
  request_.set_marker("aruco:4X4_50:7:80mm");
  request_.set_camera_id("foot");
  refused("foot: the rig has no such camera");
  request_.set_camera_id("hand");
  fs::resize_file(temp_ / "results/candle/middle-frame/volume.vdb", 100);
  refused("volume.vdb");
}

TEST_F(LiveArProgramSlow, AMarkerOfAnotherNumberIsNamed) {
  start();
  const daemon::Subscription watcher = board_.want_pictures();
  request_.set_marker("aruco:4X4_50:8:80mm");
  request_.set_focal_px(320);
  EXPECT_FALSE(show().calibrated());
  EXPECT_TRUE(test::wait_until([&] { return !board_.status()->ar().seen_instead().empty(); }));
  EXPECT_EQ(board_.status()->ar().pose(), v1::ArStatus::LOST);
  EXPECT_EQ(board_.status()->ar().seen_instead(), "a marker of 4X4_50, number 7");
}

}  // namespace
}  // namespace emberlock
