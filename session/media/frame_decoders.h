// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "base/result.h"
#include "session/media/frame_file.h"
#include "session/media/still_contents.h"

// The decoders from which FrameFile chooses by the first bytes of a file.
namespace emberlock::session {

/// PNM, PNG, JPEG or TIFF, by their magic numbers.
bool is_still_image(std::string_view head);
/// What becomes of an image's transparency (alpha, or a colour that a PNG declares transparent).
enum class Alpha {
  over_black,  ///< colour times alpha: the light that the picture adds to a dark room
  dropped,     ///< colours as they are stored, for formats that use the alpha otherwise
};
/// The first picture. `content` is the whole file; `where` names it in errors. Errors: truncated, damaged or
/// too large; a TIFF whose fourth sample has no stated meaning and isn't opaque; a TIFF of grey and a second
/// sample.
Result<Image> decode_still_image(std::string_view content, const std::string& where,
                                 Alpha alpha = Alpha::over_black);
/// One of the pictures that examine_still() found in `file`; of a TIFF, the file's header is changed.
Result<Image> decode_picture(std::string& file, const StillContents::Picture& picture,
                             const std::string& where, Alpha alpha = Alpha::over_black);

/// Of a whole PNG or JPEG, without decoding it. Errors: it is neither, or truncated.
Result<ImageSize> picture_size(std::string_view content, const std::string& where);

bool is_fits(std::string_view head);
/// The first two-dimensional image of a FITS file. 8-bit unscaled data become gray8, everything else gray16:
/// physical values (after BZERO and BSCALE) rounded and clamped to 0..65535, blanks 0. The file's first row
/// becomes row 0. This is the detector's readout order, along which smear is measured; FITS viewers draw it
/// upwards.
Result<Image> decode_fits(std::string_view content, const std::string& where);

/// Time stamps of a video's frames: with those that libavformat infers, or only those that the file holds.
enum class Stamps { inferred, stored };
/// Any file that libavformat recognises.
Result<std::unique_ptr<FrameFile>> open_video(const std::filesystem::path& path, Colours colours,
                                              Stamps stamps = Stamps::inferred);

/// Whether an image of this size may be decoded: both sides within 1..kMaxImageSide.
Status check_image_size(std::int64_t width, std::int64_t height, const std::string& where);

}  // namespace emberlock::session
