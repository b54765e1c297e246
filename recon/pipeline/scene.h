// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "recon/pipeline/session_picture.h"
#include "recon/views/flame_mask.h"
#include "recon/views/view.h"

namespace emberlock::recon {

/// What a session's cameras show over the whole of it: found by the first of the scenes that share it.
struct SharedRecording {
  std::once_flag masked, averaged;
  std::optional<Result<std::vector<FlameMask>>> masks;       ///< where each sees flame at some instants
  std::optional<Result<std::vector<SharedImage>>> averages;  ///< of each
};

struct SceneOptions {
  std::optional<Box> box;  ///< stands before the input's own; without either it is found from the pictures
  /// Of a session: frame of its first camera; else the one nearest to the middle of which every camera has a
  /// complete frame. Of a transforms.json whose frames have different times: number of the instant.
  std::optional<std::size_t> frame;
  /// Of a session whose cameras are staggered: the scene's instant, so many frame periods after that frame's,
  /// 0..1. Each view is then the frame of its camera that is nearest in time.
  std::optional<double> part = {};
  std::optional<std::filesystem::path> rig =
      {};                          ///< of a session: a rig.json that stands before its calibration
  FrameOptions frames = {};        ///< of a session: how its frames become pictures
  int threads = 0;                 ///< CPU threads, as in ComputeOptions; the result doesn't depend on them
  Progress progress = {};          ///< of a session: reading its other frames, where they are needed
  std::vector<int> held_out = {};  ///< views that get that role, counted from 0 over the whole input
  int views = 0;                   ///< input views that are used, as in with_views(); 0: all
  /// For several frames of one session that are read with the same rig and FrameOptions.
  std::shared_ptr<SharedRecording> recording = {};
};

/// A transforms.json (a file) or a recorded session (a folder with a manifest): views in the order of the
/// input, of role input unless the options hold them out. Errors name file, field and remedy: those of
/// read_transforms(), read_image() and SessionReader; an input that is neither; no box in the input nor in
/// the options, and none to be found; a rig that doesn't fit, a camera without calibration, more than 64 of
/// them (of a transforms.json: after `views` has chosen); missing pictures, all in one error; several
/// instants in a transforms.json of which `frame` chooses none; a mask of another size; a camera of the
/// session that has no complete frame within one frame period of the chosen instant; a camera response that
/// can't be read, or cameras with different ones; of an instant between frames (`part`) also cameras of
/// different or unknown rates, that film at one instant, or that have no frame within half a period of it.
///
/// A box is found (find_box()) so that it holds the flame of several instants over a session. Where a
/// session's times.json, or else its manifest, says that cameras were late, views bring their lateness, and
/// what each camera shows
/// on average over frames of the whole recording, the same whatever frame is asked for.
Result<Scene> load_scene(const std::filesystem::path& input, const SceneOptions& options = {});

/// What load_scene() reads, as far as it is there: the input, a transforms.json's pictures
/// and camera response, the rig.
std::vector<std::filesystem::path> files_of(const std::filesystem::path& input,
                                            const SceneOptions& options = {});

/// Gives the views of these indices the role held_out. Errors: no such view, none left to reconstruct from.
Status hold_out(Scene& scene, const std::vector<int>& views);

/// Indices, in order, of `count` input views, spread as far as possible (greedily, by the angle between lines
/// of sight to the box), and of all held-out ones; of all views with 0, or with as many as there are.
std::vector<std::size_t> spread_views(const Scene& scene, int count);
/// The scene with these views only.
Scene with_views(const Scene& scene, int count);

/// Holds views out and chooses among the others, as the options ask for. Errors: hold_out()'s; fewer input
/// views than options.views.
Status choose_views(Scene& scene, const SceneOptions& options);

}  // namespace emberlock::recon
