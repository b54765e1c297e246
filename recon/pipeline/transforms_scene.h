// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "base/result.h"
#include "recon/pipeline/scene.h"

namespace emberlock::recon {

/// load_scene() of a transforms.json. Pixels that a frame's mask leaves out are black and marked
/// (View::bounds). Errors name every picture and mask that is missing.
Result<Scene> load_transforms(const std::filesystem::path& path, const SceneOptions& options);

}  // namespace emberlock::recon
