// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "recon/hull/ray_list.h"
#include "recon/kernels/carve.h"
#include "recon/kernels/cut.h"

namespace emberlock::recon {

// Cameras and media in the form for kernels.

/// Without its table.
Silhouette silhouette(const CameraModel& camera);

PixelRays pixel_rays(const CameraModel& camera);

/// The medium for cutting rays, with the step and the gas from the options. Owns the data that it points to,
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
