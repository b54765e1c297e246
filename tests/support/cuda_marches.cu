// For tests: single launches of what recon/adjust/engine_cuda.cu strings together, over the CPU's memory.
#include "recon/adjust/sort_cuda.h"
#include "recon/compute/cuda_launch.h"
#include "recon/hull/device_ray_list.h"
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
  CudaBuffer<std::remove_const_t<T>> copy_;
};

template <class Real, class Path>
class CudaMarches final : public Marches<Real> {
 public:
  using Values = typename Marches<Real>::Values;
  using Field = typename Marches<Real>::Field;

  explicit CudaMarches(const RayList& list) : list_(list), rays_(list), samples_(list.first_sample(rays())) {
    const auto voxels = CudaBuffer<std::uint32_t>::unfilled(samples_);
    launch(list.runs.size(), NameVoxels<Real, Path>{rays_.table(), voxels.data(), 0}, "naming voxels");
    by_voxel_ = sort_by_voxel(voxels, list.grid.size());
  }

  [[nodiscard]] Values forward(Absorb absorb, const Values& volume, Real sigma) const override {
    if (absorb == Absorb::field) return marched(volume, FieldExtinction<Real>{});
    if (absorb == Absorb::constant) return marched(volume, ConstantExtinction<Real>{sigma});
    return marched(volume, NoExtinction<Real>{});
  }
  [[nodiscard]] Values adjoint(Absorb absorb, const Values& residual, Real sigma) const override {
    if (absorb == Absorb::constant) return spread(residual, ConstantExtinction<Real>{sigma});
    return spread(residual, NoExtinction<Real>{});
  }
  [[nodiscard]] Field field_forward(const Values& volume, const Judge<Real>& judge) const override {
    const Copy<const Rgba> seen(judge.seen, rays());
    const Copy<const Rgba> background(judge.background, rays());
    const Copy<const Rgba> offset(judge.offset, rays());
    const CudaBuffer<Quad<Real>> light(volume);
    const CudaBuffer<Quad<Real>> residual(rays());
    const CudaBuffer<Quad<Real>> samples(samples_);
    using March = FieldForward<Real, Path>;
    using Keep = JudgeAndKeep<Real>;
    launch(rays(),
           MarchJudged<March, Keep>{
               {rays_.table(), light.data(), samples.data(), 0},
               {{seen.data(), background.data(), offset.data(), judge.white}, residual.data()}},
           "marching");
    return {residual.download(), samples.download()};
  }
  [[nodiscard]] Values field_adjoint(const Field& field) const override {
    const CudaBuffer<Quad<Real>> residual(field.residual);
    const CudaBuffer<Quad<Real>> samples(field.samples);
    return gathered([&](const LayAside<Real>& aside) {
      launch(
          list_.runs.size(),
          FieldAdjoint<Real, Path, LayAside<Real>>{rays_.table(), residual.data(), samples.data(), 0, aside},
          "weighing samples");
    });
  }

 private:
  [[nodiscard]] std::size_t rays() const { return list_.rays.size(); }

  template <class Extinction>
  [[nodiscard]] Values marched(const Values& volume, const Extinction& extinction) const {
    const CudaBuffer<Quad<Real>> light(volume);
    const CudaBuffer<Quad<Real>> seen(rays());
    using March = Forward<Real, Extinction, Path>;
    launch(rays(),
           MarchAndKeep<March, KeepRadiance<Real>>{{rays_.table(), light.data(), extinction}, {seen.data()}},
           "marching");
    return seen.download();
  }
  template <class Extinction>
  [[nodiscard]] Values spread(const Values& residual, const Extinction& extinction) const {
    const CudaBuffer<Quad<Real>> of_rays(residual);
    return gathered([&](const LayAside<Real>& aside) {
      launch(
          list_.runs.size(),
          Adjoint<Real, Extinction, Path, LayAside<Real>>{rays_.table(), of_rays.data(), extinction, aside},
          "weighing samples");
    });
  }
  template <class LayAll>
  [[nodiscard]] Values gathered(const LayAll& lay_all) const {
    const auto deposits = CudaBuffer<Deposit<Real>>::unfilled(samples_);
    const CudaBuffer<Quad<Real>> gradient(list_.grid.size());
    lay_all(LayAside<Real>{deposits.data(), 0});
    const Grid& g = list_.grid;
    const SamplesByVoxel sorted{by_voxel_.order.data(), by_voxel_.begin.data()};
    launch(g.size(), GatherDeposits<Real>{g.nx, g.ny, sorted, deposits.data(), gradient.data()}, "gathering");
    return gradient.download();
  }

  const RayList& list_;
  DeviceRayList rays_;
  std::size_t samples_;
  SortedSamples by_voxel_;
};

/// What an emission's step works on, copied.
struct Emission {
  explicit Emission(const Descend<double>& s)
      : weight(s.weight, s.grid.size()),
        stiffness(s.stiffness, s.grid.size()),
        y(s.y, s.grid.size()),
        x(s.x, s.grid.size()),
        next_y(s.next_y, s.grid.size()),
        gradient(s.gradient, s.grid.size()),
        step{s.grid,          weight.data(),    x.data(), y.data(),  next_y.data(),
             gradient.data(), stiffness.data(), s.scale,  s.momentum} {}
  void back() const {
    x.back();
    next_y.back();
    gradient.back();
  }

  Copy<const double> weight, stiffness;
  Copy<const Rgba64> y;
  Copy<Rgba64> x, next_y, gradient;
  Descend<double> step;
};

template <class Step>
void each_key_point(const Step& step) {
  launch(grid_of(step).size(), ActAt<Step>{step, grid_of(step)}, "stepping");
}

}  // namespace

template <class Real>
std::unique_ptr<Marches<Real>> cuda_marches(const RayList& list) {
  if (list.bends.empty()) return std::make_unique<CudaMarches<Real, StraightPath>>(list);
  return std::make_unique<CudaMarches<Real, CurvedPath>>(list);
}
template std::unique_ptr<Marches<float>> cuda_marches(const RayList& list);
template std::unique_ptr<Marches<double>> cuda_marches(const RayList& list);

void cuda_step(const Stiffen<double>& step) {
  const Copy<const double> weight(step.weight, step.grid.size());
  const Copy<const Rgba64> y(step.y, step.grid.size());
  const Copy<double> stiffness(step.stiffness, step.grid.size());
  each_key_point(Stiffen<double>{step.grid, weight.data(), y.data(), stiffness.data(), step.most, step.soft});
  stiffness.back();
}
void cuda_step(const Descend<double>& step) {
  const Emission emission(step);
  each_key_point(emission.step);
  emission.back();
}
void cuda_step(const DescendField<double>& step) {
  const Emission emission(step.emission);
  const std::size_t size = grid_of(step).size();
  const Copy<const double> weight(step.weight, size);
  const Copy<const double> reference(step.reference, size);
  each_key_point(DescendField<double>{emission.step, weight.data(), reference.data(), step.variation,
                                      step.soft, step.most});
  emission.back();
}

}  // namespace emberlock
