// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <deque>
#include <memory>
#include <optional>
#include <string>

#include "drivers/driver.h"
#include "drivers/v4l2/device.h"
#include "drivers/v4l2/frame_numbers.h"
#include "drivers/v4l2/jpeg.h"
#include "drivers/v4l2/modes.h"

namespace emberlock::drivers {

/// A V4L2 camera. Its buffers are mapped as soon as it is opened, so that no other process can use it.
class V4l2Camera final : public Camera {
 public:
  static Result<std::unique_ptr<Camera>> open(const std::string& id, const CameraRequest& request);

  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return counts_; }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override;
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

 private:
  /// An opened device with its settings.
  struct SetUp {
    V4l2Device device;
    std::string model;
    V4l2Mode mode;
    Hertz frame_rate;
    std::size_t stride;
    DeviceTimeOf time_of;
    Seconds transport;
  };
  /// Opens the device in the mode that fits the request best, or in the mode that it had before.
  static Result<SetUp> set_up(const std::string& id, const CameraRequest& request,
                              const std::optional<V4l2Mode>& before);
  V4l2Camera(const std::string& id, const CameraRequest& request, SetUp set_up);

  /// The frame's stamp from the device's time and sequence number; counts missing frames before it.
  FrameStamp stamp(const v4l2_buffer& buffer);
  [[nodiscard]] DecodedJpeg picture(const V4l2Device::Filled& filled) const;
  Frame hand_on(const V4l2Device::Filled& filled);
  void drop(const V4l2Device::Filled& filled);
  void give_back(std::uint32_t index);
  Error lost(int error);
  [[nodiscard]] Error not_filming() const;
  [[nodiscard]] std::string where() const { return "camera " + info_.id; }

  CameraInfo info_;
  CameraRequest request_;
  V4l2Mode mode_;
  std::optional<SetUp> set_up_;  ///< empty: the camera is gone
  FrameNumbers numbers_;
  FrameCounts counts_;
  bool films_ = false;
  std::optional<V4l2Device::Filled> held_;  ///< fetched from the kernel by pass_over(), but to be handed on
  std::deque<TimePoint> given_back_;        ///< times at which the last buffers were queued, latest last
  bool starved_ = false;                    ///< the kernel had no free buffer at the frame before
};

}  // namespace emberlock::drivers
