// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <csignal>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/clock.h"
#include "tests/support/wait.h"
#include "tests/vm/v4l2/vivid.h"

// One camera of the kernel's vivid, filmed as any.
namespace emberlock {
namespace {

using testing::HasSubstr;

class V4l2Vivid : public Vivid {
 protected:
  V4l2Vivid() : Vivid(2) {}

  /// Films `n` frames, and holds the counts to their numbers.
  static std::vector<Frame> film(drivers::Camera& camera, int n) {
    std::vector<Frame> frames;
    for (int i = 0; i < n; ++i) {
      auto frame = camera.next_frame(test::kHangGuard);
      EXPECT_TRUE(frame.ok()) << frame.error().message();
      if (!frame) return frames;
      frames.push_back(*frame);
    }
    return frames;
  }
};

std::uint64_t accounted_for(const drivers::FrameCounts& counts) {
  return counts.delivered + counts.damaged + counts.passed_over + counts.lost();
}

TEST_F(V4l2Vivid, IsFoundByWhereItIsWithItsModes) {
  const auto found = drivers::v4l2_driver().find();
  ASSERT_TRUE(found.ok()) << found.error().message();
  ASSERT_EQ(found->size(), 2U);
  for (int i = 0; i < 2; ++i) EXPECT_EQ((*found)[i].id, id(i));
  EXPECT_EQ((*found)[0].model, "vivid");
  EXPECT_THAT((*found)[0].address, HasSubstr("/dev/video"));
  EXPECT_EQ((*found)[0].reset, ShutterReset::on_command);
  const drivers::CameraMode yuyv{{{640, 360}, PixelFormat::rgb8, 8}, "YUYV", Hertz(40)};
  const drivers::CameraMode gray{{{1280, 720}, PixelFormat::gray8, 8}, "GREY", Hertz(12.5)};
  const auto has = [&](const drivers::CameraMode& wanted) {
    return std::any_of((*found)[0].modes.begin(), (*found)[0].modes.end(),
                       [&](const drivers::CameraMode& mode) {
                         return mode.layout == wanted.layout && mode.encoding == wanted.encoding &&
                                std::abs(mode.frame_rate / wanted.frame_rate - 1) < 0.01;
                       });
  };
  EXPECT_TRUE(has(yuyv));
  EXPECT_TRUE(has(gray));
}

TEST_F(V4l2Vivid, FilmsInEachFormatWithNoFrameUnaccountedFor) {
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_rggb16, PixelFormat::rgb8}) {
    SCOPED_TRACE(name(format));
    drivers::CameraRequest request = small_gray();
    request.format = format;
    const auto camera = filming(id(1), request);
    ASSERT_NE(camera, nullptr);
    const auto frames = film(*camera, 5);
    ASSERT_EQ(frames.size(), 5U);
    EXPECT_EQ(camera->info().frame_rate, Hertz(15));
    EXPECT_EQ(frames[0].image->layout(), camera->info().layout);
    EXPECT_EQ(accounted_for(camera->counts()), frames.back().stamp.frame_id + 1);
    EXPECT_EQ(camera->counts().delivered, 5U);
    // vivid shows bars of colours: not all alike.
    const auto& bytes = frames.back().image->bytes();
    EXPECT_NE(*std::min_element(bytes.begin(), bytes.end()), *std::max_element(bytes.begin(), bytes.end()));
  }
}

TEST_F(V4l2Vivid, StampsFramesByTheMonotonicClock) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  EXPECT_NE(camera->info().device_time_of, drivers::DeviceTimeOf::unknown);
  const auto frames = film(*camera, 10);
  ASSERT_EQ(frames.size(), 10U);
  for (const Frame& frame : frames) {
    // vivid draws a frame at its begin, and states its end.
    EXPECT_LT(abs(frame.stamp.monotonic_time - frame.stamp.device_time), milliseconds(500));
  }
  const auto& first = frames.front().stamp;
  const auto& last = frames.back().stamp;
  const Seconds a_frame =
      (last.device_time - first.device_time) / static_cast<double>(last.frame_id - first.frame_id);
  EXPECT_NEAR(a_frame.value(), 1.0 / 15, 1e-3);
}

TEST_F(V4l2Vivid, RefusesWhatItCantFilmAndSaysWhatItCan) {
  const auto camera = drivers::v4l2_driver().open(id(0), {.size = ImageSize{123, 45}});
  ASSERT_FALSE(camera.ok());
  EXPECT_EQ(camera.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(camera.error().message(), HasSubstr("640 x 360"));
  const auto unknown = drivers::v4l2_driver().open("vivid.7", {});
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.error().kind, ErrorKind::device);
}

TEST_F(V4l2Vivid, SetsControlsByNameAndRefusesWrongOnes) {
  drivers::CameraRequest request = small_gray();
  request.controls = {{"Brightness", "100"}, {"Horizontal Flip", "on"}, {"Test Pattern", "100% Black"}};
  const auto camera = filming(id(0), request);
  ASSERT_NE(camera, nullptr);
  EXPECT_EQ(film(*camera, 1).size(), 1U);
  for (const auto& [name, value, says] : std::vector<std::tuple<std::string, std::string, std::string>>{
           {"Brightness", "9999", "from 0 to 255"},
           {"Horizontal Flip", "maybe", "on or off"},
           {"Test Pattern", "Rainbow", "16x16 Checkers"},
           {"Shininess", "1", "Brightness"}}) {
    request.controls = {{name, value}};
    const auto refused = drivers::v4l2_driver().open(id(1), request);
    ASSERT_FALSE(refused.ok()) << name;
    EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(refused.error().message(), HasSubstr(says));
  }
}

TEST_F(V4l2Vivid, CountsWhatTheCameraDropped) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  ASSERT_EQ(film(*camera, 1).size(), 1U);
  Vivid::control(0, "Percentage of Dropped Buffers", "50");
  const auto frames = film(*camera, 15);
  ASSERT_EQ(frames.size(), 15U);
  EXPECT_GT(camera->counts().camera_gap, 0U);
  EXPECT_EQ(accounted_for(camera->counts()), frames.back().stamp.frame_id + 1);
}

TEST_F(V4l2Vivid, CountsAsUnderrunWhatCameWhileNoBufferWasFree) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  ASSERT_EQ(film(*camera, 1).size(), 1U);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));  // 18 frames, for 8 buffers
  const auto frames = film(*camera, 12);
  ASSERT_EQ(frames.size(), 12U);
  EXPECT_GE(camera->counts().underrun, 6U);
  EXPECT_EQ(accounted_for(camera->counts()), frames.back().stamp.frame_id + 1);
}

TEST_F(V4l2Vivid, HandsOnBrokenFramesAsDamaged) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  ASSERT_EQ(film(*camera, 1).size(), 1U);
  Vivid::control(0, "Inject V4L2_BUF_FLAG_ERROR", "1");
  const auto frames = film(*camera, 10);
  const auto damaged = std::count_if(frames.begin(), frames.end(), [](const Frame& frame) {
    return frame.stamp.status == FrameStatus::damaged;
  });
  EXPECT_EQ(damaged, 1);
  EXPECT_EQ(camera->counts().damaged, 1U);
}

TEST_F(V4l2Vivid, FilmsOnWhenABufferIsRefused) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  for (int i = 0; i < 10; ++i) {
    Vivid::control(0, "Inject VIDIOC_QBUF Error", "1");
    ASSERT_EQ(film(*camera, 2).size(), 2U);
  }
}

TEST_F(V4l2Vivid, SaysThatItDoesNotStartAndStartsTheNextTime) {
  auto opened = drivers::v4l2_driver().open(id(0), small_gray());
  ASSERT_TRUE(opened.ok()) << opened.error().message();
  drivers::Camera& camera = **opened;
  Vivid::control(0, "Inject VIDIOC_STREAMON Error", "1");
  const Status refused = camera.start();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::device);
  const Status started = camera.start();
  ASSERT_TRUE(started.ok()) << started.error().message();
  EXPECT_EQ(film(camera, 3).size(), 3U);
}

TEST_F(V4l2Vivid, IsLostOnceByAFatalErrorAndFoundAgain) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  const auto before = film(*camera, 3);
  ASSERT_EQ(before.size(), 3U);
  Vivid::control(0, "Inject Fatal Streaming Error", "1");
  Result<Frame> next = Error{};
  do {
    next = camera->next_frame(test::kHangGuard);
  } while (next.ok());
  EXPECT_EQ(next.error().kind, ErrorKind::device);
  const Status started = camera->start();
  ASSERT_TRUE(started.ok()) << started.error().message();
  const auto after = film(*camera, 3);
  ASSERT_EQ(after.size(), 3U);
  EXPECT_GT(after[0].stamp.frame_id, before[2].stamp.frame_id);
  EXPECT_EQ(accounted_for(camera->counts()), after.back().stamp.frame_id + 1);
}

TEST_F(V4l2Vivid, DropsWhatNobodyWantsAndSaysHowMuch) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  ASSERT_EQ(film(*camera, 1).size(), 1U);
  std::this_thread::sleep_for(std::chrono::milliseconds(350));
  const TimePoint until = SteadyClock().now();
  const auto dropped = camera->pass_over(until);
  EXPECT_GE(dropped, 3U);
  EXPECT_EQ(camera->counts().passed_over, dropped);
  const auto frames = film(*camera, 2);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_GT(frames[0].stamp.device_time, until);
  EXPECT_EQ(accounted_for(camera->counts()), frames.back().stamp.frame_id + 1);
}

TEST_F(V4l2Vivid, ResetsItsShutterWithoutLosingCount) {
  const auto camera = filming(id(0));
  ASSERT_NE(camera, nullptr);
  auto frames = film(*camera, 3);
  ASSERT_EQ(frames.size(), 3U);
  const TimePoint at = SteadyClock().now() + milliseconds(50);
  const Status reset = camera->reset_shutter(at);
  ASSERT_TRUE(reset.ok()) << reset.error().message();
  frames = film(*camera, 3);
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_GT(frames[0].stamp.device_time, at);
  EXPECT_EQ(accounted_for(camera->counts()), frames.back().stamp.frame_id + 1);
  EXPECT_EQ(camera->counts().lost(), 0U);
}

TEST_F(V4l2Vivid, NamesTheProcessThatHoldsIt) {
  int ready[2];
  ASSERT_EQ(::pipe(ready), 0);
  const pid_t holder = ::fork();
  if (holder == 0) {
    const auto camera = drivers::v4l2_driver().open(id(0), small_gray());
    const char answer = camera.ok() ? 'y' : 'n';
    (void)!::write(ready[1], &answer, 1);
    ::pause();
    ::_exit(0);
  }
  char answer = 0;
  ASSERT_EQ(::read(ready[0], &answer, 1), 1);
  ASSERT_EQ(answer, 'y');

  const auto refused = drivers::v4l2_driver().open(id(0), small_gray());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::device);
  EXPECT_THAT(refused.error().message(), HasSubstr(fmt::format("process {}", holder)));
  const auto found = drivers::v4l2_driver().find();
  ASSERT_TRUE(found.ok());
  ASSERT_TRUE((*found)[0].holder);
  EXPECT_EQ((*found)[0].holder->pid, holder);
  EXPECT_FALSE((*found)[1].holder);

  ::kill(holder, SIGKILL);
  ::waitpid(holder, nullptr, 0);
  ::close(ready[0]);
  ::close(ready[1]);
  EXPECT_EQ(film(*filming(id(0)), 1).size(), 1U);
}

}  // namespace
}  // namespace emberlock
