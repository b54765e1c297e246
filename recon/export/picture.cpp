// SPDX-License-Identifier: Apache-2.0
#include "recon/export/picture.h"

#include <string_view>
#include <vector>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "base/file.h"

namespace emberlock::recon {
namespace {

/// gray8 unchanged, rgb8 as blue, green, red.
cv::Mat as_opencv_orders(const ImageView& image) {
  const bool colour = image.layout.format == PixelFormat::rgb8;
  // OpenCV takes mutable pixels, but imencode doesn't write to them.
  cv::Mat view(image.height(), image.width(), colour ? CV_8UC3 : CV_8UC1, const_cast<std::byte*>(image.data),
               image.stride);
  if (!colour) return view;
  cv::Mat ordered;
  cv::cvtColor(view, ordered, cv::COLOR_RGB2BGR);
  return ordered;
}

Status write_png(const cv::Mat& ordered, const std::filesystem::path& path) {
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", ordered, bytes)) {
    return Error{ErrorKind::io, "cannot encode the picture", path.string(),
                 "Check that the picture isn't empty"};
  }
  return write_file_atomically(path, {reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

}  // namespace

Status write_png(const ImageView& image, const std::filesystem::path& path) {
  if (image.layout.format != PixelFormat::gray8 && image.layout.format != PixelFormat::rgb8) {
    return Error{ErrorKind::bad_input, "cannot write " + std::string(name(image.layout.format)) + " as PNG",
                 path.string(), "Convert it to gray8 or rgb8"};
  }
  if (image.width() < 1 || image.height() < 1) {
    return Error{ErrorKind::bad_input, "the picture is empty", path.string(), "Give at least one pixel"};
  }
  return write_png(as_opencv_orders(image), path);
}

Status write_png(const ImageView& image, const std::vector<std::uint8_t>& opacity,
                 const std::filesystem::path& path) {
  const std::size_t pixels =
      static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height());
  if (image.layout.format != PixelFormat::rgb8 || pixels == 0 || opacity.size() != pixels)
    return Error{ErrorKind::bad_input, "no colour picture with an opacity for each pixel", path.string(),
                 "Give rgb8 and as many opacities as pixels"};
  const cv::Mat alpha(image.height(), image.width(), CV_8UC1, const_cast<std::uint8_t*>(opacity.data()));
  cv::Mat ordered;
  cv::merge(std::vector<cv::Mat>{as_opencv_orders(image), alpha}, ordered);
  return write_png(ordered, path);
}

Result<std::string> to_jpeg(const ImageView& image) {
  std::vector<unsigned char> bytes;
  if (image.layout.format != PixelFormat::rgb8 || image.width() < 1 || image.height() < 1 ||
      !cv::imencode(".jpg", as_opencv_orders(image), bytes, {cv::IMWRITE_JPEG_QUALITY, 85})) {
    return Error{ErrorKind::bad_input, "cannot be made a JPEG", "picture",
                 "Give rgb8 and at least one pixel"};
  }
  return std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size());
}

}  // namespace emberlock::recon
