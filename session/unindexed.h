// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "session/index.h"

namespace emberlock::session {

/// Which segments are asked for frames that the index lacks. An index is only ever appended to: while its
/// records are good, what it lacks lies behind the last of them.
enum class Search { behind_the_index, everywhere };

/// Records of frames that lie in a camera's segments and not in its index, by what the segments themselves
/// carry (segment.h): what a power cut leaves, or a damaged index. Whether their pixels are whole isn't
/// known. In the index's order.
std::vector<IndexRecord> unindexed_frames(const std::filesystem::path& folder, const std::string& camera_id,
                                          const std::vector<IndexRecord>& index, Search search);

/// Both in the index's order; of two that contradict each other the index's stays.
std::vector<IndexRecord> merged(const std::vector<IndexRecord>& index, const std::vector<IndexRecord>& found);

}  // namespace emberlock::session
