// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "smear_sync/detect/plane.h"

namespace emberlock::smear::detail {

/// A disk with a soft edge on a level and a slope along y:
///   v(x, y) = level + slope (y - y0) + amplitude / (1 + exp((r - radius) / kEdge)),  r = |(x, y) - (x0,
///   y0)|.
struct DotFit {
  static constexpr double kEdge = 0.5;  ///< pixels; the blur of a focused lens and of the pixel itself

  double x = 0, y = 0;  ///< in the patch
  double radius = 0;
  double amplitude = 0;
  double level = 0;
  double slope = 0;
  double sigma_x = 0,
         sigma_y = 0;  ///< standard errors from the curvature of the likelihood, scaled by the misfit
  double snr = 0;      ///< matched-filter signal over noise
  double misfit = 0;   ///< RMS residual over the noise
  double gain = 0;     ///< of the photon noise: variance per sample of signal
};

/// Rows and columns of the patch that a fit uses, ends included.
using FitWindow = Extent;

/// The noise parameters known before the fit.
struct FitNoise {
  double dark = 1;         ///< standard deviation of a pixel without signal
  double slope_sigma = 1;  ///< of the slope that remains after levelling the columns, samples per row
};

/// Maximum likelihood for Gaussian noise of variance dark^2 + gain * signal (Levenberg-Marquardt from
/// `start`). The gain is estimated from the residuals and used to weight the pixels.
DotFit fit_dot(const Patch& patch, const FitWindow& window, DotFit start, const FitNoise& noise);

/// How evenly a dot's light is distributed. Distinguishes a copy of the lamp from hot pixels and from a
/// single field.
struct Evenness {
  double least_half = 1;  ///< amplitude of the weakest half (left, right, top, bottom), relative to the whole
  double least_field = 1;    ///< amplitude of the weaker of even and odd rows, relative to the stronger
  double brightest_two = 0;  ///< share of the matched signal in its two brightest pixels
  double half_sigma = 0;     ///< standard error of least_half and least_field
};
Evenness evenness(const Patch& patch, const FitWindow& window, const DotFit& fit, double noise);

}  // namespace emberlock::smear::detail
