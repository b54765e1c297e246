// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "drivers/v4l2/controls.h"
#include "drivers/v4l2/modes.h"

namespace emberlock::drivers {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

/// A device that offers one format in given sizes and intervals, and says what it is set to.
struct FakeDevice {
  std::uint32_t fourcc = V4L2_PIX_FMT_GREY;
  std::vector<v4l2_frmsizeenum> sizes;
  std::vector<v4l2_frmivalenum> intervals;
  ImageSize size_now{640, 480};
  v4l2_fract interval_now{1, 25};

  Ioctl as_ioctl() const {
    return [*this](unsigned long request, void* argument) {
      switch (request) {
        case VIDIOC_ENUM_FMT: {
          auto& format = *static_cast<v4l2_fmtdesc*>(argument);
          format.pixelformat = fourcc;
          return format.index == 0 ? 0 : EINVAL;
        }
        case VIDIOC_ENUM_FRAMESIZES:
          return answer(sizes, argument);
        case VIDIOC_ENUM_FRAMEINTERVALS:
          return answer(intervals, argument);
        case VIDIOC_G_FMT: {
          auto& pix = static_cast<v4l2_format*>(argument)->fmt.pix;
          pix.width = static_cast<std::uint32_t>(size_now.width);
          pix.height = static_cast<std::uint32_t>(size_now.height);
          return 0;
        }
        case VIDIOC_G_PARM:
          static_cast<v4l2_streamparm*>(argument)->parm.capture.timeperframe = interval_now;
          return 0;
        default:
          return ENOTTY;
      }
    };
  }
  template <class Entry>
  static int answer(const std::vector<Entry>& entries, void* argument) {
    auto& entry = *static_cast<Entry*>(argument);
    const auto index = entry.index;
    if (index >= entries.size()) return EINVAL;
    entry = entries[index];
    entry.index = index;
    return 0;
  }
};

v4l2_frmsizeenum size(std::uint32_t width, std::uint32_t height) {
  v4l2_frmsizeenum entry{};
  entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
  entry.discrete = {width, height};
  return entry;
}

v4l2_frmivalenum interval(std::uint32_t numerator, std::uint32_t denominator) {
  v4l2_frmivalenum entry{};
  entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
  entry.discrete = {numerator, denominator};
  return entry;
}

std::vector<ImageSize> sizes_of(const V4l2Modes& all) {
  std::vector<ImageSize> sizes;
  sizes.reserve(all.modes.size());
  for (const V4l2Mode& mode : all.modes) sizes.push_back(mode.mode.layout.size);
  return sizes;
}

TEST(V4l2Modes, NameEachSizeAtItsFastestRate) {
  const FakeDevice device{.sizes = {size(640, 480), size(1280, 720)},
                          .intervals = {interval(1, 15), interval(1, 30)}};
  const V4l2Modes all = list_modes(device.as_ioctl(), {});
  ASSERT_EQ(all.modes.size(), 2U);
  EXPECT_EQ(all.modes[1].mode, (CameraMode{{{1280, 720}, PixelFormat::gray8, 8}, "GREY", Hertz(30)}));
  EXPECT_EQ(rate_of(interval_for(all.modes[0], Hertz(15))), Hertz(15));
  EXPECT_EQ(rate_of(interval_for(all.modes[0], {})), Hertz(30));
  EXPECT_EQ(rate_of(interval_for(all.modes[0], Hertz(14))), Hertz(15));
}

TEST(V4l2Modes, OfSizesByStepsAreTheUsualOnesTheEndsAndTheWantedOne) {
  v4l2_frmsizeenum steps{};
  steps.type = V4L2_FRMSIZE_TYPE_STEPWISE;
  steps.stepwise = {32, 800, 16, 20, 600, 20};
  const FakeDevice device{.sizes = {steps}, .intervals = {interval(1, 30)}};
  EXPECT_THAT(sizes_of(list_modes(device.as_ioctl(), ImageSize{64, 40})),
              ElementsAre(ImageSize{160, 120}, ImageSize{320, 240}, ImageSize{640, 360}, ImageSize{640, 480},
                          ImageSize{800, 600}, ImageSize{64, 40}, ImageSize{32, 20}));
  EXPECT_THAT(sizes_of(list_modes(device.as_ioctl(), ImageSize{65, 40})),
              testing::Not(testing::Contains(ImageSize{65, 40})));
}

TEST(V4l2Modes, OfIntervalsByStepsAnyBetweenWillDo) {
  v4l2_frmivalenum steps{};
  steps.type = V4L2_FRMIVAL_TYPE_CONTINUOUS;
  steps.stepwise = {{1, 60}, {1, 1}, {1, 1}};
  const FakeDevice device{.sizes = {size(640, 480)}, .intervals = {steps}};
  const V4l2Modes all = list_modes(device.as_ioctl(), {});
  ASSERT_EQ(all.modes.size(), 1U);
  EXPECT_EQ(all.modes[0].mode.frame_rate, Hertz(60));
  EXPECT_NEAR(rate_of(interval_for(all.modes[0], Hertz(23.976))).value(), 23.976, 1e-5);
  EXPECT_EQ(rate_of(interval_for(all.modes[0], Hertz(100))), Hertz(60));
  EXPECT_EQ(rate_of(interval_for(all.modes[0], Hertz(0.5))), Hertz(1));
}

TEST(V4l2Modes, AreWhatItIsSetToWhereItNamesNone) {
  const V4l2Modes all = list_modes(FakeDevice{}.as_ioctl(), {});
  ASSERT_EQ(all.modes.size(), 1U);
  EXPECT_EQ(all.modes[0].mode.layout.size, (ImageSize{640, 480}));
  EXPECT_EQ(all.modes[0].mode.frame_rate, Hertz(25));
}

TEST(V4l2Modes, LeaveOutWhatCantBe) {
  const FakeDevice device{
      .sizes = {size(0, 480), size(640, 0xffffffff), size(640, 480)},
      .intervals = {interval(0, 30), interval(1, 0), interval(1, 30), interval(1, 4000000000)}};
  const V4l2Modes all = list_modes(device.as_ioctl(), {});
  ASSERT_EQ(all.modes.size(), 1U);
  EXPECT_EQ(all.modes[0].intervals.size(), 1U);
}

TEST(V4l2Modes, EndWhereADeviceCountsWithoutEnd) {
  std::uint32_t calls = 0;
  const Ioctl endless = [&](unsigned long request, void* argument) {
    ++calls;
    if (request == VIDIOC_ENUM_FRAMESIZES) {
      auto& entry = *static_cast<v4l2_frmsizeenum*>(argument);
      entry.type = V4L2_FRMSIZE_TYPE_DISCRETE;
      entry.discrete = {entry.index + 1, 480};
    } else if (request == VIDIOC_ENUM_FRAMEINTERVALS) {
      auto& entry = *static_cast<v4l2_frmivalenum*>(argument);
      entry.type = V4L2_FRMIVAL_TYPE_DISCRETE;
      entry.discrete = {1, 30};
    } else {
      static_cast<v4l2_fmtdesc*>(argument)->pixelformat = V4L2_PIX_FMT_GREY;
    }
    return 0;
  };
  EXPECT_EQ(list_modes(endless, {}).modes.size(), 256U);
  EXPECT_LT(calls, 100'000U);
}

TEST(V4l2Modes, SayWhatTheyCantUse) {
  FakeDevice device;
  device.fourcc = V4L2_PIX_FMT_H264;
  const V4l2Modes all = list_modes(device.as_ioctl(), {});
  EXPECT_TRUE(all.modes.empty());
  EXPECT_THAT(all.unknown, ElementsAre("H264"));
}

TEST(V4l2Controls, AreRefusedByADeviceThatHasNone) {
  const Status refused = set_control(FakeDevice{}.as_ioctl(), "Brightness", "1", "camera 7");
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(refused.error().message(), HasSubstr("camera 7"));
}

TEST(V4l2Controls, SetTheExposureInTenthsOfAMillisecond) {
  std::vector<std::pair<std::uint32_t, int>> set;
  const Ioctl device = [&](unsigned long request, void* argument) {
    if (request != VIDIOC_S_EXT_CTRLS) return ENOTTY;
    const v4l2_ext_control& control = *static_cast<v4l2_ext_controls*>(argument)->controls;
    set.emplace_back(control.id, control.value);
    return 0;
  };
  ASSERT_TRUE(set_exposure(device, milliseconds(12.34), "camera").ok());
  EXPECT_THAT(set, ElementsAre(std::pair(V4L2_CID_EXPOSURE_AUTO, int{V4L2_EXPOSURE_MANUAL}),
                               std::pair(V4L2_CID_EXPOSURE_ABSOLUTE, 123)));
}

}  // namespace
}  // namespace emberlock::drivers
