// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

#include "apply/placement.h"
#include "apply/ray_light.h"
#include "recon/calibrate/camera_model.h"
#include "recon/compute/pool.h"
#include "recon/hull/ray_list.h"
#include "recon/kernels/rgba.h"
#include "recon/pipeline/shown_volume.h"
#include "recon/render/coarse_medium.h"
#include "recon/render/in_scatter.h"

namespace emberlock::apply {

/// A flame that stands in a scene. To a camera it shows its volume, marched through as render_view() does, by
/// the rays of a camera that is placed beside the volume as the scene's camera is beside the flame. To
/// surfaces it is a coarse grid (recon/render/coarse_medium.h): as much light, on at most `light_voxels`
/// voxels along its longest side.
class Flame {
 public:
  /// `brightness` is the factor of its light.
  Flame(recon::ShownVolume shown, const Placement& world_from_flame, double brightness, int light_voxels,
        recon::Pool& pool);

  /// What the march needs for one camera.
  struct View {
    recon::RayList rays;
    std::vector<std::int32_t> ray_of_pixel;  ///< -1: none
    /// What this camera sees of it, per voxel edge, where it depends on the camera; else the flame's own.
    std::vector<recon::Rgba> source;
  };
  /// `step`: the largest, in voxel edges.
  [[nodiscard]] View seen_by(const recon::CameraModel& camera, double step, recon::Pool& pool) const;
  /// Puts the steps of a pixel's ray into `light`, and ends the flame there.
  void add_steps(const View& view, std::size_t pixel, RayLight& light) const;
  /// Radiance, grey levels, and in lane 3 the transmittance, of each of the view's rays, by the march of
  /// render_view(), as far as `until`: metres from the camera, of each pixel; cuts the view's rays there.
  [[nodiscard]] std::vector<recon::Rgba> marched(View& view, const std::vector<float>& until,
                                                 recon::Pool& pool) const;

  // What surfaces see.

  /// How much of the light of a part at distance r is taken along rays, and not from parts that are chosen by
  /// their power: a^2 / (r^2 + a^2), with this a, metres: the coarse grid's edge, and 0 at places farther
  /// from its box than two of them, where 1 / r^2 is bounded.
  [[nodiscard]] double close_by(const Eigen::Vector3d& place) const;
  /// The optical depth between two places.
  [[nodiscard]] double depth_between(const Eigen::Vector3d& a, const Eigen::Vector3d& b) const;
  /// As add_steps(), of any ray, by the coarse grid; of its light the share that close_by() says, of this a;
  /// of its extinction all.
  void add_coarse_steps(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double a,
                        RayLight& light) const;

  /// A voxel of the coarse grid that glows, and its power: the integral of its mean source over its volume,
  /// grey levels m2, mean of the channels.
  struct Emitter {
    std::uint32_t voxel;
    double power;
  };
  [[nodiscard]] std::vector<Emitter> emitters() const;
  /// A place in an emitter, and what it sends out: the source there times the voxel's volume, grey levels m2.
  struct Sent {
    Eigen::Vector3d place;
    Eigen::Vector3d power;
  };
  /// `within`: 0..1 along each of its edges.
  [[nodiscard]] Sent sent(std::uint32_t voxel, const Eigen::Vector3d& within) const;

  /// Of the coarse grid's voxels, metres.
  [[nodiscard]] double light_edge() const {
    return static_cast<double>(coarse_.grid.edge) * world_from_flame_.scale;
  }

  /// Around its box in the world.
  [[nodiscard]] Eigen::AlignedBox3d bounds() const;

 private:
  [[nodiscard]] const recon::Rgba* source_of(const View& view) const {
    return view.source.empty() ? source_.data() : view.source.data();
  }
  [[nodiscard]] Eigen::Vector3d in_coarse_edges(const Eigen::Vector3d& world) const;
  /// The part of a line (coarse edges) inside of the coarse box, in multiples of `along`; empty: first >
  /// second.
  [[nodiscard]] std::pair<double, double> inside(const Eigen::Vector3d& from,
                                                 const Eigen::Vector3d& along) const;

  recon::Volume volume_;
  recon::Lighting lighting_;
  Placement world_from_flame_, flame_from_world_;
  recon::Effects effects_;
  recon::Hull medium_;
  recon::CroppedHull crop_;
  std::vector<recon::Rgba> source_;
  recon::ScatterField scattered_;
  recon::CoarseMedium coarse_;
};

}  // namespace emberlock::apply
