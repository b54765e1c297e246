#include "session/segment_pixels.h"

#include <cstddef>
#include <cstring>

namespace emberlock {

AVPixelFormat coded_format(const ImageLayout& layout, Encoding encoding) {
  switch (layout.format) {
    case PixelFormat::gray8:
    case PixelFormat::bayer_rggb8:
      return AV_PIX_FMT_GRAY8;
    case PixelFormat::gray16:
    case PixelFormat::bayer_rggb16:
      return AV_PIX_FMT_GRAY16LE;
    case PixelFormat::rgb8:
      return encoding == Encoding::ffv1 ? AV_PIX_FMT_BGR0 : AV_PIX_FMT_RGB24;
    case PixelFormat::rgb16:
      return AV_PIX_FMT_RGB48LE;
  }
  return AV_PIX_FMT_NONE;
}

void to_av(const Image& image, AVFrame& frame) {
  const ImageView view = image.view();
  for (int y = 0; y < view.height(); ++y) {
    const auto* in = view.row_as<std::uint8_t>(y);
    std::uint8_t* out = frame.data[0] + std::ptrdiff_t{y} * frame.linesize[0];
    if (frame.format != AV_PIX_FMT_BGR0) {
      std::memcpy(out, in, view.layout.row_bytes());
      continue;
    }
    for (int x = 0; x < view.width(); ++x, in += 3, out += 4) {
      out[0] = in[2];
      out[1] = in[1];
      out[2] = in[0];
      out[3] = 0;
    }
  }
}

void from_av(const AVFrame& frame, Image& image) {
  for (int y = 0; y < frame.height; ++y) {
    const std::uint8_t* in = frame.data[0] + std::ptrdiff_t{y} * frame.linesize[0];
    auto* out = image.row_as<std::uint8_t>(y);
    if (frame.format != AV_PIX_FMT_BGR0) {
      std::memcpy(out, in, image.layout().row_bytes());
      continue;
    }
    for (int x = 0; x < frame.width; ++x, in += 4, out += 3) {
      out[0] = in[2];
      out[1] = in[1];
      out[2] = in[0];
    }
  }
}

}  // namespace emberlock
