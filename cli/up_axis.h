// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>

#include <Eigen/Core>

#include "base/result.h"

namespace emberlock::cli {

/// The world's axis that points up, as --up takes it: "z", "-y" and so on. Where it isn't told (empty), the
/// one that a result's report.json has, as the cameras stood; z where there is none. `result`: its folder, or
/// a volume in it.
Result<Eigen::Vector3d> up_axis(const std::string& told, const std::filesystem::path& result);

}  // namespace emberlock::cli
