// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "apply/flame.h"
#include "apply/scene_file.h"
#include "apply/scene_picture.h"
#include "apply/surfaces.h"
#include "base/image.h"
#include "base/result.h"
#include "recon/compute/pool.h"

namespace emberlock::apply {

/// The files of a flame's frames in their order: frame-N of a folder of `reconstruct --frames`, or the one
/// result. Errors: neither is there.
Result<std::vector<std::filesystem::path>> frames_of(const std::filesystem::path& result);

/// Which of `count` frames is shown at a time after the scene's beginning; absent before and after one that
/// runs once. One alone is always shown.
std::optional<std::size_t> frame_at(const PlacedResult& flame, std::size_t count, Seconds time);

/// What a scene file describes, read: surfaces once, flames as time goes on.
class Scene {
 public:
  /// Reads the geometry, and the flames as they are at the beginning. Errors: those of read_gltf(),
  /// Surfaces::build(), frames_of() and recon::read_shown_volume().
  static Result<Scene> load(SceneFile file, int light_voxels, recon::Pool& pool);

  /// Reads the flames' frames for this time, seconds after the beginning, where they are others than before.
  /// Errors: those of recon::read_shown_volume() and Flame::light_by(); an albedo of a result that no light
  /// fell on.
  Status go_to(Seconds time, recon::Pool& pool);
  [[nodiscard]] ScenePicture picture(const recon::CameraModel& camera, const PictureOptions& options,
                                     recon::Pool& pool) const;
  /// The file's cameras, `frames` of them along a path; one where it has one place. Errors: a path of one
  /// frame; no flame at the beginning to move around.
  [[nodiscard]] Result<std::vector<recon::CameraModel>> cameras(ImageSize size, int frames) const;

  [[nodiscard]] std::size_t triangles() const { return triangles_; }
  /// What the geometry asks for and isn't shown.
  [[nodiscard]] const std::vector<std::string>& notes() const { return notes_; }
  /// Every file and folder that it reads.
  [[nodiscard]] static std::vector<std::filesystem::path> inputs(const SceneFile& file);

 private:
  struct Player {
    PlacedResult placed;
    std::vector<std::filesystem::path> frames;
    std::optional<std::size_t> shown;
    std::unique_ptr<Flame> flame;  ///< of the frame that is shown
  };
  [[nodiscard]] std::vector<const Flame*> burning() const;
  Status light_flames(recon::Pool& pool);
  Scene(SceneFile file, Surfaces surfaces) : file_(std::move(file)), surfaces_(std::move(surfaces)) {}

  SceneFile file_;
  Surfaces surfaces_;
  std::size_t triangles_ = 0;
  std::vector<std::string> notes_;
  int light_voxels_ = 0;
  std::vector<Player> players_;
};

}  // namespace emberlock::apply
