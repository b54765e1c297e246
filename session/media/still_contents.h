// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "base/result.h"

namespace emberlock::session {

/// How a still image stores what is transparent.
enum class Transparency {
  none,
  straight,       ///< a sample after the colours, by which they are not multiplied yet
  premultiplied,  ///< a sample after the colours, by which they are
  unnamed,        ///< a sample after the colours, of no stated meaning
  grey_key,       ///< pixels of the grey value `key`
};

/// The structure of a PNM, PNG, JPEG or TIFF file, found without decoding it.
struct StillContents {
  struct Picture {
    std::size_t begin = 0;   ///< first byte; of a TIFF, the offset of the picture's directory
    std::size_t end = 0;     ///< behind the last byte; of a TIFF, the end of the file
    std::int64_t width = 0;  ///< as the header states it; 0 where decoding checks it (PNM)
    std::int64_t height = 0;
    Transparency transparency = Transparency::none;
    std::uint32_t key = 0;  ///< of grey_key, as a decoded sample
    bool is_grey = false;   ///< set where there is a sample after the colour
  };
  /// JPEGs or binary PNMs one behind the other, the views of an MPO, the pages of a TIFF or BigTIFF.
  std::vector<Picture> pictures{};
  int orientation = 1;  ///< EXIF orientation 1..8 of the first picture; 1: as stored
};

/// Errors (bad_input): the first picture is truncated or damaged, or the file holds further pictures that
/// can't be read (an animated PNG, an ImageJ stack with one directory); a TIFF of grey and a second sample.
Result<StillContents> examine_still(std::string_view content, const std::string& where);

/// Errors: the first picture of a JPEG file is truncated or damaged.
Status check_jpeg(std::string_view content, const std::string& where);

/// Makes a TIFF begin with another of its pictures, stored without an orientation.
void select_tiff_page(std::string& content, const StillContents::Picture& page);

/// Errors of a picture of this kind ("PNG").
Error truncated_picture(const std::string& where, std::string_view kind);
Error damaged_picture(const std::string& where, std::string_view kind, std::string_view reason);

bool is_pnm(std::string_view content);
bool is_png(std::string_view content);
bool is_jpeg(std::string_view content);
bool is_tiff(std::string_view content);

}  // namespace emberlock::session
