// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace emberlock::rig {

/// The manual page emberlockd.toml(5), in roff: every key with its description, range and default.
std::string config_manual(std::string_view version);

}  // namespace emberlock::rig
