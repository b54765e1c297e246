// SPDX-License-Identifier: Apache-2.0
// Whole frames: the strobe plays the code, cameras of different counts and phases film it, and each is
// numbered.
#include <cmath>

#include <gtest/gtest.h>

#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "smear_sync/clocks/frame_code.h"
#include "smear_sync/clocks/phase.h"
#include "smear_sync/detect/detect.h"

namespace emberlock {
namespace {

struct Filmed {
  std::vector<smear::CodeFrame> frames;
  std::vector<smear::SmearReading> readings;
};

TEST(FrameCodeRun, EveryVirtualCameraIsNumberedAndADroppedFrameIsCaught) {
  drivers::VirtualRigOptions setup =
      drivers::draw_virtual_rig({.cameras = 3, .seed = 5, .layout = {.size = {160, 720}}});
  for (drivers::VirtualCameraOptions& camera : setup.cameras) camera.lamp.x = 80;
  auto rig = drivers::VirtualRig::create(setup, std::make_shared<drivers::VirtualClock>()).value();
  const smear::FrameCode code{.words = 4, .spacing = 50};
  drivers::StrobeSettings flashes{.output = drivers::StrobeOutput::flashing, .rate = Hertz(23.976)};
  flashes.code = smear::flash_pattern(code).value();
  ASSERT_TRUE(rig->strobe().apply(flashes).ok());
  const double flash_period = 1 / rig->strobe().read_back().value().rate.value();

  constexpr int kFrames = 150;
  constexpr int kLost = 95;  // by camera 2, which doesn't count it
  std::vector<Filmed> filmed(3);
  // The cameras are started 17 frames after one another.
  std::vector<std::uint64_t> first_id(3, 0);
  for (int start = 0; start < 3; ++start) {
    ASSERT_TRUE(rig->camera(start).start().ok());
    for (int i = 0; i < 17; ++i) {
      for (int camera = 0; camera <= start; ++camera)
        ASSERT_TRUE(rig->camera(camera).next_frame(Seconds(1)).ok());
    }
  }
  for (int i = 0; i < kFrames; ++i) {
    for (int camera = 0; camera < 3; ++camera) {
      const Frame frame = rig->camera(camera).next_frame(Seconds(1)).value();
      if (i == 0) first_id[camera] = frame.stamp.frame_id;
      if (camera == 2 && i == kLost) continue;
      Filmed& f = filmed[camera];
      f.readings.push_back(smear::detect(frame.image->view()));
      f.frames.push_back({static_cast<std::int64_t>(f.frames.size()), smear::flash_seen(f.readings.back())});
    }
  }

  std::vector<smear::FrameNumbers> numbers;
  for (int camera = 0; camera < 3; ++camera) {
    const smear::CcdTiming& truth = rig->truth(camera).timing;
    // tau of the first frame, as the truth has it: the strobe was told at the clock's zero.
    const double tau =
        wrap_positive(-(rig->read_start(camera, first_id[camera]) - TimePoint{}).value(), flash_period);
    smear::DecodeOptions options{.code = code,
                                 .flashes_per_frame = truth.frame_period.value() / flash_period};
    options.first_phase = tau / flash_period;
    numbers.push_back(smear::number_frames(filmed[camera].frames, options).value());
    ASSERT_FALSE(numbers.back().runs.empty()) << numbers.back().reason;
    const double start = (rig->read_start(camera, first_id[camera]) - TimePoint{}).value() / flash_period;
    EXPECT_NEAR(wrap_symmetric(numbers.back().runs[0].start - start, code.flashes()), 0, 0.01)
        << "camera " << camera;
  }
  EXPECT_TRUE(numbers[0].drops.empty());
  EXPECT_TRUE(numbers[1].drops.empty());
  ASSERT_EQ(numbers[2].drops.size(), 1U) << numbers[2].reason;
  EXPECT_EQ(numbers[2].drops[0].frames, 1);
  EXPECT_LT(numbers[2].drops[0].after, kLost);
  EXPECT_GE(numbers[2].drops[0].before, kLost);

  // Which frames belong together, against the true starts of the read phases.
  const auto offset = smear::frame_offset(numbers[0].runs[0], numbers[1].runs[0], code, 40);
  const TimePoint mine = rig->read_start(0, first_id[0] + 40);
  const auto other = static_cast<std::uint64_t>(static_cast<std::int64_t>(first_id[1]) + 40 + offset.frames);
  EXPECT_LE(std::abs((mine - rig->read_start(1, other)).value()), 0.5 * flash_period + 1e-6);
  EXPECT_NEAR((mine - rig->read_start(1, other)).value() / flash_period, offset.lag, 0.01);
}

}  // namespace
}  // namespace emberlock
