// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/problem.h"

#include <algorithm>

#include "recon/adjust/problem_cuda.h"
#include "recon/effects/refraction.h"
#include "recon/views/view.h"

namespace emberlock::recon {
namespace {

/// Scattered from the voxels, most of which are empty.
void find_shares(const Hull& hull, std::vector<float>& share, std::vector<Slice>& row_span) {
  const Grid& g = hull.grid;
  share.assign(g.size(), 0);
  std::size_t voxel = 0;
  for (int k = 0; k < g.nz - 1; ++k)
    for (int j = 0; j < g.ny - 1; ++j)
      for (int i = 0; i < g.nx - 1; ++i)
        if (hull.inside[voxel++] != 0)
          for (int c = 0; c < 8; ++c) share[g.index(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2))] += 0.125F;
  row_span.assign(static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(g.nz), {0, 0});
  const auto width = static_cast<std::ptrdiff_t>(g.nx);
  for (std::size_t row = 0; row < row_span.size(); ++row) {
    const auto begin = share.begin() + static_cast<std::ptrdiff_t>(row) * width;
    const auto first = std::find_if(begin, begin + width, [](float s) { return s > 0; });
    if (first == begin + width) continue;
    auto last = begin + width;
    while (!(*(last - 1) > 0)) --last;
    row_span[row] = {static_cast<std::size_t>(first - begin), static_cast<std::size_t>(last - begin)};
  }
}

ProblemPicture picture_of(const View& view, const Background& background) {
  ProblemPicture picture{view.image, view.bounds, nullptr, {}};
  if (background.kind == Background::Kind::image) picture.behind = view.background;
  if (background.kind == Background::Kind::constant)
    for (std::size_t c = 0; c < 3; ++c) picture.level[c] = static_cast<float>(background.radiance[c]);
  return picture;
}

std::vector<ProblemPicture> pictures_of(const std::vector<const View*>& views, const Background& background) {
  std::vector<ProblemPicture> pictures;
  pictures.reserve(views.size());
  for (const View* view : views) pictures.push_back(picture_of(*view, background));
  return pictures;
}

void read_pixels(Problem& problem, Pool& pool) {
  const std::vector<ViewPixels> views = problem.view_pixels();
  problem.seen.resize(problem.rays());
  if (problem.is_before_background) problem.background.resize(problem.rays());
  const ReadPixels read{views.data(), problem.list.rays.data(), problem.list.pixels.data(),
                        problem.seen.data(),
                        problem.is_before_background ? problem.background.data() : nullptr};
  constexpr int kTasks = 64;
  pool.run(kTasks, [&](int task) {
    const Slice mine = slice(problem.rays(), kTasks, task);
    for (std::size_t r = mine.begin; r < mine.end; ++r) read(r);
  });
}

SlabRuns sort_into_slabs(const Problem& problem, int subset) {
  const RayList& list = problem.list;
  const auto s = static_cast<std::size_t>(subset);
  const std::size_t first = list.before[s].runs;
  const std::size_t last = list.before[s + 1].runs;
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
  for (std::size_t s = 0; s + 1 < list.before.size(); ++s)
    most = std::max(most, std::size_t{list.before[s + 1].samples - list.before[s].samples});
  return most;
}

std::vector<ViewPixels> Problem::view_pixels() const {
  std::vector<ViewPixels> views;
  for (const ProblemPicture& p : pictures) {
    ViewPixels view{p.image->rgb.data(),
                    p.bounds ? p.bounds->data() : nullptr,
                    p.behind ? p.behind->rgb.data() : nullptr,
                    {},
                    p.image->size.width};
    std::copy(p.level.begin(), p.level.end(), view.level);
    views.push_back(view);
  }
  return views;
}

Problem make_problem(const std::vector<const View*>& views, const Hull& hull, const ProblemOptions& options,
                     Pool& pool) {
  Problem problem;
  problem.crop = crop_to_medium(hull);
  problem.is_before_background = options.background.kind != Background::Kind::black;
  std::vector<const CameraModel*> cameras;
  cameras.reserve(views.size());
  for (const View* view : views) cameras.push_back(&view->camera);
  problem.pictures = pictures_of(views, options.background);
  RayListOptions clip;
  clip.step = static_cast<float>(options.step);
  clip.subsets = options.subsets;
  clip.rule = options.rule;
  clip.subset_of = options.subset_of;
  clip.boxes = options.boxes;
  clip.home = options.subset_of ? RayListOptions::Home::cpu : options.home;
  IndexField gas;
  if (options.gas != nullptr) {
    gas = options.gas->field(problem.crop.hull.grid);
    clip.gas = &gas;
  }
  problem.list = clip_rays(cameras, problem.crop.hull, clip, pool);
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda && clip.home == RayListOptions::Home::where_it_is_made) {
      problem.on_gpu = read_on_cuda(problem);
      return problem;
    }
  }
  find_shares(problem.crop.hull, problem.share, problem.row_span);
  read_pixels(problem, pool);
  if (!options.adjoint || pool.device() == Device::cuda) return problem;
  problem.slabs.resize(static_cast<std::size_t>(options.subsets));
  pool.run(options.subsets, [&](int subset) {
    problem.slabs[static_cast<std::size_t>(subset)] = sort_into_slabs(problem, subset);
  });
  return problem;
}

void show_pictures(Problem& problem, const std::vector<const View*>& views, const Background& background,
                   Pool& pool) {
  problem.pictures = pictures_of(views, background);
  read_pixels(problem, pool);
}

}  // namespace emberlock::recon
