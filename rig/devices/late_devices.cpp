// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/late_devices.h"

namespace emberlock::rig {

LateCamera::LateCamera(drivers::CameraInfo expected, Open open, Configure configure)
    : info_(std::move(expected)), open_(std::move(open)), configure_(std::move(configure)) {
  configure_(info_);
}

Error LateCamera::absent() const {
  return {ErrorKind::device, "it isn't there", "camera " + info_.id, "plug it in, or switch it on"};
}

Status LateCamera::start() {
  if (!camera_) {
    EMBERLOCK_ASSIGN_OR_RETURN(camera_, open_());
    info_ = camera_->info();
    configure_(info_);
  }
  return camera_->start();
}

void LateCamera::stop() {
  if (camera_) camera_->stop();
}

Result<Frame> LateCamera::next_frame(Seconds deadline) {
  if (!camera_) return absent();
  return camera_->next_frame(deadline);
}

Status LateCamera::reset_shutter(TimePoint at) {
  if (!camera_) return absent();
  return camera_->reset_shutter(at);
}

Status LateCamera::trim_rate(PartsPerMillion trim) {
  if (!camera_) return absent();
  return camera_->trim_rate(trim);
}

Status LateStrobe::open() {
  if (strobe_) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(strobe_, open_());
  return {};
}

Status LateStrobe::apply(const drivers::StrobeSettings& settings) {
  EMBERLOCK_RETURN_IF_ERROR(open());
  return strobe_->apply(settings);
}

Result<drivers::StrobeSettings> LateStrobe::read_back() {
  EMBERLOCK_RETURN_IF_ERROR(open());
  return strobe_->read_back();
}

}  // namespace emberlock::rig
