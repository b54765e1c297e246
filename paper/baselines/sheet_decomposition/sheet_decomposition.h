// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "paper/baselines/method.h"
#include "paper/baselines/parallel_slices.h"

namespace emberlock::paper {

inline constexpr MethodFacts kSheetDecompositionFacts{"density-sheet decomposition",
                                                      "Hasinoff and Kutulakos 2003, 2007",
                                                      true,
                                                      Projection::parallel,
                                                      "linear",
                                                      false};

// Of two views' profiles with the same light there is one density on a single curve that shows both and along
// which their rays follow each other from left to right: the density sheet. It runs where the cumulative
// light of both is the same. Cut both profiles into n parts of equal light and join each part of the one with
// one of the other by its own sheet: these sheet-like densities show both pictures as well, for every such
// permutation, and so do their convex combinations, which are the n x n parts' sheets with doubly stochastic
// weights (Birkhoff 1946). With rising n they reach every density that shows the two pictures.

/// A piece of a sheet.
struct SheetDot {
  Eigen::Vector2d place;  ///< from the axis, voxel edges
  double light = 0;       ///< its share of the sheet's
};

/// What a sheet takes of two profiles, as shares of their light: `light` of each, from where the cumulative
/// light is `first` and `second`.
struct SheetPart {
  double first = 0, second = 0, light = 1;
};

/// The density sheet of two pictures' parts in layer k and a channel (0..2), in steps of at most a voxel edge
/// where it lies in the slice; none where a profile is dark. The views must cross.
std::vector<SheetDot> density_sheet(const ParallelSlices& slices, const ParallelPicture& first,
                                    const ParallelPicture& second, int k, int channel,
                                    const SheetPart& part = {});

/// The convex weights w, w >= 0 and sum w = 1, that minimise |seen w - shown|^2 + even m |w - 1/n|^2, where m
/// is the mean square of the n columns of `seen` (accelerated projected gradient, Nesterov 1983; projection
/// by Duchi et al. 2008).
Eigen::VectorXd convex_weights(const Eigen::SparseMatrix<double>& seen, const Eigen::VectorXd& shown,
                               double even);

/// Every slice is the convex combination of the sheets of all pairs' parts that shows all input views best.
/// Errors beside method.h's: no two input views that cross by 10 degrees or more.
Result<MethodResult> sheet_decomposition(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
