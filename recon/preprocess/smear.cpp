// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/smear.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Dense>
#include <fmt/format.h>

namespace emberlock::recon {
namespace {

constexpr int kBlock = 16;      // columns whose mean shows whether a row contains flame
constexpr int kFewestRows = 4;  // without flame
constexpr double kSmearSigmas = 5;

std::size_t at(int i) { return static_cast<std::size_t>(i); }

/// Means over blocks of columns, row by row.
class BlockMeans {
 public:
  explicit BlockMeans(const Samples& s) : blocks_(std::max(1, s.size.width / kBlock)), rows_(s.size.height) {
    mean_.resize(at(blocks_) * at(rows_));
    const int width = std::min(kBlock, s.size.width) * s.channels();
    for (int y = 0; y < rows_; ++y) {
      for (int b = 0; b < blocks_; ++b) {
        const float* from = &s.value[s.index(b * kBlock, y)];
        double sum = 0;
        for (int i = 0; i < width; ++i) sum += static_cast<double>(from[i]);
        mean_[at(y) * at(blocks_) + at(b)] = sum / width;
      }
    }
  }
  [[nodiscard]] double operator()(int row, int block) const {
    return mean_[at(row) * at(blocks_) + at(block)];
  }

  /// The number of rows that look like the first few, from the border inwards in steps of one pitch.
  [[nodiscard]] int alike(int first, int step, int pitch) const {
    const double limit = std::max(0.5, kSmearSigmas * 1.2 * noise(pitch));
    const int most = rows_ / pitch;
    if (most < 2 * kFewestRows) return 0;
    int count = kFewestRows;
    for (; count < most; ++count) {
      for (int b = 0; b < blocks_; ++b) {
        for (int p = 0; p < pitch; ++p) {
          double start = 0;
          for (int i = 0; i < kFewestRows; ++i) start += (*this)(first + step * (i * pitch + p), b);
          if (std::abs((*this)(first + step * (count * pitch + p), b) - start / kFewestRows) > limit)
            return count;
        }
      }
    }
    return count;
  }

 private:
  [[nodiscard]] double noise(int pitch) const {
    std::vector<double> change;
    for (int y = 0; y + pitch < rows_; y += pitch)
      for (int b = 0; b < blocks_; ++b) change.push_back(std::abs((*this)(y + pitch, b) - (*this)(y, b)));
    if (change.empty()) return 0;
    const auto middle = change.begin() + static_cast<std::ptrdiff_t>(change.size() / 2);
    std::nth_element(change.begin(), middle, change.end());
    return 1.4826 * *middle / std::sqrt(2.0);
  }

  int blocks_;
  int rows_;
  std::vector<double> mean_;
};

/// Each column's values in rows without flame, and its light in the other rows.
struct Columns {
  std::vector<std::array<double, 3>> free;  ///< mean of the rows without flame, by channel
  std::vector<double> light;                ///< sum over the other rows, mean of the channels
  std::vector<std::uint8_t> saturated;
  int free_rows = 0, light_rows = 0;
};

struct FreeRows {
  int top = 0, bottom = 0;
  [[nodiscard]] bool holds(int y, int height) const { return y < top || y >= height - bottom; }
};

/// Leaves out a quarter of the rows next to the flame, because its glow extends further than is visible.
FreeRows rows_without_flame(const Samples& s) {
  const BlockMeans means(s);
  const int pitch = s.pitch();
  const auto kept = [&](int alike) { return alike <= kFewestRows ? 0 : pitch * (alike - alike / 4); };
  FreeRows free{kept(means.alike(0, 1, pitch)), kept(means.alike(s.size.height - 1, -1, pitch))};
  if (free.top + free.bottom >= s.size.height) free = {};  // no flame at all
  return free;
}

Columns columns_of(const Samples& s, const FreeRows& rows) {
  Columns out;
  const int channels = s.channels();
  out.free.resize(at(s.size.width));
  out.light.resize(at(s.size.width));
  out.saturated.resize(at(s.size.width));
  for (int y = 0; y < s.size.height; ++y) {
    const bool free = rows.holds(y, s.size.height);
    (free ? out.free_rows : out.light_rows) += 1;
    for (int x = 0; x < s.size.width; ++x) {
      double sum = 0;
      for (int c = 0; c < channels; ++c) {
        const std::size_t i = s.index(x, y, c);
        const auto v = static_cast<double>(s.value[i]);
        sum += v;
        if (free) out.free[at(x)][at(c)] += v;
        if (!s.saturated.empty() && s.saturated[i] != 0) out.saturated[at(x)] = 1;
      }
      if (!free) out.light[at(x)] += sum / channels;
    }
  }
  for (auto& column : out.free)
    for (double& v : column) v /= std::max(1, out.free_rows);
  return out;
}

/// Models the rows without flame as a level that may vary across the picture (in a mosaic, one for each kind
/// of column), plus a share of the column's light. Least squares over the columns without saturated samples.
struct Share {
  Eigen::VectorXd level;  ///< all terms except the last
  double share = 0;
  double sigma = 0;
};

Eigen::VectorXd terms(const Samples& s, const Columns& columns, int x) {
  const double u = 2.0 * x / s.size.width - 1;
  Eigen::VectorXd row(5);
  const bool odd = s.layout == SampleLayout::mosaic && (x & 1) != 0;
  row << (odd ? 0 : 1), (odd ? 1 : 0), u, u * u, columns.light[at(x)];
  return row;
}

std::optional<Share> fit_share(const Samples& s, const Columns& columns, int channel) {
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(5, 5);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(5);
  double squares = 0;
  int used = 0;
  for (int x = 0; x < s.size.width; ++x) {
    if (columns.saturated[at(x)] != 0) continue;
    const Eigen::VectorXd row = terms(s, columns, x);
    const double seen = columns.free[at(x)][at(channel)];
    normal += row * row.transpose();
    right += row * seen;
    squares += seen * seen;
    ++used;
  }
  if (used < 16) return std::nullopt;
  if (s.layout != SampleLayout::mosaic) normal(1, 1) = 1;
  // Scales all terms to the same size, because the light's are large.
  const Eigen::VectorXd scale = normal.diagonal().cwiseMax(1e-12).cwiseSqrt().cwiseInverse();
  const Eigen::MatrixXd even = scale.asDiagonal() * normal * scale.asDiagonal();
  const Eigen::LDLT<Eigen::MatrixXd> solver(even);
  if (solver.rcond() < 1e-9) return std::nullopt;
  const Eigen::VectorXd x = scale.asDiagonal() * solver.solve(scale.asDiagonal() * right);
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(5, 5));
  const double variance = std::max(0.0, squares - x.dot(right)) / (used - 5);
  return Share{x.head(4), x[4], scale[4] * std::sqrt(variance * inverse(4, 4))};
}

std::optional<Smear> not_found(std::string* why, std::string reason) {
  if (why != nullptr) *why = std::move(reason);
  return std::nullopt;
}

/// Each column's light minus that of most columns, which is the background's; in a mosaic, by kind of column.
std::vector<double> light_above_level(const Samples& s, const std::vector<double>& sums) {
  std::vector<double> out = sums;
  for (int phase = 0; phase < s.pitch(); ++phase) {
    std::vector<double> sorted;
    for (std::size_t x = at(phase); x < sums.size(); x += at(s.pitch())) sorted.push_back(sums[x]);
    if (sorted.empty()) continue;
    const auto tenth = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 10);
    std::nth_element(sorted.begin(), tenth, sorted.end());
    for (std::size_t x = at(phase); x < sums.size(); x += at(s.pitch()))
      out[x] = std::max(0.0, sums[x] - *tenth);
  }
  return out;
}

/// What is added to each sample of a row.
std::vector<float> smear_of_columns(const Samples& s, const Smear& smear) {
  const int channels = s.channels();
  double mean_fraction = 0;
  for (int c = 0; c < channels; ++c) mean_fraction += smear.fraction[at(c)] / channels;
  const FreeRows rows = rows_without_flame(s);
  const Columns columns = columns_of(s, rows);
  std::vector<double> sums(columns.light);
  for (std::size_t x = 0; x < sums.size(); ++x)
    for (int c = 0; c < channels; ++c) sums[x] += columns.free[x][at(c)] * columns.free_rows / channels;
  const std::vector<double> light = light_above_level(s, sums);
  std::array<std::optional<Share>, 3> shown;
  const bool any =
      std::any_of(columns.saturated.begin(), columns.saturated.end(), [](auto m) { return m != 0; });
  for (int c = 0; any && columns.free_rows > 0 && c < channels; ++c) shown[at(c)] = fit_share(s, columns, c);
  std::vector<float> column(at(s.size.width) * at(channels));
  for (int x = 0; x < s.size.width; ++x) {
    for (int c = 0; c < channels; ++c) {
      double add = smear.fraction[at(c)] * light[at(x)] / (1 + mean_fraction * s.size.height);
      if (columns.saturated[at(x)] != 0 && shown[at(c)])
        add =
            std::max(add, columns.free[at(x)][at(c)] - terms(s, columns, x).head(4).dot(shown[at(c)]->level));
      column[at(x) * at(channels) + at(c)] = static_cast<float>(add);
    }
  }
  return column;
}

}  // namespace

std::optional<Smear> find_smear(const Samples& samples, std::string* why) {
  const FreeRows rows = rows_without_flame(samples);
  if (rows.top + rows.bottom == 0) return not_found(why, "no rows without flame to tell it from");
  const int channels = samples.channels();
  const Columns both = columns_of(samples, rows);
  std::optional<Smear> found;
  // Each side separately: a flame cut by the border looks like smear, but on one side only.
  for (const FreeRows& side : {FreeRows{rows.top, 0}, FreeRows{0, rows.bottom}}) {
    if (side.top + side.bottom == 0) continue;
    Columns columns = columns_of(samples, side);
    columns.light = both.light;
    columns.light_rows = both.light_rows;
    Smear smear;
    double mean = 0;
    for (int c = 0; c < channels; ++c) {
      const auto fit = fit_share(samples, columns, c);
      if (!fit) return not_found(why, "no column has light and no saturated pixel");
      smear.fraction[at(c)] = fit->share;
      smear.sigma = std::max(smear.sigma, fit->sigma);
      mean += fit->share / channels;
    }
    const double own = 1 - mean * columns.light_rows;
    if (!(own > 0.1)) continue;
    for (double& f : smear.fraction) f = std::max(0.0, f / own);
    if (!found || smear.fraction[1] + smear.fraction[0] < found->fraction[1] + found->fraction[0])
      found = smear;
  }
  if (!found) return not_found(why, "what rows without flame show is no smear");
  const double most = *std::max_element(found->fraction.begin(), found->fraction.end());
  if (!(most > kSmearSigmas * found->sigma))
    return not_found(why, fmt::format("rows without flame show none: {:.1e} +- {:.1e} of a row's light", most,
                                      found->sigma));
  if (why != nullptr)
    *why = fmt::format("{:.2e} +- {:.0e} of every row's light of the column, by rows without flame", most,
                       found->sigma);
  return found;
}

TakeSmearOfRows taking_smear(const Smear& smear) {
  TakeSmearOfRows take;
  take.from_top = smear.path == SmearPath::rows_above;
  std::copy(smear.fraction.begin(), smear.fraction.end(), take.fraction);
  return take;
}

std::vector<float> remove_smear(Samples& samples, const Smear& smear) {
  if (smear.path == SmearPath::whole_column) {
    std::vector<float> columns = smear_of_columns(samples, smear);
    for (auto row = samples.value.begin(); row != samples.value.end();)
      for (const float more : columns) *row++ -= more;
    return columns;
  }
  TakeSmearOfRows take = taking_smear(smear);
  take.s = samples.view();
  take.value = samples.value.data();
  for (int x = 0; x < samples.size.width; ++x) take(at(x));
  return {};
}

}  // namespace emberlock::recon
