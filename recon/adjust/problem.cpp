// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/problem.h"

#include <algorithm>

#include "recon/effects/background.h"
#include "recon/effects/refraction.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {
namespace {

void find_active(const Hull& hull, std::vector<std::uint8_t>& active, std::vector<Slice>& row_span) {
  const Grid& g = hull.grid;
  active.assign(g.size(), 0);
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        if (hull.inside[voxel++] != 0)
          for (int c = 0; c < 8; ++c) active[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] = 1;
  row_span.assign(static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(g.nz), {0, 0});
  const auto width = static_cast<std::ptrdiff_t>(g.nx);
  for (std::size_t row = 0; row < row_span.size(); ++row) {
    const auto begin = active.begin() + static_cast<std::ptrdiff_t>(row) * width;
    const auto first = std::find(begin, begin + width, 1);
    if (first == begin + width) continue;
    auto last = begin + width;
    while (*(last - 1) == 0) --last;
    row_span[row] = {static_cast<std::size_t>(first - begin), static_cast<std::size_t>(last - begin)};
  }
}

SlabRuns sort_into_slabs(const Problem& problem, int subset) {
  const RayList& list = problem.list;
  const auto s = static_cast<std::size_t>(subset);
  const std::size_t first = list.first_run(list.subset_begin[s]);
  const std::size_t last = list.first_run(list.subset_begin[s + 1]);
  std::vector<std::uint16_t> slab_of(last - first);
  SlabRuns slabs;
  slabs.begin.assign(static_cast<std::size_t>(problem.slab_count()) + 1, 0);
  for (std::size_t n = first; n < last; ++n) {
    const int slab = list.runs[n].slab;
    slab_of[n - first] = static_cast<std::uint16_t>(slab);
    ++slabs.begin[static_cast<std::size_t>(slab) + 1];
  }
  for (std::size_t i = 1; i < slabs.begin.size(); ++i) slabs.begin[i] += slabs.begin[i - 1];
  slabs.run.resize(last - first);
  std::vector<std::size_t> next = slabs.begin;
  for (std::size_t n = first; n < last; ++n)
    slabs.run[next[slab_of[n - first]]++] = static_cast<std::uint32_t>(n);
  return slabs;
}

}  // namespace

std::size_t Problem::most_samples() const {
  std::size_t most = 0;
  for (std::size_t s = 0; s + 1 < list.subset_begin.size(); ++s)
    most =
        std::max(most, list.first_sample(list.subset_begin[s + 1]) - list.first_sample(list.subset_begin[s]));
  return most;
}

Problem make_problem(const std::vector<const View*>& views, const Hull& hull, const ProblemOptions& options,
                     Pool& pool) {
  Problem problem;
  problem.crop = crop_to_medium(hull);
  std::vector<const CameraModel*> cameras;
  cameras.reserve(views.size());
  for (const View* view : views) cameras.push_back(&view->camera);
  RayListOptions clip;
  clip.step = static_cast<float>(options.step);
  clip.subsets = options.subsets;
  clip.subset_of = options.subset_of;
  IndexField gas;
  if (options.gas != nullptr) {
    gas = options.gas->field(problem.crop.hull.grid);
    clip.gas = &gas;
  }
  problem.list = clip_rays(cameras, problem.crop.hull, clip, pool);
  find_active(problem.crop.hull, problem.active, problem.row_span);
  problem.seen.resize(problem.list.rays.size());
  for (std::size_t r = 0; r < problem.seen.size(); ++r) {
    const View& view = *views[problem.list.rays[r].view];
    const std::size_t pixel = problem.list.pixels[r];
    const float* rgb = &view.image->rgb[3 * pixel];
    const float bounds = view.bounds ? static_cast<float>((*view.bounds)[pixel]) : 0.F;
    problem.seen[r] = Rgba{{rgb[0], rgb[1], rgb[2], bounds}};
  }
  problem.background = behind_rays(options.background, problem.list, views);
  if (!options.adjoint) return problem;
  problem.slabs.resize(static_cast<std::size_t>(options.subsets));
  pool.run(options.subsets, [&](int subset) {
    problem.slabs[static_cast<std::size_t>(subset)] = sort_into_slabs(problem, subset);
  });
  return problem;
}

std::vector<Rgba> refine(const std::vector<Rgba>& coarse, const Problem& from, const Problem& to) {
  const Grid& f = from.grid();
  const Grid& g = to.grid();
  std::vector<Rgba> fine(g.size());
  const auto place = [](int fine_key, int key_points) {
    const float p = 0.5F * static_cast<float>(fine_key);
    const int cell = clamp_cell(p, key_points);
    return std::pair(cell, p - static_cast<float>(cell));
  };
  for (int k = 0; k < g.nz; ++k) {
    const auto [ck, fz] = place(k + to.crop.offset[2] - 2 * from.crop.offset[2], f.nz);
    for (int j = 0; j < g.ny; ++j) {
      const auto [cj, fy] = place(j + to.crop.offset[1] - 2 * from.crop.offset[1], f.ny);
      const Slice span = to.row_span[static_cast<std::size_t>(j) +
                                     static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(k)];
      for (std::size_t i = span.begin; i < span.end; ++i) {
        const std::size_t p = g.index(static_cast<int>(i), j, k);
        if (to.active[p] == 0) continue;
        const auto [ci, fx] = place(static_cast<int>(i) + to.crop.offset[0] - 2 * from.crop.offset[0], f.nx);
        // Emission is kept a voxel edge, and the fine edge is half as long.
        fine[p] =
            0.5F * trilinear(coarse.data() + f.index(ci, cj, ck), static_cast<std::size_t>(f.nx),
                             static_cast<std::size_t>(f.nx) * static_cast<std::size_t>(f.ny), fx, fy, fz);
      }
    }
  }
  return fine;
}

}  // namespace emberlock::recon
