// SPDX-License-Identifier: Apache-2.0
#include "recon/render/in_scatter.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "recon/render/in_scatter_cuda.h"

namespace emberlock::recon {
namespace {

using Lights = std::vector<Rgba>;  ///< [row of the phase matrix][active point]
using Channels = std::array<double, 3>;

class Transport {
 public:
  Transport(const ScatterField& field, Pool& pool)
      : field_(field),
        pool_(pool),
        phase_(phase_matrix(field.phase, field.ordinates)),
        ordinates_(field.ordinates.size()),
        rows_(phase_.size() / ordinates_) {
    const Grid& g = field.medium.grid;
    reach_ = 1 + static_cast<std::size_t>(std::hypot(g.nx - 1, g.ny - 1, g.nz - 1));
    for (const Ordinate& o : field.ordinates)
      for (std::size_t i = 0; i < reach_; ++i)
        footsteps_.push_back(footstep({g.nx, g.ny, g.nz, nullptr}, o.travel, static_cast<int>(i)));
  }

  [[nodiscard]] std::size_t size() const { return rows_ * field_.medium.active.size(); }

  /// The in-scatter of the emission alone.
  Lights from_emission(Lights* radiance = nullptr) { return sweep(field_.medium.shine.data(), 0, radiance); }
  /// K g: the in-scatter of the light scattered with g.
  Lights from_scattered(const Lights& g) {
    set_shine(g, 0);
    return sweep(shine_.data(), field_.medium.shine.size(), nullptr);
  }
  /// Of both together.
  Lights from_all(const Lights& g, Lights* radiance) {
    set_shine(g, 1);
    return sweep(shine_.data(), field_.medium.shine.size(), radiance);
  }

  /// y += a x, with an a per channel.
  void add(Lights& y, const Channels& a, const Lights& x) const {
    pool_.run(kSlices, [&](int task) {
      const Slice s = slice(y.size(), kSlices, task);
      for (std::size_t e = s.begin; e < s.end; ++e)
        for (std::size_t c = 0; c < 3; ++c) y[e].c[c] += static_cast<float>(a[c]) * x[e].c[c];
    });
  }
  /// Sums over the medium with weight sigma_t (for which isotropic K is its own transpose), in a fixed order.
  [[nodiscard]] Channels dot(const Lights& x, const Lights& y) const {
    std::array<Channels, kSlices> part{};
    pool_.run(kSlices, [&](int task) {
      const Slice s = slice(field_.medium.active.size(), kSlices, task);
      Channels& sum = part[static_cast<std::size_t>(task)];
      for (std::size_t r = 0; r < rows_; ++r) {
        for (std::size_t n = s.begin; n < s.end; ++n) {
          const std::size_t e = r * field_.medium.active.size() + n;
          const double w = static_cast<double>(field_.medium.shine[field_.medium.active[n]].c[3]);
          for (std::size_t c = 0; c < 3; ++c)
            sum[c] += w * static_cast<double>(x[e].c[c]) * static_cast<double>(y[e].c[c]);
        }
      }
    });
    Channels sum{};
    for (const Channels& p : part)
      for (std::size_t c = 0; c < 3; ++c) sum[c] += p[c];
    return sum;
  }

 private:
  static constexpr int kSlices = 64;

  void set_shine(const Lights& g, float emission) {
    const std::size_t points = field_.medium.shine.size();
    const std::size_t active = field_.medium.active.size();
    shine_.resize(rows_ * points);
    pool_.run(static_cast<int>(rows_), [&](int task) {
      const auto row = static_cast<std::size_t>(task);
      for (std::size_t n = 0; n < active; ++n) {
        const Rgba& m = field_.medium.shine[field_.medium.active[n]];
        Rgba s = emission * m + (static_cast<float>(field_.albedo) * m.c[3]) * g[row * active + n];
        s.c[3] = m.c[3];
        shine_[row * points + field_.medium.active[n]] = s;
      }
    });
  }

  /// One march for each active point and ordinate; ordinate m sees shine + m * stride.
  Lights sweep(const Rgba* shine, std::size_t stride, Lights* keep) {
    const Grid& grid = field_.medium.grid;
    const std::size_t active = field_.medium.active.size();
    if (rows_ == 1) stride = 0;
    Lights out(size());
    if (keep != nullptr) keep->resize(ordinates_ * active);
    const ArriveAt arrive{
        {grid.nx, grid.ny, grid.nz, shine}, stride, field_.ordinates.data(), footsteps_.data(), reach_,
        field_.medium.active.data()};
    if constexpr (kCudaBuilt) {
      if (pool_.device() == Device::cuda) {
        sweep_on_cuda(
            {arrive, stride * (rows_ - 1) + field_.medium.shine.size(), ordinates_, active, &phase_}, out,
            keep);
        return out;
      }
    }
    constexpr std::size_t kBlock = 32;
    pool_.run(static_cast<int>((active + kBlock - 1) / kBlock), [&](int task) {
      const std::size_t begin = kBlock * static_cast<std::size_t>(task);
      const std::size_t count = std::min(kBlock, active - begin);
      std::vector<Rgba> radiance(ordinates_ * kBlock);
      for (std::size_t m = 0; m < ordinates_; ++m) {
        for (std::size_t n = 0; n < count; ++n) radiance[m * kBlock + n] = arrive(begin + n, m);
        if (keep != nullptr) std::copy_n(&radiance[m * kBlock], count, &(*keep)[m * active + begin]);
      }
      for (std::size_t r = 0; r < rows_; ++r)
        for (std::size_t n = 0; n < count; ++n)
          out[r * active + begin + n] =
              scattered(&phase_[r * ordinates_], &radiance[n], kBlock, static_cast<int>(ordinates_));
    });
    return out;
  }

  const ScatterField& field_;
  Pool& pool_;
  std::vector<float> phase_;
  std::size_t ordinates_;
  std::size_t rows_;
  std::size_t reach_;                ///< number of steps along the longest path
  std::vector<Footstep> footsteps_;  ///< [ordinate][step]
  std::vector<Rgba> shine_;          ///< [row][key point]
};

Channels largest(const Lights& x) {
  Channels high{};
  for (const Rgba& v : x)
    for (std::size_t c = 0; c < 3; ++c) high[c] = std::max(high[c], std::abs(static_cast<double>(v.c[c])));
  return high;
}

/// Bound on the error of g, relative to the brightest g, if the next iterate differs by `change`: |K| is at
/// most `contraction` in the maximum norm, so the rest of the geometric series is at most c / (1 - c) times
/// the last change.
double relative_error(const Lights& change, const Lights& g, double contraction) {
  const Channels d = largest(change);
  const Channels high = largest(g);
  double worst = 0;
  for (std::size_t c = 0; c < 3; ++c)
    if (high[c] > 0) worst = std::max(worst, d[c] / high[c]);
  return worst * contraction / (1 - contraction);
}

Channels ratio(const Channels& a, const Channels& b, double sign) {
  Channels out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = b[c] > 0 ? sign * a[c] / b[c] : 0;
  return out;
}

/// (1 - K) q = p of Orthomin(1): the change of the residual along r, made orthogonal to the previous one.
Lights through_medium(Transport& transport, const Lights& r) {
  Lights q = transport.from_scattered(r);
  for (std::size_t e = 0; e < q.size(); ++e) q[e] = r[e] - q[e];
  return q;
}

/// Solves g = s + K g, starting with g = s; returns the number of iterations.
int iterate(Transport& transport, double contraction, const InScatterOptions& options, Lights& g) {
  Lights r = transport.from_scattered(g);
  Lights p = r;
  Lights q = through_medium(transport, r);
  int iteration = 1;
  for (;; ++iteration) {
    const Channels length = transport.dot(q, q);
    const Channels step = ratio(transport.dot(r, q), length, 1);
    transport.add(g, step, p);
    transport.add(r, ratio(transport.dot(r, q), length, -1), q);
    if (iteration >= options.max_iterations || relative_error(r, g, contraction) <= options.tolerance) break;
    const Lights image = through_medium(transport, r);
    const Channels back = ratio(transport.dot(image, q), length, -1);
    Lights next_p = r;
    transport.add(next_p, back, p);
    p = std::move(next_p);
    Lights next_q = image;
    transport.add(next_q, back, q);
    q = std::move(next_q);
  }
  return iteration;
}

void solve_multiple(Transport& transport, const InScatterOptions& options, Lights g, ScatterField& field) {
  // Lane 3 of the first sweep is the mean share 1 - T absorbed on the way: times the albedo, this is K 1.
  double ends = 0;
  for (const Rgba& v : g) ends = std::max(ends, static_cast<double>(v.c[3]));
  const double contraction = std::min(field.albedo * ends, 1 - 1e-6);
  field.iterations = iterate(transport, contraction, options, g);
  // One more plain iteration: G of non-negative light is non-negative, and its change is the true residual.
  for (Rgba& v : g) v = non_negative(v);
  Lights radiance;
  Lights final_g = transport.from_all(g, field.phase.isotropic() ? nullptr : &radiance);
  for (std::size_t e = 0; e < g.size(); ++e) g[e] = final_g[e] - g[e];
  field.error_bound = relative_error(g, final_g, contraction);
  field.light = field.phase.isotropic() ? std::move(final_g) : std::move(radiance);
}

}  // namespace

ScatterField find_in_scatter(const Volume& volume, const Hull& medium, const Effects& effects,
                             const InScatterOptions& options, Pool& pool) {
  ScatterField field;
  const Scattering& scattering = effects.scattering;
  if (scattering.order == Scattering::Order::none || scattering.albedo <= 0) return field;
  field.medium = coarse_medium(volume, medium, effects.extinction, options.voxels, pool);
  if (field.empty()) return field;
  field.order = scattering.order;
  field.albedo = scattering.albedo;
  const int levels = std::clamp(options.octant_levels, 1, 8);
  field.phase = split_phase(scattering.asymmetry, levels);
  field.ordinates = product_ordinates(levels);

  Transport transport(field, pool);
  Lights radiance;
  const bool keep = field.order == Scattering::Order::single && !field.phase.isotropic();
  Lights g0 = transport.from_emission(keep ? &radiance : nullptr);
  if (field.order == Scattering::Order::multiple)
    solve_multiple(transport, options, std::move(g0), field);
  else
    field.light = keep ? std::move(radiance) : std::move(g0);
  return field;
}

namespace {

WayToCamera way_to(const Eigen::Vector3d& camera_center, const Grid& grid) {
  WayToCamera way{grid.nx, grid.ny};
  for (int a = 0; a < 3; ++a)
    way.center[a] = (camera_center[a] - static_cast<double>(grid.origin[a])) / static_cast<double>(grid.edge);
  return way;
}

/// The source along the peak: the emission and, for multiple scattering, the light scattered by the blunt
/// part. Light scattered by the peak itself stays on its path and isn't lost, so sigma_t is reduced by that
/// share. (For a peak straight back, light reversed twice is treated as never reversed.)
std::vector<Rgba> shine_along_peak(const ScatterField& field, const std::vector<Rgba>& blunt) {
  std::vector<Rgba> shine = field.medium.shine;
  if (field.order == Scattering::Order::single) return shine;
  const auto back = static_cast<float>(field.albedo * (1 - field.phase.peak));
  for (const std::size_t at : field.medium.active) {
    const float sigma = field.medium.shine[at].c[3];
    shine[at] = shine[at] + (back * sigma) * blunt[at];
    shine[at].c[3] = sigma * static_cast<float>(1 - field.albedo * field.phase.peak);
  }
  return shine;
}

}  // namespace

std::vector<Rgba> in_scattered(const ScatterField& field, const Eigen::Vector3d& camera_center, Pool& pool) {
  const Grid& grid = field.medium.grid;
  const std::vector<std::size_t>& active = field.medium.active;
  std::vector<Rgba> out(grid.size());
  if (field.phase.isotropic()) {
    for (std::size_t n = 0; n < active.size(); ++n) {
      out[active[n]] = field.light[n];
      out[active[n]].c[3] = 0;
    }
    return out;
  }
  const auto at_active = [&](const auto& act) {
    if constexpr (kCudaBuilt) {
      if (pool.device() == Device::cuda) return at_active_on_cuda(act, field.light.size(), out);
    }
    constexpr std::size_t kBlock = 256;
    pool.run(static_cast<int>((active.size() + kBlock - 1) / kBlock), [&](int task) {
      const std::size_t begin = kBlock * static_cast<std::size_t>(task);
      for (std::size_t n = begin; n < std::min(active.size(), begin + kBlock); ++n) act(n);
    });
  };
  const WayToCamera way = way_to(camera_center, grid);
  const ScatteredTowards towards{field.phase.blunt, field.ordinates.data(),
                                 static_cast<int>(field.ordinates.size())};
  at_active(BluntTowards{way, towards, active.data(), active.size(), field.light.data(), out.data()});
  if (field.phase.peak <= 0) return out;
  const std::vector<Rgba> shine = shine_along_peak(field, out);
  at_active(MixPeak{way,
                    {grid.nx, grid.ny, grid.nz, shine.data()},
                    active.data(),
                    active.size(),
                    static_cast<float>(field.phase.peak),
                    field.phase.blunt.g < 0,
                    out.data()});
  return out;
}

}  // namespace emberlock::recon
