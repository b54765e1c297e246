// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "session/camera_reader.h"
#include "session/writer.h"

namespace emberlock::session {

/// Frames of one segment that are to lie in a file of their own.
struct SegmentRewrite {
  std::vector<std::size_t> frames;  ///< places in the reader's records, rising
  Encoding encoding = Encoding::ffv1;
  Hertz rate;
};

/// Writes them as `target`.partial, reads every one back, compares it with its hash, and only then gives the
/// file its name, whatever bore it before. A failure leaves all as it was.
Status rewrite_segment(CameraReader& reader, const SegmentRewrite& what, const std::filesystem::path& target,
                       const Observer& observer);

/// Whether each of the records' frames can be read from the file `path`; the error tells of the first that
/// can't.
Status read_back(const std::filesystem::path& path, const ImageLayout& layout,
                 std::span<const IndexRecord> records, const Observer& observer);

}  // namespace emberlock::session
