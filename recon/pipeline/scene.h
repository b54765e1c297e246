#pragma once

#include <cstddef>
#include <filesystem>
#include <optional>
#include <vector>

#include "base/result.h"
#include "recon/pipeline/session_picture.h"
#include "recon/preprocess/view.h"

namespace emberlock {

struct SceneOptions {
  std::optional<Box> box;            ///< stands before the input's own
  std::optional<std::size_t> frame;  ///< of a session: frame of its first camera; else the one nearest to the
                                     ///< middle of which every camera has a complete frame
  std::optional<std::filesystem::path> rig =
      {};  ///< of a session: a rig.json that stands before its calibration
  FrameOptions frames = {};          ///< of a session: how its frames become pictures
};

/// A transforms.json (a file) or a recorded session (a folder with a manifest): views in the order of the
/// input, all of role input. Errors name file, field and remedy: those of read_transforms(), read_image() and
/// SessionReader; an input that is neither; no box in the input nor in the options; a rig that
/// doesn't fit, a camera without calibration, more than 64 of them; a camera of the session that has no
/// complete frame within one frame period of the chosen instant.
Result<Scene> load_scene(const std::filesystem::path& input, const SceneOptions& options = {});

/// Gives the views of these indices the role held_out. Errors: no such view, none left to reconstruct from.
Status hold_out(Scene& scene, const std::vector<int>& views);

}  // namespace emberlock
