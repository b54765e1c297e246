// SPDX-License-Identifier: Apache-2.0
#pragma once

extern "C" {
#include <libavutil/frame.h>
#include <libavutil/pixfmt.h>
}

#include "base/image.h"
#include "session/writer.h"

namespace emberlock::session {

/// The libav format in which a layout is encoded. Grey and Bayer are stored as they are; 10 and 12 bits are
/// stored in 16, because FFV1 of libav 59 corrupts its gray10. 8-bit RGB is BGR0 in FFV1 (coded as three
/// planes), wider RGB is GBRP16; raw video stores both interleaved; Ut Video stores 8-bit RGB as planes.
AVPixelFormat coded_format(const ImageLayout& layout, Encoding encoding);

/// Both copy whole images; `frame` must have the image's size and the coded_format of its layout (of either
/// encoding).
void to_av(const Image& image, AVFrame& frame);
void from_av(const AVFrame& frame, Image& image);

}  // namespace emberlock::session
