// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/dot_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <vector>

#include <Eigen/Dense>

#include "smear_sync/detect/kernels.h"

namespace emberlock::smear::detail {
namespace {

constexpr int kParameters = NormalSums::kParameters;  // amplitude, level, slope, x, y, radius
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

/// The window's pixels, padded to whole vectors with weight 0.
struct Pixels {
  int count = 0;
  std::vector<float> x, y, value, weight;

  [[nodiscard]] std::size_t size() const { return value.size(); }
  [[nodiscard]] PixelSpan span() const {
    return {x.data(), y.data(), value.data(), weight.data(), static_cast<int>(size())};
  }
};

Pixels gather(const Patch& patch, const FitWindow& w) {
  Pixels p;
  p.count = (w.right - w.left + 1) * (w.bottom - w.top + 1);
  const std::size_t whole = (static_cast<std::size_t>(p.count) + 7) / 8 * 8;
  for (std::vector<float>* v : {&p.x, &p.y, &p.value, &p.weight}) v->resize(whole);
  const std::ptrdiff_t columns = w.right - w.left + 1;
  for (int y = w.top; y <= w.bottom; ++y) {
    const std::ptrdiff_t row = (y - w.top) * columns;
    std::iota(p.x.begin() + row, p.x.begin() + row + columns, static_cast<float>(w.left));
    std::fill_n(p.y.begin() + row, columns, static_cast<float>(y));
    std::copy_n(patch.row(y) + w.left, columns, p.value.begin() + row);
  }
  std::fill_n(p.weight.begin(), p.count, 1.0F);
  return p;
}

DiskModel model_of(const DotFit& f) {
  return {.amplitude = static_cast<float>(f.amplitude),
          .level = static_cast<float>(f.level),
          .slope = static_cast<float>(f.slope),
          .x = static_cast<float>(f.x),
          .y = static_cast<float>(f.y),
          .radius = static_cast<float>(f.radius),
          .edge = static_cast<float>(1 / DotFit::kEdge)};
}

struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double squares = 0;
};

Normal linearise(const Pixels& p, const DotFit& f) {
  const NormalSums sums = normal_sums(model_of(f), p.span());
  std::size_t k = 0;
  const auto next = [&] {
    double sum = 0;
    for (const float v : sums.v[k]) sum += static_cast<double>(v);
    ++k;
    return sum;
  };
  Normal n;
  for (int a = 0; a < kParameters; ++a) {
    for (int b = 0; b <= a; ++b) n.matrix(a, b) = n.matrix(b, a) = next();
  }
  for (int a = 0; a < kParameters; ++a) n.right[a] = next();
  n.squares = next();
  return n;
}

/// With the prior of the slope: `stiffness` is (dark noise / slope_sigma)^2.
Normal linearise(const Pixels& p, const DotFit& f, double stiffness) {
  Normal n = linearise(p, f);
  n.matrix(2, 2) += stiffness;
  n.right[2] -= stiffness * f.slope;
  n.squares += stiffness * f.slope * f.slope;
  return n;
}

DotFit stepped(const DotFit& f, const Vector6& step) {
  DotFit next = f;
  next.amplitude += step[0];
  next.level += step[1];
  next.slope += step[2];
  next.x += std::clamp(step[3], -1.0, 1.0);
  next.y += std::clamp(step[4], -1.0, 1.0);
  next.radius = std::max(0.3, f.radius + std::clamp(step[5], -1.0, 1.0));
  return next;
}

/// Levenberg-Marquardt until the next step would gain less than `still` in chi-square. Returns the normal
/// equations near the end.
Normal minimise(const Pixels& p, DotFit& f, const FitNoise& noise, double still) {
  constexpr int kIterations = 12;
  const double variance = noise.dark * noise.dark;
  const double stiffness = std::pow(noise.dark / noise.slope_sigma, 2);
  double damping = 1e-4;
  Normal normal = linearise(p, f, stiffness);
  for (int i = 0; i < kIterations && damping < 1e6; ++i) {
    Matrix6 damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;
    const Vector6 step = damped.ldlt().solve(normal.right);
    if (!step.allFinite()) return normal;
    const double gain = step.dot(normal.right) / variance;
    const DotFit next = stepped(f, step);
    if (gain < still) {  // so small a step needn't be checked
      f = next;
      break;
    }
    const Normal trial = linearise(p, next, stiffness);
    if (trial.squares <= normal.squares + 0.1 * still * variance) {
      f = next;
      normal = trial;
      damping = std::max(1e-6, damping / 10);
    } else {
      damping *= 10;
    }
  }
  return normal;
}

/// The fitted disk of amplitude 1 at all pixels.
std::vector<float> disk_of(const Pixels& p, const DotFit& f) {
  std::vector<float> disk(p.size());
  disk_at(model_of(f), p.span(), disk.data());
  return disk;
}

/// A pixel minus the model's level and slope.
float above_level(const Pixels& p, const DiskModel& m, std::size_t i) {
  return p.value[i] - m.level - m.slope * (p.y[i] - m.y);
}

/// Variance per sample of signal: the regression of squared residuals on the disk, if it exceeds its own
/// error.
double photon_gain(const Pixels& p, const DotFit& f, const std::vector<float>& disk, double dark) {
  const DiskModel model = model_of(f);
  const auto variance = static_cast<float>(dark * dark);
  float excess = 0;
  float power = 0;
  for (std::size_t i = 0; i < p.size(); ++i) {
    const float signal = model.amplitude * disk[i] * p.weight[i];
    const float residual = above_level(p, model, i) - signal;
    excess += (residual * residual - variance) * signal;
    power += signal * signal;
  }
  if (power <= 0) return 0;
  const double gain = static_cast<double>(excess / power);
  const double error = std::sqrt(2 / static_cast<double>(power)) * dark * dark;
  return gain < 2 * error ? 0 : gain * gain * gain / (gain * gain + error * error);
}

}  // namespace

DotFit fit_dot(const Patch& patch, const FitWindow& window, DotFit f, const FitNoise& noise) {
  constexpr int kFewest = 12;  // pixels
  if (window.right < window.left || window.bottom < window.top) return f;
  Pixels pixels = gather(patch, window);
  if (pixels.count < kFewest) return f;
  // Half a sigma is accurate enough to estimate photon noise; in the end all parameters are within a
  // thirtieth of theirs.
  constexpr double kNear = 0.25;
  constexpr double kStill = 1e-3;  // chi-square in floats is accurate to 1e-4
  minimise(pixels, f, noise, kNear);
  if (f.amplitude > 0) {
    const std::vector<float> disk = disk_of(pixels, f);
    f.gain = photon_gain(pixels, f, disk, noise.dark);
    constexpr double kMatters = 0.1;  // of the dark variance
    const double raise = f.gain * f.amplitude / (noise.dark * noise.dark);
    if (raise > kMatters) {
      for (std::size_t i = 0; i < disk.size(); ++i)
        pixels.weight[i] /= 1 + static_cast<float>(raise) * disk[i];
    }
  }
  const Normal normal = minimise(pixels, f, noise, kStill);
  const double variance = normal.squares / std::max(1, pixels.count - kParameters);
  f.misfit = std::sqrt(variance) / noise.dark;
  const Matrix6 covariance =
      (normal.matrix + 1e-9 * Matrix6::Identity()).inverse() * std::max(noise.dark * noise.dark, variance);
  f.sigma_x = std::sqrt(std::max(0.0, covariance(3, 3)));
  f.sigma_y = std::sqrt(std::max(0.0, covariance(4, 4)));
  f.snr = f.amplitude * std::sqrt(normal.matrix(0, 0)) / noise.dark;
  return f;
}

Evenness evenness(const Patch& patch, const FitWindow& window, const DotFit& f, double noise) {
  // Least-squares amplitude of the disk over parts of it: left, right, top, bottom, even rows, odd rows.
  std::array<double, 6> signal{};
  std::array<double, 6> power{};
  double total = 0;
  std::array<double, 2> brightest{};
  const Pixels pixels = gather(patch, window);
  const std::vector<float> disk = disk_of(pixels, f);
  const DiskModel model = model_of(f);
  for (std::size_t i = 0; i < static_cast<std::size_t>(pixels.count); ++i) {
    const auto g = static_cast<double>(disk[i]);
    const double s = static_cast<double>(above_level(pixels, model, i)) * g;
    const bool even_row = static_cast<int>(pixels.y[i]) % 2 == 0;
    for (const std::size_t part :
         {pixels.x[i] < model.x ? std::size_t{0} : 1, pixels.y[i] < model.y ? std::size_t{2} : 3,
          even_row ? std::size_t{4} : 5}) {
      signal[part] += s;
      power[part] += g * g;
    }
    total += s;
    if (s > brightest[0]) {
      brightest = {s, brightest[0]};
    } else if (s > brightest[1]) {
      brightest[1] = s;
    }
  }
  Evenness e;
  const auto amplitude = [&](std::size_t part) {
    return power[part] > 0.3 ? signal[part] / power[part] : f.amplitude;
  };
  double least_power = power[0];
  for (std::size_t part = 0; part < 4; ++part) {
    e.least_half = std::min(e.least_half, amplitude(part) / f.amplitude);
    if (power[part] > 0.3) least_power = std::min(least_power, power[part]);
  }
  const double even = amplitude(4);
  const double odd = amplitude(5);
  e.least_field = std::min(even, odd) / std::max({even, odd, 1e-9});
  e.brightest_two = (brightest[0] + brightest[1]) / std::max(total, 1e-9);
  e.half_sigma = noise / (std::sqrt(std::max(least_power, 0.3)) * std::max(f.amplitude, 1e-9));
  return e;
}

}  // namespace emberlock::smear::detail
