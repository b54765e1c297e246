// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "session/index.h"

namespace emberlock::session {

/// Which segments are searched for frames that the index lacks. The index is append-only: while its records
/// are valid, missing frames lie behind its last record.
enum class Search { behind_the_index, everywhere };

/// Index records of frames that are in a camera's segments but not in its index, read from the segments
/// (segment.h). They appear after a power cut or when the index is damaged. Their pixels haven't been
/// checked. Sorted like the index.
std::vector<IndexRecord> unindexed_frames(const std::filesystem::path& folder, const std::string& camera_id,
                                          const std::vector<IndexRecord>& index, Search search);

/// Merges two lists in the index's order. Where two records contradict each other, that of the index wins.
std::vector<IndexRecord> merged(const std::vector<IndexRecord>& index, const std::vector<IndexRecord>& found);

}  // namespace emberlock::session
