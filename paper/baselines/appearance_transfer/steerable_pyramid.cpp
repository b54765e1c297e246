// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/appearance_transfer/steerable_pyramid.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>

#include <unsupported/Eigen/FFT>

namespace emberlock::paper {
namespace {

using Complex = std::complex<float>;

/// The amplitude of a low pass whose edge falls from half of Nyquist's frequency to all of it, in its units.
double low_pass(double frequency) {
  if (frequency <= 0.5) return 1;
  if (frequency >= 1) return 0;
  return std::cos(std::numbers::pi / 2 * std::log2(2 * frequency));
}

/// Of entry n of a transform of a length, in units of Nyquist's frequency: -1 to 1.
double frequency_of(int n, int length) { return 2.0 * (n <= length / 2 ? n : n - length) / length; }

/// The next number without prime factors above 5.
int fast_size(int size) {
  for (;; ++size) {
    int rest = size;
    for (const int prime : {2, 3, 5})
      while (rest % prime == 0) rest /= prime;
    if (rest == 1) return size;
  }
}

enum class Transform { forward, inverse };

void transform(std::vector<Complex>& values, int across, int down, Transform direction) {
  Eigen::FFT<float> fft;
  const auto run = [&](std::vector<Complex>& to, const std::vector<Complex>& from) {
    if (direction == Transform::forward)
      fft.fwd(to, from);
    else
      fft.inv(to, from);
  };
  const auto width = static_cast<std::size_t>(across);
  const auto height = static_cast<std::size_t>(down);
  std::vector<Complex> from(width);
  std::vector<Complex> to;
  for (std::size_t y = 0; y < height; ++y) {
    std::copy_n(values.begin() + static_cast<std::ptrdiff_t>(y * width), width, from.begin());
    run(to, from);
    std::copy_n(to.begin(), width, values.begin() + static_cast<std::ptrdiff_t>(y * width));
  }
  from.resize(height);
  for (std::size_t x = 0; x < width; ++x) {
    for (std::size_t y = 0; y < height; ++y) from[y] = values[y * width + x];
    run(to, from);
    for (std::size_t y = 0; y < height; ++y) values[y * width + x] = to[y];
  }
}

}  // namespace

SteerablePyramid::SteerablePyramid(int width, int height)
    : width_(width), height_(height), across_(fast_size(width)), down_(fast_size(height)) {
  // The coarsest octave has some four waves across the picture.
  const int octaves = std::max(1, static_cast<int>(std::log2(std::min(width, height) / 8.0)));
  filters_.resize(band(octaves, 0) + 1);
  for (Filter& filter : filters_)
    filter.gain.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  // The sum of cos^6 over four orientations is 5/4 in every direction.
  const double share = std::sqrt(0.8);
  std::size_t at = 0;
  for (int y = 0; y < down_; ++y)
    for (int x = 0; x < across_; ++x, ++at) {
      const double fx = frequency_of(x, across_);
      const double fy = frequency_of(y, down_);
      const double radius = std::hypot(fx, fy);
      const double angle = std::atan2(fy, fx);
      double low = low_pass(radius);
      filters_.front().gain[at] = static_cast<float>(std::sqrt(1 - low * low));
      for (int octave = 0; octave < octaves; ++octave) {
        const double lower = low_pass(std::ldexp(radius, octave + 1));
        const double ring = std::sqrt(low * low - lower * lower);
        for (int o = 0; o < kOrientations; ++o)
          filters_[band(octave, o)].gain[at] =
              static_cast<float>(ring * share * std::pow(std::cos(angle - o * std::numbers::pi / 4), 3));
        low = lower;
      }
      filters_.back().gain[at] = static_cast<float>(low);
    }
  for (std::size_t b = 1; b + 1 < filters_.size(); ++b) filters_[b].odd = true;
}

std::size_t SteerablePyramid::band(int octave, int orientation) {
  return std::size_t{1} + static_cast<std::size_t>(octave) * kOrientations +
         static_cast<std::size_t>(orientation);
}

std::vector<std::vector<float>> SteerablePyramid::analyse(const std::vector<float>& picture) const {
  std::vector<Complex> spectrum(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  for (int y = 0; y < height_; ++y)
    std::copy_n(picture.begin() + std::ptrdiff_t{y} * width_, width_,
                spectrum.begin() + std::ptrdiff_t{y} * across_);
  transform(spectrum, across_, down_, Transform::forward);
  std::vector<std::vector<float>> bands;
  std::vector<Complex> seen(spectrum.size());
  for (const Filter& filter : filters_) {
    const Complex turn = filter.odd ? Complex(0, 1) : Complex(1, 0);
    for (std::size_t i = 0; i < seen.size(); ++i) seen[i] = turn * filter.gain[i] * spectrum[i];
    transform(seen, across_, down_, Transform::inverse);
    std::vector<float>& band = bands.emplace_back(seen.size());
    for (std::size_t i = 0; i < seen.size(); ++i) band[i] = seen[i].real();
  }
  return bands;
}

std::vector<float> SteerablePyramid::synthesise(const std::vector<std::vector<float>>& bands) const {
  std::vector<Complex> sum(static_cast<std::size_t>(across_) * static_cast<std::size_t>(down_));
  for (std::size_t b = 0; b < bands.size(); ++b) {
    const Complex turn = filters_[b].odd ? Complex(0, -1) : Complex(1, 0);
    std::vector<Complex> spectrum(bands[b].begin(), bands[b].end());
    transform(spectrum, across_, down_, Transform::forward);
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += turn * filters_[b].gain[i] * spectrum[i];
  }
  transform(sum, across_, down_, Transform::inverse);
  std::vector<float> picture(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_));
  for (int y = 0; y < height_; ++y)
    std::transform(
        sum.begin() + std::ptrdiff_t{y} * across_, sum.begin() + std::ptrdiff_t{y} * across_ + width_,
        picture.begin() + std::ptrdiff_t{y} * width_, [](const Complex& value) { return value.real(); });
  return picture;
}

void match_histogram(std::vector<float>& values, const std::vector<float>& rising) {
  std::vector<std::size_t> order(values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return values[a] < values[b]; });
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < order.size(); begin = end) {
    const float value = values[order[begin]];
    double sum = 0;
    for (end = begin; end < order.size() && values[order[end]] == value; ++end)
      sum += static_cast<double>(rising[end]);
    // The loop above reads values at `end` only, which are not yet changed.
    for (std::size_t n = begin; n < end; ++n)
      values[order[n]] = static_cast<float>(sum / static_cast<double>(end - begin));
  }
}

}  // namespace emberlock::paper
