// SPDX-License-Identifier: Apache-2.0
#include "session/layout.h"

#include <string>

namespace emberlock::session {
namespace {

v1::CameraStream::PixelFormat to_proto(PixelFormat format) {
  switch (format) {
    case PixelFormat::gray8:
      return v1::CameraStream::GRAY8;
    case PixelFormat::gray16:
      return v1::CameraStream::GRAY16;
    case PixelFormat::bayer_rggb8:
      return v1::CameraStream::BAYER_RGGB8;
    case PixelFormat::bayer_rggb16:
      return v1::CameraStream::BAYER_RGGB16;
    case PixelFormat::rgb8:
      return v1::CameraStream::RGB8;
    case PixelFormat::rgb16:
      return v1::CameraStream::RGB16;
  }
  return v1::CameraStream::PIXEL_FORMAT_UNSPECIFIED;
}

Result<PixelFormat> from_proto(const v1::CameraStream& stream) {
  switch (stream.format()) {
    case v1::CameraStream::GRAY8:
      return PixelFormat::gray8;
    case v1::CameraStream::GRAY16:
      return PixelFormat::gray16;
    case v1::CameraStream::BAYER_RGGB8:
      return PixelFormat::bayer_rggb8;
    case v1::CameraStream::BAYER_RGGB16:
      return PixelFormat::bayer_rggb16;
    case v1::CameraStream::RGB8:
      return PixelFormat::rgb8;
    case v1::CameraStream::RGB16:
      return PixelFormat::rgb16;
    default:
      return Error{ErrorKind::bad_input, "unknown pixel format " + std::to_string(stream.format()),
                   "camera " + stream.camera_id() + ", field format",
                   "Use a newer Emberlock, or mend the manifest"};
  }
}

}  // namespace

void set_layout(v1::CameraStream& stream, const ImageLayout& layout) {
  stream.set_format(to_proto(layout.format));
  stream.set_width(static_cast<std::uint32_t>(layout.size.width));
  stream.set_height(static_cast<std::uint32_t>(layout.size.height));
  stream.set_bit_depth(static_cast<std::uint32_t>(layout.bit_depth));
}

Result<ImageLayout> layout_of(const v1::CameraStream& stream) {
  EMBERLOCK_ASSIGN_OR_RETURN(const PixelFormat format, from_proto(stream));
  const auto out_of_range = [&](const char* field, std::uint32_t value, int low, int high) {
    return Error{ErrorKind::bad_input,
                 std::to_string(value) + " is outside " + std::to_string(low) + ".." + std::to_string(high),
                 "camera " + stream.camera_id() + ", field " + field, "Mend the manifest"};
  };
  if (stream.width() < kMinRecordedSide || stream.width() > kMaxImageSide) {
    return out_of_range("width", stream.width(), kMinRecordedSide, kMaxImageSide);
  }
  if (stream.height() < kMinRecordedSide || stream.height() > kMaxImageSide) {
    return out_of_range("height", stream.height(), kMinRecordedSide, kMaxImageSide);
  }
  const bool wide = bytes_per_sample(format) == 2;
  const int low = wide ? 9 : 8;
  const int high = wide ? 16 : 8;
  if (stream.bit_depth() < static_cast<std::uint32_t>(low) ||
      stream.bit_depth() > static_cast<std::uint32_t>(high)) {
    return out_of_range("bit_depth", stream.bit_depth(), low, high);
  }
  return ImageLayout{{static_cast<int>(stream.width()), static_cast<int>(stream.height())},
                     format,
                     static_cast<int>(stream.bit_depth())};
}

}  // namespace emberlock::session
