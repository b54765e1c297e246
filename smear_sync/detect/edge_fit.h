// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace emberlock::smear::detail {

/// A disk with a Gaussian edge on a constant level, surrounded by its own glare. With centre (x, y), and r
/// and phi a sample's distance and angle from it (0 along the row):
///   v = level + glare / (1 + (r / spread)^2) + amplitude Q((r - rim) / blur),
///   rim = across cos^2 phi + along sin^2 phi,   Q(t) = erfc(t / sqrt 2) / 2.
/// Unit: pixels. Half-widths are at half of the amplitude. `blur` is the sigma of the edge, including the
/// pixel's own 0.29.
struct EdgeFit {
  double amplitude = 0, level = 0, x = 0, y = 0;
  double across = 1, along = 1;
  double blur = 0.85;
  double glare = 0, spread = 8;
  double across_sigma = 0, blur_sigma = 0;  ///< standard errors, scaled by the misfit; 0 for fixed parameters
  double chi_square = 0;
  double misfit = 0;  ///< root of chi-square per degree of freedom
};

/// The samples of a fit with their positions and 1 / variance, padded to whole vectors with weights of 0.
struct EdgeSamples {
  std::vector<float> x, y, value, weight;
  std::vector<float> pixels;  ///< number of pixels that a sample averages
  int count = 0;
  void reserve(int most);
  void add(int px, int py, float v, double mean_of = 1) {
    x.push_back(static_cast<float>(px));
    y.push_back(static_cast<float>(py));
    value.push_back(v);
    pixels.push_back(static_cast<float>(mean_of));
    ++count;
  }
  void fill_up();
  /// Sets the variance to dark^2 + gain * signal + (part * signal)^2, with the signal of a fit.
  void weigh(const EdgeFit& f, double dark, double gain, double part);
  /// The same, with the samples as the signal.
  void weigh(double dark, double gain, double part);
};

enum class EdgeFree { amplitude, level, x, y, across, along, radius, blur, glare, spread };

/// Prior of the shape: along - across, normally distributed. Sigma 0: no prior.
struct EdgePrior {
  double taller = 0, sigma = 0;
};

/// Least squares by Levenberg-Marquardt over the free parameters; `radius` is both half-widths together. Ends
/// when a step improves chi-square by less than `still`.
EdgeFit fit_edge(const EdgeSamples& samples, EdgeFit start, const std::vector<EdgeFree>& free,
                 const EdgePrior& prior, double still, int iterations);

/// Variance per sample of signal that the residuals of a fit show in addition to the dark noise; 0 or more.
double residual_gain(const EdgeSamples& samples, const EdgeFit& f, double dark);

/// Result of the inner loops.
struct EdgeSums {
  static constexpr int kParameters = 9;  ///< amplitude, level, x, y, across, along, blur, glare, ln spread^2
  static constexpr int kWithoutBlur = 6, kWithoutGlare = 7;  ///< number of parameters without these
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;
  static constexpr int kSums = kProducts + kParameters + 1;
  std::array<std::array<float, 8>, kSums> v{};
};
/// The sums for the first `count` parameters; zeros for the others.
EdgeSums edge_sums(const EdgeFit& f, const EdgeSamples& samples, int count);
void edge_values(const EdgeFit& f, const EdgeSamples& samples, float* out);

}  // namespace emberlock::smear::detail
