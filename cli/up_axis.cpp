// SPDX-License-Identifier: Apache-2.0
#include "cli/up_axis.h"

#include <nlohmann/json.hpp>

#include "base/file.h"

namespace emberlock::cli {
namespace {

/// Nothing where no report tells.
std::string reported_up(const std::filesystem::path& result) {
  const auto folder = std::filesystem::is_directory(result) ? result : result.parent_path();
  const auto text = read_file(folder / "report.json");
  const auto json = nlohmann::json::parse(text ? *text : std::string(), nullptr, false);
  const bool tells = json.is_object() && json.contains("up") && json["up"].is_string();
  return tells ? json["up"].get<std::string>() : std::string();
}

Result<Eigen::Vector3d> parse_up(const std::string& text) {
  const double sign = text.rfind('-', 0) == 0 ? -1 : 1;
  const std::string axis = sign < 0 ? text.substr(1) : text;
  if (axis == "x" || axis == "y" || axis == "z")
    return Eigen::Vector3d(sign * Eigen::Vector3d::Unit(axis[0] - 'x'));
  return Error{ErrorKind::bad_input, "\"" + text + "\" is no axis", "--up", "Give x, y, z, -x, -y or -z"};
}

}  // namespace

Result<Eigen::Vector3d> up_axis(const std::string& told, const std::filesystem::path& result) {
  if (!told.empty()) return parse_up(told);
  const std::string reported = reported_up(result);
  return reported.empty() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : parse_up(reported);
}

}  // namespace emberlock::cli
