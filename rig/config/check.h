// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include <toml++/toml.h>

#include "rig/config/config.h"

// Rules that no single key can break; private to rig/config.
namespace emberlock::rig::config {

struct Together {
  const DaemonConfig& config;
  const toml::table& root;
  std::function<void(const toml::source_region& at, std::string what, std::string remedy)> problem;
};

/// Reports what doesn't fit together: ids that are missing or doubled, a network address without its token,
/// ...
void check_together(const Together& together);

}  // namespace emberlock::rig::config
