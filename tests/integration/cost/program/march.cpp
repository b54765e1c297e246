// SPDX-License-Identifier: Apache-2.0
// march CASE: does one piece of work in the function `measured`, whose instructions callgrind counts.
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <string>

#include "recon/render/render.h"
#include "tests/integration/cost/program/by_hand.h"
#include "tests/integration/cost/program/measured.h"
#include "tests/support/march_case.h"

/// Stands before libhwy's, which runs when the library is loaded and by an instruction that valgrind does not
/// know on each machine (rdtscp). Nothing here measures time.
namespace hwy::platform {
std::uint64_t TimerResolution();
std::uint64_t TimerResolution() { return 1; }
}  // namespace hwy::platform

namespace emberlock {

using Cases = std::map<std::string, std::function<void()>>;

// With the table's signatures.
__attribute__((noinline)) void forward_by_hand(const recon::MarchWork<float>& w, std::size_t begin,
                                               std::size_t end) {
  const ForwardByHand march{w.rays, w.volume};
  for (std::size_t ray = begin; ray < end; ++ray) w.residual[ray] = march(ray);
}
__attribute__((noinline)) void adjoint_by_hand(const recon::MarchWork<float>& w, const std::uint32_t* runs,
                                               std::size_t count) {
  const AdjointByHand march{w.rays, w.residual, {w.rays, w.gradient}};
  for (std::size_t n = 0; n < count; ++n) march(runs[n]);
}

/// What render_view has to do where every effect is off, and no more.
std::vector<float> picture_by_hand(const recon::Volume& volume, const recon::Hull& medium,
                                   const recon::CameraModel& camera) {
  recon::RadianceImage image(camera.intrinsics.size);
  recon::Pool pool(1);
  const recon::CroppedHull crop = recon::crop_to_medium(medium);
  const recon::Grid& grid = crop.hull.grid;
  std::vector<recon::Rgba> source(grid.size());
  for (std::size_t p = 0; p < source.size(); ++p)
    source[p] = grid.edge * recon::Rgba{{volume.emission[3 * p], volume.emission[3 * p + 1],
                                         volume.emission[3 * p + 2], 0}};
  const recon::RayList list = recon::clip_rays({&camera}, crop.hull, {}, pool);
  std::vector<recon::Rgba> seen(list.rays.size());
  const ForwardByHand march{list.table(), source.data()};
  for (std::size_t ray = 0; ray < seen.size(); ++ray) seen[ray] = march(ray);
  for (std::size_t ray = 0; ray < seen.size(); ++ray)
    for (std::size_t c = 0; c < 3; ++c) image.rgb[3 * std::size_t{list.pixels[ray]} + c] = seen[ray].c[c];
  return image.rgb;
}

recon::Effects some_effects() {
  recon::Effects effects = recon::absorbing(PerMeter(20));
  effects.background = {recon::Background::Kind::constant, {1, 2, 3}};
  effects.exposure = {recon::Exposure::Shutter::integrated, Seconds(0.01), 1};
  effects.sensor = {recon::Sensor::Response::gamma, recon::Sensor::Clipping::at_white, 2.2, 255};
  return effects;
}

int run(const std::string& name) {
  const MarchCase c = march_case({.voxels = 40, .filled = 1});
  const auto volume = random_quads<float>(c.list.grid.size(), 1);
  std::vector<recon::Rgba> rays = random_quads<float>(c.list.rays.size(), 2);
  std::vector<recon::Rgba> gradient(c.list.grid.size());
  recon::MarchWork<float> work;
  work.rays = c.list.table();
  work.volume = volume.data();
  work.sigma = 0.05F;
  work.residual = rays.data();
  work.gradient = gradient.data();
  std::vector<std::uint32_t> runs(c.list.runs.size());
  for (std::uint32_t n = 0; n < runs.size(); ++n) runs[n] = n;

  const recon::Volume emission{c.medium.grid, std::vector<float>(3 * c.medium.grid.size(), 100), {}};
  const recon::CameraModel camera =
      recon::look_at({{80, 60}, 70, 70, 40, 30, {}}, {0.3, 0.1, 0.05}, Eigen::Vector3d::Zero());
  recon::RenderOptions one_thread;
  one_thread.compute.threads = 1;

  const auto forward = [&](recon::Absorb absorb) {
    recon::march_table<float>().forward_of(absorb, recon::Travel::straight)(work, 0, rays.size());
  };
  const auto adjoint = [&](recon::Absorb absorb) {
    recon::march_table<float>().adjoint_of(absorb, recon::Travel::straight)(work, runs.data(), runs.size());
  };
  const Cases cases = {
      {"forward_none", [&] { forward(recon::Absorb::nothing); }},
      {"forward_constant", [&] { forward(recon::Absorb::constant); }},
      {"forward_by_hand", [&] { forward_by_hand(work, 0, rays.size()); }},
      {"adjoint_none", [&] { adjoint(recon::Absorb::nothing); }},
      {"adjoint_constant", [&] { adjoint(recon::Absorb::constant); }},
      {"adjoint_by_hand", [&] { adjoint_by_hand(work, runs.data(), runs.size()); }},
      {"picture",
       [&] { rays[0].c[0] += recon::render_view(emission, c.medium, {}, camera, one_thread).rgb[0]; }},
      {"picture_of_effects",
       [&] {
         rays[0].c[0] += recon::render_view(emission, c.medium, some_effects(), camera, one_thread).rgb[0];
       }},
      {"picture_by_hand", [&] { rays[0].c[0] += picture_by_hand(emission, c.medium, camera)[0]; }},
  };
  const auto at = cases.find(name);
  if (at == cases.end()) return 2;
  measured(at->second);
  std::printf("%s %g %g\n", recon::march_table_name(), dot(rays, rays), dot(gradient, gradient));
  return 0;
}

}  // namespace emberlock

int main(int argc, char** argv) { return argc == 2 ? emberlock::run(argv[1]) : 2; }
