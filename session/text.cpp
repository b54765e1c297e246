// SPDX-License-Identifier: Apache-2.0
#include "session/text.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

namespace emberlock::session {
namespace {

struct Compositions {
  char32_t mark;
  std::u32string_view pairs;  ///< a letter, and what it becomes with the mark
};
constexpr Compositions kCompositions[] = {
#include "session/compositions.inc"
};

// Hangul syllables are computed (The Unicode Standard, 3.12).
constexpr char32_t kSyllables = 0xAC00, kLeads = 0x1100, kVowels = 0x1161, kTails = 0x11A7;
constexpr char32_t kLeadCount = 19, kVowelCount = 21, kTailCount = 28;

/// The one character that two are; 0 if there is none.
char32_t composition(char32_t letter, char32_t mark) {
  if (letter - kLeads < kLeadCount && mark - kVowels < kVowelCount)
    return kSyllables + ((letter - kLeads) * kVowelCount + (mark - kVowels)) * kTailCount;
  const char32_t syllable = letter - kSyllables;
  if (syllable < kLeadCount * kVowelCount * kTailCount && syllable % kTailCount == 0 && mark > kTails &&
      mark - kTails < kTailCount)
    return letter + (mark - kTails);
  const auto* const row =
      std::lower_bound(std::begin(kCompositions), std::end(kCompositions), mark,
                       [](const Compositions& entry, char32_t wanted) { return entry.mark < wanted; });
  if (row == std::end(kCompositions) || row->mark != mark) return 0;
  for (std::size_t i = 0; i + 1 < row->pairs.size(); i += 2)
    if (row->pairs[i] == letter) return row->pairs[i + 1];
  return 0;
}

/// The number of bytes that follow a first byte, and the bits of that; nullopt for no first byte.
struct Lead {
  int more;
  char32_t bits;
  char32_t least;  ///< that may be written so long
};
std::optional<Lead> lead_of(unsigned char byte) {
  if (byte < 0x80) return Lead{0, byte, 0};
  if (byte >= 0xC0 && byte < 0xE0) return Lead{1, byte & 0x1FU, 0x80};
  if (byte >= 0xE0 && byte < 0xF0) return Lead{2, byte & 0x0FU, 0x800};
  if (byte >= 0xF0 && byte < 0xF8) return Lead{3, byte & 0x07U, 0x10000};
  return std::nullopt;
}

}  // namespace

std::optional<std::u32string> from_utf8(std::string_view text) {
  std::u32string characters;
  for (std::size_t i = 0; i < text.size();) {
    const auto lead = lead_of(static_cast<unsigned char>(text[i++]));
    if (!lead) return std::nullopt;
    char32_t c = lead->bits;
    for (int k = 0; k < lead->more; ++k, ++i) {
      if (i == text.size() || (static_cast<unsigned char>(text[i]) & 0xC0U) != 0x80U) return std::nullopt;
      c = c << 6U | (static_cast<unsigned char>(text[i]) & 0x3FU);
    }
    if (c < lead->least || c > 0x10FFFF || (c >= 0xD800 && c < 0xE000)) return std::nullopt;
    characters += c;
  }
  return characters;
}

std::string to_utf8(std::u32string_view text) {
  std::string bytes;
  const auto add = [&bytes](char32_t value) { bytes += static_cast<char>(value); };
  for (const char32_t c : text) {
    if (c < 0x80) {
      add(c);
    } else if (c < 0x800) {
      add(0xC0U | c >> 6U);
      add(0x80U | (c & 0x3FU));
    } else if (c < 0x10000) {
      add(0xE0U | c >> 12U);
      add(0x80U | (c >> 6U & 0x3FU));
      add(0x80U | (c & 0x3FU));
    } else {
      add(0xF0U | c >> 18U);
      add(0x80U | (c >> 12U & 0x3FU));
      add(0x80U | (c >> 6U & 0x3FU));
      add(0x80U | (c & 0x3FU));
    }
  }
  return bytes;
}

std::string printable(std::string_view text) {
  const auto is_control = [](char32_t c) { return c < 0x20 || (c >= 0x7F && c < 0xA0); };
  if (auto characters = from_utf8(text)) {
    std::replace_if(characters->begin(), characters->end(), is_control, U'?');
    return to_utf8(*characters);
  }
  std::string ascii(text);
  std::replace_if(
      ascii.begin(), ascii.end(), [](unsigned char c) { return c < 0x20 || c >= 0x7F; }, '?');
  return ascii;
}

std::u32string composed(std::u32string_view text) {
  std::u32string result;
  for (const char32_t c : text) {
    const char32_t one = result.empty() ? 0 : composition(result.back(), c);
    if (one != 0) {
      result.back() = one;
    } else {
      result += c;
    }
  }
  return result;
}

}  // namespace emberlock::session
