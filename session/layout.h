// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "base/image.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

/// The largest side of an image read from a file; larger images are refused before memory is allocated.
inline constexpr int kMaxImageSide = 16384;
/// The smallest side that can be recorded: FFV1 (libav 59) damages single rows or columns.
inline constexpr int kMinRecordedSide = 2;

/// Writes size, format and bit depth of `layout` into the stream's fields.
void set_layout(v1::CameraStream& stream, const ImageLayout& layout);

/// The stream's layout. Error bad_input names the field that is missing or out of range.
Result<ImageLayout> layout_of(const v1::CameraStream& stream);

}  // namespace emberlock::session
