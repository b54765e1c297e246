// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/lent_frame.h"

#include <bit>
#include <cstring>

#include <fmt/format.h>

#include "session/layout.h"

namespace emberlock::daemon {
static_assert(std::endian::native == std::endian::little, "pixels travel in little-endian order");

v1::LentFrame to_proto(const Frame& frame, const drivers::FrameCounts& counts) {
  v1::LentFrame lent;
  lent.set_frame_id(frame.stamp.frame_id);
  lent.set_device_ns(frame.stamp.device_time.ns);
  lent.set_system_ns(frame.stamp.system_time.ns);
  lent.set_monotonic_ns(frame.stamp.monotonic_time.ns);
  lent.set_damaged(frame.stamp.status == FrameStatus::damaged);
  v1::CameraStream stream;
  session::set_layout(stream, frame.image->layout());
  lent.set_format(stream.format());
  lent.set_width(stream.width());
  lent.set_height(stream.height());
  lent.set_bit_depth(stream.bit_depth());
  const std::vector<std::byte>& pixels = frame.image->bytes();
  lent.set_pixels(pixels.data(), pixels.size());
  *lent.mutable_counts() = to_proto(counts);
  return lent;
}

Result<Frame> frame_of(const v1::LentFrame& lent, const std::string& where) {
  v1::CameraStream stream;
  stream.set_format(lent.format());
  stream.set_width(lent.width());
  stream.set_height(lent.height());
  stream.set_bit_depth(lent.bit_depth());
  const auto layout = session::layout_of(stream);
  if (!layout)
    return Error{ErrorKind::bad_input, "its frame is of no known layout: " + layout.error().what, where,
                 "Let both hosts have the same version of emberlockd"};
  auto image = std::make_shared<Image>(*layout);
  if (lent.pixels().size() != image->bytes().size())
    return Error{ErrorKind::bad_input,
                 fmt::format("its frame has {} bytes, and {} belong to its size", lent.pixels().size(),
                             image->bytes().size()),
                 where, "Let both hosts have the same version of emberlockd"};
  std::memcpy(image->bytes().data(), lent.pixels().data(), lent.pixels().size());
  const FrameStamp stamp{.frame_id = lent.frame_id(),
                         .device_time = {lent.device_ns()},
                         .system_time = {lent.system_ns()},
                         .monotonic_time = {lent.monotonic_ns()},
                         .status = lent.damaged() ? FrameStatus::damaged : FrameStatus::complete};
  return Frame{stamp, std::move(image)};
}

drivers::FrameCounts counts_of(const v1::CameraCounts& counts) {
  return {.delivered = counts.delivered(),
          .damaged = counts.damaged(),
          .camera_gap = counts.camera_gap(),
          .transport = counts.transport(),
          .resend = counts.resend(),
          .underrun = counts.underrun(),
          .queue = counts.queue(),
          .passed_over = counts.passed_over()};
}

v1::CameraCounts to_proto(const drivers::FrameCounts& counts) {
  v1::CameraCounts shown;
  shown.set_delivered(counts.delivered);
  shown.set_damaged(counts.damaged);
  shown.set_camera_gap(counts.camera_gap);
  shown.set_transport(counts.transport);
  shown.set_resend(counts.resend);
  shown.set_underrun(counts.underrun);
  shown.set_queue(counts.queue);
  shown.set_passed_over(counts.passed_over);
  return shown;
}

}  // namespace emberlock::daemon
