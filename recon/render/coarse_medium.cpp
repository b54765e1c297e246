// SPDX-License-Identifier: Apache-2.0
#include "recon/render/coarse_medium.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/Core>

#include "recon/hull/hull.h"
#include "recon/hull/ray_list.h"

namespace emberlock::recon {
namespace {

/// The weights of a fine voxel in the means around three coarse key points along one axis: the integral of a
/// key point's tent function over the voxel, divided by its integral over the grid. Such means preserve the
/// integral.
struct TentWeights {
  int first = 0;
  std::array<float, 3> weight{};
};

std::vector<TentWeights> tent_weights(double start, double size, int voxels, int key_points) {
  const auto cumulative = [](double u) {
    const double c = std::clamp(u, -1.0, 1.0);
    return c < 0 ? (1 + c) * (1 + c) / 2 : 1 - (1 - c) * (1 - c) / 2;
  };
  std::vector<TentWeights> out(static_cast<std::size_t>(voxels));
  for (int i = 0; i < voxels; ++i) {
    const double low = start + i * size;
    TentWeights& t = out[static_cast<std::size_t>(i)];
    t.first = std::clamp(static_cast<int>(std::floor(low)), 0, std::max(0, key_points - 3));
    for (int n = 0; n < std::min(3, key_points); ++n) {
      const int k = t.first + n;
      const double whole = k == 0 || k == key_points - 1 ? 0.5 : 1;
      t.weight[static_cast<std::size_t>(n)] =
          static_cast<float>((cumulative(low + size - k) - cumulative(low - k)) / whole);
    }
  }
  return out;
}

/// Averages fine voxels to coarse key points, one axis after another.
class Coarsening {
 public:
  Coarsening(const Volume& volume, const CroppedHull& crop, const Extinction& extinction, const Grid& coarse)
      : volume_(volume), crop_(crop), extinction_(extinction), coarse_(coarse) {
    const Grid& fine = crop.hull.grid;
    const int voxels[3] = {fine.nx - 1, fine.ny - 1, fine.nz - 1};
    const int key_points[3] = {coarse.nx, coarse.ny, coarse.nz};
    const double edge = static_cast<double>(coarse.edge);
    for (std::size_t a = 0; a < 3; ++a) {
      const double start =
          (static_cast<double>(fine.origin[a]) - static_cast<double>(coarse.origin[a])) / edge;
      axis_[a] = tent_weights(start, static_cast<double>(fine.edge) / edge, voxels[a], key_points[a]);
    }
  }

  std::vector<Rgba> operator()(std::vector<std::size_t>& active, Pool& pool) const {
    const auto plane = static_cast<std::size_t>(coarse_.nx) * static_cast<std::size_t>(coarse_.ny);
    const std::size_t layers = axis_[2].size();
    std::vector<Rgba> thin(plane * layers);
    pool.run(static_cast<int>(layers),
             [&](int k) { add_layer(k, &thin[plane * static_cast<std::size_t>(k)]); });
    std::vector<Rgba> out(coarse_.size());
    for (std::size_t k = 0; k < layers; ++k) {
      for (std::size_t n = 0; n < 3; ++n) {
        const float w = coarse_.edge * axis_[2][k].weight[n];
        if (w == 0) continue;
        Rgba* to = &out[plane * (static_cast<std::size_t>(axis_[2][k].first) + n)];
        for (std::size_t p = 0; p < plane; ++p) to[p] = to[p] + w * thin[plane * k + p];
      }
    }
    for (std::size_t i = 0; i < out.size(); ++i)
      if (out[i].c[3] > 0) active.push_back(i);
    sharpen(out);
    return out;
  }

 private:
  /// Averaging, followed by trilinear interpolation, blurs twice. Subtracting a sixth of the second
  /// difference undoes one of the two and preserves the integral; it is limited where values would become
  /// negative.
  void sharpen(std::vector<Rgba>& v) const {
    const int counts[3] = {coarse_.nx, coarse_.ny, coarse_.nz};
    std::size_t stride = 1;
    for (const int count : counts) {
      const auto n = static_cast<std::size_t>(count);
      const std::vector<Rgba> blurred = v;
      for (std::size_t at = 0; at < v.size(); ++at) {
        const std::size_t i = at / stride % n;
        const std::size_t low = i > 0 ? at - stride : at + stride;
        const std::size_t high = i + 1 < n ? at + stride : at - stride;
        v[at] = v[at] - (1.F / 6) * (blurred[low] + blurred[high] - 2.F * blurred[at]);
      }
      stride *= n;
    }
    for (Rgba& x : v) x = non_negative(x);
  }

  void add_layer(int k, Rgba* out) const {
    const Grid& fine = crop_.hull.grid;
    const std::uint8_t* inside =
        &crop_.hull.inside[axis_[0].size() * axis_[1].size() * static_cast<std::size_t>(k)];
    std::vector<Rgba> row(static_cast<std::size_t>(coarse_.nx) + 2);
    for (int j = 0; j < fine.ny - 1; ++j, inside += fine.nx - 1) {
      std::fill(row.begin(), row.end(), Rgba{});
      for (int i = 0; i < fine.nx - 1; ++i) {
        if (inside[i] == 0) continue;
        const Rgba v = voxel(i, j, k);
        const TentWeights& t = axis_[0][static_cast<std::size_t>(i)];
        for (std::size_t n = 0; n < 3; ++n) {
          Rgba& to = row[static_cast<std::size_t>(t.first) + n];
          to = to + t.weight[n] * v;
        }
      }
      const TentWeights& t = axis_[1][static_cast<std::size_t>(j)];
      for (std::size_t n = 0; n < 3; ++n) {
        if (t.weight[n] == 0) continue;
        Rgba* to = out + static_cast<std::size_t>(coarse_.nx) * (static_cast<std::size_t>(t.first) + n);
        for (std::size_t i = 0; i < static_cast<std::size_t>(coarse_.nx); ++i)
          to[i] = to[i] + t.weight[n] * row[i];
      }
    }
  }

  /// A fine voxel's mean, per metre.
  [[nodiscard]] Rgba voxel(int i, int j, int k) const {
    const bool field = extinction_.model == Extinction::Model::field;
    Rgba sum;
    for (int c = 0; c < 8; ++c) {
      const std::size_t at = volume_.grid.index(
          crop_.offset[0] + i + (c & 1), crop_.offset[1] + j + (c >> 1 & 1), crop_.offset[2] + k + (c >> 2));
      const float* e = &volume_.emission[3 * at];
      sum = sum + Rgba{{e[0], e[1], e[2], field ? volume_.extinction[at] : 0.F}};
    }
    sum = 0.125F * sum;
    if (!field) sum.c[3] = static_cast<float>(extinction_.value.value());
    return sum;
  }

  const Volume& volume_;
  const CroppedHull& crop_;
  const Extinction& extinction_;
  const Grid& coarse_;
  std::array<std::vector<TentWeights>, 3> axis_;
};

}  // namespace

CoarseMedium coarse_medium(const Volume& volume, const Hull& medium, const Extinction& extinction, int voxels,
                           Pool& pool) {
  CoarseMedium out;
  if (medium.count == 0 || extinction.model == Extinction::Model::none) return out;
  const CroppedHull crop = crop_to_medium(medium);
  const Grid& fine = crop.hull.grid;
  const Eigen::Vector3d size =
      static_cast<double>(fine.edge) * Eigen::Vector3d(fine.nx - 1, fine.ny - 1, fine.nz - 1);
  const Eigen::Vector3d low(fine.origin[0], fine.origin[1], fine.origin[2]);
  const int longest = std::max({fine.nx, fine.ny, fine.nz}) - 1;
  out.grid = grid_over({low + size / 2, size}, std::clamp(voxels, 1, longest));
  out.shine = Coarsening(volume, crop, extinction, out.grid)(out.active, pool);
  return out;
}

}  // namespace emberlock::recon
