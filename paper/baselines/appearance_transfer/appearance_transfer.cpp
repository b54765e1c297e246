// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/appearance_transfer/appearance_transfer.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include <Eigen/Core>

#include "recon/compute/pool.h"
#include "recon/hull/hull.h"

namespace emberlock::paper {
namespace {

constexpr double kLeastAcross = 0.17;  // sine of 10 degrees between two views
constexpr double kApart = 20;          // most degrees between neighbouring views, filmed or novel
constexpr int kFirstPasses = 40;       // of the tomography of the input views
constexpr int kRounds = 6;
constexpr int kPasses = 5;            // of the tomography in each round
constexpr double kNovelWeight = 0.5;  // of all novel views, where all input views have 1
constexpr float kFaint = 0.05F;       // grey levels, added to both sides of a ratio of light
constexpr float kMostRatio = 4;

/// The direction of a view's rays as an angle of 0..180 degrees.
double angle_of(const Eigen::Vector2d& across) {
  const double degrees = std::atan2(across.y(), across.x()) * 180 / std::numbers::pi;
  return degrees < 0 ? degrees + 180 : degrees >= 180 ? degrees - 180 : degrees;
}

/// The picture from the opposite side.
ParallelPicture mirrored(const ParallelPicture& picture, const ParallelSlices& slices) {
  ParallelPicture out{-picture.across, picture.light};
  for (std::size_t at = 0; at < out.light.size(); at += 3)
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t row = at / slices.profile() * slices.profile();
      out.light[at + c] = picture.light[row + slices.profile() - 3 - (at - row) + c];
    }
  return out;
}

/// Pictures of input views from the side on which their angle is below 180 degrees, sorted by it.
std::vector<ParallelPicture> by_angle(std::vector<ParallelPicture> pictures, const ParallelSlices& slices) {
  for (ParallelPicture& picture : pictures)
    if (picture.across.y() < 0 || (picture.across.y() == 0 && picture.across.x() < 0))
      picture = mirrored(picture, slices);
  std::sort(pictures.begin(), pictures.end(), [](const ParallelPicture& a, const ParallelPicture& b) {
    return angle_of(a.across) < angle_of(b.across);
  });
  return pictures;
}

/// One channel of a picture.
std::vector<float> channel_of(const std::vector<float>& light, std::size_t channel) {
  std::vector<float> out(light.size() / 3);
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = light[3 * i + channel];
  return out;
}

using Appearances = std::array<Appearance, 3>;  // of the channels

Appearances appearances_of(const SteerablePyramid& pyramid, const ParallelPicture& picture) {
  return {appearance_of(pyramid, channel_of(picture.light, 0)),
          appearance_of(pyramid, channel_of(picture.light, 1)),
          appearance_of(pyramid, channel_of(picture.light, 2))};
}

/// A view that nobody filmed, and what it should look like.
struct NovelView {
  ParallelPicture picture;
  Appearances looks;
};

/// Novel views in the gaps between input views sorted by_angle().
std::vector<NovelView> novel_views(const std::vector<ParallelPicture>& inputs, const ParallelSlices& slices,
                                   const SteerablePyramid& pyramid) {
  std::vector<NovelView> novel;
  for (std::size_t n = 0; n < inputs.size(); ++n) {
    const bool last = n + 1 == inputs.size();
    // Behind the last one the first one follows, seen from the other side.
    const ParallelPicture next = last ? mirrored(inputs[0], slices) : inputs[n + 1];
    const double from = angle_of(inputs[n].across);
    const double gap = angle_of(last ? inputs[0].across : next.across) + (last ? 180 : 0) - from;
    const int views = static_cast<int>(std::ceil(gap / kApart)) - 1;
    if (views < 1) continue;
    const Appearances first = appearances_of(pyramid, inputs[n]);
    const Appearances second = appearances_of(pyramid, next);
    for (int v = 1; v <= views; ++v) {
      const double part = static_cast<double>(v) / (views + 1);
      const double angle = (from + part * gap) * std::numbers::pi / 180;
      novel.push_back({{{std::cos(angle), std::sin(angle)}, std::vector<float>(inputs[n].light.size())},
                       {between(first[0], second[0], part), between(first[1], second[1], part),
                        between(first[2], second[2], part)}});
    }
  }
  return novel;
}

/// A picture that a volume should show, and how much that counts.
struct Aim {
  const ParallelPicture* picture;
  ParallelProjector projector;
  float weight;  ///< they add up to 1
};

/// The key points of a slice that aren't dark.
std::vector<std::uint32_t> lit_points(const ParallelSlices& slices, const float* layer) {
  std::vector<std::uint32_t> points;
  for (std::size_t p = 0; 3 * p < slices.layer(); ++p)
    if (std::max({layer[3 * p], layer[3 * p + 1], layer[3 * p + 2]}) > 0)
      points.push_back(static_cast<std::uint32_t>(p));
  return points;
}

/// Where to start from in layer k: even light in all places where every input view has some.
void light_up(const ParallelSlices& slices, const std::vector<Aim>& inputs, int k, float* layer) {
  std::vector<std::uint32_t> points(slices.layer() / 3);
  std::iota(points.begin(), points.end(), 0U);
  std::vector<float> rays(slices.profile());
  std::vector<float> lit(slices.layer());
  std::fill_n(layer, slices.layer(), 1.F);
  for (const Aim& input : inputs) {
    const float* seen = input.picture->light.data() + static_cast<std::size_t>(k) * slices.profile();
    for (std::size_t i = 0; i < rays.size(); ++i) rays[i] = seen[i] > kFaint ? 1.F : 0.F;
    std::fill(lit.begin(), lit.end(), 0.F);
    input.projector.back_project(rays.data(), points, lit.data());
    for (std::size_t i = 0; i < lit.size(); ++i)
      if (lit[i] <= 0) layer[i] = 0;
  }
}

/// Simultaneous multiplicative algebraic reconstruction (Byrne 1993, "SMART"): every pass multiplies a slice
/// by the weighted geometric mean of what its rays lack. It keeps what is dark dark and converges to the
/// density nearest to the start by Kullback and Leibler's measure.
void tomography(const ParallelSlices& slices, const std::vector<Aim>& aims, int passes, int k, float* layer) {
  const std::vector<std::uint32_t> points = lit_points(slices, layer);
  std::vector<float> profile(slices.profile());
  std::vector<float> change(slices.layer());
  const float edge = slices.grid.edge;
  for (int pass = 0; pass < passes; ++pass) {
    std::fill(change.begin(), change.end(), 0.F);
    for (const Aim& aim : aims) {
      aim.projector.project(layer, points, profile.data());
      const float* seen = aim.picture->light.data() + static_cast<std::size_t>(k) * slices.profile();
      for (std::size_t i = 0; i < profile.size(); ++i) {
        const float ratio = (seen[i] + kFaint) / (profile[i] + kFaint);
        profile[i] = aim.weight / edge * std::log(std::clamp(ratio, 1 / kMostRatio, kMostRatio));
      }
      aim.projector.back_project(profile.data(), points, change.data());
    }
    for (const std::size_t p : points)
      for (std::size_t c = 0; c < 3; ++c) layer[3 * p + c] *= std::exp(change[3 * p + c]);
  }
}

/// All layers of a volume against some aims.
void reconstruct(const ParallelSlices& slices, const MethodOptions& options, const std::vector<Aim>& aims,
                 int passes, std::vector<float>& emission) {
  each_layer(slices, options, [&](int k) {
    tomography(slices, aims, passes, k, emission.data() + static_cast<std::size_t>(k) * slices.layer());
  });
}

/// Renders the novel views and makes them look as they should.
void make_novel(const ParallelSlices& slices, const SteerablePyramid& pyramid, const std::vector<Aim>& aims,
                const std::vector<float>& emission, const MethodOptions& options,
                std::vector<NovelView>& novel) {
  const std::size_t inputs = aims.size() - novel.size();
  each_layer(slices, options, [&](int k) {
    const float* layer = emission.data() + static_cast<std::size_t>(k) * slices.layer();
    const std::vector<std::uint32_t> points = lit_points(slices, layer);
    for (std::size_t v = 0; v < novel.size(); ++v)
      aims[inputs + v].projector.project(
          layer, points, novel[v].picture.light.data() + static_cast<std::size_t>(k) * slices.profile());
  });
  recon::Pool pool(options.compute.threads);
  pool.run(static_cast<int>(3 * novel.size()), [&](int task) {
    NovelView& view = novel[static_cast<std::size_t>(task) / 3];
    const auto c = static_cast<std::size_t>(task) % 3;
    std::vector<float> picture = channel_of(view.picture.light, c);
    transfer(pyramid, view.looks[c], picture);
    for (std::size_t i = 0; i < picture.size(); ++i) view.picture.light[3 * i + c] = picture[i];
  });
}

bool crosses(const std::vector<ParallelPicture>& pictures) {
  for (const ParallelPicture& a : pictures)
    for (const ParallelPicture& b : pictures)
      if (crossing(a, b) >= kLeastAcross) return true;
  return false;
}

}  // namespace

Appearance appearance_of(const SteerablePyramid& pyramid, const std::vector<float>& picture) {
  Appearance out{picture, pyramid.analyse(picture)};
  std::sort(out.intensities.begin(), out.intensities.end());
  for (std::vector<float>& band : out.bands) std::sort(band.begin(), band.end());
  return out;
}

Appearance between(const Appearance& first, const Appearance& second, double part) {
  Appearance out = first;
  const auto mix = [part](std::vector<float>& to, const std::vector<float>& other) {
    for (std::size_t i = 0; i < to.size(); ++i) to[i] += static_cast<float>(part) * (other[i] - to[i]);
  };
  mix(out.intensities, second.intensities);
  for (std::size_t b = 0; b < out.bands.size(); ++b) mix(out.bands[b], second.bands[b]);
  return out;
}

void transfer(const SteerablePyramid& pyramid, const Appearance& appearance, std::vector<float>& picture) {
  std::vector<std::vector<float>> bands = pyramid.analyse(picture);
  for (std::size_t b = 0; b < bands.size(); ++b) match_histogram(bands[b], appearance.bands[b]);
  picture = pyramid.synthesise(bands);
  match_histogram(picture, appearance.intensities);
}

Result<MethodResult> appearance_transfer(const recon::Scene& scene, const MethodOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check_method(scene, options));
  const ParallelSlices slices = slices_over(recon::grid_over(scene.box, options.voxels));
  EMBERLOCK_ASSIGN_OR_RETURN(std::vector<ParallelPicture> pictures, parallel_pictures(scene, slices));
  if (!crosses(pictures))
    return Error{ErrorKind::bad_input, "no two input views see the flame from different sides", "scene",
                 "Add a view, best at a right angle to another"};
  const std::vector<ParallelPicture> inputs = by_angle(std::move(pictures), slices);
  const SteerablePyramid pyramid(slices.offsets, slices.grid.nz);
  std::vector<NovelView> novel = novel_views(inputs, slices, pyramid);

  recon::Volume volume{slices.grid, std::vector<float>(3 * slices.grid.size()), {}};
  std::vector<Aim> aims;
  aims.reserve(inputs.size());
  for (const ParallelPicture& input : inputs)
    aims.push_back({&input, ParallelProjector(slices, input.across), 1 / static_cast<float>(inputs.size())});
  each_layer(slices, options, [&](int k) {
    light_up(slices, aims, k, volume.emission.data() + static_cast<std::size_t>(k) * slices.layer());
  });
  reconstruct(slices, options, aims, kFirstPasses, volume.emission);
  const double share = novel.empty() ? 0 : kNovelWeight / (1 + kNovelWeight);
  for (Aim& aim : aims) aim.weight *= static_cast<float>(1 - share);
  for (const NovelView& view : novel)
    aims.push_back({&view.picture, ParallelProjector(slices, view.picture.across),
                    static_cast<float>(share / static_cast<double>(novel.size()))});
  int rounds = 0;
  for (; rounds < kRounds && !(options.stop && options.stop()); ++rounds) {
    make_novel(slices, pyramid, aims, volume.emission, options, novel);
    reconstruct(slices, options, aims, kPasses, volume.emission);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(MethodResult result, checked_result(scene, std::move(volume), options));
  result.iterations = rounds;
  return result;
}

}  // namespace emberlock::paper
