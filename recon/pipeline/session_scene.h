// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/quantity.h"
#include "recon/pipeline/scene.h"
#include "recon/pipeline/session_picture.h"
#include "session/reader.h"

namespace emberlock::recon {

/// load_scene() of a recorded session. Its cameras are read and developed at once, by options.threads.
Result<Scene> load_session(const std::filesystem::path& folder, const SceneOptions& options);

/// How each camera's frames become pictures, kept from one scene of a recording to the next.
using KeptDevelopers = std::vector<std::optional<FrameDeveloper>>;
/// The same of a reader that is open already, such as one that follows a recording: of the frames that it
/// knows. Of cameras with a developer in `kept` that one is used; the others' are put there.
Result<Scene> load_session(session::SessionReader& reader, const SceneOptions& options, KeptDevelopers& kept);

/// A camera's frame that stands for an instant.
struct FilmedFrame {
  std::size_t frame = 0;        ///< of the camera
  std::optional<Seconds> late;  ///< later than the instant, where times.json or the manifest tells
  Seconds late_sigma{0};
};
/// Those that load_session() makes a scene of, of each camera; nothing of one that has none.
std::vector<std::optional<FilmedFrame>> filmed_frames(const session::SessionReader& reader,
                                                      const std::optional<v1::ShutterTimes>& times,
                                                      const SceneOptions& options);

}  // namespace emberlock::recon
