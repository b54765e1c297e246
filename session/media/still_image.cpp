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

namespace emberlock::session {
namespace {

using Byte = unsigned char;

Byte byte_at(std::string_view s, std::size_t i) { return static_cast<Byte>(s[i]); }
std::uint32_t big16(std::string_view s, std::size_t i) {
  return std::uint32_t{byte_at(s, i)} << 8 | byte_at(s, i + 1);
}
std::uint32_t big32(std::string_view s, std::size_t i) { return big16(s, i) << 16 | big16(s, i + 2); }

bool is_pnm(std::string_view s) {
  return s.size() > 2 && s[0] == 'P' && s[1] >= '1' && s[1] <= '6' &&
         (std::isspace(byte_at(s, 2)) != 0 || s[2] == '#');
}
bool is_png(std::string_view s) { return s.starts_with("\x89PNG\r\n\x1a\n"); }
bool is_jpeg(std::string_view s) { return s.starts_with("\xff\xd8\xff"); }
bool is_tiff(std::string_view s) {
  return s.starts_with(std::string_view("II*\0", 4)) || s.starts_with(std::string_view("MM\0*", 4));
}

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

Error truncated(const std::string& where, std::string_view kind) {
  return {ErrorKind::bad_input, "the " + std::string(kind) + " is truncated", where,
          "Copy or record it again"};
}
Error damaged(const std::string& where, std::string_view kind, std::string_view reason) {
  return {ErrorKind::bad_input, "the " + std::string(kind) + " is damaged: " + std::string(reason), where,
          "Copy or record it again"};
}

/// The header of a binary PGM or PPM: numbers between white space and comments (netpbm's format definition).
class PnmHeader {
 public:
  explicit PnmHeader(std::string_view s) : s_(s) {}
  std::optional<std::int64_t> number() {
    skip_space();
    std::int64_t v = 0;
    const std::size_t first = at_;
    for (; at_ < s_.size() && std::isdigit(byte_at(s_, at_)) != 0; ++at_) {
      v = std::min<std::int64_t>(v * 10 + (s_[at_] - '0'), std::numeric_limits<std::int32_t>::max());
    }
    if (at_ == first) return std::nullopt;
    return v;
  }
  /// A single white space ends the header; the samples follow.
  [[nodiscard]] std::string_view samples() const { return s_.substr(std::min(at_ + 1, s_.size())); }

 private:
  void skip_space() {
    while (at_ < s_.size() && (std::isspace(byte_at(s_, at_)) != 0 || s_[at_] == '#')) {
      if (s_[at_] == '#') at_ = std::min(s_.find('\n', at_), s_.size() - 1);
      ++at_;
    }
  }
  std::string_view s_;
  std::size_t at_ = 2;
};

/// Binary PGM and PPM. Parsed here because OpenCV reports neither maxval nor truncation.
Result<Image> decode_binary_pnm(std::string_view content, const std::string& where) {
  PnmHeader header(content);
  const auto width = header.number();
  const auto height = header.number();
  const auto maxval = header.number();
  if (!width || !height || !maxval)
    return damaged(where, "PNM header", "width, height and maxval are expected");
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(*width, *height, where));
  if (*maxval < 1 || *maxval > 65535) return damaged(where, "PNM header", "maxval is outside 1..65535");

  const bool wide = *maxval > 255;
  const bool color = content[1] == '6';
  ImageLayout layout{{static_cast<int>(*width), static_cast<int>(*height)}, PixelFormat::gray8, 8};
  if (color) layout.format = wide ? PixelFormat::rgb16 : PixelFormat::rgb8;
  if (!color && wide) layout.format = PixelFormat::gray16;
  while (layout.white() < *maxval) ++layout.bit_depth;

  const std::string_view samples = header.samples();
  if (samples.size() < layout.row_bytes() * static_cast<std::size_t>(*height)) return truncated(where, "PNM");
  Image image(layout);
  std::memcpy(image.bytes().data(), samples.data(), image.bytes().size());
  if (wide) {  // big-endian in the file
    for (std::size_t i = 0; i < image.bytes().size(); i += 2)
      std::swap(image.bytes()[i], image.bytes()[i + 1]);
  }
  return image;
}

struct StillSize {
  std::int64_t width = 0;
  std::int64_t height = 0;
};

/// Walks the chunks of a PNG to its end.
Result<StillSize> check_png(std::string_view s, const std::string& where) {
  if (s.size() < 33) return truncated(where, "PNG");
  const StillSize size{big32(s, 16), big32(s, 20)};
  for (std::size_t at = 8; at + 12 <= s.size();) {
    if (s.substr(at + 4, 4) == "IEND") return size;
    const std::size_t length = big32(s, at);
    if (length > s.size() - at - 12) break;
    at += 12 + length;
  }
  return truncated(where, "PNG");
}

/// Walks the markers of a JPEG to its first scan, and looks for the end marker behind it.
Result<StillSize> check_jpeg(std::string_view s, const std::string& where) {
  StillSize size;
  for (std::size_t at = 2; at + 4 <= s.size();) {
    if (byte_at(s, at) != 0xff) return damaged(where, "JPEG", "a marker is missing");
    const Byte marker = byte_at(s, at + 1);
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    if (marker == 0xda) {
      if (size.width == 0) return damaged(where, "JPEG", "no size before the first scan");
      if (s.find("\xff\xd9", at) == std::string_view::npos) break;
      return size;
    }
    const bool frame_header =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame_header && at + 9 <= s.size()) size = {big16(s, at + 7), big16(s, at + 5)};
    at += 2 + std::size_t{big16(s, at + 2)};
  }
  return truncated(where, "JPEG");
}

/// Reads width and height from the first directory of a TIFF (tags 256 and 257).
Result<StillSize> check_tiff(std::string_view s, const std::string& where) {
  const bool big = s[0] == 'M';
  const auto get16 = [&](std::size_t i) {
    return big ? big16(s, i) : std::uint32_t{byte_at(s, i + 1)} << 8 | byte_at(s, i);
  };
  const auto get32 = [&](std::size_t i) { return big ? big32(s, i) : get16(i + 2) << 16 | get16(i); };
  if (s.size() < 8) return truncated(where, "TIFF");
  const std::size_t directory = get32(4);
  if (directory + 2 > s.size()) return truncated(where, "TIFF");
  const std::size_t entries = get16(directory);
  if (directory + 2 + entries * 12 > s.size()) return truncated(where, "TIFF");
  StillSize size;
  for (std::size_t i = 0; i < entries; ++i) {
    const std::size_t entry = directory + 2 + i * 12;
    const std::int64_t value = get16(entry + 2) == 3 ? get16(entry + 8) : get32(entry + 8);
    if (get16(entry) == 256) size.width = value;
    if (get16(entry) == 257) size.height = value;
  }
  return size;
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
  EMBERLOCK_ASSIGN_OR_RETURN(const StillSize size,
                             is_png(content) ? check_png(content, where) : check_jpeg(content, where));
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(size.width, size.height, where));
  return ImageSize{static_cast<int>(size.width), static_cast<int>(size.height)};
}

Result<Image> decode_still_image(std::string_view content, const std::string& where) {
  if (!is_still_image(content)) return not_read(content, where);
  if (is_pnm(content) && (content[1] == '5' || content[1] == '6')) return decode_binary_pnm(content, where);
  // OpenCV allocates whatever the header states and accepts truncated files, so both are checked first.
  if (!is_pnm(content)) {
    EMBERLOCK_ASSIGN_OR_RETURN(const StillSize size, is_png(content)    ? check_png(content, where)
                                                     : is_jpeg(content) ? check_jpeg(content, where)
                                                                        : check_tiff(content, where));
    EMBERLOCK_RETURN_IF_ERROR(check_image_size(size.width, size.height, where));
  }
  if (content.size() > static_cast<std::size_t>(std::numeric_limits<int>::max())) {
    return Error{ErrorKind::bad_input, "larger than 2 GiB", where, "Crop the image"};
  }
  // As stored: an EXIF orientation is ignored, because rows and columns must be the sensor's.
  const int flags = cv::IMREAD_ANYCOLOR | cv::IMREAD_ANYDEPTH | cv::IMREAD_IGNORE_ORIENTATION;
  try {
    // imdecode doesn't write, but cv::Mat has no view of constant bytes.
    const cv::Mat bytes(1, static_cast<int>(content.size()), CV_8U, const_cast<char*>(content.data()));
    const cv::Mat mat = cv::imdecode(bytes, flags);
    if (mat.empty()) return damaged(where, "image", "it can't be decoded");
    return from_mat(mat, where);
  } catch (const cv::Exception& e) {
    return damaged(where, "image", e.err);
  }
}

}  // namespace emberlock::session
