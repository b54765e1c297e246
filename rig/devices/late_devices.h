// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "drivers/camera.h"
#include "drivers/strobe.h"

// Devices that may not be there yet.
namespace emberlock::rig {

/// A camera that start() opens once it is there. Until then it says of itself what `expected` does; from then
/// on what the device does, but for what `configured` sets. Start it on a CameraThread: opening takes a
/// while.
class LateCamera final : public drivers::Camera {
 public:
  using Open = std::function<Result<std::unique_ptr<drivers::Camera>>()>;
  using Configure = std::function<void(drivers::CameraInfo&)>;
  LateCamera(drivers::CameraInfo expected, Open open, Configure configure);

  [[nodiscard]] const drivers::CameraInfo& info() const override { return info_; }
  [[nodiscard]] drivers::FrameCounts counts() const override {
    return camera_ ? camera_->counts() : drivers::FrameCounts{};
  }
  Status start() override;
  void stop() override;
  Result<Frame> next_frame(Seconds deadline) override;
  std::uint64_t pass_over(TimePoint until) override { return camera_ ? camera_->pass_over(until) : 0; }
  Status reset_shutter(TimePoint at) override;
  Status trim_rate(PartsPerMillion trim) override;

 private:
  [[nodiscard]] Error absent() const;

  drivers::CameraInfo info_;
  Open open_;
  Configure configure_;
  std::unique_ptr<drivers::Camera> camera_;
};

/// A strobe that is opened when something is asked of it, and again until it is there.
class LateStrobe final : public drivers::Strobe {
 public:
  using Open = std::function<Result<std::unique_ptr<drivers::Strobe>>()>;
  LateStrobe(std::string id, Open open) : id_(std::move(id)), open_(std::move(open)) {}

  [[nodiscard]] const std::string& id() const override { return id_; }
  Status apply(const drivers::StrobeSettings& settings) override;
  Result<drivers::StrobeSettings> read_back() override;

 private:
  Status open();

  std::string id_;
  Open open_;
  std::unique_ptr<drivers::Strobe> strobe_;
};

}  // namespace emberlock::rig
