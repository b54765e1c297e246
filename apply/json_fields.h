// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apply/unreadable.h"

namespace emberlock::apply {

using Json = nlohmann::json;

inline constexpr double kFar = 1e6;  ///< metres, pixels and factors: what lies beyond is out of range

/// An object of the file, whose keys are asked for one by one; those that nobody asked for aren't known.
class Fields {
 public:
  Fields(const Json& json, std::string path) : json_(json), path_(std::move(path)) {
    if (!json.is_object()) refuse("isn't an object", path_, "Write it in braces");
  }
  [[nodiscard]] std::string path(const std::string& key) const {
    return path_.empty() ? key : path_ + "." + key;
  }
  const Json* find(const std::string& key) {
    asked_.insert(key);
    const auto at = json_.find(key);
    return at == json_.end() ? nullptr : &*at;
  }
  const Json& need(const std::string& key) {
    const Json* const found = find(key);
    if (found == nullptr) refuse("is missing", path(key));
    return *found;
  }
  double number(const std::string& key, double least, double most) {
    return number_in(need(key), path(key), least, most);
  }
  std::int64_t whole(const std::string& key, std::int64_t least, std::int64_t most) {
    const Json& found = need(key);
    if (!found.is_number_integer()) refuse("isn't a whole number", path(key));
    const double value = found.get<double>();
    if (!(value >= static_cast<double>(least) && value <= static_cast<double>(most)))
      refuse("is out of range", path(key), fmt::format("Give {} to {}", least, most));
    return found.get<std::int64_t>();
  }
  double number(const std::string& key, double otherwise, double least, double most) {
    const Json* const found = find(key);
    return found == nullptr ? otherwise : number_in(*found, path(key), least, most);
  }
  /// Three numbers in an array.
  Eigen::Vector3d three(const std::string& key, double least, double most) {
    const Json* const found = find(key);
    return found == nullptr ? Eigen::Vector3d::Zero() : three_in(*found, path(key), least, most);
  }
  Eigen::Vector3d place(const std::string& key) { return three_in(need(key), path(key), -kFar, kFar); }
  std::string word(const std::string& key, const std::vector<std::string>& words) {
    const Json* const found = find(key);
    if (found == nullptr) return words.front();
    for (const std::string& w : words)
      if (*found == w) return w;
    refuse("isn't known", path(key), fmt::format("Give {}", fmt::join(words, ", ")));
  }
  std::string text(const std::string& key) {
    const Json& found = need(key);
    if (!found.is_string() || found.get_ref<const std::string&>().empty()) refuse("isn't a text", path(key));
    return found.get<std::string>();
  }
  std::filesystem::path file(const std::string& key, const std::filesystem::path& folder) {
    const Json& found = need(key);
    if (!found.is_string() || found.get_ref<const std::string&>().empty()) refuse("isn't a path", path(key));
    const auto& name = found.get_ref<const std::string&>();
    if (name.find('\0') != std::string::npos) refuse("isn't a path", path(key));
    return folder / name;
  }
  /// Points of a picture, [[x, y], ...].
  std::vector<Eigen::Vector2d> points(const std::string& key, std::size_t fewest, std::size_t most,
                                      double far) {
    const Json& found = need(key);
    if (!found.is_array() || found.size() < fewest || found.size() > most)
      refuse("isn't a list of points", path(key), fmt::format("Give {} to {} of [x, y]", fewest, most));
    std::vector<Eigen::Vector2d> points;
    for (const Json& point : found) points.push_back(two_in(point, path(key), -far, far));
    return points;
  }
  Eigen::Vector2d two(const std::string& key, double least, double most) {
    return two_in(need(key), path(key), least, most);
  }
  void finish() const {
    for (const auto& [key, value] : json_.items())
      if (!asked_.contains(key))
        refuse("isn't known", path(key), fmt::format("Known here are {}", fmt::join(asked_, ", ")));
  }

 private:
  static double number_in(const Json& json, const std::string& key, double least, double most) {
    if (!json.is_number()) refuse("isn't a number", key);
    const double value = json.get<double>();
    if (!(value >= least && value <= most))
      refuse("is out of range", key, fmt::format("Give {:g} to {:g}", least, most));
    return value;
  }
  static Eigen::Vector2d two_in(const Json& json, const std::string& key, double least, double most) {
    if (!json.is_array() || json.size() != 2) refuse("isn't two numbers", key, "Give [x, y]");
    return {number_in(json[0], key, least, most), number_in(json[1], key, least, most)};
  }
  static Eigen::Vector3d three_in(const Json& json, const std::string& key, double least, double most) {
    if (!json.is_array() || json.size() != 3) refuse("isn't three numbers", key, "Give [x, y, z]");
    Eigen::Vector3d out;
    for (int a = 0; a < 3; ++a) out[a] = number_in(json[static_cast<std::size_t>(a)], key, least, most);
    return out;
  }

  const Json& json_;
  std::string path_;
  std::set<std::string> asked_;
};

/// Calls act(fields) for each object of an array, and says that nothing else is known in it.
template <class Act>
void each_of(const Json& json, const std::string& key, std::size_t most, const Act& act) {
  if (!json.is_array()) refuse("isn't an array", key, "Write it in brackets");
  if (json.size() > most) refuse(fmt::format("has more than {} entries", most), key);
  for (std::size_t i = 0; i < json.size(); ++i) {
    Fields fields(json[i], fmt::format("{}[{}]", key, i));
    act(fields);
    fields.finish();
  }
}

}  // namespace emberlock::apply
