// SPDX-License-Identifier: Apache-2.0
#pragma once

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixfmt.h>
}

#include "base/image.h"
#include "session/writer.h"

namespace emberlock::session {

/// The libav format in which a layout is encoded. Grey and Bayer go as they are, 10 and 12 bits within 16
/// (libav 59's FFV1 corrupts its own gray10). FFV1 takes 8-bit RGB as BGR0, which it codes as three planes,
/// and wider RGB as GBRP16; raw video takes both interleaved, Ut Video
/// 8-bit RGB as planes.
AVPixelFormat coded_format(const ImageLayout& layout, Encoding encoding);

/// Both copy whole images; `frame` has the image's size and coded_format of its layout (either encoding's).
void to_av(const Image& image, AVFrame& frame);
void from_av(const AVFrame& frame, Image& image);

}  // namespace emberlock::session
