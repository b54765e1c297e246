// SPDX-License-Identifier: Apache-2.0
#include "rig/config/manual.h"

#include <cctype>

#include "base/roff.h"
#include "rig/config/keys.h"

namespace emberlock::rig {
namespace {
using config::Key;
using config::Section;

template <class T>
std::string described(const Section<T>& section, const std::string& header) {
  std::string page = ".SH \"" + roff(header) + "\"\n" + roff(section.words) + "\n";
  const T defaults{};
  for (const Key<T>& key : section.keys) {
    std::string takes = key.takes;
    takes.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(takes.front())));
    const std::string value = key.write(defaults);
    page += ".TP\n\\fB" + roff(key.name) + "\\fR = \\fI" + roff(value.empty() ? key.example : value) +
            "\\fR\n" + roff(key.sentence) + " " + roff(takes) + ". " +
            (key.applies_words.empty() ? "" : "For cameras " + roff(key.applies_words) + ". ") +
            (value.empty() ? "No default; the value above is an example.\n" : "The default is above.\n");
  }
  return page;
}

}  // namespace

std::string config_manual(std::string_view version) {
  std::string page = fmt::format(".TH EMBERLOCKD.TOML 5 \"\" \"Emberlock {}\" \"File formats\"\n", version) +
                     ".SH NAME\nemberlockd.toml \\- the configuration of emberlockd\n.SH SYNOPSIS\n"
                     "/etc/emberlock/emberlockd.toml\n.SH DESCRIPTION\n";
  page += roff(
      "A TOML file (https://toml.io). Every key may be left out. A key that isn't known is an error, as is a "
      "value out "
      "of its range: `emberlockd --check-config` tells all of them, each with its line. Relative paths "
      "start from "
      "the file's folder. `emberlockd --print-config` prints a file with every key.");
  page += "\n";
  for (const auto& section : config::sections()) {
    page += described(section, "[" + section.name + "]");
    if (section.name == "rig")
      page += described(config::camera_section(), "[[" + config::camera_section().name + "]]");
  }
  return page + ".SH SEE ALSO\n\\fBemberlockd\\fR(8), \\fBemberlock\\fR(1)\n";
}

}  // namespace emberlock::rig
