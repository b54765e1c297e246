// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <utility>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "session/media/frame_decoders.h"
#include "session/media/pnm_header.h"
#include "session/media/still_contents.h"

namespace emberlock::session {
namespace {

/// A kind of picture that isn't read, by its magic number.
Error not_read(std::string_view s, const std::string& where) {
  const std::string_view brand = s.size() >= 12 && s.substr(4, 4) == "ftyp" ? s.substr(8, 4) : "";
  const std::string_view kind = s.starts_with("RIFF") && s.size() >= 12 && s.substr(8, 4) == "WEBP" ? "WebP"
                                : s.starts_with("GIF8")                                             ? "GIF"
                                : s.starts_with("BM")                                               ? "BMP"
                                : s.starts_with("\xabKTX")                                          ? "KTX"
                                : s.starts_with("DDS ")                                             ? "DDS"
                                : s.starts_with("8BPS")                       ? "Photoshop"
                                : s.starts_with("#?RADIANCE")                 ? "Radiance"
                                : s.starts_with("\x76\x2f\x31\x01")           ? "OpenEXR"
                                : brand.starts_with("avi")                    ? "AVIF"
                                : brand.starts_with("hei") || brand == "mif1" ? "HEIF"
                                                                              : "";
  return {ErrorKind::bad_input,
          kind.empty() ? "isn't a picture (known are PGM, PPM, PNG, JPEG, TIFF and FITS)"
                       : "a " + std::string(kind) + " picture, which isn't read",
          where, "Convert it to PNG or JPEG"};
}

/// Binary PGM and PPM. Parsed here because OpenCV reports neither maxval nor truncation.
Result<Image> decode_binary_pnm(std::string_view content, const std::string& where) {
  PnmHeader header(content);
  const auto width = header.number();
  const auto height = header.number();
  const auto maxval = header.number();
  if (!width || !height || !maxval)
    return damaged_picture(where, "PNM header", "width, height and maxval are expected");
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(*width, *height, where));
  if (*maxval < 1 || *maxval > 65535)
    return damaged_picture(where, "PNM header", "maxval is outside 1..65535");

  const bool wide = *maxval > 255;
  const bool color = content[1] == '6';
  ImageLayout layout{{static_cast<int>(*width), static_cast<int>(*height)}, PixelFormat::gray8, 8};
  if (color) layout.format = wide ? PixelFormat::rgb16 : PixelFormat::rgb8;
  if (!color && wide) layout.format = PixelFormat::gray16;
  while (layout.white() < *maxval) ++layout.bit_depth;

  const std::string_view samples = header.samples();
  if (samples.size() < layout.row_bytes() * static_cast<std::size_t>(*height))
    return truncated_picture(where, "PNM");
  Image image(layout);
  std::memcpy(image.bytes().data(), samples.data(), image.bytes().size());
  if (wide) {  // big-endian in the file
    for (std::size_t i = 0; i < image.bytes().size(); i += 2)
      std::swap(image.bytes()[i], image.bytes()[i + 1]);
  }
  return image;
}

/// Blue, green, red and alpha, as OpenCV stores them, over black: colour times alpha, without the alpha.
template <class Sample>
cv::Mat over_black(const cv::Mat& mat, bool multiply) {
  constexpr std::uint32_t kOpaque = std::numeric_limits<Sample>::max();
  cv::Mat out(mat.rows, mat.cols, CV_MAKETYPE(mat.depth(), 3));
  for (int y = 0; y < mat.rows; ++y) {
    const Sample* in = mat.ptr<Sample>(y);
    Sample* to = out.ptr<Sample>(y);
    for (int x = 0; x < mat.cols; ++x, in += 4, to += 3) {
      const std::uint32_t alpha = multiply ? in[3] : kOpaque;
      for (int c = 0; c < 3; ++c) to[c] = static_cast<Sample>((in[c] * alpha + kOpaque / 2) / kOpaque);
    }
  }
  return out;
}

template <class Sample>
bool is_opaque(const cv::Mat& mat) {
  for (int y = 0; y < mat.rows; ++y)
    for (int x = 0; x < mat.cols; ++x)
      if (mat.ptr<Sample>(y)[4 * x + 3] != std::numeric_limits<Sample>::max()) return false;
  return true;
}

/// What the decoded image shows over black.
Result<cv::Mat> without_transparency(const cv::Mat& mat, const StillContents::Picture& still, Alpha alpha,
                                     const std::string& where) {
  const bool wide = mat.depth() == CV_16U;
  if (mat.channels() == 1 && still.transparency == Transparency::grey_key && alpha == Alpha::over_black) {
    cv::Mat out = mat.clone();
    out.setTo(0, mat == static_cast<double>(still.key));
    return out;
  }
  if (mat.channels() != 4 || (mat.depth() != CV_8U && !wide)) return mat;
  if (still.transparency == Transparency::unnamed &&
      !(wide ? is_opaque<std::uint16_t>(mat) : is_opaque<std::uint8_t>(mat)))
    return Error{ErrorKind::bad_input, "the meaning of its fourth sample isn't stated (ExtraSamples)", where,
                 "Write it as straight or premultiplied alpha, or without it"};
  const bool multiply = still.transparency == Transparency::straight && alpha == Alpha::over_black;
  cv::Mat out = wide ? over_black<std::uint16_t>(mat, multiply) : over_black<std::uint8_t>(mat, multiply);
  if (still.is_grey) cv::extractChannel(out, out, 0);
  return out;
}

Result<Image> from_mat(const cv::Mat& mat, const std::string& where) {
  const bool wide = mat.depth() == CV_16U;
  if ((mat.depth() != CV_8U && !wide) || (mat.channels() != 1 && mat.channels() != 3)) {
    return Error{ErrorKind::bad_input, "samples are neither 8 nor 16 bit grey or RGB", where,
                 "Convert the image"};
  }
  const bool color = mat.channels() == 3;
  ImageLayout layout{{mat.cols, mat.rows}, PixelFormat::gray8, wide ? 16 : 8};
  if (color) layout.format = wide ? PixelFormat::rgb16 : PixelFormat::rgb8;
  if (!color && wide) layout.format = PixelFormat::gray16;
  Image image(layout);
  const int samples = mat.cols * mat.channels();
  const auto copy_row = [&]<class Sample>(int y, Sample* out) {
    const Sample* in = mat.ptr<Sample>(y);
    std::copy_n(in, samples, out);
    if (color) {  // OpenCV's order is B, G, R
      for (int x = 0; x < samples; x += 3) std::swap(out[x], out[x + 2]);
    }
  };
  for (int y = 0; y < mat.rows; ++y) {
    if (wide) {
      copy_row(y, image.row_as<std::uint16_t>(y));
    } else {
      copy_row(y, image.row_as<std::uint8_t>(y));
    }
  }
  return image;
}

}  // namespace

bool is_still_image(std::string_view head) {
  return is_pnm(head) || is_png(head) || is_jpeg(head) || is_tiff(head);
}

Result<ImageSize> picture_size(std::string_view content, const std::string& where) {
  if (!is_png(content) && !is_jpeg(content))
    return Error{ErrorKind::bad_input, "is neither a PNG nor a JPEG", where, "Convert it"};
  EMBERLOCK_ASSIGN_OR_RETURN(const StillContents found, examine_still(content, where));
  const StillContents::Picture& picture = found.pictures.front();
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(picture.width, picture.height, where));
  return ImageSize{static_cast<int>(picture.width), static_cast<int>(picture.height)};
}

Result<Image> decode_still_image(std::string_view content, const std::string& where, Alpha alpha) {
  if (!is_still_image(content)) return not_read(content, where);
  EMBERLOCK_ASSIGN_OR_RETURN(const StillContents found, examine_still(content, where));
  std::string file(content);
  return decode_picture(file, found.pictures.front(), where, alpha);
}

Result<Image> decode_picture(std::string& file, const StillContents::Picture& picture,
                             const std::string& where, Alpha alpha) {
  std::string_view content = file;
  if (is_tiff(content)) {
    select_tiff_page(file, picture);
  } else {
    content = content.substr(picture.begin, picture.end - picture.begin);
  }
  if (is_pnm(content) && (content[1] == '5' || content[1] == '6')) return decode_binary_pnm(content, where);
  // OpenCV allocates whatever the header states and accepts truncated files, so both are checked first.
  if (!is_pnm(content)) EMBERLOCK_RETURN_IF_ERROR(check_image_size(picture.width, picture.height, where));
  if (is_jpeg(content)) EMBERLOCK_RETURN_IF_ERROR(check_jpeg(content, where));
  if (content.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return Error{ErrorKind::bad_input, "larger than 2 GiB", where, "Crop the image"};
  }
  // As stored: an EXIF orientation is ignored, because rows and columns must be the sensor's.
  const bool has_alpha =
      picture.transparency != Transparency::none && picture.transparency != Transparency::grey_key;
  const int flags = has_alpha ? cv::IMREAD_UNCHANGED
                              : cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
  try {
    // imdecode doesn't write, but cv::Mat has no view of constant bytes.
    const cv::Mat bytes(1, static_cast<int>(content.size()), CV_8U, const_cast<char*>(content.data()));
    const cv::Mat mat = cv::imdecode(bytes, flags);
    if (mat.empty()) return damaged_picture(where, "image", "it can't be decoded");
    EMBERLOCK_ASSIGN_OR_RETURN(const cv::Mat shown, without_transparency(mat, picture, alpha, where));
    return from_mat(shown, where);
  } catch (const cv::Exception& e) {
    return damaged_picture(where, "image", e.err);
  }
}

}  // namespace emberlock::session
