#pragma once

#include <string>
#include <string_view>

namespace emberlock {

/// Text as roff shows it: what it would take for its own is escaped.
std::string roff(std::string_view text);

/// The manual page emberlockd.toml(5), in roff: every key with its words, range and default.
std::string config_manual(std::string_view version);

}  // namespace emberlock
