// SPDX-License-Identifier: Apache-2.0
#include "drivers/driver.h"

#include <csignal>
#include <filesystem>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "tests/support/temp_folder.h"

namespace emberlock::drivers {
namespace {

using ::testing::HasSubstr;

CameraMode mode(ImageSize size, PixelFormat format, double rate, int depth = 8) {
  return {{size, format, depth}, std::string(name(format)), Hertz(rate)};
}

const std::vector<CameraMode> kModes{
    mode({640, 480}, PixelFormat::gray8, 60),       mode({1280, 720}, PixelFormat::gray8, 30),
    mode({1280, 720}, PixelFormat::rgb8, 30),       mode({1280, 720}, PixelFormat::bayer_rggb8, 30),
    mode({1280, 720}, PixelFormat::gray16, 15, 12), mode({1280, 720}, PixelFormat::bayer_rggb8, 25),
};

TEST(ChooseMode, WhatKeepsMostWhereNothingIsAskedFor) {
  EXPECT_EQ(choose_mode(kModes, {}, "cam").value(), kModes[3]);
}

TEST(ChooseMode, WhatIsAskedForIsKept) {
  CameraRequest request;
  request.frame_rate = Hertz(50);
  EXPECT_EQ(choose_mode(kModes, request, "cam").value(), kModes[0]);
  request = {.format = PixelFormat::gray16};
  EXPECT_EQ(choose_mode(kModes, request, "cam").value(), kModes[4]);
  request = {.size = ImageSize{640, 480}};
  EXPECT_EQ(choose_mode(kModes, request, "cam").value(), kModes[0]);
}

TEST(ChooseMode, AJpegIsTakenForItsRateAlone) {
  const std::vector<CameraMode> webcam{{{{1280, 720}, PixelFormat::rgb8, 8}, "YUYV", Hertz(10)},
                                       {{{1280, 720}, PixelFormat::rgb8, 8}, "MJPG", Hertz(30)}};
  EXPECT_EQ(choose_mode(webcam, {}, "cam").value(), webcam[0]);
  CameraRequest request;
  request.frame_rate = Hertz(24);
  EXPECT_EQ(choose_mode(webcam, request, "cam").value(), webcam[1]);
}

TEST(ChooseMode, ARateSaidWithFewDigitsIsMet) {
  const std::vector<CameraMode> film{mode({640, 480}, PixelFormat::gray8, 23.976)};
  CameraRequest request;
  request.frame_rate = Hertz(23.98);
  EXPECT_TRUE(choose_mode(film, request, "cam").ok());
  request.frame_rate = Hertz(25);
  EXPECT_FALSE(choose_mode(film, request, "cam").ok());
}

TEST(ChooseMode, ARefusalSaysWhatTheCameraCanDo) {
  CameraRequest request;
  request.size = ImageSize{1920, 1080};
  const auto refused = choose_mode(kModes, request, "camera c7");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message(), HasSubstr("camera c7: it has no pictures of 1920 x 1080"));
  EXPECT_THAT(refused.error().message(), HasSubstr("640 x 480 gray8 at 60 frames/s"));
  EXPECT_FALSE(choose_mode({}, {}, "cam").ok());
}

/// Another process that opens a file so, until it is destroyed.
class Opener {
 public:
  Opener(const std::filesystem::path& file, int flags) {
    int ready[2];
    if (::pipe(ready) != 0) return;
    pid_ = ::fork();
    if (pid_ == 0) {
      if (::open(file.c_str(), flags) < 0 || ::write(ready[1], "x", 1) != 1) ::_exit(1);
      ::pause();
      ::_exit(0);
    }
    ::close(ready[1]);
    char byte = 0;
    opened_ = ::read(ready[0], &byte, 1) == 1;
    ::close(ready[0]);
  }
  ~Opener() {
    ::kill(pid_, SIGKILL);
    ::waitpid(pid_, nullptr, 0);
  }
  Opener(const Opener&) = delete;
  Opener& operator=(const Opener&) = delete;
  bool opened() const { return opened_; }
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  bool opened_ = false;
};

class HolderOf : public testing::Test {
 protected:
  void SetUp() override { ASSERT_TRUE(UniqueFd(::open(file_.c_str(), O_RDWR | O_CREAT, 0600))); }
  const test::TempFolder folder_;
  const std::filesystem::path file_ = folder_ / "device";
};

TEST_F(HolderOf, AnotherProcessIsNamedOurselvesAreNot) {
  {
    const Opener other(file_, O_RDWR);
    ASSERT_TRUE(other.opened());
    const auto held = holder_of(file_);
    ASSERT_TRUE(held);
    EXPECT_EQ(held->pid, other.pid());
    EXPECT_FALSE(held->program.empty());
  }
  const UniqueFd ours(::open(file_.c_str(), O_RDONLY));
  EXPECT_FALSE(holder_of(file_));
  EXPECT_THAT(held_error(file_, "camera c7").message(), HasSubstr("another process"));
  std::filesystem::remove(file_);
  EXPECT_FALSE(holder_of(file_));
}

TEST_F(HolderOf, OneThatOnlyNamesItIsNone) {
  const Opener udev(file_, O_PATH);
  ASSERT_TRUE(udev.opened());
  EXPECT_FALSE(holder_of(file_));
}

}  // namespace
}  // namespace emberlock::drivers
