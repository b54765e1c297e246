// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>

#include "recon/kernels/grid.h"
#include "recon/kernels/in_scatter.h"

namespace emberlock::apply {

/// A place (metres, the grid's own) in a grid's edges from its first key point.
inline Eigen::Vector3d in_edges(const recon::Grid& g, const Eigen::Vector3d& place) {
  return (place - Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>()) /
         static_cast<double>(g.edge);
}

inline recon::Rgba at_place(const recon::ShiningGrid& grid, const Eigen::Vector3d& p) {
  return grid.at(static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]));
}

}  // namespace emberlock::apply
