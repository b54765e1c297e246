// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/edge_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

namespace emberlock::smear::detail {
namespace {

constexpr int kAll = EdgeSums::kParameters;
using EdgeMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, kAll, kAll>;
using EdgeVector = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kAll, 1>;

struct EdgeNormal {
  EdgeMatrix matrix;
  EdgeVector right;
  double squares = 0;
};

/// The model parameters changed by a free parameter, both by the same amount. The amplitude is stepped on a
/// logarithmic scale.
struct EdgeDirection {
  int first, second;  ///< equal if there is only one
  double factor = 1;
};
using EdgeDirections = std::vector<EdgeDirection>;

EdgeDirections directions(const EdgeFit& f, const std::vector<EdgeFree>& free) {
  EdgeDirections d;
  d.reserve(free.size());
  for (const EdgeFree what : free) {
    switch (what) {
      case EdgeFree::amplitude:
        d.push_back({0, 0, f.amplitude});
        break;
      case EdgeFree::level:
        d.push_back({1, 1});
        break;
      case EdgeFree::x:
        d.push_back({2, 2});
        break;
      case EdgeFree::y:
        d.push_back({3, 3});
        break;
      case EdgeFree::across:
        d.push_back({4, 4});
        break;
      case EdgeFree::along:
        d.push_back({5, 5});
        break;
      case EdgeFree::radius:
        d.push_back({4, 5});
        break;
      case EdgeFree::blur:
        d.push_back({6, 6});
        break;
      case EdgeFree::glare:
        d.push_back({7, 7});
        break;
      case EdgeFree::spread:
        d.push_back({8, 8});
        break;
    }
  }
  return d;
}

EdgeNormal edge_normal(const EdgeSamples& samples, const EdgeFit& f, const EdgeDirections& t,
                       const EdgePrior& prior) {
  int count = f.glare != 0 ? EdgeSums::kParameters : 0;
  for (const EdgeDirection& d : t) count = std::max(count, d.second + 1);
  const EdgeSums sums = edge_sums(f, samples, count);
  std::size_t k = 0;
  const auto next = [&] {
    double sum = 0;
    for (const float v : sums.v[k]) sum += static_cast<double>(v);
    ++k;
    return sum;
  };
  EdgeMatrix all(kAll, kAll);
  EdgeVector right(kAll);
  for (int a = 0; a < kAll; ++a) {
    for (int b = 0; b <= a; ++b) all(a, b) = all(b, a) = next();
  }
  for (int a = 0; a < kAll; ++a) right[a] = next();
  EdgeNormal n;
  n.squares = next();
  if (prior.sigma > 0) {
    const double weight = 1 / (prior.sigma * prior.sigma);
    const double off = prior.taller - (f.along - f.across);
    all(4, 4) += weight;
    all(5, 5) += weight;
    all(4, 5) -= weight;
    all(5, 4) -= weight;
    right[4] -= weight * off;
    right[5] += weight * off;
    n.squares += weight * off * off;
  }
  const auto size = static_cast<Eigen::Index>(t.size());
  n.matrix.resize(size, size);
  n.right.resize(size);
  for (Eigen::Index i = 0; i < size; ++i) {
    const EdgeDirection& a = t[static_cast<std::size_t>(i)];
    const double both = a.first == a.second ? 0 : 1;
    n.right[i] = a.factor * (right[a.first] + both * right[a.second]);
    for (Eigen::Index j = 0; j <= i; ++j) {
      const EdgeDirection& b = t[static_cast<std::size_t>(j)];
      const double other = b.first == b.second ? 0 : 1;
      n.matrix(i, j) = n.matrix(j, i) = a.factor * b.factor *
                                        (all(a.first, b.first) + both * all(a.second, b.first) +
                                         other * (all(a.first, b.second) + both * all(a.second, b.second)));
    }
  }
  return n;
}

EdgeFit edge_stepped(const EdgeFit& f, const EdgeDirections& t, const EdgeVector& by) {
  std::array<double, kAll> step{};
  for (std::size_t i = 0; i < t.size(); ++i) {
    const double s = t[i].factor * by[static_cast<Eigen::Index>(i)];
    step[static_cast<std::size_t>(t[i].first)] = s;
    step[static_cast<std::size_t>(t[i].second)] = s;
  }
  const auto limited = [](double v, double limit) { return std::clamp(v, -limit, limit); };
  EdgeFit next = f;
  next.amplitude *= std::exp(limited(f.amplitude != 0 ? step[0] / f.amplitude : 0, 1.5));
  next.level += step[1];
  next.x += limited(step[2], 1);
  next.y += limited(step[3], 1);
  next.across = std::max(0.3, f.across + limited(step[4], 1));
  next.along = std::max(0.3, f.along + limited(step[5], 1));
  next.blur = std::clamp(f.blur + limited(step[6], 0.5), 0.3, 8.0);
  next.glare += step[7];
  next.spread = std::clamp(f.spread * std::exp(limited(step[8], 1) / 2), 1.0, 50.0);
  return next;
}

}  // namespace

void EdgeSamples::reserve(int most) {
  for (std::vector<float>* v : {&x, &y, &value, &pixels, &weight})
    v->reserve(static_cast<std::size_t>(most) + 8);
}

void EdgeSamples::fill_up() {
  const std::size_t whole = (static_cast<std::size_t>(count) + 7) / 8 * 8;
  for (std::vector<float>* v : {&x, &y, &value}) v->resize(whole);
  weight.assign(whole, 0);
}

void EdgeSamples::weigh(const EdgeFit& f, double dark, double gain, double part) {
  if (gain == 0 && part == 0) {
    const auto alike = static_cast<float>(1 / (dark * dark));
    for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) weight[i] = pixels[i] * alike;
    return;
  }
  std::vector<float> signal(value.size());
  edge_values(f, *this, signal.data());
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const double s = std::max(0.0, static_cast<double>(signal[i]));
    weight[i] = pixels[i] * static_cast<float>(1 / (dark * dark + gain * s + part * part * s * s));
  }
}

void EdgeSamples::weigh(double dark, double gain, double part) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(count); ++i) {
    const double s = std::max(0.0, static_cast<double>(value[i]));
    weight[i] = pixels[i] * static_cast<float>(1 / (dark * dark + gain * s + part * part * s * s));
  }
}

EdgeFit fit_edge(const EdgeSamples& samples, EdgeFit f, const std::vector<EdgeFree>& free,
                 const EdgePrior& prior, double still, int iterations) {
  const auto unknowns = static_cast<Eigen::Index>(free.size());
  EdgeDirections t = directions(f, free);
  EdgeNormal normal = edge_normal(samples, f, t, prior);
  double damping = 1e-3;
  for (int i = 0; i < iterations && damping < 1e6; ++i) {
    EdgeMatrix damped = normal.matrix;
    damped.diagonal() *= 1 + damping;
    damped.diagonal().array() += 1e-9;
    const EdgeVector step = damped.ldlt().solve(normal.right);
    if (!step.allFinite()) break;
    const double gain = step.dot(normal.right);
    const EdgeFit next = edge_stepped(f, t, step);
    if (gain < still) {
      f = next;
      break;
    }
    EdgeDirections next_t = directions(next, free);
    EdgeNormal trial = edge_normal(samples, next, next_t, prior);
    if (trial.squares <= normal.squares) {
      f = next;
      t = std::move(next_t);
      normal = std::move(trial);
      damping = std::max(1e-7, damping / 10);
    } else {
      damping *= 8;
    }
  }
  f.chi_square = normal.squares;
  f.misfit = std::sqrt(normal.squares / std::max<double>(1, samples.count - static_cast<double>(unknowns)));
  EdgeMatrix stiff = normal.matrix;
  stiff.diagonal().array() += 1e-9;
  const EdgeMatrix covariance = stiff.inverse() * std::pow(std::max(1.0, f.misfit), 2);
  Eigen::Index column = 0;
  for (const EdgeFree what : free) {
    // Parameters that the samples don't determine get a large error, not a small one.
    const double variance = covariance(column, column);
    const double sigma = variance > 0 ? std::sqrt(variance) : std::numeric_limits<double>::infinity();
    if (what == EdgeFree::across || what == EdgeFree::radius) f.across_sigma = sigma;
    if (what == EdgeFree::blur) f.blur_sigma = sigma;
    ++column;
  }
  return f;
}

double residual_gain(const EdgeSamples& samples, const EdgeFit& f, double dark) {
  std::vector<float> signal(samples.value.size());
  edge_values(f, samples, signal.data());
  // Squared residuals weighted by 1 / variance^2, so that the brightest samples don't dominate.
  double excess = 0;
  double power = 0;
  for (std::size_t i = 0; i < static_cast<std::size_t>(samples.count); ++i) {
    const double s = std::max(0.0, static_cast<double>(signal[i]));
    const double residual = static_cast<double>(samples.value[i] - signal[i]);
    const double weight = std::pow(static_cast<double>(samples.weight[i]), 2);
    const auto one = 1 / static_cast<double>(samples.pixels[i]);  // variance of a mean
    excess += weight * s * one * (residual * residual - dark * dark * one);
    power += weight * s * s * one * one;
  }
  return power > 0 ? std::max(0.0, excess / power) : 0;
}

}  // namespace emberlock::smear::detail
