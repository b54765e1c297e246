// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include <toml++/toml.h>

#include "rig/config/config.h"

// Rules that involve several keys; private to rig/config.
namespace emberlock::rig::config {

struct ConfigCheck {
  const DaemonConfig& config;
  const toml::table& root;
  std::function<void(const toml::source_region& at, std::string what, std::string remedy)> problem;
};

/// Reports inconsistencies: missing or duplicate ids, a network address without a token, ...
void check_consistency(const ConfigCheck& check);

}  // namespace emberlock::rig::config
