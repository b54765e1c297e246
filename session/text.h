// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>

// Unicode, as far as names need it.
namespace emberlock::session {

/// The characters of a UTF-8 text. nullopt where it isn't UTF-8: overlong forms, surrogates and what lies
/// beyond U+10FFFF included.
std::optional<std::u32string> from_utf8(std::string_view text);
std::string to_utf8(std::u32string_view text);

/// For a terminal, whose cursor foreign text mustn't move: '?' stands for each control character, and for all
/// that isn't UTF-8.
std::string printable(std::string_view text);

/// Letters and the marks behind them made one character where Unicode has one ("e" and an acute accent,
/// Hangul syllables from their parts): normalisation form C of texts whose marks are in canonical order and
/// stand behind a letter without any, as most keyboards and file systems write them.
std::u32string composed(std::u32string_view text);

}  // namespace emberlock::session
