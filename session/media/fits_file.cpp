// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <memory>
#include <vector>

#include <fitsio.h>

#include "session/media/frame_decoders.h"

namespace emberlock::session {
namespace {

struct FitsClose {
  void operator()(fitsfile* f) const {
    int status = 0;
    fits_close_file(f, &status);
  }
};

Error fits_error(int status, const std::string& where) {
  std::array<char, FLEN_STATUS> text{};
  fits_get_errstatus(status, text.data());
  fits_clear_errmsg();
  return {ErrorKind::bad_input, "the FITS file is damaged: " + std::string(text.data()), where,
          "Copy or record it again"};
}

struct FitsImage {
  int bitpix = 0;
  std::int64_t width = 0;
  std::int64_t height = 0;
  double scale = 1;
  double zero = 0;
};

/// Moves to the first HDU that holds a picture: two axes, all further axes of length 1.
Result<FitsImage> find_image(fitsfile* file, const std::string& where) {
  int status = 0;
  int units = 0;
  fits_get_num_hdus(file, &units, &status);
  for (int unit = 1; unit <= units && status == 0; ++unit) {
    int type = 0;
    fits_movabs_hdu(file, unit, &type, &status);
    if (status != 0 || type != IMAGE_HDU) continue;
    int axes = 0;
    FitsImage image;
    std::array<LONGLONG, 8> sizes{};
    fits_get_img_paramll(file, static_cast<int>(sizes.size()), &image.bitpix, &axes, sizes.data(), &status);
    if (status != 0 || axes < 2 || axes > static_cast<int>(sizes.size())) continue;
    if (std::any_of(sizes.begin() + 2, sizes.begin() + axes, [](LONGLONG n) { return n != 1; })) continue;
    image.width = sizes[0];
    image.height = sizes[1];
    fits_read_key(file, TDOUBLE, "BSCALE", &image.scale, nullptr, &status);
    if (status == KEY_NO_EXIST) status = 0;
    fits_read_key(file, TDOUBLE, "BZERO", &image.zero, nullptr, &status);
    if (status == KEY_NO_EXIST) status = 0;
    fits_clear_errmsg();
    if (status == 0) return image;
  }
  if (status != 0) return fits_error(status, where);
  return Error{ErrorKind::bad_input, "the FITS file holds no whole two-dimensional image", where,
               "Export a single image, or copy it again"};
}

/// Needed because cfitsio reads zeros beyond the end of a truncated file.
Status check_whole(fitsfile* file, const FitsImage& image, std::size_t size, const std::string& where) {
  int status = 0;
  LONGLONG header_start = 0;
  LONGLONG data_start = 0;
  LONGLONG data_end = 0;
  fits_get_hduaddrll(file, &header_start, &data_start, &data_end, &status);
  const bool compressed = fits_is_compressed_image(file, &status) != 0;
  if (status != 0) return fits_error(status, where);
  // Some writers omit the padding after the last pixel.
  const LONGLONG pixels_end = data_start + image.width * image.height * (std::abs(image.bitpix) / 8);
  if ((compressed ? data_end : pixels_end) <= static_cast<LONGLONG>(size)) return {};
  return Error{ErrorKind::bad_input, "the FITS file is truncated", where, "Copy or record it again"};
}

}  // namespace

bool is_fits(std::string_view head) { return head.starts_with("SIMPLE  ="); }

Result<Image> decode_fits(std::string_view content, const std::string& where) {
  // Read from memory, because cfitsio interprets file names (filters, programs, network).
  auto* bytes = static_cast<void*>(const_cast<char*>(content.data()));
  std::size_t size = content.size();
  fitsfile* opened = nullptr;
  int status = 0;
  fits_open_memfile(&opened, "image", READONLY, &bytes, &size, 0, nullptr, &status);
  if (status != 0) return fits_error(status, where);
  const std::unique_ptr<fitsfile, FitsClose> file(opened);
  EMBERLOCK_ASSIGN_OR_RETURN(const FitsImage header, find_image(file.get(), where));
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(header.width, header.height, where));

  EMBERLOCK_RETURN_IF_ERROR(check_whole(file.get(), header, content.size(), where));
  const bool narrow = header.bitpix == BYTE_IMG && header.scale == 1 && header.zero == 0;
  ImageLayout layout{
      {static_cast<int>(header.width), static_cast<int>(header.height)}, PixelFormat::gray8, 8};
  if (!narrow) {
    layout.format = PixelFormat::gray16;
    layout.bit_depth = 16;
  }
  Image image(layout);
  std::vector<double> row(static_cast<std::size_t>(header.width));
  for (int y = 0; y < layout.size.height; ++y) {
    std::array<LONGLONG, 8> first{1, y + 1, 1, 1, 1, 1, 1, 1};
    double blank = std::numeric_limits<double>::quiet_NaN();
    int any_blank = 0;
    fits_read_pixll(file.get(), TDOUBLE, first.data(), header.width, &blank, row.data(), &any_blank, &status);
    if (status != 0) return fits_error(status, where);
    const auto quantise = [&](double v) {
      return std::isfinite(v) ? std::clamp(std::round(v), 0.0, 65535.0) : 0.0;
    };
    if (narrow) {
      std::transform(row.begin(), row.end(), image.row_as<std::uint8_t>(y),
                     [&](double v) { return static_cast<std::uint8_t>(quantise(v)); });
    } else {
      std::transform(row.begin(), row.end(), image.row_as<std::uint16_t>(y),
                     [&](double v) { return static_cast<std::uint16_t>(quantise(v)); });
    }
  }
  return image;
}

}  // namespace emberlock::session
