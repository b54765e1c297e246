// SPDX-License-Identifier: Apache-2.0
#include "evaluate/baselines/sheet_decomposition/sheet_decomposition.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <utility>

#include <Eigen/LU>

#include "recon/compute/pool.h"

namespace emberlock::evaluate {
namespace {

constexpr double kLeastCrossing = 0.17;  // 10 degrees: below, a sheet's depth is a picture's error magnified
constexpr double kEven = 1e-3;  // pull towards equal weights, of the mean square of a sheet's profile
constexpr int kMostSteps = 2000;
constexpr int kLayersAtOnce = 16;  // between two looks at `stop`

/// A profile's light up to each boundary between rays, scaled to end at `total`.
std::vector<double> cumulative(const ParallelSlices& slices, const ParallelPicture& picture, int k,
                               int channel, double total) {
  const float* light = picture.light.data() + static_cast<std::size_t>(k) * slices.profile() + channel;
  std::vector<double> sums(static_cast<std::size_t>(slices.offsets) + 1);
  for (std::size_t b = 0; b + 1 < sums.size(); ++b) sums[b + 1] = sums[b] + static_cast<double>(light[3 * b]);
  if (sums.back() <= 0) return {};
  const double scale = total / sums.back();
  for (double& sum : sums) sum *= scale;
  return sums;
}

/// Where the cumulative light of a profile reaches an amount, in edges from the axis; walks on with rising
/// amounts.
class Follow {
 public:
  explicit Follow(const std::vector<double>& sums) : sums_(sums) {}

  /// The next amount at which the profile's ray changes.
  [[nodiscard]] double next() const { return sums_[ray_ + 1]; }
  [[nodiscard]] bool ended() const { return ray_ + 2 == sums_.size(); }
  void step() { ++ray_; }
  [[nodiscard]] double offset(double amount) const {
    const double light = sums_[ray_ + 1] - sums_[ray_];
    const double part = light > 0 ? std::clamp((amount - sums_[ray_]) / light, 0.0, 1.0) : 0.5;
    return static_cast<double>(ray_) + part - static_cast<double>(sums_.size() - 1) / 2;
  }

 private:
  const std::vector<double>& sums_;
  std::size_t ray_ = 0;
};

/// Puts light onto the four key points around a place, in edges from the axis; the grid's border takes what
/// lies beyond.
void splat(const recon::Grid& grid, const Eigen::Vector2d& place, double light, int channel, float* layer) {
  const double x = std::clamp(place.x() + (grid.nx - 1) / 2.0, 0.0, grid.nx - 1.0);
  const double y = std::clamp(place.y() + (grid.ny - 1) / 2.0, 0.0, grid.ny - 1.0);
  const int i = std::min(static_cast<int>(x), grid.nx - 2);
  const int j = std::min(static_cast<int>(y), grid.ny - 2);
  for (int corner = 0; corner < 4; ++corner) {
    const double weight =
        ((corner & 1) != 0 ? x - i : 1 - (x - i)) * ((corner >> 1) != 0 ? y - j : 1 - (y - j));
    const std::size_t at = grid.index(i + (corner & 1), j + (corner >> 1), 0);
    layer[3 * at + static_cast<std::size_t>(channel)] += static_cast<float>(weight * light);
  }
}

/// Places from the offsets of two views' rays that meet there.
Eigen::Matrix2d place_from_offsets(const ParallelPicture& first, const ParallelPicture& second) {
  Eigen::Matrix2d offsets_from_place;
  offsets_from_place << first.across.transpose(), second.across.transpose();
  return offsets_from_place.inverse();
}

struct Pair {
  std::size_t first, second;
};

std::vector<Pair> pairs_of(const std::vector<ParallelPicture>& pictures) {
  std::vector<Pair> pairs;
  for (std::size_t a = 0; a < pictures.size(); ++a)
    for (std::size_t b = a + 1; b < pictures.size(); ++b)
      if (crossing(pictures[a], pictures[b]) >= kLeastCrossing) pairs.push_back({a, b});
  return pairs;
}

/// Decomposes slices, one after the other.
class Decomposer {
 public:
  Decomposer(const ParallelSlices& slices, const std::vector<ParallelPicture>& pictures,
             const std::vector<Pair>& pairs)
      : slices_(slices), pictures_(pictures), pairs_(pairs) {
    for (const ParallelPicture& picture : pictures) projectors_.emplace_back(slices, picture.across);
  }

  void decompose(int k, float* layer) const {
    std::vector<std::vector<float>> sheets(pairs_.size(), std::vector<float>(slices_.layer()));
    for (int c = 0; c < 3; ++c) {
      const double total = mean_total(k, c);
      if (total <= 0) continue;
      for (std::size_t p = 0; p < pairs_.size(); ++p)
        draw_density_sheet(slices_, pictures_[pairs_[p].first], pictures_[pairs_[p].second], k, c, total,
                           sheets[p].data());
    }
    const std::size_t profile = slices_.profile();
    Eigen::MatrixXd seen(static_cast<Eigen::Index>(profile * pictures_.size()),
                         static_cast<Eigen::Index>(pairs_.size()));
    Eigen::VectorXd light(seen.rows());
    std::vector<float> values(profile);
    for (std::size_t v = 0; v < pictures_.size(); ++v) {
      for (std::size_t p = 0; p < pairs_.size(); ++p) {
        projectors_[v].project(sheets[p].data(), values.data());
        for (std::size_t i = 0; i < profile; ++i)
          seen(static_cast<Eigen::Index>(v * profile + i), static_cast<Eigen::Index>(p)) =
              static_cast<double>(values[i]);
      }
      const float* from = pictures_[v].light.data() + static_cast<std::size_t>(k) * profile;
      for (std::size_t i = 0; i < profile; ++i)
        light[static_cast<Eigen::Index>(v * profile + i)] = static_cast<double>(from[i]);
    }
    combine(sheets, seen, light, layer);
  }

 private:
  /// Each view's light in a layer should be the same; what they say of it is averaged.
  [[nodiscard]] double mean_total(int k, int channel) const {
    double sum = 0;
    for (const ParallelPicture& picture : pictures_) {
      const float* light = picture.light.data() + static_cast<std::size_t>(k) * slices_.profile() + channel;
      for (int b = 0; b < slices_.offsets; ++b) sum += static_cast<double>(light[3 * b]);
    }
    return sum / static_cast<double>(pictures_.size());
  }

  static void combine(const std::vector<std::vector<float>>& sheets, const Eigen::MatrixXd& seen,
                      const Eigen::VectorXd& light, float* layer) {
    const auto count = seen.cols();
    Eigen::MatrixXd gram = seen.transpose() * seen;
    const double mean = gram.trace() / static_cast<double>(count);
    if (mean <= 0) return;  // a dark slice
    gram.diagonal().array() += kEven * mean;
    const Eigen::VectorXd weights = convex_weights(gram, seen.transpose() * light);
    for (std::size_t p = 0; p < sheets.size(); ++p) {
      const auto weight = static_cast<float>(weights[static_cast<Eigen::Index>(p)]);
      if (weight <= 0) continue;
      for (std::size_t i = 0; i < sheets[p].size(); ++i) layer[i] += weight * sheets[p][i];
    }
  }

  const ParallelSlices& slices_;
  const std::vector<ParallelPicture>& pictures_;
  const std::vector<Pair>& pairs_;
  std::vector<ParallelProjector> projectors_;
};

/// The nearest point of the simplex w >= 0, sum w = 1.
Eigen::VectorXd onto_simplex(const Eigen::VectorXd& from) {
  std::vector<double> falling(from.begin(), from.end());
  std::sort(falling.begin(), falling.end(), std::greater<>());
  double sum = 0;
  double shift = 0;
  for (std::size_t n = 0; n < falling.size(); ++n) {
    sum += falling[n];
    const double candidate = (sum - 1) / static_cast<double>(n + 1);
    if (falling[n] > candidate) shift = candidate;
  }
  return (from.array() - shift).max(0);
}

}  // namespace

void draw_density_sheet(const ParallelSlices& slices, const ParallelPicture& first,
                        const ParallelPicture& second, int k, int channel, double total, float* layer) {
  const std::vector<double> sums_first = cumulative(slices, first, k, channel, total);
  const std::vector<double> sums_second = cumulative(slices, second, k, channel, total);
  if (sums_first.empty() || sums_second.empty()) return;
  const Eigen::Matrix2d place = place_from_offsets(first, second);
  // A ray's light is spread over its strip of one edge: grey levels * edge, over edge^2 a key point.
  const double density = 1 / static_cast<double>(slices.grid.edge);
  Follow left(sums_first);
  Follow right(sums_second);
  double from = 0;
  while (true) {
    const double to = std::min(left.next(), right.next());
    if (to > from) {
      const Eigen::Vector2d begin = place * Eigen::Vector2d(left.offset(from), right.offset(from));
      const Eigen::Vector2d end = place * Eigen::Vector2d(left.offset(to), right.offset(to));
      const int dots = 1 + static_cast<int>(2 * (end - begin).norm());
      for (int dot = 0; dot < dots; ++dot)
        splat(slices.grid, begin + (dot + 0.5) / dots * (end - begin), density * (to - from) / dots, channel,
              layer);
      from = to;
    }
    const bool left_next = left.next() <= right.next();
    Follow& behind = (left_next && !left.ended()) || right.ended() ? left : right;
    if (behind.ended()) break;
    behind.step();
  }
}

Eigen::VectorXd convex_weights(const Eigen::MatrixXd& gram, const Eigen::VectorXd& right) {
  const auto count = static_cast<double>(right.size());
  // The largest row sum bounds the largest eigenvalue.
  const double step = 1 / gram.cwiseAbs().rowwise().sum().maxCoeff();
  Eigen::VectorXd weights = Eigen::VectorXd::Constant(right.size(), 1 / count);
  Eigen::VectorXd ahead = weights;
  double momentum = 1;
  for (int n = 0; n < kMostSteps; ++n) {
    const Eigen::VectorXd before = weights;
    weights = onto_simplex(ahead - step * (gram * ahead - right));
    const Eigen::VectorXd change = weights - before;
    if (change.cwiseAbs().maxCoeff() < 1e-9) break;
    // Starting anew where the momentum points uphill (O'Donoghue and Candes 2015).
    if ((ahead - weights).dot(change) > 0) momentum = 1;
    const double next = (1 + std::sqrt(1 + 4 * momentum * momentum)) / 2;
    ahead = weights + (momentum - 1) / next * change;
    momentum = next;
  }
  return weights;
}

Result<MethodResult> sheet_decomposition(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_method(scene, options));
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, options.voxels));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<ParallelPicture> pictures, parallel_pictures(scene, slices));
  const std::vector<Pair> pairs = pairs_of(pictures);
  if (pairs.empty())
    return Error{ErrorKind::bad_input, "no two input views see the flame from different sides", "scene",
                 "Add a view, best at a right angle to another"};
  recon::Volume volume{slices.grid, std::vector<float>(3 * slices.grid.size()), {}};
  const Decomposer decomposer(slices, pictures, pairs);
  recon::Pool pool(options.compute.threads);
  for (int first = 0; first < slices.grid.nz && !(options.stop && options.stop()); first += kLayersAtOnce)
    pool.run(std::min(kLayersAtOnce, slices.grid.nz - first), [&](int n) {
      const int k = first + n;
      decomposer.decompose(k, volume.emission.data() + static_cast<std::size_t>(k) * slices.layer());
    });
  return checked_result(scene, std::move(volume), options);
}

}  // namespace emberlock::evaluate
