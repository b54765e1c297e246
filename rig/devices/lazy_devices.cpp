// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/lazy_devices.h"

namespace emberlock::rig {

LazyCamera::LazyCamera(drivers::CameraInfo expected, Open open, Configure configure)
    : info_(std::move(expected)), open_(std::move(open)), configure_(std::move(configure)) {
  configure_(info_);
}

Error LazyCamera::absent() const {
  return {ErrorKind::device, "it isn't there", "camera " + info_.id, "plug it in, or switch it on"};
}

Status LazyCamera::start() {
  if (!camera_) {
    EMBERLOCK_ASSIGN_OR_RETURN(camera_, open_());
    info_ = camera_->info();
    configure_(info_);
  }
  return camera_->start();
}

void LazyCamera::stop() {
  if (camera_) camera_->stop();
}

Result<Frame> LazyCamera::next_frame(Seconds deadline) {
  if (!camera_) return absent();
  return camera_->next_frame(deadline);
}

Status LazyCamera::reset_shutter(TimePoint at) {
  if (!camera_) return absent();
  return camera_->reset_shutter(at);
}

Status LazyCamera::trim_rate(PartsPerMillion trim) {
  if (!camera_) return absent();
  return camera_->trim_rate(trim);
}

Status LazyStrobe::open() {
  if (strobe_) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(strobe_, open_());
  return {};
}

Status LazyStrobe::apply(const drivers::StrobeSettings& settings) {
  EMBERLOCK_RETURN_IF_ERROR(open());
  return strobe_->apply(settings);
}

Result<drivers::StrobeSettings> LazyStrobe::read_back() {
  EMBERLOCK_RETURN_IF_ERROR(open());
  return strobe_->read_back();
}

}  // namespace emberlock::rig
