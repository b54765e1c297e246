// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "recon/calibrate/rig_formats.h"

namespace emberlock::cli {

/// Imports a rig with recon::import_rig(), and prints its notes on stderr.
Result<v1::Rig> import_rig_argument(const std::filesystem::path& path);

}  // namespace emberlock::cli
