// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/volume_flow.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>

#include <Eigen/Dense>

namespace emberlock::recon {
namespace {

constexpr int kFinestFlow = 48;     // points along the longest side, at most
constexpr int kCoarsestFlow = 12;   // no level has fewer
constexpr int kWarps = 4;           // a level
constexpr int kReach = 2;           // of the window over which a point's displacement is even, points
constexpr float kMostAWarp = 1.5F;  // points
constexpr float kFirm = 0.01F;      // by which nothing moves, over the mean of the squared gradient

/// Values at the points of a grid, or vectors one after the other.
struct Field {
  int nx = 1, ny = 1, nz = 1, lanes = 1;
  std::vector<float> values = {};

  Field(int x, int y, int z, int of)
      : nx(x), ny(y), nz(z), lanes(of), values(points() * static_cast<std::size_t>(of)) {}
  [[nodiscard]] std::size_t points() const {
    return static_cast<std::size_t>(nx) * static_cast<std::size_t>(ny) * static_cast<std::size_t>(nz);
  }
  [[nodiscard]] std::size_t index(int i, int j, int k) const {
    return static_cast<std::size_t>(i) +
           static_cast<std::size_t>(nx) *
               (static_cast<std::size_t>(j) + static_cast<std::size_t>(ny) * static_cast<std::size_t>(k));
  }
  [[nodiscard]] float* at(int i, int j, int k) {
    return &values[index(i, j, k) * static_cast<std::size_t>(lanes)];
  }
  [[nodiscard]] const float* at(int i, int j, int k) const {
    return &values[index(i, j, k) * static_cast<std::size_t>(lanes)];
  }
};

/// Calls act(i, j, k) for every point, a plane a task.
template <class Act>
void each_point(const Field& field, Pool& pool, const Act& act) {
  pool.run(field.nz, [&](int k) {
    for (int j = 0; j < field.ny; ++j)
      for (int i = 0; i < field.nx; ++i) act(i, j, k);
  });
}

/// Trilinear, at a place in points; beyond the border what is at it.
template <int kLanes>
std::array<float, kLanes> sample(const Field& field, const std::array<float, 3>& place) {
  const int size[3] = {field.nx, field.ny, field.nz};
  int low[3];
  float part[3];
  for (std::size_t a = 0; a < 3; ++a) {
    const float inside = std::clamp(place[a], 0.F, static_cast<float>(size[a] - 1));
    low[a] = std::min(static_cast<int>(inside), std::max(0, size[a] - 2));
    part[a] = inside - static_cast<float>(low[a]);
  }
  std::array<float, kLanes> sum{};
  for (int corner = 0; corner < 8; ++corner) {
    float weight = 1;
    int at[3];
    for (int a = 0; a < 3; ++a) {
      const int high = corner >> a & 1;
      weight *= high != 0 ? part[a] : 1 - part[a];
      at[a] = std::min(low[a] + high, size[a] - 1);
    }
    const float* values = field.at(at[0], at[1], at[2]);
    for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += weight * values[lane];
  }
  return sum;
}

/// Means over blocks of factor^3 points.
Field shrunk(const Field& fine, int factor, Pool& pool) {
  const auto part = [&](int n) { return (n + factor - 1) / factor; };
  Field coarse(part(fine.nx), part(fine.ny), part(fine.nz), 1);
  each_point(coarse, pool, [&](int i, int j, int k) {
    float sum = 0;
    int count = 0;
    for (int z = k * factor; z < std::min(fine.nz, (k + 1) * factor); ++z)
      for (int y = j * factor; y < std::min(fine.ny, (j + 1) * factor); ++y)
        for (int x = i * factor; x < std::min(fine.nx, (i + 1) * factor); ++x, ++count)
          sum += *fine.at(x, y, z);
    *coarse.at(i, j, k) = sum / static_cast<float>(count);
  });
  return coarse;
}

/// Means over 2 reach + 1 points along each axis, one axis after the other; beyond the border there is
/// nothing.
Field blurred(Field field, Pool& pool) {
  for (int axis = 0; axis < 3; ++axis) {
    Field out(field.nx, field.ny, field.nz, field.lanes);
    const int size[3] = {field.nx, field.ny, field.nz};
    each_point(field, pool, [&](int i, int j, int k) {
      float* to = out.at(i, j, k);
      const int place[3] = {i, j, k};
      for (int d = -kReach; d <= kReach; ++d) {
        int from[3] = {i, j, k};
        from[axis] = place[axis] + d;
        if (from[axis] < 0 || from[axis] >= size[axis]) continue;
        const float* values = field.at(from[0], from[1], from[2]);
        for (int lane = 0; lane < field.lanes; ++lane) to[lane] += values[lane] / (2 * kReach + 1);
      }
    });
    field = std::move(out);
  }
  return field;
}

Field light_of(const Volume& volume, Pool& pool) {
  const Grid& g = volume.grid;
  Field light(g.nx, g.ny, g.nz, 1);
  each_point(light, pool, [&](int i, int j, int k) {
    const float* rgb = &volume.emission[3 * g.index(i, j, k)];
    *light.at(i, j, k) = rgb[0] + rgb[1] + rgb[2];
  });
  return light;
}

std::array<float, 3> upstream(const Field& flow, int i, int j, int k) {
  const float* u = flow.at(i, j, k);
  return {static_cast<float>(i) - u[0], static_cast<float>(j) - u[1], static_cast<float>(k) - u[2]};
}

/// One improvement of the flow, in points: `after` is explained by `before` as the flow carries it.
void improve(const Field& before, const Field& after, Field& flow, Pool& pool) {
  Field carried(after.nx, after.ny, after.nz, 1);
  each_point(after, pool, [&](int i, int j, int k) {
    *carried.at(i, j, k) = sample<1>(before, upstream(flow, i, j, k))[0];
  });
  // The gradient's products, and with what is not explained.
  Field terms(after.nx, after.ny, after.nz, 9);
  each_point(after, pool, [&](int i, int j, int k) {
    const auto slope = [&](int di, int dj, int dk) {
      const auto mean = [&](int sign) {
        const int x = std::clamp(i + sign * di, 0, after.nx - 1);
        const int y = std::clamp(j + sign * dj, 0, after.ny - 1);
        const int z = std::clamp(k + sign * dk, 0, after.nz - 1);
        return 0.5F * (*carried.at(x, y, z) + *after.at(x, y, z));
      };
      return 0.5F * (mean(1) - mean(-1));
    };
    const float g[3] = {slope(1, 0, 0), slope(0, 1, 0), slope(0, 0, 1)};
    const float missing = *after.at(i, j, k) - *carried.at(i, j, k);
    float* t = terms.at(i, j, k);
    std::size_t n = 0;
    for (int a = 0; a < 3; ++a)
      for (int b = a; b < 3; ++b) t[n++] = g[a] * g[b];
    for (int a = 0; a < 3; ++a) t[n++] = g[a] * missing;
  });
  terms = blurred(std::move(terms), pool);
  double squared = 0;
  std::size_t lit = 0;
  for (std::size_t p = 0; p < terms.points(); ++p) {
    const float* t = &terms.values[9 * p];
    const float here = t[0] + t[3] + t[5];
    squared += static_cast<double>(here);
    lit += here > 0 ? 1 : 0;
  }
  if (lit == 0) return;
  const float firm = kFirm * static_cast<float>(squared / static_cast<double>(lit));
  each_point(after, pool, [&](int i, int j, int k) {
    const float* t = terms.at(i, j, k);
    Eigen::Matrix3f products;
    products << t[0] + firm, t[1], t[2], t[1], t[3] + firm, t[4], t[2], t[4], t[5] + firm;
    const Eigen::Vector3f more = -products.ldlt().solve(Eigen::Vector3f(t[6], t[7], t[8]));
    if (!more.allFinite()) return;
    for (int a = 0; a < 3; ++a) flow.at(i, j, k)[a] += std::clamp(more[a], -kMostAWarp, kMostAWarp);
  });
}

/// The flow of a level half as fine, on this one.
Field refined(const Field& coarse, const Field& like, Pool& pool) {
  Field fine(like.nx, like.ny, like.nz, 3);
  each_point(fine, pool, [&](int i, int j, int k) {
    const auto place = [](int at) { return 0.5F * (static_cast<float>(at) - 0.5F); };
    const std::array<float, 3> from = sample<3>(coarse, {place(i), place(j), place(k)});
    for (std::size_t a = 0; a < 3; ++a) fine.at(i, j, k)[a] = 2 * from[a];
  });
  return fine;
}

}  // namespace

VolumeFlow find_flow(const Volume& before, const Volume& after, Pool& pool) {
  const Grid& g = after.grid;
  const auto longest = [](const Field& f) { return std::max({f.nx, f.ny, f.nz}); };
  std::vector<std::array<Field, 2>> levels = {{light_of(before, pool), light_of(after, pool)}};
  const int factor = (longest(levels[0][0]) + kFinestFlow - 1) / kFinestFlow;
  for (Field& light : levels[0]) light = shrunk(light, factor, pool);
  while (longest(levels.back()[0]) >= 2 * kCoarsestFlow)
    levels.push_back({shrunk(levels.back()[0], 2, pool), shrunk(levels.back()[1], 2, pool)});
  const Field& coarsest = levels.back()[0];
  Field flow(coarsest.nx, coarsest.ny, coarsest.nz, 3);
  for (std::size_t l = levels.size(); l-- > 0;) {
    if (l + 1 < levels.size()) flow = refined(flow, levels[l][0], pool);
    for (int w = 0; w < kWarps; ++w) improve(levels[l][0], levels[l][1], flow, pool);
    flow = blurred(std::move(flow), pool);
  }
  VolumeFlow found;
  found.grid = g;
  found.grid.nx = flow.nx;
  found.grid.ny = flow.ny;
  found.grid.nz = flow.nz;
  found.grid.edge = g.edge * static_cast<float>(factor);
  for (int a = 0; a < 3; ++a)
    found.grid.origin[a] = g.origin[a] + 0.5F * g.edge * static_cast<float>(factor - 1);
  found.move = std::move(flow.values);
  for (float& v : found.move) v *= found.grid.edge;
  return found;
}

Volume carried(const Volume& volume, const VolumeFlow& flow, Pool& pool) {
  const Grid& g = volume.grid;
  Field moves(flow.grid.nx, flow.grid.ny, flow.grid.nz, 3);
  moves.values = flow.move;
  Field light(g.nx, g.ny, g.nz, 3);
  light.values = volume.emission;
  Field thick(g.nx, g.ny, g.nz, 1);
  if (!volume.extinction.empty()) thick.values = volume.extinction;
  Volume next{g, std::vector<float>(volume.emission.size()), std::vector<float>(volume.extinction.size())};
  each_point(light, pool, [&](int i, int j, int k) {
    std::array<float, 3> place{};
    const std::array<float, 3> at = {static_cast<float>(i), static_cast<float>(j), static_cast<float>(k)};
    for (std::size_t a = 0; a < 3; ++a)
      place[a] = (g.origin[a] + g.edge * at[a] - flow.grid.origin[a]) / flow.grid.edge;
    const std::array<float, 3> move = sample<3>(moves, place);
    std::array<float, 3> from{};
    for (std::size_t a = 0; a < 3; ++a) from[a] = at[a] - move[a] / g.edge;
    const std::size_t p = g.index(i, j, k);
    const std::array<float, 3> rgb = sample<3>(light, from);
    std::copy(rgb.begin(), rgb.end(), &next.emission[3 * p]);
    if (!next.extinction.empty()) next.extinction[p] = sample<1>(thick, from)[0];
  });
  return next;
}

}  // namespace emberlock::recon
