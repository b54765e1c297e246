// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "base/progress.h"
#include "base/result.h"
#include "films/import_run.h"

namespace emberlock::films {

/// The transforms.json given by a path, or in the given folder.
std::optional<std::filesystem::path> transforms_in(const std::filesystem::path& path);

/// Imports the pictures of a transforms.json: they become a session of one frame per camera, with calibration
/// and the file's box. Or its videos, whose frames of one number are of one instant. Cameras are named after
/// their files. Errors: those of the file, its pictures and lenses; duplicate ids; videos of different
/// lengths or rates.
Result<ImportResult> import_transforms(const std::filesystem::path& transforms, const ImportOptions& options,
                                       const Observer& observer, const ReportsOf& reports);

}  // namespace emberlock::films
