// SPDX-License-Identifier: Apache-2.0
// The least that a camera is (CONTRIBUTING.md, "A camera"). A driver takes pixels and stamps from its device;
// this one makes them up.
#include "drivers/camera.h"

#include <algorithm>
#include <memory>
#include <string>
#include <utility>

#include <gtest/gtest.h>

#include "base/clock.h"
#include "drivers/virtual/virtual_clock.h"

namespace emberlock::drivers {
namespace {

/// Films a grey wall, a frame each period of the clock that it is given.
class GreyWall final : public Camera {
 public:
  GreyWall(std::string id, Clock& clock) : clock_(clock) {
    info_.id = std::move(id);
    info_.model = "Example";
    info_.layout = {{64, 48}, PixelFormat::gray8, 8};
    info_.frame_rate = Hertz(200);
  }
  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return counts_; }

  Status start() override {
    next_ = clock_.now() + period(info_.frame_rate);
    films_ = true;
    return {};
  }
  void stop() override { films_ = false; }

  Result<Frame> next_frame(Seconds deadline) override {
    if (!films_) return Error{ErrorKind::device, "doesn't film", info_.id, "Start it first"};
    if (next_ > clock_.now() + deadline)
      return Error{ErrorKind::timed_out, "no frame came in time", info_.id};
    clock_.sleep_until(next_);
    Image wall(info_.layout);
    std::ranges::fill(wall.bytes(), std::byte{128});
    Frame frame;
    frame.stamp.frame_id = counts_.made();
    frame.stamp.monotonic_time = clock_.now();
    frame.image = std::make_shared<const Image>(std::move(wall));
    ++counts_.delivered;
    next_ = next_ + period(info_.frame_rate);
    return frame;
  }
  std::uint64_t pass_over(TimePoint until) override {
    std::uint64_t passed = 0;
    for (; next_ <= until; next_ = next_ + period(info_.frame_rate)) ++passed;
    counts_.passed_over += passed;
    return passed;
  }
  // CameraInfo says that it can do neither.
  Status reset_shutter(TimePoint) override { return cannot("its shutter can't be reset"); }
  Status trim_rate(PartsPerMillion) override { return cannot("its frame rate can't be trimmed"); }

 private:
  [[nodiscard]] Error cannot(const char* what) const { return {ErrorKind::device, what, info_.id}; }

  Clock& clock_;
  CameraInfo info_;
  FrameCounts counts_;
  TimePoint next_;
  bool films_ = false;
};

TEST(ExampleCamera, FilmsAndCountsEachFrameOnce) {
  VirtualClock clock;
  GreyWall camera("wall-1", clock);
  EXPECT_EQ(camera.next_frame(Seconds(1)).error().kind, ErrorKind::device);
  ASSERT_TRUE(camera.start().ok());
  for (std::uint64_t i = 0; i < 3; ++i) {
    const auto frame = camera.next_frame(Seconds(1));
    ASSERT_TRUE(frame.ok());
    EXPECT_EQ(frame->stamp.frame_id, i);
    EXPECT_EQ(frame->image->layout(), camera.info().layout);
  }
  EXPECT_EQ(camera.next_frame(Seconds(0)).error().kind, ErrorKind::timed_out);
  const std::uint64_t passed = camera.pass_over(clock.now() + Seconds(0.05));
  EXPECT_GE(passed, 9U);
  EXPECT_EQ(camera.counts().made(), 3 + passed);
  EXPECT_EQ(camera.reset_shutter(clock.now()).error().kind, ErrorKind::device);
}

}  // namespace
}  // namespace emberlock::drivers
