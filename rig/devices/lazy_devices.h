// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>

#include "drivers/camera.h"
#include "drivers/strobe.h"

// Devices that are opened when they become available.
namespace emberlock::rig {

/// A camera that is opened by start(). Until then info() is `expected`, afterwards the device's, in both
/// cases changed by `configure`. Use it on a CameraThread, because opening takes time.
class LazyCamera final : public drivers::Camera {
 public:
  using Open = std::function<Result<std::unique_ptr<drivers::Camera>>()>;
  using Configure = std::function<void(drivers::CameraInfo&)>;
  LazyCamera(drivers::CameraInfo expected, Open open, Configure configure);

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

/// A strobe that is opened by the first call; every call tries again until that succeeds.
class LazyStrobe final : public drivers::Strobe {
 public:
  using Open = std::function<Result<std::unique_ptr<drivers::Strobe>>()>;
  LazyStrobe(std::string id, Open open) : id_(std::move(id)), open_(std::move(open)) {}

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
