// SPDX-License-Identifier: Apache-2.0
// What is there, who has it, and what it is asked for.
#include <algorithm>
#include <csignal>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include "tests/integration/aravis/bed_test.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {

using namespace testing_support;
using ::testing::Contains;
using ::testing::HasSubstr;

class FindAndSetUp : public AravisBed {};

TEST_F(FindAndSetUp, ElevenCamerasAreFoundBySerialWithWhatTheyCan) {
  const auto cameras = fakes(11, "FIND");
  const TimePoint before = clock.now();
  const auto found = driver.find();
  EXPECT_LT((clock.now() - before).value(), 3.0);
  ASSERT_TRUE(found.ok()) << found.error().message();
  ASSERT_EQ(found->size(), 11U);
  for (const auto& fake : cameras) {
    const auto it = std::find_if(found->begin(), found->end(),
                                 [&](const drivers::CameraFound& one) { return one.id == fake->serial(); });
    ASSERT_NE(it, found->end()) << fake->serial();
    EXPECT_EQ(it->address, fake->address());
    EXPECT_EQ(it->model, "Aravis Fake");
    EXPECT_EQ(it->modes.size(), 7U);  // Mono8, Mono16, RGB8, four Bayer mosaics
    EXPECT_EQ(it->reset, ShutterReset::on_command);
    EXPECT_EQ(it->trigger, drivers::ExternalTrigger::present);
    EXPECT_FALSE(it->holder.has_value());
    EXPECT_THAT(it->notes, Contains(HasSubstr("packets of 1400 bytes, the network takes 65536")));
  }
}

TEST_F(FindAndSetUp, AWrongIdSaysWhatIsThere) {
  const auto cameras = fakes(2, "RIGHT");
  const auto opened = driver.open("WRONG", {});
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().kind, ErrorKind::device);
  EXPECT_THAT(opened.error().message(), HasSubstr("There are RIGHT1 (Aravis Fake), RIGHT2 (Aravis Fake)"));
}

TEST_F(FindAndSetUp, WhatACameraCannotIsRefusedWithWhatItCan) {
  const auto cameras = fakes(1, "PICKY");
  const auto refusal = [&](const drivers::CameraRequest& request) {
    const auto opened = driver.open("PICKY1", request);
    EXPECT_FALSE(opened.ok());
    if (opened) return std::string();
    EXPECT_EQ(opened.error().kind, ErrorKind::bad_input) << opened.error().message();
    return opened.error().message();
  };
  drivers::CameraRequest request = small_film();
  request.size = ImageSize{9000, 9000};
  EXPECT_THAT(refusal(request), HasSubstr("9000 x 9000"));
  request = small_film();
  request.frame_rate = Hertz(5000);
  EXPECT_THAT(refusal(request), HasSubstr("at most 1000"));
  request = small_film();
  request.controls["GainAuto"] = "Sometimes";
  EXPECT_THAT(refusal(request), HasSubstr("It can be Off, Once, Continuous"));
  request.controls = {{"Gain9", "1"}};
  EXPECT_THAT(refusal(request), HasSubstr("no control Gain9"));
  request.controls = {{"GainRaw", "11"}};
  EXPECT_THAT(refusal(request), HasSubstr("It can be 0 .. 10"));
  request.controls = {{"PacketDelayNs", "-1"}};
  EXPECT_THAT(refusal(request), HasSubstr(">= 0"));
}

TEST_F(FindAndSetUp, FormatsThatLieOtherwiseInMemoryAreHandedOnWhole) {
  const auto cameras = fakes(1, "COLOUR");
  for (const auto& [format, size, depth] : {std::tuple(PixelFormat::gray16, ImageSize{64, 32}, 16),
                                            {PixelFormat::rgb8, ImageSize{64, 32}, 8},
                                            {PixelFormat::bayer_rggb8, ImageSize{64, 32}, 8}}) {
    drivers::CameraRequest request = small_film();
    request.format = format;
    request.size = size;
    request.frame_rate = Hertz(50);
    auto camera = driver.open("COLOUR1", request);
    ASSERT_TRUE(camera.ok()) << camera.error().message();
    EXPECT_EQ((*camera)->info().layout, (ImageLayout{size, format, depth}));
    ASSERT_TRUE((*camera)->start().ok());
    const auto frame = (*camera)->next_frame(Seconds(2));
    ASSERT_TRUE(frame.ok()) << frame.error().message();
    EXPECT_EQ(frame->image->layout(), (*camera)->info().layout);
    EXPECT_EQ(frame->stamp.status, FrameStatus::complete);
    if (format == PixelFormat::gray16) {  // a ramp of 256 a pixel
      const ImageView image = frame->image->view();
      EXPECT_EQ((image.sample(1, 0) - image.sample(0, 0) + 65535) % 65535, 256);
    }
  }
}

TEST_F(FindAndSetUp, ACameraThatAnotherProgramHasNamesThatProgram) {
  const auto cameras = fakes(1, "TAKEN");
  const pid_t other = ::fork();
  if (other == 0) {
    ::prctl(PR_SET_PDEATHSIG, SIGKILL);
    const int nowhere = ::open("/dev/null", O_WRONLY);
    ::dup2(nowhere, 1);
    ::dup2(nowhere, 2);
    ::execlp("arv-camera-test-0.8", "arv-camera-test-0.8", "-n", "Aravis-Fake-TAKEN1", nullptr);
    ::_exit(127);
  }
  EXPECT_TRUE(test::wait_until([&] { return !cameras[0]->sent().frames.empty(); }));
  const auto found = driver.find();
  const auto opened = driver.open("TAKEN1", small_film());
  ::kill(other, SIGKILL);
  ::waitpid(other, nullptr, 0);

  ASSERT_TRUE(found.ok() && found->size() == 1) << "found";
  ASSERT_TRUE(found->front().holder.has_value());
  EXPECT_EQ(found->front().holder->pid, other);
  EXPECT_EQ(found->front().holder->program, "arv-camera-test");  // the kernel keeps 15 letters
  EXPECT_TRUE(found->front().modes.empty());
  ASSERT_FALSE(opened.ok());
  EXPECT_EQ(opened.error().kind, ErrorKind::device);
  EXPECT_THAT(opened.error().message(),
              HasSubstr("arv-camera-test (process " + std::to_string(other) + ") has it"));
}

}  // namespace
}  // namespace emberlock
