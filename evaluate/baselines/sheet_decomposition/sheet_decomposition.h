// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include <Eigen/Core>

#include "evaluate/baselines/method.h"
#include "evaluate/baselines/parallel_slices.h"

namespace emberlock::evaluate {

inline constexpr MethodFacts kSheetDecompositionFacts{"density-sheet decomposition",
                                                      "Hasinoff and Kutulakos 2003, 2007",
                                                      true,
                                                      Projection::parallel,
                                                      "linear",
                                                      false};

/// The density sheet of two profiles of one slice and channel: all light on the one curve along which rays of
/// both views follow each other from left to right (the ordering of stereo vision), so that both views see
/// their profiles. It follows from where the cumulative light of both is the same. `layer` receives it in
/// grey levels per metre at key points, in channel `channel` of RGB interleaved; profiles are taken to hold
/// `total` light each, grey levels times rays.
void draw_density_sheet(const ParallelSlices& slices, const ParallelPicture& first,
                        const ParallelPicture& second, int k, int channel, double total, float* layer);

/// The convex weights w, w >= 0 and sum w = 1, that minimise w^T gram w / 2 - w^T right (projected gradient,
/// Nesterov 1983; projection by Duchi et al. 2008). `gram` is symmetric and positive definite.
Eigen::VectorXd convex_weights(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right);

/// Hasinoff and Kutulakos 2007: every slice is a convex combination of its pairs' density sheets, the one
/// that shows all input views best. Two views at least that cross by 10 degrees.
Result<MethodResult> sheet_decomposition(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::evaluate
