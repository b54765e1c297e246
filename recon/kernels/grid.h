// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>

#include "base/host_device.h"

namespace emberlock::recon {

/// A regular grid of key points (voxel corners): key point (i, j, k) lies at origin + edge * (i, j, k), in
/// metres, and is stored at index i + nx * (j + ny * k). The medium lives inside the nx - 1 by ny - 1 by nz -
/// 1 voxels.
struct Grid {
  float origin[3] = {0, 0, 0};
  float edge = 1;  ///< voxel edge, metres
  int nx = 2, ny = 2, nz = 2;

  [[nodiscard]] HOST_DEVICE std::size_t size() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
  [[nodiscard]] HOST_DEVICE std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(nx) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(ny) * static_cast<std::size_t>(k));
  }
};

/// Whether both have the same key points.
inline bool same_place(const Grid& a, const Grid& b) {
  return a.nx == b.nx && a.ny == b.ny && a.nz == b.nz && a.edge == b.edge && a.origin[0] == b.origin[0] &&
         a.origin[1] == b.origin[1] && a.origin[2] == b.origin[2];
}

}  // namespace emberlock::recon
