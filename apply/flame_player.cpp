// SPDX-License-Identifier: Apache-2.0
#include "apply/flame_player.h"

#include <utility>

#include "apply/scene.h"
#include "recon/hull/ray_list.h"
#include "recon/pipeline/shown_volume.h"

namespace emberlock::apply {
namespace {

constexpr std::size_t kKept = 32;  // frames of a sequence that are shown again; 128^3 voxels take some 70 MB
constexpr int kLightPoints = 65;

/// Around the voxels of a volume that hold anything, as a placement puts them.
Eigen::AlignedBox3d around(const recon::Volume& volume, const Placement& place) {
  const recon::Hull medium = recon::filled_voxels(volume);
  Eigen::AlignedBox3d box;
  if (medium.count == 0) return box;
  const recon::Box inner = recon::box_of(recon::crop_to_medium(medium).hull.grid);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d side((corner & 1) - 0.5, (corner >> 1 & 1) - 0.5, (corner >> 2) - 0.5);
    box.extend(place * (inner.center + side.cwiseProduct(inner.size)));
  }
  return box;
}

}  // namespace

Result<FlamePlayer> FlamePlayer::load(const StandingFlame& standing, recon::Pool& pool) {
  FlamePlayer player;
  player.standing_ = standing;
  EMBERLOCK_ASSIGN_OR_RETURN(player.files_, frames_of(standing.placed.result));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::ShownVolume first, recon::read_shown_volume(player.files_[0]));
  Placement& place = player.standing_.placed.world_from_flame;
  place.translation.setZero();
  const Eigen::AlignedBox3d box = around(first.volume, place);
  if (box.isEmpty())
    return Error{ErrorKind::bad_input, "nothing glows in it", player.files_[0].string(),
                 "Name another result of `reconstruct`"};
  place.translation = standing.foot - Eigen::Vector3d(box.center().x(), box.center().y(), box.min().z());
  player.bounds_ = around(first.volume, place);
  const auto shown = player.at(standing.placed.shift, pool);
  if (!shown) return shown.error();
  return player;
}

Result<const FlamePlayer::Shown*> FlamePlayer::at(Seconds time, recon::Pool& pool) {
  const std::optional<std::size_t> frame = frame_at(standing_.placed, files_.size(), time);
  if (!frame) return static_cast<const Shown*>(nullptr);
  for (auto kept = kept_.begin(); kept != kept_.end(); ++kept)
    if (kept->frame == *frame) {
      kept_.splice(kept_.begin(), kept_, kept);
      return kept_.front().shown.get();
    }
  EMBERLOCK_ASSIGN_OR_RETURN(recon::ShownVolume volume, recon::read_shown_volume(files_[*frame]));
  auto shown = std::make_shared<Shown>();
  shown->flame = std::make_unique<const Flame>(std::move(volume), standing_.placed.world_from_flame,
                                               standing_.placed.brightness, standing_.light_voxels, pool);
  if (standing_.plate > 0) shown->light = PlateLight(*shown->flame, standing_.plate, kLightPoints, pool);
  kept_.push_front({*frame, std::move(shown)});
  if (kept_.size() > kKept) kept_.pop_back();
  return kept_.front().shown.get();
}

}  // namespace emberlock::apply
