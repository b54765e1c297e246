// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

namespace emberlock::recon {

/// OpenVDB gives each file an identifier (a UUID, 36 characters behind the first 21 bytes) at random, by
/// which its readers know one file from another. Replaces it by one that follows from the rest of the file,
/// so that equal volumes are equal files. Throws std::ios::failure.
void identify_by_content(const std::filesystem::path& vdb);

/// Whether a file has the identifier that follows from the rest of it, as one has that wasn't sealed later.
bool is_identified_by_content(const std::filesystem::path& vdb);

}  // namespace emberlock::recon
