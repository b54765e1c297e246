// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/hull/ray_list.h"
#include "recon/kernels/carve.h"
#include "recon/kernels/cut.h"

namespace emberlock::recon {

// Cameras and media as kernels need them.

/// Without its table.
Silhouette silhouette(const CameraModel& camera);

PixelRays pixel_rays(const CameraModel& camera);

/// The medium as rays are cut against it, with the step and the gas of the options. Holds what it points to,
/// except for the gas.
class Cutter {
 public:
  Cutter(const Hull& medium, const RayListOptions& options);
  Cutter(Cutter&&) = delete;
  Cutter& operator=(Cutter&&) = delete;
  ~Cutter() = default;

  [[nodiscard]] const CutRay& cut() const { return cut_; }

 private:
  std::vector<std::uint8_t> inside_, occupied_;
  CutRay cut_;
};

}  // namespace emberlock::recon
