// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/gaussian_splats/splat_fit.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/random.h"

namespace emberlock::paper {
namespace {

// A splat isn't made narrower than half a voxel edge, which key points couldn't show.
constexpr float kSharpest = 2;
constexpr float kBluntest = 0.05F;

/// Sums over the views, in their order, of what `make` puts for each.
template <class Make>
std::vector<Splat> summed_over(const std::vector<SplatView>& views, std::size_t splats, recon::Pool& pool,
                               const Make& make) {
  std::vector<std::vector<Splat>> of_view(views.size(), std::vector<Splat>(splats));
  pool.run(static_cast<int>(views.size()), [&](int task) {
    const auto v = static_cast<std::size_t>(task);
    make(views[v], of_view[v]);
  });
  for (std::size_t v = 1; v < of_view.size(); ++v)
    for (std::size_t s = 0; s < splats; ++s)
      for (std::size_t n = 0; n < Splat{}.size(); ++n) of_view[0][s][n] += of_view[v][s][n];
  return of_view.empty() ? std::vector<Splat>(splats) : std::move(of_view[0]);
}

/// The gradient of half the squared differences over one picture of each view.
std::vector<Splat> gradient_of(const Splats& splats, const std::vector<SplatView>& views, std::size_t picture,
                               recon::Pool& pool) {
  return summed_over(views, splats.all.size(), pool, [&](const SplatView& view, std::vector<Splat>& sum) {
    const SplatPicture& p = view.pictures[picture % view.pictures.size()];
    SplatLight residual = show(splats, view, p);
    for (std::size_t c = 0; c < 3; ++c)
      for (int row = 0; row < p.rows; ++row)
        for (int column = 0; column < p.pitch; ++column) {
          const std::size_t at = static_cast<std::size_t>(row) * static_cast<std::size_t>(p.pitch) +
                                 static_cast<std::size_t>(column);
          residual[c][at] = column < p.columns ? residual[c][at] - p.seen[c][at] : 0;
        }
    add_gradient(splats, view, p, residual, sum);
  });
}

/// Adam's moments of each number of each splat.
class Adam {
 public:
  explicit Adam(std::size_t splats) : moments_(splats) {}

  void step(const std::vector<Splat>& gradient, float rate, std::vector<Splat>& splats) {
    ++steps_;
    const float unbias_mean = 1 - std::pow(kMean, static_cast<float>(steps_));
    const float unbias_square = 1 - std::pow(kSquare, static_cast<float>(steps_));
    for (std::size_t s = 0; s < splats.size(); ++s) {
      Moments& m = moments_[s];
      for (std::size_t n = 0; n < Splat{}.size(); ++n) {
        const float g = gradient[s][n];
        m.mean[n] = kMean * m.mean[n] + (1 - kMean) * g;
        m.square[n] = kSquare * m.square[n] + (1 - kSquare) * g * g;
        splats[s][n] -= rate * kRates[n] * (m.mean[n] / unbias_mean) /
                        (std::sqrt(m.square[n] / unbias_square) + kSmallest);
      }
      keep_in_bounds(splats[s]);
    }
  }
  /// Those of splat s of the new ones are those of splat from[s] of the old ones, or none where it is beyond.
  void rearrange(const std::vector<std::size_t>& from) {
    std::vector<Moments> moments(from.size());
    for (std::size_t s = 0; s < from.size(); ++s)
      if (from[s] < moments_.size()) moments[s] = moments_[from[s]];
    moments_ = std::move(moments);
  }

 private:
  static constexpr float kMean = 0.9F, kSquare = 0.99F, kSmallest = 1e-8F;
  static constexpr Splat kRates = {0.1F,  0.1F,  0.1F,  0.04F, 0.04F, 0.04F,
                                   0.02F, 0.02F, 0.02F, 0.1F,  0.1F,  0.1F};
  struct Moments {
    Splat mean = {}, square = {};
  };

  static void keep_in_bounds(Splat& splat) {
    for (std::size_t a = 0; a < 3; ++a) {
      float& sharpness = splat[kSharpness + a];
      sharpness = std::clamp(sharpness, std::log(kBluntest), std::log(kSharpest));
      splat[kShear + a] = std::clamp(splat[kShear + a], -kSharpest, kSharpest);
      splat[kLight + a] = std::max(splat[kLight + a], -14.F);
    }
  }

  std::vector<Moments> moments_;
  int steps_ = 0;
};

float shine_of(const Splat& splat) {
  const std::array<float, 3> light = light_of(splat, 1);
  return volume_of(splat) * (light[0] + light[1] + light[2]);
}

void scale_light(Splat& splat, float by) {
  const std::array<float, 3> light = light_of(splat, 1);
  for (std::size_t c = 0; c < 3; ++c) splat[kLight + c] = number_of_light(by * light[c], 1);
}

/// A place drawn from the splat's own distribution: c + W^-1 n, n standard normal.
void move_at_random(Splat& splat, RandomStream& random) {
  const std::array<float, 6> w = sharpness_of(splat);
  float n[3];
  for (float& value : n) value = static_cast<float>(random.normal());
  const float x = n[0] / w[0];
  const float y = (n[1] - w[1] * x) / w[2];
  const float z = (n[2] - w[3] * x - w[4] * y) / w[5];
  splat[kCentre] += x;
  splat[kCentre + 1] += y;
  splat[kCentre + 2] += z;
}

/// Two in place of one, with its light: a wide one (Kerbl: "over-reconstruction") becomes two narrower ones
/// at places drawn from it, a narrow one ("under-reconstruction") is there twice.
std::array<Splat, 2> two_of(const Splat& splat, RandomStream& random) {
  constexpr float kWide = 15.75F * 1.5F * 1.5F * 1.5F;  // volume_of() one whose sigma is 1.5 voxel edges
  constexpr float kNarrower = 1.6F;                     // Kerbl's
  std::array<Splat, 2> two = {splat, splat};
  const bool wide = volume_of(splat) > kWide;
  for (Splat& half : two) {
    scale_light(half, wide ? 0.5F * kNarrower * kNarrower * kNarrower : 0.5F);
    if (!wide) continue;
    move_at_random(half, random);
    for (std::size_t a = 0; a < 3; ++a) {
      half[kSharpness + a] += std::log(kNarrower);
      half[kShear + a] *= kNarrower;
    }
  }
  return two;
}

/// Prunes and densifies; `pull` is how much each splat's centre was drawn since the last time.
void control_density(const std::vector<float>& pull, std::size_t most, RandomStream& random, Splats& splats,
                     Adam& adam) {
  constexpr float kDark = 0.02F;              // of the mean shine
  constexpr std::size_t kPartThatSplits = 3;  // at most a third of them a time
  std::vector<float> shine(splats.all.size());
  std::transform(splats.all.begin(), splats.all.end(), shine.begin(), shine_of);
  const float mean = std::accumulate(shine.begin(), shine.end(), 0.F) /
                     static_cast<float>(std::max<std::size_t>(1, shine.size()));
  std::vector<std::size_t> from;
  for (std::size_t s = 0; s < shine.size(); ++s)
    if (shine[s] > kDark * mean) from.push_back(s);
  std::vector<Splat> all;
  all.reserve(2 * from.size());
  for (const std::size_t s : from) all.push_back(splats.all[s]);

  std::vector<std::size_t> by_pull(from.size());
  std::iota(by_pull.begin(), by_pull.end(), std::size_t{0});
  std::stable_sort(by_pull.begin(), by_pull.end(),
                   [&](std::size_t a, std::size_t b) { return pull[from[a]] > pull[from[b]]; });
  const std::size_t room = most > all.size() ? most - all.size() : 0;
  by_pull.resize(std::min(room, by_pull.size() / kPartThatSplits));
  for (const std::size_t s : by_pull) {
    const std::array<Splat, 2> two = two_of(all[s], random);
    all[s] = two[0];
    all.push_back(two[1]);
    from[s] = shine.size();  // its moments were another one's
    from.push_back(shine.size());
  }
  splats.all = std::move(all);
  adam.rearrange(from);
}

/// About `count` of them in the hull, one beside the other.
Splats lattice_in(const recon::Hull& hull, std::size_t count) {
  const recon::Grid& g = hull.grid;
  const double share = static_cast<double>(hull.count) / static_cast<double>(std::max<std::size_t>(1, count));
  const int spacing = std::max(1, static_cast<int>(std::lround(std::cbrt(share))));
  constexpr float kWidth = 0.6F;  // sigma over spacing
  Splat splat = {};
  for (std::size_t a = 0; a < 3; ++a) splat[kSharpness + a] = -std::log(kWidth * static_cast<float>(spacing));
  Splats splats;
  for (int k = spacing / 2; k < g.nz - 1; k += spacing)
    for (int j = spacing / 2; j < g.ny - 1; j += spacing)
      for (int i = spacing / 2; i < g.nx - 1; i += spacing) {
        const std::size_t voxel = static_cast<std::size_t>(i) +
                                  static_cast<std::size_t>(g.nx - 1) *
                                      (static_cast<std::size_t>(j) +
                                       static_cast<std::size_t>(g.ny - 1) * static_cast<std::size_t>(k));
        if (hull.inside[voxel] == 0) continue;
        splat[kCentre] = static_cast<float>(i) + 0.5F;
        splat[kCentre + 1] = static_cast<float>(j) + 0.5F;
        splat[kCentre + 2] = static_cast<float>(k) + 0.5F;
        splats.all.push_back(splat);
      }
  return splats;
}

/// The light alone, by steps of A^T b over A^T A x (image space reconstruction, Daube-Witherspoon and
/// Muehllehner 1986): never negative, towards the least squares.
void brighten(const std::vector<SplatView>& views, int steps, Splats& splats, recon::Pool& pool) {
  for (int step = 0; step < steps; ++step) {
    // The slopes by the light numbers are those by the light times the same factor, which cancels.
    const auto back = [&](bool of_seen) {
      return summed_over(views, splats.all.size(), pool, [&](const SplatView& view, std::vector<Splat>& sum) {
        const SplatPicture& p = view.pictures[static_cast<std::size_t>(step) % view.pictures.size()];
        add_gradient(splats, view, p, of_seen ? p.seen : show(splats, view, p), sum);
      });
    };
    const std::vector<Splat> seen = back(true);
    const std::vector<Splat> shown = back(false);
    for (std::size_t s = 0; s < splats.all.size(); ++s) {
      const std::array<float, 3> light = light_of(splats.all[s], 1);
      for (std::size_t c = 0; c < 3; ++c) {
        const float ratio = shown[s][kLight + c] > 0 ? seen[s][kLight + c] / shown[s][kLight + c] : 0;
        splats.all[s][kLight + c] = number_of_light(light[c] * ratio, 1);
      }
    }
  }
}

/// A unit of the mean light, about which log(1 + exp(x)) turns.
void choose_unit(Splats& splats) {
  double sum = 0;
  for (const Splat& splat : splats.all)
    for (const float light : light_of(splat, splats.unit)) sum += static_cast<double>(light);
  const auto unit =
      static_cast<float>(sum / static_cast<double>(3 * std::max<std::size_t>(1, splats.all.size())));
  if (!(unit > 0)) return;
  for (Splat& splat : splats.all) {
    const std::array<float, 3> light = light_of(splat, splats.unit);
    for (std::size_t c = 0; c < 3; ++c) splat[kLight + c] = number_of_light(light[c], unit);
  }
  splats.unit = unit;
}

}  // namespace

Splats splats_in(const recon::Hull& hull, const std::vector<SplatView>& views, std::size_t count,
                 recon::Pool& pool) {
  constexpr int kSteps = 10;
  Splats splats = lattice_in(hull, count);
  brighten(views, kSteps, splats, pool);
  choose_unit(splats);
  return splats;
}

SplatFit fit_splats(const recon::Hull& hull, const std::vector<SplatView>& views,
                    const SplatFitOptions& options, recon::Pool& pool) {
  constexpr int kControls = 5;       // of the density, in the first half of the steps
  constexpr float kLastRate = 0.1F;  // of the first
  SplatFit fit{splats_in(hull, views, options.first, pool), 0};
  Adam adam(fit.splats.all.size());
  const auto most = static_cast<std::size_t>(options.growth * static_cast<double>(fit.splats.all.size()));
  RandomStream random(options.seed, 0);
  std::vector<float> pull(fit.splats.all.size());
  const int between = std::max(1, options.iterations / (2 * kControls));
  while (fit.iterations < options.iterations && !(options.stop && options.stop())) {
    const auto done = static_cast<float>(fit.iterations) / static_cast<float>(options.iterations);
    const std::vector<Splat> gradient =
        gradient_of(fit.splats, views, static_cast<std::size_t>(fit.iterations), pool);
    for (std::size_t s = 0; s < pull.size(); ++s)
      pull[s] += std::hypot(gradient[s][kCentre], gradient[s][kCentre + 1], gradient[s][kCentre + 2]);
    adam.step(gradient, std::pow(kLastRate, done), fit.splats.all);
    ++fit.iterations;
    if (fit.iterations % between == 0 && fit.iterations <= kControls * between) {
      control_density(pull, most, random, fit.splats, adam);
      pull.assign(fit.splats.all.size(), 0);
    }
  }
  return fit;
}

}  // namespace emberlock::paper
