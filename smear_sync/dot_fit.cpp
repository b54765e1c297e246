#include "smear_sync/dot_fit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <Eigen/Dense>

#include "smear_sync/kernels.h"

namespace emberlock::detail {
namespace {

constexpr int kParameters = NormalSums::kParameters;  // amplitude, level, slope, x, y, radius
using Vector6 = Eigen::Matrix<double, kParameters, 1>;
using Matrix6 = Eigen::Matrix<double, kParameters, kParameters>;

/// The window's pixels and their weights, rows padded to whole vectors by pixels of weight 0.
struct Pixels {
  int left = 0, top = 0, rows = 0, stride = 0, count = 0;
  std::vector<float> v, weight;
};

Pixels gather(const Patch& patch, const FitWindow& w) {
  Pixels p;
  const int columns = w.right - w.left + 1;
  p.left = w.left;
  p.top = w.top;
  p.rows = w.bottom - w.top + 1;
  p.count = p.rows * columns;
  p.stride = (columns + 7) / 8 * 8;
  const std::size_t size = static_cast<std::size_t>(p.rows) * static_cast<std::size_t>(p.stride);
  p.v.resize(size);
  p.weight.resize(size);
  for (int y = 0; y < p.rows; ++y) {
    const std::ptrdiff_t at = std::ptrdiff_t{y} * p.stride;
    std::copy_n(patch.row(w.top + y) + w.left, columns, p.v.begin() + at);
    std::fill_n(p.weight.begin() + at, columns, 1.0F);
  }
  return p;
}

DiskModel row_model(const DotFit& f, int left, int y) {
  return {.amplitude = static_cast<float>(f.amplitude),
          .base = static_cast<float>(f.level),
          .slope = static_cast<float>(f.slope),
          .radius = static_cast<float>(f.radius),
          .edge = static_cast<float>(1 / DotFit::kEdge),
          .dx = static_cast<float>(left - f.x),
          .dy = static_cast<float>(y - f.y)};
}

struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double squares = 0;
};

Normal linearise(const Pixels& p, const DotFit& f) {
  NormalSums sums;
  for (int y = 0; y < p.rows; ++y) {
    const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(p.stride);
    add_normal_row(row_model(f, p.left, p.top + y), &p.v[at], &p.weight[at], p.stride, sums);
  }
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

/// With what is known of the slope: `stiffness` is (dark noise / slope_sigma)^2.
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

/// Levenberg-Marquardt; the normal equations near the end.
Normal minimise(const Pixels& p, DotFit& f, const FitNoise& noise) {
  constexpr int kIterations = 12;
  // Of chi-square left to gain, which floats know to 1e-4: all parameters are within a thirtieth of their
  // sigma.
  constexpr double kStill = 1e-3;
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
    if (gain < kStill) {  // so small a step needs no proof
      f = next;
      break;
    }
    const Normal trial = linearise(p, next, stiffness);
    if (trial.squares <= normal.squares + 0.1 * kStill * variance) {
      f = next;
      normal = trial;
      damping = std::max(1e-6, damping / 10);
    } else {
      damping *= 10;
    }
  }
  return normal;
}

/// The fitted disk of amplitude 1 over all pixels.
std::vector<float> disk_of(const Pixels& p, const DotFit& f) {
  std::vector<float> disk(p.v.size());
  for (int y = 0; y < p.rows; ++y) {
    disk_row(row_model(f, p.left, p.top + y), p.stride,
             &disk[static_cast<std::size_t>(y) * static_cast<std::size_t>(p.stride)]);
  }
  return disk;
}

/// Variance a sample of signal: the slope of squared residuals on the disk, where it stands out of its own
/// error.
double photon_gain(const Pixels& p, const DotFit& f, const std::vector<float>& disk, double dark) {
  const auto amplitude = static_cast<float>(f.amplitude);
  const auto variance = static_cast<float>(dark * dark);
  float excess = 0;
  float power = 0;
  for (int y = 0; y < p.rows; ++y) {
    const auto base = static_cast<float>(f.level + f.slope * (p.top + y - f.y));
    for (int x = 0; x < p.stride; ++x) {
      const std::size_t at =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(p.stride) + static_cast<std::size_t>(x);
      const float signal = amplitude * disk[at] * p.weight[at];
      const float residual = p.v[at] - base - signal;
      excess += (residual * residual - variance) * signal;
      power += signal * signal;
    }
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
  Normal normal = minimise(pixels, f, noise);
  if (f.amplitude > 0) {
    const std::vector<float> disk = disk_of(pixels, f);
    f.gain = photon_gain(pixels, f, disk, noise.dark);
    constexpr double kMatters = 0.1;  // of the dark variance
    const double raise = f.gain * f.amplitude / (noise.dark * noise.dark);
    if (raise > kMatters) {
      for (std::size_t i = 0; i < disk.size(); ++i)
        pixels.weight[i] /= 1 + static_cast<float>(raise) * disk[i];
      normal = minimise(pixels, f, noise);
    }
  }
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
  std::vector<float> disk(static_cast<std::size_t>(window.right - window.left + 8));
  for (int y = window.top; y <= window.bottom; ++y) {
    const float* row = patch.row(y);
    const auto base = static_cast<float>(f.level + f.slope * (y - f.y));
    disk_row(row_model(f, window.left, y), window.right - window.left + 1, disk.data());
    double row_signal = 0;
    double row_power = 0;
    for (int x = window.left; x <= window.right; ++x) {
      const auto g = static_cast<double>(disk[static_cast<std::size_t>(x - window.left)]);
      const double s = static_cast<double>(row[x] - base) * g;
      const std::size_t side = x < f.x ? 0 : 1;
      signal[side] += s;
      power[side] += g * g;
      row_signal += s;
      row_power += g * g;
      if (s > brightest[0]) {
        brightest = {s, brightest[0]};
      } else if (s > brightest[1]) {
        brightest[1] = s;
      }
    }
    for (const std::size_t part : {y < f.y ? std::size_t{2} : 3, y % 2 == 0 ? std::size_t{4} : 5}) {
      signal[part] += row_signal;
      power[part] += row_power;
    }
    total += row_signal;
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

}  // namespace emberlock::detail
