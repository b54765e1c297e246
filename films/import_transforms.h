// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>

#include "base/progress.h"
#include "base/result.h"
#include "films/import_run.h"

namespace emberlock::films {

/// The transforms.json that a path names, or that the folder holds.
std::optional<std::filesystem::path> transforms_in(const std::filesystem::path& path);

/// One instant: the pictures of a transforms.json become a session of one frame a camera, calibrated, with
/// the file's box. Cameras are called as their pictures are. Errors: those of the file, its pictures and
/// lenses; ids there twice.
Result<ImportResult> import_transforms(const std::filesystem::path& transforms, const ImportOptions& options,
                                       const Observer& observer, const ReportsOf& reports);

}  // namespace emberlock::films
