// SPDX-License-Identifier: Apache-2.0
#include "session/name.h"

#include <algorithm>
#include <array>
#include <string>

namespace emberlock::session {
namespace {

constexpr std::size_t kMaxNameBytes =
    200;  // file systems have 255; files made beside a folder add to its name

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool allowed(char c) {
  return (lower(c) >= 'a' && lower(c) <= 'z') || is_digit(c) ||
         std::string_view(" ._:-").find(c) != std::string_view::npos;
}

/// Names of devices on Windows, whatever follows a point (Microsoft, "Naming Files, Paths, and Namespaces").
bool is_windows_device(std::string_view name) {
  std::string stem(name.substr(0, name.find('.')));
  while (stem.ends_with(' ')) stem.pop_back();
  std::transform(stem.begin(), stem.end(), stem.begin(), lower);
  constexpr std::array<std::string_view, 4> kDevices{"con", "prn", "aux", "nul"};
  if (std::find(kDevices.begin(), kDevices.end(), stem) != kDevices.end()) return true;
  return stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt")) && is_digit(stem[3]);
}

/// The name as a message may show it.
std::string shown(std::string_view name) {
  constexpr std::size_t kShown = 60;
  std::string text = "session \"";
  for (const char c : name.substr(0, kShown)) text += c >= ' ' && c <= '~' ? c : '?';
  return text + (name.size() > kShown ? "...\"" : "\"");
}

}  // namespace

bool is_folder_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxNameBytes && name.front() != '.' &&
         std::all_of(name.begin(), name.end(), allowed);
}

Status check_text(std::string_view field, std::string_view text) {
  const auto bad = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), "field " + std::string(field), std::move(remedy)};
  };
  if (text.size() > kMaxTextBytes) {
    return bad("is " + std::to_string(text.size()) + " bytes long, " + std::to_string(kMaxTextBytes) +
                   " are allowed",
               "Say it in fewer words");
  }
  const bool controls = std::any_of(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) < ' ') || c == '\x7f'; });
  if (controls) return bad("holds control characters", "Leave line breaks and the like away");
  return {};
}

Status check_session_name(std::string_view name) {
  const auto bad = [&](std::string what, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), shown(name), std::move(remedy)};
  };
  if (!is_folder_name(name)) {
    return bad("can't name a session",
               "Use letters, digits, space and . _ : - alone, no point in front, at most " +
                   std::to_string(kMaxNameBytes));
  }
  if (name.starts_with('-')) {
    return bad("begins with a hyphen, so that programs take it for an option",
               "Begin with a letter or a digit");
  }
  if (name.starts_with(' ')) return bad("begins with a space, which nobody sees", "Leave it off");
  if (name.ends_with(' ') || name.ends_with('.')) {
    return bad("ends with a space or a point, which Windows drops", "Leave it off");
  }
  if (is_windows_device(name)) return bad("is the name of a device on Windows", "Choose another name");
  return {};
}

}  // namespace emberlock::session
