// SPDX-License-Identifier: Apache-2.0
#include "cli/up_axis.h"

#include "cli/result_files.h"

namespace emberlock::cli {
namespace {

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
  const std::string up = reported(result, "up");
  return up.empty() ? Eigen::Vector3d(Eigen::Vector3d::UnitZ()) : parse_up(up);
}

}  // namespace emberlock::cli
