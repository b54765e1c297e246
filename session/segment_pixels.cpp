// SPDX-License-Identifier: Apache-2.0
#include "session/segment_pixels.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace emberlock::session {

AVPixelFormat coded_format(const ImageLayout& layout, Encoding encoding) {
  switch (layout.format) {
    case PixelFormat::gray8:
    case PixelFormat::bayer_rggb8:
      return AV_PIX_FMT_GRAY8;
    case PixelFormat::gray16:
    case PixelFormat::bayer_rggb16:
      return AV_PIX_FMT_GRAY16LE;
    case PixelFormat::rgb8:
      if (encoding == Encoding::huffman_nut) return AV_PIX_FMT_GBRP;
      return encoding == Encoding::ffv1 ? AV_PIX_FMT_BGR0 : AV_PIX_FMT_RGB24;
    case PixelFormat::rgb16:
      return encoding == Encoding::ffv1 ? AV_PIX_FMT_GBRP16LE : AV_PIX_FMT_RGB48LE;
  }
  return AV_PIX_FMT_NONE;
}

namespace {

// The planes of libav's GBRP that hold red, green and blue.
constexpr std::array<std::size_t, 3> kPlaneOf{2, 0, 1};

std::uint8_t* row(const AVFrame& frame, std::size_t plane, int y) {
  return frame.data[plane] + std::ptrdiff_t{y} * frame.linesize[plane];
}

template <class Sample>
void to_planes(const Sample* in, const AVFrame& frame, int y) {
  Sample* red = reinterpret_cast<Sample*>(row(frame, kPlaneOf[0], y));
  Sample* green = reinterpret_cast<Sample*>(row(frame, kPlaneOf[1], y));
  Sample* blue = reinterpret_cast<Sample*>(row(frame, kPlaneOf[2], y));
  for (int x = 0; x < frame.width; ++x, in += 3) {
    red[x] = in[0];
    green[x] = in[1];
    blue[x] = in[2];
  }
}

template <class Sample>
void from_planes(const AVFrame& frame, int y, Sample* out) {
  const Sample* red = reinterpret_cast<const Sample*>(row(frame, kPlaneOf[0], y));
  const Sample* green = reinterpret_cast<const Sample*>(row(frame, kPlaneOf[1], y));
  const Sample* blue = reinterpret_cast<const Sample*>(row(frame, kPlaneOf[2], y));
  for (int x = 0; x < frame.width; ++x, out += 3) {
    out[0] = red[x];
    out[1] = green[x];
    out[2] = blue[x];
  }
}

}  // namespace

void to_av(const Image& image, AVFrame& frame) {
  const ImageView view = image.view();
  const int width = view.width();
  for (int y = 0; y < view.height(); ++y) {
    if (frame.format == AV_PIX_FMT_BGR0) {
      const auto* in = view.row_as<std::uint8_t>(y);
      std::uint8_t* out = row(frame, 0, y);
      for (int x = 0; x < width; ++x, in += 3, out += 4) {
        out[0] = in[2];
        out[1] = in[1];
        out[2] = in[0];
        out[3] = 0;
      }
    } else if (frame.format == AV_PIX_FMT_GBRP16LE) {
      to_planes(view.row_as<std::uint16_t>(y), frame, y);
    } else if (frame.format == AV_PIX_FMT_GBRP) {
      to_planes(view.row_as<std::uint8_t>(y), frame, y);
    } else {
      std::memcpy(row(frame, 0, y), view.row(y), view.layout.row_bytes());
    }
  }
}

void from_av(const AVFrame& frame, Image& image) {
  const int width = frame.width;
  for (int y = 0; y < frame.height; ++y) {
    if (frame.format == AV_PIX_FMT_BGR0) {
      const std::uint8_t* in = row(frame, 0, y);
      auto* out = image.row_as<std::uint8_t>(y);
      for (int x = 0; x < width; ++x, in += 4, out += 3) {
        out[0] = in[2];
        out[1] = in[1];
        out[2] = in[0];
      }
    } else if (frame.format == AV_PIX_FMT_GBRP16LE) {
      from_planes(frame, y, image.row_as<std::uint16_t>(y));
    } else if (frame.format == AV_PIX_FMT_GBRP) {
      from_planes(frame, y, image.row_as<std::uint8_t>(y));
    } else {
      std::memcpy(image.row_as<std::byte>(y), row(frame, 0, y), image.layout().row_bytes());
    }
  }
}

}  // namespace emberlock::session
