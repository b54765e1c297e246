// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <vector>

#include "rig/align/run.h"

namespace emberlock::rig {

/// run_align(), recorded as a session in `folder`: every frame delivered, every strobe setting, reset and
/// decision, and the settings themselves. Errors: run_align's and the writer's; what was recorded until then
/// is kept.
Result<AlignRunResult> record_align(const std::filesystem::path& folder, AlignRig rig,
                                    const AlignRunOptions& options, const AlignObserver& observer = {},
                                    const Progress& progress = {}, const StopAsked& stop = {});

/// Runs a recorded alignment again from its frames. Errors: the reader's; bad_input when the session is not
/// an alignment's; device when the codes and numbers of a decision differ from the recorded ones (named by
/// its round). `seed` receives the recorded one.
Result<AlignRunResult> replay_align(const std::filesystem::path& folder, const AlignObserver& observer = {},
                                    const Progress& progress = {}, std::uint64_t* seed = nullptr);

/// What earlier runs learnt of the cameras' reset delays: {"CAMERA": {"mean_s", "sigma_s"}, ...}. Cameras
/// that the file doesn't name are unknown; error bad_input names the file and the camera.
Result<std::vector<std::optional<smear::ResetDelay>>> read_delays(const std::filesystem::path& file,
                                                                  const AlignRig& rig);
Status write_delays(const std::filesystem::path& file, const AlignRig& rig,
                    const std::vector<std::optional<smear::ResetDelay>>& delays);

}  // namespace emberlock::rig
