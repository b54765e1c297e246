// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace emberlock::smear::detail {

/// A disk with a Gaussian edge on a level, in the glare of its own light. About its centre (x, y), with r and
/// phi a sample's distance and angle from there (0 along the row):
///   v = level + glare / (1 + (r / spread)^2) + amplitude Q((r - rim) / blur),
///   rim = across cos^2 phi + along sin^2 phi,   Q(t) = erfc(t / sqrt 2) / 2.
/// Pixels and samples. Half widths are those at half of the amplitude; `blur` is the edge's sigma, the
/// pixel's own 0.29 in it.
struct EdgeFit {
  double amplitude = 0, level = 0, x = 0, y = 0;
  double across = 1, along = 1;
  double blur = 0.85;
  double glare = 0, spread = 8;
  double across_sigma = 0, blur_sigma = 0;  ///< standard errors, scaled by the misfit; 0 where fixed
  double chi_square = 0;
  double misfit = 0;  ///< root of chi-square over the degrees of freedom
};

/// Samples to be fitted, each with its place and 1 / variance, filled up to whole vectors by weights of 0.
struct EdgeSamples {
  std::vector<float> x, y, value, weight;
  std::vector<float> pixels;  ///< that a sample is the mean of
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
  /// Variance dark^2 + gain * signal + (a part of the signal)^2, the signal that of a fit.
  void weigh(const EdgeFit& f, double dark, double gain, double part);
  /// The same, the signal the samples' own.
  void weigh(double dark, double gain, double part);
};

enum class EdgeFree { amplitude, level, x, y, across, along, radius, blur, glare, spread };

/// What is known of a shape before: along - across, normally distributed. A sigma of 0: nothing.
struct EdgePrior {
  double taller = 0, sigma = 0;
};

/// Least squares by Levenberg-Marquardt over what is free, `radius` being both half widths at once; until a
/// step gains less than `still` of chi-square.
EdgeFit fit_edge(const EdgeSamples& samples, EdgeFit start, const std::vector<EdgeFree>& free,
                 const EdgePrior& prior, double still, int iterations);

/// Variance a sample of signal that the residuals of a fit show beyond the dark noise; 0 or more.
double residual_gain(const EdgeSamples& samples, const EdgeFit& f, double dark);

/// The loops.
struct EdgeSums {
  static constexpr int kParameters = 9;  ///< amplitude, level, x, y, across, along, blur, glare, ln spread^2
  static constexpr int kWithoutBlur = 6, kWithoutGlare = 7;  ///< of them
  static constexpr int kProducts = kParameters * (kParameters + 1) / 2;
  static constexpr int kSums = kProducts + kParameters + 1;
  std::array<std::array<float, 8>, kSums> v{};
};
/// The sums of the first `count` parameters, zeros for those of the others.
EdgeSums edge_sums(const EdgeFit& f, const EdgeSamples& samples, int count);
void edge_values(const EdgeFit& f, const EdgeSamples& samples, float* out);

}  // namespace emberlock::smear::detail
