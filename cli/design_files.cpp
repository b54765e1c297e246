// SPDX-License-Identifier: Apache-2.0
#include "cli/design_files.h"

#include <cmath>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "base/file.h"

namespace emberlock::cli {
namespace {

constexpr std::size_t kMostBytes = 4 << 20;
constexpr double kMostNumber = 1e9;

/// The object in a text; null if it is something else.
nlohmann::json json_object(std::string_view text) {
  nlohmann::json json = nlohmann::json::parse(text, nullptr, false);
  return json.is_object() ? json : nlohmann::json();
}

/// A number of at least `least` and at most kMostNumber; nothing for anything else.
std::optional<double> number_in(const nlohmann::json& json, const std::string& key, double least) {
  if (!json.is_object() || !json.contains(key) || !json[key].is_number()) return {};
  const double value = json[key].get<double>();
  return value >= least && value <= kMostNumber ? std::optional(value) : std::nullopt;
}

}  // namespace

Result<BenchFile> parse_bench_file(std::string_view text, const std::filesystem::path& file) {
  const auto refused = [&](const char* what) {
    return Error{ErrorKind::bad_input, what, file.string(),
                 "Give a file that `emberlock bench --json > FILE` wrote on that machine"};
  };
  const nlohmann::json json = json_object(text);
  if (!json.is_object() || !json.contains("machine") || !json["machine"].is_array())
    return refused("is not what bench writes");
  std::optional<double> quickest;
  for (const nlohmann::json& line : json["machine"]) {
    if (!line.is_object() || !line.contains("what") || !line.contains("here"))
      return refused("has a line of the machine that isn't bench's");
    if (!line["what"].is_string() || !line["here"].is_number()) continue;  // null: not measured there
    const double seconds = line["here"].get<double>();
    if (!line["what"].get<std::string>().ends_with("a frame, effects found out")) continue;
    if (!std::isfinite(seconds) || !(seconds > 0)) return refused("has a time that isn't positive");
    if (!quickest || seconds < *quickest) quickest = seconds;
  }
  if (!quickest) return refused("tells no time of a frame");
  return BenchFile{file.stem().string(), Seconds(*quickest)};
}

Result<evaluate::ErrorLaw> parse_error_law(std::string_view text, const std::filesystem::path& file) {
  constexpr double kLeastReach = 1e-3;
  const nlohmann::json json = json_object(text);
  const auto refused = [&](const std::string& what) {
    return Error{ErrorKind::bad_input, what, file.string(), "Give the report.json of an `emberlock design`"};
  };
  if (!json.is_object() || !json.contains("law")) return refused("holds no law of errors");
  const nlohmann::json& told = json["law"];
  const auto reach = number_in(told, "reach", kLeastReach);
  const auto spread = number_in(told, "spread", 0);
  if (!reach || !spread) return refused("has a law without reach or spread");
  evaluate::ErrorLaw law{*reach, {}, *spread};
  for (const evaluate::ErrorPart part : evaluate::kAllErrorParts) {
    const std::string key(name(part));
    const auto strength = told.contains("strength") ? number_in(told["strength"], key, 0) : std::nullopt;
    if (!strength) return refused("has a law without a strength of " + key);
    law.strength[static_cast<std::size_t>(part)] = *strength;
  }
  return law;
}

Result<BenchFile> read_bench_file(const std::filesystem::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMostBytes));
  return parse_bench_file(text, file);
}

Result<evaluate::ErrorLaw> read_error_law(const std::filesystem::path& file) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(file, kMostBytes));
  return parse_error_law(text, file);
}

}  // namespace emberlock::cli
