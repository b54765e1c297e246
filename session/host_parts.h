// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "emberlock/v1/session.pb.h"

namespace emberlock::session {

/// Writes into a finished session's manifest what is known of the other hosts' parts. Errors: refused
/// (another process, or another thread, writes the session now), bad_input (no session), io.
Status write_host_parts(const std::filesystem::path& folder, const std::vector<v1::HostPart>& parts);

}  // namespace emberlock::session
