// SPDX-License-Identifier: Apache-2.0
// Flames in a scene's light from outside.
#include <algorithm>
#include <numbers>

#include "apply/flame.h"
#include "recon/kernels/phase_function.h"
#include "recon/render/cropped_source.h"
#include "recon/render/lit_medium.h"

namespace emberlock::apply {
namespace {

using Source = recon::Light::Source;

Eigen::Vector3d place_in(const recon::Light& light) {
  return {light.place[0], light.place[1], light.place[2]};
}

/// The light as the volume stands to it. One nearby shines by distances in the volume's metres.
recon::Light as_seen_by(const Placement& flame_from_world, recon::Light light) {
  const Eigen::Vector3d place = light.source == Source::nearby
                                    ? flame_from_world * place_in(light)
                                    : Eigen::Vector3d(flame_from_world.rotation * place_in(light));
  light.place = {place[0], place[1], place[2]};
  if (light.source == Source::nearby)
    for (double& level : light.strength) level *= flame_from_world.scale * flame_from_world.scale;
  return light;
}

Eigen::Vector3d key_point_of(const recon::Grid& g, int i, int j, int k) {
  return Eigen::Vector3d(static_cast<double>(g.origin[0]), static_cast<double>(g.origin[1]),
                         static_cast<double>(g.origin[2])) +
         static_cast<double>(g.edge) * Eigen::Vector3d(i, j, k);
}

/// What a medium's extinction scatters of a light whose share `reach` comes to each key point.
std::vector<float> scattered_of(const recon::Volume& volume, double albedo,
                                const std::array<double, 3>& level, const std::vector<float>* reach) {
  std::vector<float> source(3 * volume.extinction.size());
  for (std::size_t p = 0; p < volume.extinction.size(); ++p) {
    const double share = albedo * static_cast<double>(volume.extinction[p]) *
                         (reach != nullptr ? static_cast<double>((*reach)[p]) : 1);
    for (std::size_t c = 0; c < 3; ++c) source[3 * p + c] = static_cast<float>(share * level[c]);
  }
  return source;
}

Eigen::Vector3d in_edges(const recon::Grid& g, const Eigen::Vector3d& place) {
  return (place - key_point_of(g, 0, 0, 0)) / static_cast<double>(g.edge);
}

void add(const std::vector<float>& more, std::vector<float>& to) {
  for (std::size_t i = 0; i < to.size(); ++i) to[i] += more[i];
}

}  // namespace

std::vector<float> Flame::arriving(const recon::Light& light, const Shade& shade, recon::Pool& pool) const {
  const recon::Grid& fine = volume_.grid;
  const recon::Grid& coarse = coarse_.grid;
  std::vector<recon::Rgba> shades(coarse.size());
  pool.run(coarse.nz, [&](int k) {
    for (int j = 0; j < coarse.ny; ++j)
      for (int i = 0; i < coarse.nx; ++i)
        shades[coarse.index(i, j, k)].c[0] =
            static_cast<float>(shade(world_from_flame_ * key_point_of(coarse, i, j, k)));
  });
  std::vector<recon::Rgba> medium(fine.size());
  for (std::size_t p = 0; p < medium.size(); ++p) medium[p].c[3] = fine.edge * volume_.extinction[p];
  std::vector<float> reach = recon::light_that_reaches(medium, fine, light, pool);
  const recon::ShiningGrid between{coarse.nx, coarse.ny, coarse.nz, shades.data()};
  pool.run(fine.nz, [&](int k) {
    for (int j = 0; j < fine.ny; ++j)
      for (int i = 0; i < fine.nx; ++i) {
        const std::size_t p = fine.index(i, j, k);
        if (!(volume_.extinction[p] > 0)) continue;
        const Eigen::Vector3d at = in_edges(coarse, key_point_of(fine, i, j, k));
        reach[p] *= std::clamp(
            between.at(static_cast<float>(at[0]), static_cast<float>(at[1]), static_cast<float>(at[2])).c[0],
            0.F, 1.F);  // beyond the grid it goes on
      }
  });
  return reach;
}

Status Flame::light_by(const recon::Light& light, std::optional<double> albedo, const Shade& shade,
                       recon::Pool& pool) {
  const bool was_lit = lighting_.light.source != Source::none;
  if (volume_.extinction.empty() || medium_.count == 0 || !(was_lit ? albedo.has_value() : scatters()))
    return {};
  light_ = as_seen_by(flame_from_world_, light);
  const recon::Box box = recon::box_of(volume_.grid);
  if (light.source == Source::nearby &&
      ((place_in(light_) - box.center).array().abs() <= 0.5 * box.size.array()).all())
    return Error{ErrorKind::bad_input,
                 "the nearby light stands inside of the box around a flame that scatters it", "light",
                 "Give a place outside of it"};
  const double share = was_lit ? *albedo : lighting_.scattering.albedo;
  const std::vector<float> reach = arriving(light_, shade, pool);
  const std::vector<float> beam = scattered_of(volume_, share, light_.strength, &reach);
  const std::vector<float> even = scattered_of(volume_, share, light_.ambient, nullptr);
  recon::Volume shown = volume_;
  if (was_lit) std::fill(shown.emission.begin(), shown.emission.end(), 0.F);
  if (!was_lit && lighting_.scattering.order == recon::Scattering::Order::multiple) {
    add(beam, shown.emission);
    scattered_ = recon::find_in_scatter(shown, medium_, effects_, {}, pool);
    shown.emission = volume_.emission;
  }
  add(even, shown.emission);
  const auto show = [&] {
    source_ = std::make_shared<const std::vector<recon::Rgba>>(
        recon::cropped_source(shown, crop_, effects_.extinction.model));
  };
  if (!was_lit) show();
  add(beam, shown.emission);
  if (was_lit)
    show();
  else
    beam_ = recon::cropped_source({volume_.grid, beam, {}}, crop_, recon::Extinction::Model::none);
  coarse_ = recon::coarse_medium(shown, medium_, effects_.extinction, light_voxels_, pool);
  emitters_ = glowing();
  on_gpu_.reset();
  return {};
}

void Flame::add_beam(const Eigen::Vector3d& camera_center, std::vector<recon::Rgba>& source,
                     recon::Pool& pool) const {
  const recon::Grid& g = crop_.hull.grid;
  const recon::HenyeyGreenstein<double> phase{lighting_.scattering.asymmetry};
  const bool nearby = light_.source == Source::nearby;
  const Eigen::Vector3d stands = place_in(light_);
  pool.run(g.nz, [&](int k) {
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t p = g.index(i, j, k);
        const Eigen::Vector3d at = key_point_of(g, i, j, k);
        const Eigen::Vector3d comes_from = nearby ? Eigen::Vector3d(stands - at) : stands;
        const double mu = -comes_from.normalized().dot((camera_center - at).normalized());
        source[p] = source[p] + static_cast<float>(4 * std::numbers::pi * phase(mu)) * beam_[p];
      }
  });
}

}  // namespace emberlock::apply
