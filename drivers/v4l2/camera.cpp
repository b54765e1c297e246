// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/camera.h"

#include <algorithm>
#include <cstring>
#include <utility>

#include "base/clock.h"
#include "drivers/v4l2/controls.h"
#include "drivers/v4l2/nodes.h"

namespace emberlock::drivers {
namespace {

/// Frames queued in the kernel: half a second at 15 frames/s.
constexpr std::uint32_t kBuffers = 8;
/// Duration of one wait: a device that disappears silently is noticed within this time.
constexpr Seconds kSlice = milliseconds(200);
constexpr double kUvcHolds =
    3;  // frames in the camera and on the bus: one being exposed, one encoded, one sent

TimePoint now() { return SteadyClock().now(); }

TimePoint time_of(const v4l2_buffer& buffer) {
  return {static_cast<std::int64_t>(buffer.timestamp.tv_sec) * 1'000'000'000 +
          buffer.timestamp.tv_usec * 1000};
}

DeviceTimeOf meaning_of(std::uint32_t flags) {
  if ((flags & V4L2_BUF_FLAG_TIMESTAMP_MASK) != V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC)
    return DeviceTimeOf::unknown;
  return (flags & V4L2_BUF_FLAG_TSTAMP_SRC_MASK) == V4L2_BUF_FLAG_TSTAMP_SRC_SOE
             ? DeviceTimeOf::exposure_start
             : DeviceTimeOf::frame_end;
}

/// Sets size and encoding. Returns the bytes per row.
Result<std::size_t> set_format(const V4l2Device& device, const V4l2Mode& mode, const std::string& where) {
  v4l2_format format{};
  format.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  format.fmt.pix.width = static_cast<std::uint32_t>(mode.pixels.size.width);
  format.fmt.pix.height = static_cast<std::uint32_t>(mode.pixels.size.height);
  format.fmt.pix.pixelformat = mode.fourcc;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  const v4l2_pix_format asked = format.fmt.pix;
  if (const int error = device.ioctl(VIDIOC_S_FMT, &format); error != 0) {
    return device.refused("setting the pixel format", error);
  }
  const v4l2_pix_format& set = format.fmt.pix;
  if (set.width != asked.width || set.height != asked.height || set.pixelformat != asked.pixelformat) {
    return Error{ErrorKind::device, "it offers " + mode.mode.encoding + " and then sends something else",
                 where, "choose another size or pixel format"};
  }
  if (set.field != V4L2_FIELD_NONE && set.field != V4L2_FIELD_ANY) {
    return Error{ErrorKind::device, "its pictures are interlaced so", where, "choose another size"};
  }
  return std::max<std::size_t>(set.bytesperline, row_bytes(mode.pixels));
}

Result<V4l2Mode> choose(const std::vector<V4l2Mode>& offered, const CameraRequest& request,
                        const std::string& where) {
  std::vector<CameraMode> modes;
  modes.reserve(offered.size());
  for (const V4l2Mode& mode : offered) modes.push_back(mode.mode);
  EMBERLOCK_ASSIGN_OR_RETURN(const CameraMode chosen, choose_mode(modes, request, where));
  return offered[static_cast<std::size_t>(std::find(modes.begin(), modes.end(), chosen) - modes.begin())];
}

/// Sets the rate. Returns the resulting one; the mode's own if it can't be set.
Hertz set_rate(const V4l2Device& device, const V4l2Mode& mode, std::optional<Hertz> wanted) {
  v4l2_streamparm parameters{};
  parameters.type = V4L2_BUF_TYPE_VIDEO_CAPTURE;
  parameters.parm.capture.timeperframe = interval_for(mode, wanted);
  if (device.ioctl(VIDIOC_S_PARM, &parameters) != 0) return mode.mode.frame_rate;
  const Hertz set = rate_of(parameters.parm.capture.timeperframe);
  return set > Hertz(0) ? set : mode.mode.frame_rate;
}

}  // namespace

Result<V4l2Camera::SetUp> V4l2Camera::set_up(const std::string& id, const CameraRequest& request,
                                             const std::optional<V4l2Mode>& before) {
  const std::string where = "camera " + id;
  const auto node = find_video_node(list_video_nodes(), id);
  if (!node) {
    return Error{ErrorKind::device, "it isn't there", where,
                 "plug it in; `emberlock devices` lists what there is"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(V4l2Device device, V4l2Device::open(node->device, where));
  const auto card = device.camera_card();
  if (!card) return Error{ErrorKind::device, node->device.string() + " is no camera that streams", where, {}};
  if (device.in_use()) return held_error(node->device, where);

  V4l2Mode mode;
  if (before) {
    mode = *before;
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(mode,
                               choose(list_modes(device.as_ioctl(), request.size).modes, request, where));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t stride, set_format(device, mode, where));
  const Hertz frame_rate = set_rate(device, mode, request.frame_rate);
  if (request.exposure) EMBERLOCK_RETURN_IF_ERROR(set_exposure(device.as_ioctl(), *request.exposure, where));
  for (const auto& [name, value] : request.controls) {
    EMBERLOCK_RETURN_IF_ERROR(set_control(device.as_ioctl(), name, value, where));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::uint32_t flags, device.map_buffers(kBuffers));
  const Seconds transport = device.is_uvc() ? kUvcHolds * period(frame_rate) : Seconds(0);
  return SetUp{std::move(device), *card, mode, frame_rate, stride, meaning_of(flags), transport};
}

Result<std::unique_ptr<Camera>> V4l2Camera::open(const std::string& id, const CameraRequest& request) {
  EMBERLOCK_ASSIGN_OR_RETURN(SetUp found, set_up(id, request, {}));
  return std::unique_ptr<Camera>(new V4l2Camera(id, request, std::move(found)));
}

V4l2Camera::V4l2Camera(const std::string& id, const CameraRequest& request, SetUp set_up)
    : info_{.id = id,
            .model = set_up.model,
            .layout = set_up.mode.mode.layout,
            .frame_rate = set_up.frame_rate,
            .reset = ShutterReset::on_command,
            .device_time_of = set_up.time_of,
            .transport = set_up.transport},
      request_(request),
      mode_(set_up.mode),
      set_up_(std::move(set_up)),
      numbers_(info_.device_time_of == DeviceTimeOf::unknown ? Seconds(0) : period(info_.frame_rate)) {}

Status V4l2Camera::start() {
  if (films_) return {};
  if (!set_up_) {
    EMBERLOCK_ASSIGN_OR_RETURN(SetUp found, set_up(info_.id, request_, mode_));
    if (found.frame_rate != info_.frame_rate) {
      return Error{ErrorKind::device, "it came back, but films at another rate than before", where(),
                   "open it anew"};
    }
    set_up_ = std::move(found);
  }
  if (const Status started = set_up_->device.stream_on(); !started) {
    set_up_.reset();
    return started.error();
  }
  numbers_.restart();
  given_back_.clear();
  starved_ = false;
  films_ = true;
  return {};
}

void V4l2Camera::stop() {
  if (!films_) return;
  pass_over(now());
  if (held_) drop(*std::exchange(held_, {}));
  set_up_->device.stream_off();
  films_ = false;
}

Result<Frame> V4l2Camera::next_frame(Seconds deadline) {
  if (!films_) return not_filming();
  if (held_) return hand_on(*std::exchange(held_, {}));
  const TimePoint until = now() + deadline;
  while (true) {
    const auto taken = set_up_->device.take();
    if (taken.filled) return hand_on(*taken.filled);
    if (taken.error != 0) return lost(taken.error);
    const Seconds left = until - now();
    if (left <= Seconds(0)) {
      return Error{ErrorKind::timed_out, "no frame in time", where(), "wait longer than a frame period"};
    }
    set_up_->device.wait(std::min(left, kSlice));
  }
}

std::uint64_t V4l2Camera::pass_over(TimePoint until) {
  std::uint64_t dropped = 0;
  while (films_) {
    if (!held_) {
      const auto taken = set_up_->device.take();
      // A lost device is reported by next_frame.
      if (!taken.filled) break;
      held_ = taken.filled;
    }
    const bool by_our_clock = info_.device_time_of != DeviceTimeOf::unknown;
    if (by_our_clock && time_of(held_->buffer) > until) break;
    drop(*std::exchange(held_, {}));
    ++dropped;
  }
  return dropped;
}

Status V4l2Camera::reset_shutter(TimePoint at) {
  if (!films_) return not_filming();
  SteadyClock().sleep_until(at);
  stop();
  return start();
}

Status V4l2Camera::trim_rate(PartsPerMillion /*trim*/) {
  return Error{ErrorKind::device, "its frame rate can't be trimmed", where(),
               "choose a camera that `devices` says can"};
}

FrameStamp V4l2Camera::stamp(const v4l2_buffer& buffer) {
  const TimePoint device_time = time_of(buffer);
  const auto number = numbers_.next(buffer.sequence, device_time);
  (starved_ ? counts_.underrun : counts_.camera_gap) += number.missing;
  // The kernel had no further free buffer if, when this frame was filled, the oldest of the others hadn't
  // been queued again.
  starved_ = given_back_.size() + 1 >= set_up_->device.buffers() && given_back_.front() > device_time;
  FrameStamp stamp{number.frame_id, device_time, wall_clock(), now(), FrameStatus::complete};
  const std::size_t needed =
      is_jpeg(mode_.fourcc) ? 1 : (mode_.pixels.size.height - 1) * set_up_->stride + row_bytes(mode_.pixels);
  const bool whole = (buffer.flags & V4L2_BUF_FLAG_ERROR) == 0 && buffer.bytesused >= needed;
  if (!whole) stamp.status = FrameStatus::damaged;
  return stamp;
}

DecodedJpeg V4l2Camera::picture(const V4l2Device::Filled& filled) const {
  if (is_jpeg(mode_.fourcc)) {
    return decode_jpeg(
        filled.bytes.first(std::min<std::size_t>(filled.buffer.bytesused, filled.bytes.size())),
        mode_.pixels.size);
  }
  // The only copy. Missing parts of a damaged frame show an older frame's content.
  auto image = unpack(mode_.pixels, filled.bytes, set_up_->stride);
  if (!image) return {Image(info_.layout), FrameStatus::damaged};
  return {std::move(image).value(), FrameStatus::complete};
}

Frame V4l2Camera::hand_on(const V4l2Device::Filled& filled) {
  FrameStamp stamped = stamp(filled.buffer);
  auto [image, status] = picture(filled);
  give_back(filled.buffer.index);
  if (status == FrameStatus::damaged) stamped.status = status;
  ++(stamped.status == FrameStatus::complete ? counts_.delivered : counts_.damaged);
  return Frame{stamped, std::make_shared<const Image>(std::move(image))};
}

void V4l2Camera::drop(const V4l2Device::Filled& filled) {
  (void)stamp(filled.buffer);
  give_back(filled.buffer.index);
  ++counts_.passed_over;
}

void V4l2Camera::give_back(std::uint32_t index) {
  set_up_->device.queue(index);
  given_back_.push_back(now());
  if (given_back_.size() >= set_up_->device.buffers()) given_back_.pop_front();
}

Error V4l2Camera::lost(int error) {
  set_up_.reset();
  held_.reset();
  films_ = false;
  return {ErrorKind::device, std::string("it is lost (") + std::strerror(error) + ")", where(),
          "plug it in again, or see what its cable and hub do"};
}

Error V4l2Camera::not_filming() const {
  return {ErrorKind::device, "it does not film", where(), "start() it first"};
}

}  // namespace emberlock::drivers
