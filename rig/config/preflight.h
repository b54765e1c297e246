// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "rig/config/config.h"

namespace emberlock::rig {

/// What can be found wrong with a configuration without opening devices or ports, as whoever runs this:
/// folders that can't be written, certificates, keys, tokens and sessions that can't be read, secrets that
/// others can read. `where` of each is the key and its path.
std::vector<Error> preflight(const DaemonConfig& config);

/// Everything that is wrong with a configuration file: what its text says, else preflight().
std::vector<Error> check_config(const std::filesystem::path& file);

}  // namespace emberlock::rig
