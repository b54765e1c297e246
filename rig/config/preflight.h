// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include "base/result.h"
#include "rig/config/config.h"

namespace emberlock::rig {

/// Problems of a configuration that can be found without opening devices or ports, with the permissions of
/// the current user: folders that can't be written; certificates, keys and tokens that the start would
/// refuse, read by the same functions; sessions that can't be read. `where` is the key and its path.
std::vector<Error> preflight(const DaemonConfig& config);

/// All problems of a configuration file: those of its text; if there are none, preflight().
std::vector<Error> check_config(const std::filesystem::path& file);

}  // namespace emberlock::rig
