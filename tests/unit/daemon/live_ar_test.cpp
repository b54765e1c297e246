// SPDX-License-Identifier: Apache-2.0
// The daemon's side of a flame in live pictures; tests/integration/daemon/live_ar_test.cpp has the program
// that draws.
#include "daemon/ar/live_ar.h"

#include <fstream>
#include <memory>

#include <gmock/gmock.h>

#include "tests/support/child_script.h"
#include "tests/support/recording.h"
#include "tests/support/wait.h"

namespace emberlock::daemon {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// A result, a camera, and a shell script in the place of `emberlock`.
class LiveArTest : public testing::Test {
 protected:
  LiveArTest() {
    fs::create_directories(root_ / "results/candle/frame-9");
    std::ofstream(root_ / "results/candle/frame-9/volume.vdb") << "a volume";
    options_.program = root_ / "program";
    options_.results = root_ / "results";
    options_.patience = test::kHangGuard;
    camera_.id = "left";
    camera_.layout = {{8, 6}, PixelFormat::gray8, 8};
    camera_.calibration.emplace().set_fx(10);
    request_.set_camera_id("left");
    request_.set_session("candle");
    request_.set_result("frame-9");
    request_.set_marker("aruco:4X4_50:7:80mm");
    v1::ChildMessage ready;
    ready.mutable_progress()->set_fraction(1);
    test::put_message(root_ / "ready", ready);
  }
  LiveAr& with_script(const std::string& script) {
    test::put_script(root_.path(), script);
    return *(ar_ = std::make_unique<LiveAr>(options_, board_));
  }
  [[nodiscard]] static Frame frame_at(std::int64_t ns) {
    Frame frame;
    frame.stamp.monotonic_time = {ns};
    frame.image = std::make_shared<const Image>(ImageLayout{{8, 6}, PixelFormat::gray8, 8});
    return frame;
  }

  test::TempFolder root_;
  LiveArOptions options_;
  ArCamera camera_;
  v1::ArRequest request_;
  Board board_;
  std::unique_ptr<LiveAr> ar_;
};

TEST_F(LiveArTest, WhatCannotBeShownIsRefusedAndNothingIsStarted) {
  LiveAr& ar = with_script("touch $ROOT/started");
  const auto refused = [&](const v1::ArRequest& request, const char* words) {
    const auto answer = ar.start(request, camera_);
    ASSERT_FALSE(answer.ok()) << words;
    EXPECT_EQ(answer.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(answer.error().message(), HasSubstr(words));
  };
  const auto with = [&](auto change) {
    v1::ArRequest request = request_;
    change(request);
    return request;
  };
  refused(with([](auto& r) { r.set_session("other"); }), "there is no such result");
  refused(with([](auto& r) { r.set_result("../frame-9"); }), "there is no such result");
  refused(with([](auto& r) { r.set_scale(-1); }), "scale: is out of range");
  refused(with([](auto& r) { r.set_brightness(std::nan("")); }), "brightness: is out of range");
  refused(with([](auto& r) { r.set_focal_px(1e9); }), "focal_px: is out of range");
  refused(with([](auto& r) { r.clear_marker(); }), "aruco:4X4_50:7:80mm");
  camera_.calibration.reset();
  refused(request_, "left: its lens isn't known. Calibrate the rig");
  EXPECT_FALSE(fs::exists(root_ / "started"));
  EXPECT_FALSE(ar.status().has_value());
  EXPECT_FALSE(ar.offer("left", frame_at(1))) << "pictures are as always";
}

TEST_F(LiveArTest, WhatTheChildTellsOfItsFailureIsTheAnswer) {
  v1::ChildMessage failure;
  failure.mutable_failure()->set_message("aruco:4X4: no dictionary. Give another");
  test::put_message(root_ / "failure", failure);
  const auto answer = with_script("cat $ROOT/failure >&3; exit 2").start(request_, camera_);
  ASSERT_FALSE(answer.ok());
  EXPECT_EQ(answer.error().message(), "aruco:4X4: no dictionary. Give another");
  EXPECT_EQ(ar_->status()->state(), v1::ArStatus::FAILED);
}

TEST_F(LiveArTest, AChildThatDiesOrHangsIsTold) {
  EXPECT_THAT(with_script("echo no memory >&2; exit 7").start(request_, camera_).error().message(),
              HasSubstr("ended with exit code 7: no memory"));
  EXPECT_THAT(with_script("kill -SEGV $$").start(request_, camera_).error().message(),
              HasSubstr("crashed by signal 11"));
  EXPECT_THAT(with_script(R"(printf '\377\377\377\377\377' >&3; sleep 60)")
                  .start(request_, camera_)
                  .error()
                  .message(),
              HasSubstr("can't be understood"));
  options_.patience = Seconds(0.2);
  EXPECT_THAT(with_script("sleep 60").start(request_, camera_).error().message(),
              HasSubstr("told nothing for 0.2 s"));
  fs::remove(root_ / "program");
  EXPECT_FALSE(LiveAr(options_, board_).start(request_, camera_).ok());
}

TEST_F(LiveArTest, ItTakesTheFramesOfItsCameraAloneUntilItEnds) {
  LiveAr& ar = with_script("cat $ROOT/ready >&3; sleep 60");
  EXPECT_EQ(ar.stop().error().kind, ErrorKind::refused) << "none is shown";
  const auto shown = ar.start(request_, camera_);
  ASSERT_TRUE(shown.ok()) << shown.error().message();
  EXPECT_EQ(shown->state(), v1::ArStatus::SHOWN);
  EXPECT_TRUE(shown->calibrated());
  EXPECT_EQ(ar.start(request_, camera_).error().kind, ErrorKind::refused) << "one at a time";
  EXPECT_TRUE(ar.offer("left", frame_at(1)));
  EXPECT_FALSE(ar.offer("right", frame_at(1)));
  ASSERT_TRUE(ar.stop().ok());
  EXPECT_EQ(ar.status()->state(), v1::ArStatus::STOPPED);
  EXPECT_FALSE(ar.offer("left", frame_at(2)));
  EXPECT_TRUE(ar.start(request_, camera_).ok()) << "and again";
  ar.end();
  EXPECT_TRUE(test::wait_until([&] { return ar.status()->state() == v1::ArStatus::STOPPED; }));
  EXPECT_EQ(ar.start(request_, camera_).error().kind, ErrorKind::refused);
}

TEST_F(LiveArTest, AChildThatGoesGivesThePicturesBackAndTheJournalSaysSo) {
  const Subscription watcher = board_.want_pictures();
  LiveAr& ar = with_script("cat $ROOT/ready >&3; sleep 0.3; echo gone >&2; exit 7");
  ASSERT_TRUE(ar.start(request_, camera_).ok());
  std::int64_t now = 0;
  EXPECT_TRUE(test::wait_until([&] { return !ar.offer("left", frame_at(++now)); }));
  EXPECT_EQ(ar.status()->state(), v1::ArStatus::FAILED);
  EXPECT_THAT(ar.status()->error(), HasSubstr("exit code 7: gone"));
  ASSERT_EQ(board_.notices(0).size(), 1U);
  EXPECT_THAT(board_.notices(0)[0].text(), HasSubstr("left"));
}

}  // namespace
}  // namespace emberlock::daemon
