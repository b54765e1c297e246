// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "apply/kernels/flame_table.h"
#include "apply/placement.h"
#include "base/result.h"
#include "recon/compute/pool.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/rgba.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/render/coarse_medium.h"
#include "recon/render/in_scatter.h"
#include "recon/views/camera_model.h"

namespace emberlock::apply {

struct FlameOnGpu;

/// A flame that stands in a scene. To a camera it shows its volume, marched through as render_view() does, by
/// the rays of a camera that is placed beside the volume as the scene's camera is beside the flame. To
/// surfaces it is a coarse grid (recon/render/coarse_medium.h): as much light, on at most `light_voxels`
/// voxels along its longest side.
class Flame {
 public:
  /// `brightness` is the factor of its light.
  Flame(recon::ShownVolume shown, const Placement& world_from_flame, double brightness, int light_voxels,
        recon::Pool& pool);

  /// The share of a light that comes to a place in the world, past all that isn't this flame.
  using Shade = std::function<double(const Eigen::Vector3d& place)>;
  /// Shows it in this light from outside (LightTables'), instead of that of an earlier call. Matter that
  /// scatters its own flame's light scatters this too: once, by its phase function towards the camera; if it
  /// scatters often, also again, evenly. A result that was lit from outside scatters it once and evenly, if
  /// `albedo` says how much of it, and otherwise keeps the light that it was filmed in. It shades itself as
  /// in recon/render/lit_medium.h, and `shade` holds at the key points of the coarse grid. Nothing shades the
  /// light from all sides, which isn't scattered again. Error: a nearby light within its box.
  Status light_by(const recon::Light& light, std::optional<double> albedo, const Shade& shade,
                  recon::Pool& pool);

  /// What the march needs for one camera.
  struct View {
    recon::RayList rays;
    std::vector<std::int32_t> ray_of_pixel;                  ///< -1: none; empty where the rays are on a GPU
    std::shared_ptr<const std::vector<recon::Rgba>> source;  ///< what this camera sees of it, per voxel edge
  };
  /// `step`: the largest, in voxel edges.
  [[nodiscard]] View seen_by(const recon::CameraModel& camera, double step, recon::Pool& pool) const;
  /// Radiance, grey levels, and in lane 3 the transmittance, of each of the view's rays, by the march of
  /// render_view(), as far as `until`: metres from the camera, of each pixel; cuts the view's rays there. The
  /// view's rays must be in the CPU's memory.
  [[nodiscard]] std::vector<recon::Rgba> marched(View& view, const std::vector<float>& until,
                                                 recon::Pool& pool) const;
  /// What kernels need of it: of what surfaces see alone, and with a camera's view, which must outlive it.
  [[nodiscard]] FlameTable table() const;
  [[nodiscard]] FlameTable table(const View& view) const;

  /// A voxel of the coarse grid that glows, and its power: the integral of its mean source over its volume,
  /// grey levels m2, mean of the channels.
  struct Emitter {
    std::uint32_t voxel;
    double power;
  };
  [[nodiscard]] const std::vector<Emitter>& emitters() const { return emitters_; }

  /// Of the coarse grid's voxels, metres.
  [[nodiscard]] double light_edge() const {
    return static_cast<double>(coarse_.grid.edge) * world_from_flame_.scale;
  }

  /// Around its box in the world.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;

  /// What it keeps in a GPU's memory from picture to picture (scene_cuda.h).
  [[nodiscard]] std::shared_ptr<FlameOnGpu>& on_gpu() const { return on_gpu_; }
  [[nodiscard]] const std::vector<recon::Rgba>& coarse_shine() const { return coarse_.shine; }

 private:
  [[nodiscard]] bool scatters() const {
    return lighting_.scattering.order != recon::Scattering::Order::none && lighting_.scattering.albedo > 0 &&
           !volume_.extinction.empty();
  }
  /// What comes of a light to each key point of the volume, in the light's own measure; its place is the
  /// flame's.
  [[nodiscard]] std::vector<float> arriving(const recon::Light& light, const Shade& shade,
                                            recon::Pool& pool) const;
  void add_beam(const Eigen::Vector3d& camera_center, std::vector<recon::Rgba>& source,
                recon::Pool& pool) const;
  [[nodiscard]] std::vector<Emitter> glowing() const;

  recon::Volume volume_;
  recon::Lighting lighting_;
  Placement world_from_flame_, flame_from_world_;
  int light_voxels_;
  recon::Effects effects_;
  recon::Hull medium_;
  recon::CroppedHull crop_;
  std::shared_ptr<const std::vector<recon::Rgba>> source_;
  recon::ScatterField scattered_;
  recon::Light light_;  ///< from outside, as the flame stands to it
  std::vector<recon::Rgba>
      beam_;  ///< like source_: what is scattered of it with a phase function, as an even one would; or empty
  recon::CoarseMedium coarse_;
  std::vector<Emitter> emitters_;
  mutable std::shared_ptr<FlameOnGpu> on_gpu_;
};

}  // namespace emberlock::apply
