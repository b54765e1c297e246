// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>

#include "recon/pipeline/scene.h"

namespace emberlock::recon {

/// load_scene() of a recorded session. Its cameras are read and developed at once, by options.threads.
Result<Scene> load_session(const std::filesystem::path& folder, const SceneOptions& options);

}  // namespace emberlock::recon
