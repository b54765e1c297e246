// SPDX-License-Identifier: Apache-2.0
#include "session/name.h"

#include <algorithm>
#include <array>
#include <string>

#include "session/text.h"

namespace emberlock::session {
namespace {

constexpr std::size_t kMaxNameBytes = 200;  // file systems allow 255; temporary files append to the name

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

bool allowed(char c) {
  return (lower(c) >= 'a' && lower(c) <= 'z') || is_digit(c) ||
         std::string_view(" ._:-").find(c) != std::string_view::npos;
}

/// Device names of Windows, with any extension (Microsoft, "Naming Files, Paths, and Namespaces").
bool is_windows_device(std::string_view name) {
  std::string stem(name.substr(0, name.find('.')));
  while (stem.ends_with(' ')) stem.pop_back();
  std::transform(stem.begin(), stem.end(), stem.begin(), lower);
  constexpr std::array<std::string_view, 4> kDevices{"con", "prn", "aux", "nul"};
  if (std::find(kDevices.begin(), kDevices.end(), stem) != kDevices.end()) return true;
  return stem.size() == 4 && (stem.starts_with("com") || stem.starts_with("lpt")) && is_digit(stem[3]);
}

struct Span {
  char32_t first, last;
};

/// Characters that no name holds: what isn't seen, what turns the direction of writing, spaces that look like
/// the plain one, what looks like a slash or a point, and what has no meaning of its own (private use, tags,
/// noncharacters). The joiners of U+200C and U+200D stay: Persian and the scripts of India are written with
/// them.
constexpr std::array<Span, 24> kRefused{
    {{0x80, 0xA0},     {0xAD, 0xAD},     {0x34F, 0x34F},   {0x61C, 0x61C},   {0x115F, 0x1160},
     {0x1680, 0x1680}, {0x180B, 0x180F}, {0x2000, 0x200B}, {0x200E, 0x200F}, {0x2024, 0x2026},
     {0x2028, 0x202F}, {0x2044, 0x2044}, {0x205F, 0x206F}, {0x2215, 0x2216}, {0x29F5, 0x29F9},
     {0x3000, 0x3000}, {0x3164, 0x3164}, {0xE000, 0xF8FF}, {0xFDD0, 0xFDEF}, {0xFE52, 0xFE52},
     {0xFEFF, 0xFF00}, {0xFF0E, 0xFF0F}, {0xFF3C, 0xFF3C}, {0xFFA0, 0xFFA0}}};

bool is_refused(char32_t c) {
  if (c < 0x80) return !allowed(static_cast<char>(c));
  if ((c & 0xFFFEU) == 0xFFFEU || (c >= 0xFFF0 && c < 0x10000) || c >= 0xE0000) return true;
  return std::any_of(kRefused.begin(), kRefused.end(),
                     [c](const Span& span) { return c >= span.first && c <= span.last; });
}

/// A mark that belongs to the letter before it.
bool is_mark(char32_t c) {
  return (c >= 0x300 && c < 0x370) || c == 0x200C || c == 0x200D || (c >= 0x1AB0 && c < 0x1B00) ||
         (c >= 0x1DC0 && c < 0x1E00) || (c >= 0x20D0 && c < 0x2100) || (c >= 0xFE00 && c < 0xFE10);
}

/// The name, made safe for messages.
std::string shown(std::string_view name) {
  constexpr std::size_t kShown = 60;
  std::u32string characters;
  if (const auto read = from_utf8(name)) {
    characters = *read;
  } else {
    for (const char c : name) characters += c >= ' ' && c <= '~' ? static_cast<char32_t>(c) : U'?';
  }
  const bool cut = characters.size() > kShown;
  characters.resize(std::min(characters.size(), kShown));
  for (char32_t& c : characters)
    if ((c < 0x80 && (c < ' ' || c > '~')) || (c >= 0x80 && is_refused(c))) c = U'?';
  return "session \"" + to_utf8(characters) + (cut ? "...\"" : "\"");
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
  const auto characters = from_utf8(name);
  if (name.size() > kMaxNameBytes)
    return bad("is " + std::to_string(name.size()) + " bytes long, " + std::to_string(kMaxNameBytes) +
                   " are allowed",
               "Choose a shorter name");
  if (!characters || name.empty() || name.front() == '.' ||
      std::any_of(characters->begin(), characters->end(), is_refused)) {
    return bad("can't name a session",
               "Use letters of any script, digits, space and . _ : - alone, no point in front");
  }
  if (is_mark(characters->front()) || characters->back() == 0x200C || characters->back() == 0x200D)
    return bad("begins or ends with a mark that belongs to a letter",
               "Begin and end with a letter or a digit");
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

std::string stored_name(std::string_view name) {
  const auto characters = from_utf8(name);
  return characters ? to_utf8(composed(*characters)) : std::string(name);
}

}  // namespace emberlock::session
