// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "base/progress.h"
#include "base/result.h"
#include "recon/adjust/solver.h"

namespace emberlock::recon {

/// What the pictures' noise alone does to a volume, at its key points: one standard error each.
struct NoiseErrors {
  std::vector<float> emission;    ///< of R, G and B, 3 * size, levels/m
  std::vector<float> extinction;  ///< 1/m; empty where none was reconstructed
  double noise = 0;               ///< of a pixel, grey levels, RMS over the input views
  int probes = 0;
  int steps = 0;  ///< of conjugate gradients, all probes together
  Seconds time{0};
};

/// Of a pixel's channels, grey levels, by Immerkaer's operator (1996), which even and evenly rising light
/// leaves dark: its median size over the lit part of the picture. Noise that neighbours share, as where
/// colours were interpolated, is told too small.
double pixel_noise(const RadianceImage& image, const FlameMask& lit);

/// The diagonal of s^2 H^-1, H the Gauss-Newton Hessian of the solver's objective at the volume
/// (gauss_newton.h) and s the noise of a pixel: probes draw noise in pixels and ties, and H^-1 of what it
/// pulls has that covariance (Papandreou and Yuille 2010). Their squares are pooled over each point's 26
/// neighbours. It holds what noise does and what the ties leave open: one to three times what repeated noise
/// does to the emission, from a third of it on where the extinction was found too, whose solve ends before it
/// has settled and which starts from the light that the noisy pictures show. What is 0 or at its bound stays.
/// On the CPU; the same bits for every number of threads. Errors: of kind not_converged where it isn't
/// finite; refused if `options.stop` asks to end.
Result<NoiseErrors> errors_by_noise(const Scene& scene, const Reconstruction& done,
                                    const SolveOptions& options, const Elapsed& elapsed = {},
                                    const Progress& progress = {});

}  // namespace emberlock::recon
