// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/sheet_decomposition/sheet_decomposition.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <utility>

#include <Eigen/LU>

#include "recon/hull/hull.h"

namespace emberlock::paper {
namespace {

constexpr double kLeastCrossing = 0.17;  // 10 degrees: below, a sheet's depth is a picture's error magnified
constexpr int kMostParts = 12;           // that a pair's pictures are cut into
constexpr double kMostSheets = 1000;     // of a slice: parts^2 for each pair
constexpr double kEven = 0.1;            // pull towards equal weights, relative to a sheet's mean square
constexpr int kMostSteps = 100;

/// A profile's light up to each boundary between rays, scaled to end at 1; empty where it is dark.
std::vector<double> cumulative(const ParallelSlices& slices, const ParallelPicture& picture, int k,
                               int channel) {
  const float* light = picture.light.data() + static_cast<std::size_t>(k) * slices.profile() + channel;
  std::vector<double> sums(static_cast<std::size_t>(slices.offsets) + 1);
  for (std::size_t b = 0; b + 1 < sums.size(); ++b) sums[b + 1] = sums[b] + static_cast<double>(light[3 * b]);
  const double whole = sums.back();
  if (whole <= 0) return {};
  for (double& sum : sums) sum /= whole;
  return sums;
}

/// Where a profile's cumulative light reaches an amount; follows it along rising amounts.
class Follow {
 public:
  Follow(const std::vector<double>& sums, double from) : sums_(sums), from_(from) {
    while (!ended() && next() <= 0) step();
  }

  /// The next amount, counted from the start, at which the ray changes.
  [[nodiscard]] double next() const { return sums_[ray_ + 1] - from_; }
  [[nodiscard]] bool ended() const { return ray_ + 2 == sums_.size(); }
  void step() { ++ray_; }
  /// In voxel edges from the axis.
  [[nodiscard]] double offset(double amount) const {
    const double light = sums_[ray_ + 1] - sums_[ray_];
    const double part = light > 0 ? std::clamp((from_ + amount - sums_[ray_]) / light, 0.0, 1.0) : 0.5;
    return static_cast<double>(ray_) + part - static_cast<double>(sums_.size() - 1) / 2;
  }

 private:
  const std::vector<double>& sums_;
  double from_;
  std::size_t ray_ = 0;
};

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

/// Adds light to the four key points around a dot, which lies in the grid.
void splat(const recon::Grid& grid, const SheetDot& dot, double light, std::size_t channel, float* layer) {
  const double x = dot.place.x() + (grid.nx - 1) / 2.0;
  const double y = dot.place.y() + (grid.ny - 1) / 2.0;
  const int i = std::min(static_cast<int>(x), grid.nx - 2);
  const int j = std::min(static_cast<int>(y), grid.ny - 2);
  for (int corner = 0; corner < 4; ++corner) {
    const double weight =
        ((corner & 1) != 0 ? x - i : 1 - (x - i)) * ((corner >> 1) != 0 ? y - j : 1 - (y - j));
    const std::size_t at = grid.index(i + (corner & 1), j + (corner >> 1), 0);
    layer[3 * at + channel] += static_cast<float>(weight * dot.light * light);
  }
}

/// In the three channels.
struct Sheet {
  std::array<std::vector<SheetDot>, 3> dots;
};

/// Decomposes slices, one after the other.
class Decomposer {
 public:
  Decomposer(const ParallelSlices& slices, const std::vector<ParallelPicture>& pictures,
             const std::vector<Pair>& pairs)
      : slices_(slices), pictures_(pictures), pairs_(pairs) {
    // Parts narrower than rays would say nothing new.
    const double most = std::clamp(slices.grid.nx / 4.0, 1.0, double{kMostParts});
    parts_ =
        static_cast<int>(std::clamp(std::sqrt(kMostSheets / static_cast<double>(pairs.size())), 1.0, most));
  }

  void decompose(int k, float* layer) const {
    const std::array<double, 3> light = {mean_light(k, 0), mean_light(k, 1), mean_light(k, 2)};
    if (light[0] + light[1] + light[2] <= 0) return;
    // A ray's light is spread over its strip of one edge: grey levels * edge, over edge^2 a key point.
    const double density = 1 / static_cast<double>(slices_.grid.edge);
    const std::vector<Sheet> sheets = sheets_of(k);
    const Eigen::SparseMatrix<double> seen = seen_of(sheets, light);
    Eigen::VectorXd shown(seen.rows());
    for (std::size_t v = 0; v < pictures_.size(); ++v)
      for (std::size_t i = 0; i < slices_.profile(); ++i)
        shown[static_cast<Eigen::Index>(v * slices_.profile() + i)] =
            static_cast<double>(pictures_[v].light[static_cast<std::size_t>(k) * slices_.profile() + i]);
    const Eigen::VectorXd weights = convex_weights(seen, shown, kEven);
    for (std::size_t p = 0; p < sheets.size(); ++p)
      for (std::size_t c = 0; c < 3; ++c)
        for (const SheetDot& dot : sheets[p].dots[c])
          splat(slices_.grid, dot, weights[static_cast<Eigen::Index>(p)] * light[c] * density, c, layer);
  }

 private:
  /// Each view's light in a layer should be the same; what they say of it is averaged.
  [[nodiscard]] double mean_light(int k, int channel) const {
    double sum = 0;
    for (const ParallelPicture& picture : pictures_) {
      const float* light = picture.light.data() + static_cast<std::size_t>(k) * slices_.profile() + channel;
      for (int b = 0; b < slices_.offsets; ++b) sum += static_cast<double>(light[3 * b]);
    }
    return sum / static_cast<double>(pictures_.size());
  }

  [[nodiscard]] std::vector<Sheet> sheets_of(int k) const {
    const double part = 1.0 / parts_;
    std::vector<Sheet> sheets;
    for (const Pair& pair : pairs_)
      for (int i = 0; i < parts_; ++i)
        for (int j = 0; j < parts_; ++j) {
          Sheet sheet;
          for (std::size_t c = 0; c < 3; ++c)
            sheet.dots[c] = density_sheet(slices_, pictures_[pair.first], pictures_[pair.second], k,
                                          static_cast<int>(c), {part * i, part * j, part});
          sheets.push_back(std::move(sheet));
        }
    return sheets;
  }

  /// The profiles of the sheets, view by view: a column each.
  [[nodiscard]] Eigen::SparseMatrix<double> seen_of(const std::vector<Sheet>& sheets,
                                                    const std::array<double, 3>& light) const {
    std::vector<Eigen::Triplet<double>> values;
    for (std::size_t p = 0; p < sheets.size(); ++p)
      for (std::size_t v = 0; v < pictures_.size(); ++v)
        for (std::size_t c = 0; c < 3; ++c)
          for (const SheetDot& dot : sheets[p].dots[c]) {
            const double ray = pictures_[v].across.dot(dot.place) + (slices_.offsets - 1) / 2.0;
            const double before = std::floor(ray);
            const auto row =
                static_cast<Eigen::Index>(v * slices_.profile() + 3 * static_cast<std::size_t>(before) + c);
            const auto column = static_cast<Eigen::Index>(p);
            values.emplace_back(row, column, (before + 1 - ray) * dot.light * light[c]);
            values.emplace_back(row + 3, column, (ray - before) * dot.light * light[c]);
          }
    Eigen::SparseMatrix<double> seen(static_cast<Eigen::Index>(slices_.profile() * pictures_.size()),
                                     static_cast<Eigen::Index>(sheets.size()));
    seen.setFromTriplets(values.begin(), values.end());
    return seen;
  }

  const ParallelSlices& slices_;
  const std::vector<ParallelPicture>& pictures_;
  const std::vector<Pair>& pairs_;
  int parts_;
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

double largest_eigenvalue(const Eigen::SparseMatrix<double>& seen) {
  Eigen::VectorXd v = Eigen::VectorXd::Ones(seen.cols()).normalized();
  double value = 0;
  for (int n = 0; n < 20; ++n) {
    v = seen.transpose() * (seen * v);
    value = v.norm();
    if (value <= 0) return 0;
    v /= value;
  }
  return value;
}

}  // namespace

std::vector<SheetDot> density_sheet(const ParallelSlices& slices, const ParallelPicture& first,
                                    const ParallelPicture& second, int k, int channel,
                                    const SheetPart& part) {
  const std::vector<double> sums_first = cumulative(slices, first, k, channel);
  const std::vector<double> sums_second = cumulative(slices, second, k, channel);
  if (sums_first.empty() || sums_second.empty()) return {};
  const Eigen::Matrix2d place = place_from_offsets(first, second);
  const Eigen::Vector2d reach((slices.grid.nx - 1) / 2.0, (slices.grid.ny - 1) / 2.0);
  std::vector<SheetDot> sheet;
  Follow left(sums_first, part.first);
  Follow right(sums_second, part.second);
  double from = 0;
  while (true) {
    const double to = std::min({left.next(), right.next(), part.light});
    if (to > from) {
      const Eigen::Vector2d begin = place * Eigen::Vector2d(left.offset(from), right.offset(from));
      const Eigen::Vector2d end = place * Eigen::Vector2d(left.offset(to), right.offset(to));
      const int dots = 1 + static_cast<int>((end - begin).norm());
      for (int dot = 0; dot < dots; ++dot) {
        const Eigen::Vector2d at = begin + (dot + 0.5) / dots * (end - begin);
        if ((at.array().abs() < reach.array()).all()) sheet.push_back({at, (to - from) / dots / part.light});
      }
      from = to;
    }
    if (to >= part.light) break;
    const bool left_next = left.next() <= right.next();
    Follow& behind = (left_next && !left.ended()) || right.ended() ? left : right;
    if (behind.ended()) break;
    behind.step();
  }
  return sheet;
}

Eigen::VectorXd convex_weights(const Eigen::SparseMatrix<double>& seen, const Eigen::VectorXd& shown,
                               double even) {
  const auto count = static_cast<double>(seen.cols());
  const double pull = even * seen.squaredNorm() / count;
  // Power iteration comes from below.
  const double step = 1 / (1.05 * largest_eigenvalue(seen) + pull);
  const Eigen::VectorXd prior = Eigen::VectorXd::Constant(seen.cols(), 1 / count);
  Eigen::VectorXd weights = prior;
  Eigen::VectorXd ahead = weights;
  double momentum = 1;
  for (int n = 0; n < kMostSteps; ++n) {
    const Eigen::VectorXd before = weights;
    const Eigen::VectorXd slope = seen.transpose() * (seen * ahead - shown) + pull * (ahead - prior);
    weights = onto_simplex(ahead - step * slope);
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
  each_layer(slices, options, [&](int k) {
    decomposer.decompose(k, volume.emission.data() + static_cast<std::size_t>(k) * slices.layer());
  });
  return checked_result(scene, std::move(volume), options);
}

}  // namespace emberlock::paper
