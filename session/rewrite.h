// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "session/camera_reader.h"
#include "session/writer.h"

namespace emberlock::session {

/// Frames of one segment that are moved to a new file.
struct SegmentRewrite {
  std::vector<std::size_t> frames;  ///< indices of the reader's records, rising
  Encoding encoding = Encoding::ffv1;
  Hertz rate;
};

/// Writes the frames as `target`.partial, reads each back, compares it with its hash, and only then renames
/// the file to `target`, replacing an existing one. A failure changes nothing.
Status rewrite_segment(CameraReader& reader, const SegmentRewrite& what, const std::filesystem::path& target,
                       const Observer& observer);

/// Whether the frame of every record can be read from the file `path`. The error names the first that can't.
Status read_back(const std::filesystem::path& path, const ImageLayout& layout,
                 std::span<const IndexRecord> records, const Observer& observer);

}  // namespace emberlock::session
