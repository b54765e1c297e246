// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/result.h"
#include "paper/baselines/appearance_transfer/steerable_pyramid.h"
#include "paper/baselines/method.h"
#include "paper/baselines/parallel_slices.h"

namespace emberlock::paper {

inline constexpr MethodFacts kAppearanceTransferFacts{
    "appearance transfer", "Okabe et al. 2015", true, Projection::parallel, "linear", true};

/// What a picture of one channel looks like, wherever its parts are: the sorted values of the picture and of
/// each band of its pyramid.
struct Appearance {
  std::vector<float> intensities;
  std::vector<std::vector<float>> bands;
};
Appearance appearance_of(const SteerablePyramid& pyramid, const std::vector<float>& picture);
/// Between two of them: `part` (0..1) of the second's values and the rest of the first's, rank by rank.
Appearance between(const Appearance& first, const Appearance& second, double part);

/// Makes a picture look like something: its bands get its bands' histograms, and the picture that they make
/// its intensities' (Heeger and Bergen 1995).
void transfer(const SteerablePyramid& pyramid, const Appearance& appearance, std::vector<float>& picture);

/// Okabe et al.: a volume from the input views, of which novel views between them are rendered, made to look
/// like the input views beside them, and reconstructed again together with those; and so on. Errors beside
/// method.h's: no two input views that cross by 10 degrees or more.
Result<MethodResult> appearance_transfer(const recon::Scene& scene, const MethodOptions& options);

}  // namespace emberlock::paper
