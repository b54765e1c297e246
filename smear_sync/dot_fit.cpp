#include "smear_sync/dot_fit.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Dense>

namespace emberlock::detail {
namespace {

using Vector6 = Eigen::Matrix<double, 6, 1>;
using Matrix6 = Eigen::Matrix<double, 6, 6>;

struct Normal {
  Matrix6 matrix = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double squares = 0;
  int pixels = 0;
};

// Parameters in this order: amplitude, level, slope, x, y, radius.
Normal linearise(const Patch& patch, const FitWindow& window, const DotFit& f) {
  Normal n;
  for (int y = window.top; y <= window.bottom; ++y) {
    const float* row = patch.row(y);
    for (int x = window.left; x <= window.right; ++x) {
      const double dx = x - f.x;
      const double dy = y - f.y;
      const double r = std::sqrt(dx * dx + dy * dy + 1e-6);
      const double g = 1 / (1 + std::exp((r - f.radius) / DotFit::kEdge));
      const double edge = f.amplitude * g * (1 - g) / DotFit::kEdge;
      const Vector6 j(g, 1, dy, edge * dx / r, edge * dy / r - f.slope, edge);
      const double residual = static_cast<double>(row[x]) - (f.level + f.slope * dy + f.amplitude * g);
      n.matrix.selfadjointView<Eigen::Lower>().rankUpdate(j);
      n.right += j * residual;
      n.squares += residual * residual;
      ++n.pixels;
    }
  }
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

}  // namespace

double DotFit::disk(double px, double py) const {
  return 1 / (1 + std::exp((std::hypot(px - x, py - y) - radius) / kEdge));
}

DotFit fit_dot(const Patch& patch, const FitWindow& window, DotFit f, double noise) {
  constexpr int kIterations = 25;
  double damping = 1e-3;
  Normal normal = linearise(patch, window, f);
  if (normal.pixels < 12) return f;
  for (int i = 0; i < kIterations; ++i) {
    Matrix6 damped = normal.matrix.selfadjointView<Eigen::Lower>();
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;
    const Vector6 step = damped.ldlt().solve(normal.right);
    if (!step.allFinite()) return f;
    const DotFit next = stepped(f, step);
    Normal trial = linearise(patch, window, next);
    if (trial.squares <= normal.squares) {
      const bool still =
          normal.squares - trial.squares < 1e-6 * (normal.squares + 1e-9) && std::abs(step[4]) < 1e-3;
      f = next;
      normal = std::move(trial);
      damping = std::max(1e-6, damping / 5);
      if (still) {
        f.converged = true;
        break;
      }
    } else {
      damping *= 8;
      if (damping > 1e6) {
        f.converged = true;  // at a minimum to machine precision
        break;
      }
    }
  }
  const Matrix6 full = normal.matrix.selfadjointView<Eigen::Lower>();
  const double variance = normal.squares / std::max(1, normal.pixels - 6);
  f.misfit = std::sqrt(variance) / noise;
  const Matrix6 covariance =
      (full + 1e-9 * Matrix6::Identity()).inverse() * std::max(noise * noise, variance);
  f.sigma_x = std::sqrt(std::max(0.0, covariance(3, 3)));
  f.sigma_y = std::sqrt(std::max(0.0, covariance(4, 4)));
  f.snr = f.amplitude * std::sqrt(full(0, 0)) / noise;
  return f;
}

Evenness evenness(const Patch& patch, const FitWindow& window, const DotFit& f, double noise) {
  // Least-squares amplitude of the disk over parts of it: left, right, top, bottom, even rows, odd rows.
  std::array<double, 6> signal{};
  std::array<double, 6> power{};
  double total = 0;
  std::array<double, 2> brightest{};
  for (int y = window.top; y <= window.bottom; ++y) {
    const float* row = patch.row(y);
    for (int x = window.left; x <= window.right; ++x) {
      const double g = f.disk(x, y);
      const double d = static_cast<double>(row[x]) - f.level - f.slope * (y - f.y);
      const double s = d * g;
      const std::array<std::size_t, 3> parts{x < f.x ? 0U : 1U, y < f.y ? 2U : 3U, y % 2 == 0 ? 4U : 5U};
      for (const std::size_t part : parts) {
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
