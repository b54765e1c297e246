// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <toml++/toml.h>

#include "base/quantity.h"
#include "rig/config/config.h"

// A key of the configuration, and functions to define one; private to rig/config. A key knows its value's
// place in T and its TOML format: `at` below is a function from T& (const or not) to a reference to the
// member.
namespace emberlock::rig::config {

template <class T>
struct Key {
  std::string name;      ///< ends in its unit, if it has one: "flash_width_us"
  std::string takes;     ///< "a number from 0.1 to 1000", for remedies and the manual
  std::string sentence;  ///< description for the file and the manual
  std::string example;   ///< TOML, for keys without a default
  /// Sets the value; false for a node that isn't what `takes` says.
  std::function<bool(const toml::node&, T&)> read;
  /// The value as TOML; empty if there is none.
  std::function<std::string(const T&)> write;
  /// Whether the key has a meaning together with the other values; absent: always.
  std::function<bool(const T&)> applies = {};
  std::string applies_words = {};  ///< "drivers virtual, v4l2"
};

template <class T>
struct Section {
  std::string name;  ///< "rig.strobe"
  std::string words;
  std::vector<Key<T>> keys;
};

/// [rig] and its subsections, except [[rig.camera]].
std::vector<Section<DaemonConfig>> rig_sections();
/// All sections except [[rig.camera]], in the order of the file.
const std::vector<Section<DaemonConfig>>& sections();
/// [[rig.camera]]; `driver` comes first, because other keys depend on it.
const Section<CameraConfig>& camera_section();

std::string in_quotes(std::string_view text);

template <class M>
struct Bare {
  using type = M;
};
template <class M>
struct Bare<std::optional<M>> {
  using type = M;
};
template <class T, class At>
using MemberOf = typename Bare<std::decay_t<std::invoke_result_t<At, T&>>>::type;

template <class M>
const M* value_in(const M& member) {
  return &member;
}
template <class M>
const M* value_in(const std::optional<M>& member) {
  return member ? &*member : nullptr;
}

/// A number in [low, high], in units of `unit` (SI value = unit x number).
struct NumberRange {
  double low = 0, high = 0;
  double unit = 1;
};

template <class M>
double to_double(const M& value) {
  if constexpr (std::is_arithmetic_v<M>) {
    return static_cast<double>(value);
  } else {
    return value.value();
  }
}

template <class T, class At>
Key<T> number(std::string name, At at, NumberRange range, std::string sentence, std::string example = {}) {
  using M = MemberOf<T, At>;
  constexpr bool kWhole = std::is_integral_v<M>;
  Key<T> key{
      std::move(name),
      fmt::format("a {} from {:.15g} to {:.15g}", kWhole ? "whole number" : "number", range.low, range.high),
      std::move(sentence),
      std::move(example),
      {},
      {}};
  key.read = [at, range](const toml::node& node, T& target) {
    const auto value = node.value<double>();
    if (!value || !(node.is_integer() || (!kWhole && node.is_floating_point()))) return false;
    if (!(*value >= range.low && *value <= range.high)) return false;
    at(target) = M(static_cast<std::conditional_t<kWhole, M, double>>(*value * range.unit));
    return true;
  };
  key.write = [at, range](const T& source) {
    const M* value = value_in(at(source));
    return value == nullptr ? std::string() : fmt::format("{:.12g}", to_double(*value) / range.unit);
  };
  return key;
}

/// A text that `parse` (std::optional<M>(const std::string&)) reads and `print` writes.
template <class T, class At, class Parse, class Print>
Key<T> spelled(std::string name, At at, std::string takes, Parse parse, Print print, std::string sentence,
               std::string example = {}) {
  Key<T> key{std::move(name), std::move(takes), std::move(sentence), std::move(example), {}, {}};
  key.read = [at, parse](const toml::node& node, T& target) {
    const auto text = node.value<std::string>();
    if (!text) return false;
    auto value = parse(*text);
    if (!value) return false;
    at(target) = std::move(*value);
    return true;
  };
  key.write = [at, print](const T& source) {
    const auto* value = value_in(at(source));
    const std::string text = value == nullptr ? std::string() : print(*value);
    return text.empty() ? text : in_quotes(text);
  };
  return key;
}

template <class T, class At>
Key<T> text(std::string name, At at, std::string takes, std::string sentence, std::string example = {}) {
  using M = MemberOf<T, At>;
  return spelled<T>(
      std::move(name), at, std::move(takes), [](const std::string& value) { return std::optional<M>(value); },
      [](const M& value) { return std::string(value); }, std::move(sentence), std::move(example));
}

template <class T, class At>
Key<T> choice(std::string name, At at, std::vector<std::pair<std::string_view, MemberOf<T, At>>> names,
              std::string sentence, std::string example = {}) {
  using M = MemberOf<T, At>;
  std::string takes;
  for (const auto& [word, value] : names)
    takes += (takes.empty() ? "" : &word == &names.back().first ? " or " : ", ") + in_quotes(word);
  const auto parse = [names](const std::string& given) -> std::optional<M> {
    for (const auto& [word, value] : names) {
      if (word == given) return value;
    }
    return std::nullopt;
  };
  const auto print = [names](const M& given) {
    for (const auto& [word, value] : names) {
      if (value == given) return std::string(word);
    }
    return std::string();
  };
  return spelled<T>(std::move(name), at, std::move(takes), parse, print, std::move(sentence),
                    std::move(example));
}

/// An accessor for a member.
// NOLINTBEGIN(bugprone-macro-parentheses): a member can't stand in parentheses.
#define EMBERLOCK_AT(member) \
  [](auto& c) -> auto& { return c.member; }
// NOLINTEND(bugprone-macro-parentheses)

inline constexpr double kMilli = 1e-3;
inline constexpr double kMicro = 1e-6;
inline constexpr double kMebi = 1 << 20;

inline constexpr const char* kPath = "a path";
inline constexpr const char* kAddress = "HOST:PORT, or empty";

/// An enumeration with the names and values that another header lists as pairs.
template <class M, class Names>
std::vector<std::pair<std::string_view, M>> named(std::initializer_list<M> values,
                                                  const Names& name_of_value) {
  std::vector<std::pair<std::string_view, M>> names;
  for (const M value : values) names.emplace_back(name_of_value(value), value);
  return names;
}

}  // namespace emberlock::rig::config
