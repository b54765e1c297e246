// SPDX-License-Identifier: Apache-2.0
// For tests: single launches of what recon/adjust/engine_cuda.cu strings together, over the CPU's memory.
#include "recon/adjust/sort_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/hull/gpu_rays.h"
#include "recon/kernels/field.h"
#include "recon/kernels/gather.h"
#include "tests/support/marches.h"

namespace emberlock {
namespace {

/// A copy of an array; back() brings it home. Nothing where there is none.
template <class T>
class Copy {
 public:
  Copy(T* home, std::size_t size) : home_(home), copy_(home, home == nullptr ? 0 : size) {}
  [[nodiscard]] T* data() const { return copy_.data(); }
  void back() const { copy_.download(home_); }

 private:
  T* home_;
  recon::CudaBuffer<std::remove_const_t<T>> copy_;
};

template <class Real, class Path>
class CudaMarches final : public Marches<Real> {
 public:
  using Values = typename Marches<Real>::Values;
  using Field = typename Marches<Real>::Field;

  explicit CudaMarches(const recon::RayList& list)
      : list_(list),
        rays_(recon::GpuRays::of(list)),
        samples_(list.count().samples),
        run_of_sample_(recon::CudaBuffer<std::uint32_t>::unfilled(samples_)) {
    const auto voxels = recon::CudaBuffer<std::uint32_t>::unfilled(samples_);
    recon::launch(list.runs.size(), recon::NameVoxels<Real, Path>{all(), voxels.data()}, "naming voxels");
    by_voxel_ = recon::sort_by_voxel(voxels, list.grid.size());
  }

  [[nodiscard]] Values forward(recon::Absorb absorb, const Values& volume, Real sigma) const override {
    if (absorb == recon::Absorb::field) return marched(volume, recon::FieldExtinction<Real>{});
    if (absorb == recon::Absorb::constant) return marched(volume, recon::ConstantExtinction<Real>{sigma});
    return marched(volume, recon::NoExtinction<Real>{});
  }
  [[nodiscard]] Values adjoint(recon::Absorb absorb, const Values& residual, Real sigma) const override {
    if (absorb == recon::Absorb::constant) return spread(residual, recon::ConstantExtinction<Real>{sigma});
    return spread(residual, recon::NoExtinction<Real>{});
  }
  [[nodiscard]] Field field_forward(const Values& volume,
                                    const recon::PixelResidual<Real>& pixel) const override {
    const Copy<const recon::Rgba> seen(pixel.seen, rays());
    const Copy<const recon::Rgba> background(pixel.background, rays());
    const Copy<const recon::Rgba> offset(pixel.offset, rays());
    const recon::CudaBuffer<recon::Quad<Real>> light(volume);
    const recon::CudaBuffer<recon::Quad<Real>> residual(rays());
    const recon::CudaBuffer<recon::Quad<Real>> samples(samples_);
    using March = recon::FieldForward<Real, Path>;
    using Keep = recon::KeepResidual<Real>;
    recon::launch(rays(),
                  recon::MarchByResidual<March, Keep>{
                      {rays_->table(), light.data(), samples.data(), 0},
                      {{seen.data(), background.data(), offset.data(), pixel.white}, residual.data()}},
                  "marching");
    return {residual.download(), samples.download()};
  }
  [[nodiscard]] Values field_adjoint(const Field& field) const override {
    const recon::CudaBuffer<recon::Quad<Real>> residual(field.residual);
    const recon::CudaBuffer<recon::Quad<Real>> samples(field.samples);
    return gathered(recon::FieldWeight<Real>{residual.data(), samples.data(), 0});
  }

 private:
  [[nodiscard]] std::size_t rays() const { return list_.rays.size(); }
  [[nodiscard]] recon::SubsetSamples all() const { return {rays_->table(), 0, run_of_sample_.data()}; }

  template <class Extinction>
  [[nodiscard]] Values marched(const Values& volume, const Extinction& extinction) const {
    const recon::CudaBuffer<recon::Quad<Real>> light(volume);
    const recon::CudaBuffer<recon::Quad<Real>> seen(rays());
    using March = recon::Forward<Real, Extinction, Path>;
    recon::launch(rays(),
                  recon::MarchAndKeep<March, recon::KeepRadiance<Real>>{
                      {rays_->table(), light.data(), extinction}, {seen.data()}},
                  "marching");
    return seen.download();
  }
  template <class Extinction>
  [[nodiscard]] Values spread(const Values& residual, const Extinction& extinction) const {
    const recon::CudaBuffer<recon::Quad<Real>> of_rays(residual);
    return gathered(recon::AdjointWeight<Real, Extinction>{of_rays.data(), extinction});
  }
  template <class Weight>
  [[nodiscard]] Values gathered(const Weight& weight) const {
    const auto deposits = recon::CudaBuffer<recon::Deposit<Real>>::unfilled(samples_);
    recon::launch(samples_, recon::LayAside<Real, Path, Weight>{all(), weight, deposits.data()},
                  "weighing samples");
    const recon::SamplesByVoxel by_voxel = by_voxel_.view();
    const auto sums = recon::CudaBuffer<recon::Quad<Real>>::unfilled(8 * by_voxel.voxels);
    recon::launch(by_voxel.voxels, recon::SumCorners<Real>{by_voxel, deposits.data(), sums.data()},
                  "summing samples");
    const recon::Grid& g = list_.grid;
    const recon::CudaBuffer<recon::Quad<Real>> gradient(g.size());
    recon::launch(g.size(), recon::AddCorners<Real>{g.nx, g.ny, by_voxel, sums.data(), gradient.data()},
                  "adding up voxels");
    return gradient.download();
  }

  const recon::RayList& list_;
  std::shared_ptr<const recon::GpuRays> rays_;
  std::size_t samples_;
  recon::CudaBuffer<std::uint32_t> run_of_sample_;
  recon::SortedSamples by_voxel_;
};

/// What an emission's step works on, copied.
struct Emission {
  explicit Emission(const recon::Descend<double>& s)
      : weight(s.weight, s.grid.size()),
        stiffness(s.stiffness, s.grid.size()),
        y(s.y, s.grid.size()),
        x(s.x, s.grid.size()),
        next_y(s.next_y, s.grid.size()),
        gradient(s.gradient, s.grid.size()),
        step{s.grid,          weight.data(),    x.data(), y.data(),   next_y.data(),
             gradient.data(), stiffness.data(), s.scale,  s.momentum, s.length} {}
  void back() const {
    x.back();
    next_y.back();
    gradient.back();
  }

  Copy<const double> weight, stiffness;
  Copy<const recon::Rgba64> y;
  Copy<recon::Rgba64> x, next_y, gradient;
  recon::Descend<double> step;
};

template <class Step>
void each_key_point(const Step& step) {
  recon::launch(grid_of(step).size(), recon::ActAt<Step>{step, grid_of(step)}, "stepping");
}

}  // namespace

template <class Real>
std::unique_ptr<Marches<Real>> cuda_marches(const recon::RayList& list) {
  if (!list.curved) return std::make_unique<CudaMarches<Real, recon::StraightPath>>(list);
  return std::make_unique<CudaMarches<Real, recon::CurvedPath>>(list);
}
template std::unique_ptr<Marches<float>> cuda_marches(const recon::RayList& list);
template std::unique_ptr<Marches<double>> cuda_marches(const recon::RayList& list);

void cuda_step(const recon::Stiffen<double>& step) {
  const Copy<const double> weight(step.weight, step.grid.size());
  const Copy<const recon::Rgba64> y(step.y, step.grid.size());
  const Copy<double> stiffness(step.stiffness, step.grid.size());
  each_key_point(
      recon::Stiffen<double>{step.grid, weight.data(), y.data(), stiffness.data(), step.most, step.soft});
  stiffness.back();
}
void cuda_step(const recon::Descend<double>& step) {
  const Emission emission(step);
  each_key_point(emission.step);
  emission.back();
}
void cuda_step(const recon::DescendField<double>& step) {
  const Emission emission(step.emission);
  const std::size_t size = grid_of(step).size();
  const Copy<const double> weight(step.weight, size);
  const Copy<const double> reference(step.reference, size);
  each_key_point(recon::DescendField<double>{emission.step, weight.data(), reference.data(), step.variation,
                                             step.soft, step.most});
  emission.back();
}

}  // namespace emberlock
