// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/glow_cost.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <Eigen/Dense>

namespace emberlock::recon {
namespace {

constexpr std::size_t kKnots = 512;
constexpr int kTasks = 64;
constexpr double kLeastVariance = 1e-6;  // of a channel's residuals, over all channels'
constexpr double kDamping = 1e-3;  // of the diagonal, so that brightness and temperature can be told apart
constexpr double kMostBrightness = 0.5, kMostKelvin = 100;  // a step

std::array<std::size_t, 3> steps_of(const Grid& g) { return {1, g.index(0, 1, 0), g.index(0, 0, 1)}; }

/// The next point along an axis, or none.
bool has_next(const Grid& g, int i, int j, int k, std::size_t axis) {
  return axis == 0 ? i + 1 < g.nx : axis == 1 ? j + 1 < g.ny : k + 1 < g.nz;
}

/// The direction in which light changes fastest; zero where it doesn't.
Eigen::Vector3d direction(const Grid& g, const std::vector<float>& total, int i, int j, int k) {
  const std::size_t p = g.index(i, j, k);
  const std::array<std::size_t, 3> step = steps_of(g);
  const std::array<bool, 3> before = {i > 0, j > 0, k > 0};
  Eigen::Vector3d slope;
  for (std::size_t d = 0; d < 3; ++d) {
    const float high = has_next(g, i, j, k, d) ? total[p + step[d]] : 0;
    const float low = before[d] ? total[p - step[d]] : 0;
    slope[static_cast<Eigen::Index>(d)] = static_cast<double>(high - low);
  }
  return slope.norm() > 0 ? slope.normalized() : slope;
}

}  // namespace

EmitterColours::EmitterColours(const EmitterTable& table)
    : coldest_(table.coldest().value()), hottest_(table.hottest().value()) {
  for (std::size_t i = 0; i < kKnots; ++i) {
    const double share = static_cast<double>(i) / (kKnots - 1);
    knots_.push_back(table.at(Kelvin(1 / ((1 - share) / coldest_ + share / hottest_))).value);
  }
}

EmitterColours::At EmitterColours::at(double kelvin) const {
  const double t = std::clamp(kelvin, coldest_, hottest_);
  const double per_place = (kKnots - 1) / (1 / coldest_ - 1 / hottest_);
  const double place = (1 / coldest_ - 1 / t) * per_place;
  const std::size_t i = std::min(static_cast<std::size_t>(place), kKnots - 2);
  const double f = place - static_cast<double>(i);
  const double by_kelvin = t == kelvin ? per_place / (t * t) : 0;
  At out;
  for (std::size_t c = 0; c < 3; ++c) {
    const double b = knots_[i][c];
    const double d = knots_[i + 1][c];
    const double rise_b = i > 0 ? (d - knots_[i - 1][c]) / 2 : d - b;
    const double rise_d = i + 2 < kKnots ? (knots_[i + 2][c] - b) / 2 : d - b;
    const double cubic = rise_b + rise_d - 2 * (d - b);
    const double square = 3 * (d - b) - 2 * rise_b - rise_d;
    out.value[c] = b + f * (rise_b + f * (square + f * cubic));
    out.slope[c] = (rise_b + f * (2 * square + f * 3 * cubic)) * by_kelvin;
  }
  return out;
}

template <class Real>
GlowCost<Real>::GlowCost(const Problem& problem, GlowStart start, EmitterColours colours, Pool& pool)
    : problem_(problem),
      start_(std::move(start)),
      colours_(std::move(colours)),
      pool_(pool),
      travel_(problem.list.curved ? 1 : 0),
      ties_(problem.grid().size()),
      shown_(problem.grid().size()),
      residual_(problem.rays()),
      gradient_(problem.grid().size()),
      weight_(problem.grid().size()) {
  if (start_.absorb == Absorb::field) samples_.resize(problem.most_samples());
  const Grid& g = problem.grid();
  const std::array<std::size_t, 3> step = steps_of(g);
  each_point([&](int i, int j, int k, std::size_t p) {
    if (!moves(p)) return;
    for (std::size_t d = 0; d < 3; ++d) {
      if (!has_next(g, i, j, k, d) || !moves(p + step[d])) continue;
      const Eigen::Vector3d n = direction(g, start_.total, i, j, k);
      ties_[p][d] = static_cast<Real>(1 - std::pow(n[static_cast<Eigen::Index>(d)], 2));
    }
  });
}

template <class Real>
template <class Act>
void GlowCost<Real>::each_point(const Act& act) const {
  const Grid& g = problem_.grid();
  pool_.run(g.nz, [&](int k) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) act(i, j, k, g.index(i, j, k));
  });
}

template <class Real>
void GlowCost<Real>::show(const GlowField<Real>& at) {
  each_point([&](int /*i*/, int /*j*/, int /*k*/, std::size_t p) {
    for (int c = 0; c < 4; ++c) shown_[p].c[c] = static_cast<Real>(start_.light[p].c[c]);
    if (!moves(p)) return;
    const EmitterColours::At colour = colours_.at(static_cast<double>(at.kelvin[p]));
    const double total =
        static_cast<double>(start_.total[p]) * std::exp(static_cast<double>(at.brightness[p]));
    for (std::size_t c = 0; c < 3; ++c)
      shown_[p].c[static_cast<int>(c)] = static_cast<Real>(total * colour.value[c]);
  });
}

template <class Real>
MarchWork<Real> GlowCost<Real>::work(int subset) {
  return {problem_.list.table(),
          shown_.data(),
          static_cast<Real>(start_.sigma),
          residual_.data(),
          gradient_.data(),
          samples_.data(),
          problem_.list.before[static_cast<std::size_t>(subset)].samples};
}

template <class Real>
template <class Act>
void GlowCost<Real>::march_and_spread(const PixelResidual<Real>& pixel, const Act& act) {
  std::fill(gradient_.begin(), gradient_.end(), Quad<Real>{});
  for (int subset = 0; subset < problem_.list.subsets(); ++subset) {
    march(pixel, subset);
    const auto s = static_cast<std::size_t>(subset);
    act(problem_.list.subset_begin[s], problem_.list.subset_begin[s + 1]);
    spread(subset);
  }
}

template <class Real>
void GlowCost<Real>::march(const PixelResidual<Real>& pixel, int subset) {
  const MarchWork<Real> here = work(subset);
  const auto s = static_cast<std::size_t>(subset);
  const std::size_t first = problem_.list.subset_begin[s];
  const std::size_t count = problem_.list.subset_begin[s + 1] - first;
  pool_.run(kTasks, [&](int task) {
    const Slice mine = slice(count, kTasks, task);
    const std::size_t begin = first + mine.begin;
    const std::size_t end = first + mine.end;
    if (start_.absorb == Absorb::field) {
      table_.field_forward[travel_](here, pixel, begin, end);
      return;
    }
    table_.forward[static_cast<int>(start_.absorb)][travel_](here, begin, end);
    for (std::size_t r = begin; r < end; ++r) residual_[r] = pixel(r, residual_[r]);
  });
}

template <class Real>
void GlowCost<Real>::spread(int subset) {
  const MarchWork<Real> here = work(subset);
  const SlabRuns& slabs = problem_.slabs[static_cast<std::size_t>(subset)];
  const int count = problem_.slab_count();
  for (int parity = 0; parity < 2; ++parity)  // no two slabs that run at once share a key point
    pool_.run((count + 1 - parity) / 2, [&](int task) {
      const std::size_t s = 2 * static_cast<std::size_t>(task) + static_cast<std::size_t>(parity);
      table_.adjoint[static_cast<int>(start_.absorb)][travel_](here, slabs.run.data() + slabs.begin[s],
                                                               slabs.begin[s + 1] - slabs.begin[s]);
    });
}

/// 1/2 r^T P r, and r becomes P r. Where a pixel is a bound that is met, r is 0 whatever the light.
template <class Real>
double GlowCost<Real>::data(std::size_t begin, std::size_t end) {
  std::array<double, kTasks> sums = {};
  pool_.run(kTasks, [&](int task) {
    const Slice mine = slice(end - begin, kTasks, task);
    for (std::size_t r = begin + mine.begin; r < begin + mine.end; ++r) {
      Quad<Real>& residual = residual_[r];
      Eigen::Vector3d own;
      for (int c = 0; c < 3; ++c) own[c] = static_cast<double>(residual.c[c]);
      const Eigen::Vector3d weighed = precision_ * own;
      sums[static_cast<std::size_t>(task)] += own.dot(weighed) / 2;
      for (int c = 0; c < 3; ++c) residual.c[c] = own[c] == 0 ? Real(0) : static_cast<Real>(weighed[c]);
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

/// What the ties cost; their slope is added.
template <class Real>
double GlowCost<Real>::tied(const GlowField<Real>& at, GlowField<Real>& slope) const {
  const Grid& g = problem_.grid();
  const std::array<std::size_t, 3> step = steps_of(g);
  std::vector<double> sums(static_cast<std::size_t>(g.nz));
  each_point([&](int i, int j, int k, std::size_t p) {
    if (!moves(p)) return;
    const auto add = [&](std::size_t q, Real tie) {
      const double t = static_cast<double>(tie);
      const double kelvin = static_cast<double>(at.kelvin[p] - at.kelvin[q]);
      const double brightness = static_cast<double>(at.brightness[p] - at.brightness[q]);
      slope.kelvin[p] += static_cast<Real>(tie_kelvin_ * t * kelvin);
      slope.brightness[p] += static_cast<Real>(tie_brightness_ * t * brightness);
      // Each tie is met from both of its ends.
      sums[static_cast<std::size_t>(k)] +=
          t * (tie_kelvin_ * kelvin * kelvin + tie_brightness_ * brightness * brightness) / 4;
    };
    const std::array<bool, 3> before = {i > 0, j > 0, k > 0};
    for (std::size_t d = 0; d < 3; ++d) {
      if (ties_[p][d] > 0) add(p + step[d], ties_[p][d]);
      if (before[d] && ties_[p - step[d]][d] > 0) add(p - step[d], ties_[p - step[d]][d]);
    }
  });
  return std::accumulate(sums.begin(), sums.end(), 0.0);
}

template <class Real>
double GlowCost<Real>::operator()(const GlowField<Real>& at, GlowField<Real>& slope) {
  show(at);
  double data_cost = 0;
  march_and_spread(problem_.pixel_residual<Real>({}, start_.white),
                   [&](std::size_t begin, std::size_t end) { data_cost += data(begin, end); });
  slope.brightness.assign(shown_.size(), 0);
  slope.kelvin.assign(shown_.size(), 0);
  each_point([&](int /*i*/, int /*j*/, int /*k*/, std::size_t p) {
    if (!moves(p)) return;
    const Eigen::Matrix<double, 3, 2> by = derivative(at, p);
    Eigen::Vector3d light;
    for (int c = 0; c < 3; ++c) light[c] = static_cast<double>(gradient_[p].c[c]);
    const Eigen::Vector2d along = by.transpose() * light;
    slope.brightness[p] = static_cast<Real>(along[0]);
    slope.kelvin[p] = static_cast<Real>(along[1]);
  });
  return data_cost + tied(at, slope);
}

/// Of the emission's three channels by brightness and temperature.
template <class Real>
Eigen::Matrix<double, 3, 2> GlowCost<Real>::derivative(const GlowField<Real>& at, std::size_t p) const {
  const EmitterColours::At colour = colours_.at(static_cast<double>(at.kelvin[p]));
  const double total = static_cast<double>(start_.total[p]) * std::exp(static_cast<double>(at.brightness[p]));
  Eigen::Matrix<double, 3, 2> out;
  out.col(0) = total * Eigen::Vector3d::Map(colour.value.data());
  out.col(1) = total * Eigen::Vector3d::Map(colour.slope.data());
  return out;
}

/// J^T W P W J, W^2 being A^T A 1 of each channel.
template <class Real>
Eigen::Matrix2d GlowCost<Real>::curvature(const GlowField<Real>& at, std::size_t p) const {
  Eigen::Vector3d root;
  for (int c = 0; c < 3; ++c) root[c] = std::sqrt(static_cast<double>(weight_[p].c[c]));
  const Eigen::Matrix<double, 3, 2> by = root.asDiagonal() * derivative(at, p);
  return by.transpose() * precision_ * by;
}

template <class Real>
void GlowCost<Real>::weigh(const GlowField<Real>& at, const GlowTies& ties) {
  for (std::size_t p = 0; p < shown_.size(); ++p)
    for (int c = 0; c < 4; ++c) shown_[p].c[c] = c < 3 ? Real(1) : static_cast<Real>(start_.light[p].c[c]);
  const std::vector<Rgba> black(problem_.rays());
  march_and_spread({black.data()}, [](std::size_t /*begin*/, std::size_t /*end*/) {});
  weight_ = gradient_;
  show(at);
  for (int subset = 0; subset < problem_.list.subsets(); ++subset)
    march(problem_.pixel_residual<Real>({}, start_.white), subset);
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Quad<Real>& r : residual_) {
    Eigen::Vector3d own;
    for (int c = 0; c < 3; ++c) own[c] = static_cast<double>(r.c[c]);
    covariance += own * own.transpose() / static_cast<double>(residual_.size());
  }
  covariance.diagonal().array() += kLeastVariance * covariance.trace() + 1e-12;
  precision_ = covariance.inverse();
  double moving = 0;
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  for (std::size_t p = 0; p < shown_.size(); ++p) {
    if (!moves(p)) continue;
    sum += curvature(at, p).diagonal();
    ++moving;
  }
  if (moving == 0) return;
  tie_brightness_ = ties.brightness * sum[0] / moving;
  tie_kelvin_ = ties.kelvin * sum[1] / moving;
}

template <class Real>
void GlowCost<Real>::descend(GlowField<Real>& at, const GlowField<Real>& slope, double length) const {
  const Grid& g = problem_.grid();
  const std::array<std::size_t, 3> step = steps_of(g);
  each_point([&](int i, int j, int k, std::size_t p) {
    if (!moves(p)) return;
    const std::array<bool, 3> before = {i > 0, j > 0, k > 0};
    double tied = 0;
    for (std::size_t d = 0; d < 3; ++d)
      tied += static_cast<double>(ties_[p][d] + (before[d] ? ties_[p - step[d]][d] : Real(0)));
    Eigen::Matrix2d hessian = curvature(at, p);
    hessian.diagonal() *= 1 + kDamping;
    hessian(0, 0) += 2 * tied * tie_brightness_;
    hessian(1, 1) += 2 * tied * tie_kelvin_;
    const Eigen::Vector2d against(static_cast<double>(slope.brightness[p]),
                                  static_cast<double>(slope.kelvin[p]));
    const Eigen::Vector2d by = -length * hessian.inverse() * against;
    if (!by.allFinite()) return;
    at.brightness[p] += static_cast<Real>(std::clamp(by[0], -kMostBrightness, kMostBrightness));
    at.kelvin[p] += static_cast<Real>(std::clamp(by[1], -kMostKelvin, kMostKelvin));
  });
}

template class GlowCost<float>;
template class GlowCost<double>;

}  // namespace emberlock::recon
