// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include <Eigen/Core>

#include "base/result.h"

namespace emberlock::cli {

/// The world's axis that points up, as --up takes it: "z", "-y" and so on.
inline Result<Eigen::Vector3d> parse_up(const std::string& text) {
  const double sign = text.rfind('-', 0) == 0 ? -1 : 1;
  const std::string axis = sign < 0 ? text.substr(1) : text;
  if (axis == "x" || axis == "y" || axis == "z")
    return Eigen::Vector3d(sign * Eigen::Vector3d::Unit(axis[0] - 'x'));
  return Error{ErrorKind::bad_input, "\"" + text + "\" is no axis", "--up", "Give x, y, z, -x, -y or -z"};
}

}  // namespace emberlock::cli
