// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/stochastic_tomography/footprints.h"

#include "recon/kernels/march.h"

namespace emberlock::paper {
namespace {

/// Calls act(key point, ray, weight) once for each entry of A, ray by ray.
template <class Act>
void each_entry(const LinearProjector& projector, const Act& act) {
  const recon::RayTable table = projector.list().table();
  std::vector<recon::Rgba> sums(projector.unknowns());
  std::vector<std::int32_t> touched;
  const std::size_t row = static_cast<std::size_t>(table.nx);
  const std::size_t plane = row * static_cast<std::size_t>(table.ny);
  const recon::Trilinear spread;
  recon::Rgba step{};
  const auto take = [&](int /*sample*/, std::int32_t base, float fx, float fy, float fz) {
    if (touched.empty() || touched.back() != base) touched.push_back(base);
    spread(&sums[static_cast<std::size_t>(base)], row, plane, fx, fy, fz, step);
  };
  for (std::size_t ray = 0; ray < projector.rays(); ++ray) {
    const recon::MarchRay& of = table.rays[ray];
    touched.clear();
    for (std::size_t n = of.first_run; n < of.first_run + of.runs; ++n) {
      step.c[0] = table.runs[n].step;
      recon::each_sample(table, recon::StraightPath::line<float>(table, n), table.runs[n], take);
    }
    for (const std::int32_t base : touched)
      for (std::size_t corner = 0; corner < 8; ++corner) {
        const std::size_t p =
            static_cast<std::size_t>(base) + (corner & 1) + (corner >> 1 & 1) * row + (corner >> 2) * plane;
        if (!(sums[p].c[0] > 0)) continue;  // another voxel's corner took it
        act(p, static_cast<std::uint32_t>(ray), sums[p].c[0]);
        sums[p] = recon::Rgba{};
      }
  }
}

}  // namespace

Footprints footprints_of(const LinearProjector& projector) {
  Footprints prints;
  prints.begin.assign(projector.unknowns() + 1, 0);
  each_entry(projector, [&](std::size_t p, std::uint32_t, float) { ++prints.begin[p + 1]; });
  for (std::size_t p = 0; p < projector.unknowns(); ++p) prints.begin[p + 1] += prints.begin[p];
  prints.entries.resize(prints.begin.back());
  std::vector<std::size_t> next = prints.begin;
  each_entry(projector, [&](std::size_t p, std::uint32_t ray, float weight) {
    prints.entries[next[p]++] = {ray, weight};
  });
  return prints;
}

}  // namespace emberlock::paper
