// SPDX-License-Identifier: Apache-2.0
#include "recon/adjust/gpu_problem.h"
#include "recon/adjust/problem_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/compute/gpu_pictures.h"
#include "recon/kernels/level.h"
#include "recon/kernels/update.h"
#include "recon/views/picture_on_gpu.h"

namespace emberlock::recon {
GpuProblem::GpuProblem(const Problem& problem) : rays(GpuRays::of(problem.list)) {
  std::vector<ViewPixels> table = problem.view_pixels();
  for (std::size_t v = 0; v < table.size(); ++v) {
    const ProblemPicture& picture = problem.pictures[v];
    const auto image = on_gpu(picture.image);
    const auto behind = on_gpu(picture.behind);
    const auto bounds = on_gpu(picture.bounds);
    table[v].rgb = image->data();
    table[v].behind = behind ? behind->data() : nullptr;
    table[v].bounds = bounds ? bounds->data() : nullptr;
    pictures_.insert(pictures_.end(), {image, behind, bounds});
  }
  views = CudaBuffer<ViewPixels>(table);
}

std::shared_ptr<const GpuProblem> GpuProblem::of(const Problem& problem) {
  if (problem.on_gpu) return problem.on_gpu;
  auto copied = std::make_shared<GpuProblem>(problem);
  copied->seen = CudaBuffer<Rgba>(problem.seen);
  copied->background = CudaBuffer<Rgba>(problem.background);
  copied->share = CudaBuffer<float>(problem.share);
  return copied;
}

std::shared_ptr<const GpuProblem> read_on_cuda(const Problem& problem) {
  auto read = std::make_shared<GpuProblem>(problem);
  const std::size_t rays = problem.rays();
  read->seen = CudaBuffer<Rgba>::unfilled(rays);
  read->background = CudaBuffer<Rgba>::unfilled(problem.is_before_background ? rays : 0);
  launch(rays,
         ReadPixels{read->views.data(), read->rays->rays.data(), read->rays->pixels.data(), read->seen.data(),
                    read->background.data()},
         "reading pixels");
  const Hull& hull = problem.crop.hull;
  const CudaBuffer<std::uint8_t> inside(hull.inside);
  read->share = CudaBuffer<float>::unfilled(hull.grid.size());
  launch(hull.grid.size(), ActAt<ShareInside>{{hull.grid, inside.data(), read->share.data()}, hull.grid},
         "finding the medium");
  return read;
}

}  // namespace emberlock::recon
