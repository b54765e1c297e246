// The engine's launches on a GPU. The functors are those of the CPU; sums into key points are atomic, so
// their order, and the last bits of a result, differ from run to run.
#include "recon/adjust/engine.h"
#include "recon/compute/cuda_buffer.h"
#include "recon/kernels/field.h"
#include "recon/kernels/march.h"
#include "recon/kernels/paper.h"
#include "recon/kernels/update.h"

namespace emberlock {
namespace {

constexpr unsigned kBlock = 128;

struct AddAtomically {
  HOST_DEVICE void operator()([[maybe_unused]] Rgba& target, [[maybe_unused]] const Rgba& value) const {
#ifdef __CUDA_ARCH__
    for (int c = 0; c < 4; ++c) atomicAdd(&target.c[c], value.c[c]);
#endif
  }
};

template <class March>
__global__ void march_rays(March march, Rgba* radiance, std::size_t first, std::size_t last) {
  const std::size_t ray = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < last) radiance[ray] = march(ray);
}

template <class March>
__global__ void march_and_judge(March march, Judge<float> judge, Rgba* residual, std::size_t first,
                                std::size_t last) {
  const std::size_t ray = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < last) residual[ray] = judge(ray, march(ray));
}

struct JudgeAndKeep {
  Judge<float> judge;
  Rgba* residual;
  HOST_DEVICE Rgba operator()(std::size_t ray, const Rgba& radiance) const {
    return residual[ray] = judge(ray, radiance);
  }
};

template <class March>
__global__ void march_field(March march, JudgeAndKeep judge, std::size_t first, std::size_t last) {
  const std::size_t ray = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < last) march(ray, judge);
}

template <class Scatter>
__global__ void scatter_runs(Scatter scatter, std::size_t first, std::size_t last) {
  const std::size_t run = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (run < last) scatter(run, layers_of(scatter.table.runs[run]));
}

template <class Update>
__global__ void update_keys(Update update, int nx) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < nx) update(i, static_cast<int>(blockIdx.y), static_cast<int>(blockIdx.z));
}

/// One combination of the shipped ones.
template <class Extinction, class Path>
class CudaEngine final : public Engine {
 public:
  CudaEngine(const Problem& problem, const Optics& optics, Extinction extinction)
      : problem_(problem),
        optics_(optics),
        extinction_(extinction),
        origins_(problem.list.origins),
        rays_(problem.list.rays),
        runs_(problem.list.runs),
        bends_(problem.list.bends),
        seen_(problem.seen),
        background_(problem.background),
        offset_(problem.list.rays.size()),
        x_(problem.grid().size()),
        y_(problem.grid().size()),
        next_y_(problem.grid().size()),
        gradient_(problem.grid().size()),
        weight_(problem.grid().size()),
        field_weight_(problem.grid().size()),
        reference_(problem.grid().size()),
        residual_(problem.list.rays.size()),
        target_(problem.list.rays.size()),
        samples_(Extinction::kField ? problem.most_samples() : 0) {}

  void set(const std::vector<Rgba>& x) override {
    x_.upload(x);
    y_.copy_from(x_);
    next_y_.copy_from(x_);
  }
  [[nodiscard]] std::vector<Rgba> get() const override { return x_.download(); }
  [[nodiscard]] std::vector<Rgba> residuals() const override { return residual_.download(); }
  [[nodiscard]] std::vector<Rgba> gradient() const override { return gradient_.download(); }

  void residual(int subset) override {
    Judge<float> judge = problem_.judge<float>(offset_host_, optics_.white);
    judge.seen = seen_.data();
    if (judge.background != nullptr) judge.background = background_.data();
    if (judge.offset != nullptr) judge.offset = offset_.data();
    residual(subset, judge);
  }
  void set_offset(const std::vector<Rgba>& offset) override {
    offset_host_ = offset;
    if (!offset.empty()) offset_.upload(offset);
  }
  void residual_against(const std::vector<Rgba>& target, int subset) override {
    target_.upload(target);
    residual(subset, Judge<float>{target_.data(), nullptr, nullptr, 0});
  }
  void residual(int subset, const Judge<float>& judge) {
    const auto [begin, end] = rays_of(subset);
    if (begin == end) return;
    if constexpr (Extinction::kField) {
      march_field<<<blocks_for(end - begin), kBlock>>>(
          FieldForward<float, Path>{table(), y_.data(), samples_.data(), first_sample(subset)},
          JudgeAndKeep{judge, residual_.data()}, begin, end);
    } else {
      march_and_judge<<<blocks_for(end - begin), kBlock>>>(forward(), judge, residual_.data(), begin, end);
    }
    check_cuda(cudaGetLastError(), "residual");
  }

  void project(int subset) override {
    const auto [begin, end] = rays_of(subset);
    if (begin == end) return;
    march_rays<<<blocks_for(end - begin), kBlock>>>(forward(), residual_.data(), begin, end);
    check_cuda(cudaGetLastError(), "project");
  }

  void backproject(int subset) override {
    if constexpr (Extinction::kField) {
      scatter(subset, FieldAdjoint<float, Path, AddAtomically>{table(), residual_.data(), samples_.data(),
                                                               first_sample(subset), gradient_.data()});
    } else {
      scatter(subset, Adjoint<float, Extinction, Path, AddAtomically>{table(), residual_.data(),
                                                                      gradient_.data(), extinction_});
    }
  }

  void clear_gradient() override { gradient_.clear(); }
  void set_weights(const std::vector<float>& weights) override {
    weight_.upload(weights);
    gradient_.clear();
  }

  void descend(const Step& step) override { update(emission_step(step)); }

  void set_field(const std::vector<float>& weights, const std::vector<float>& reference) override {
    field_weight_.upload(weights);
    reference_.upload(reference);
    gradient_.clear();
  }
  void descend_field(const FieldStep& step) override {
    update(DescendField<float>{emission_step(step.emission), field_weight_.data(), reference_.data(),
                               step.variation, step.soft, step.most});
  }

  void adjust([[maybe_unused]] int subset, [[maybe_unused]] const PaperStep& step) override {
    if constexpr (!Extinction::kField && std::is_same_v<Path, StraightPath>) {
      scatter(subset,
              PaperAdjust<Extinction, AddAtomically>{table(), residual_.data(), x_.data(), extinction_,
                                                     step.gain, step.decay, step.deviation, step.stream});
      y_.copy_from(x_);
    }
  }

 private:
  [[nodiscard]] Descend<float> emission_step(const Step& step) {
    const Grid& g = problem_.grid();
    return {g.nx,       g.ny,           g.nz,           weight_.data(),
            x_.data(),  y_.data(),      next_y_.data(), gradient_.data(),
            step.scale, step.smoothing, step.momentum};
  }
  template <class Update>
  void update(const Update& step) {
    const Grid& g = problem_.grid();
    const dim3 blocks((static_cast<unsigned>(g.nx) + kBlock - 1) / kBlock, static_cast<unsigned>(g.ny),
                      static_cast<unsigned>(g.nz));
    update_keys<<<blocks, kBlock>>>(step, g.nx);
    check_cuda(cudaGetLastError(), "update_keys");
    y_.swap(next_y_);
  }
  [[nodiscard]] RayTable table() const {
    const Grid& g = problem_.grid();
    return {origins_.data(),
            rays_.data(),
            runs_.data(),
            problem_.list.bends.empty() ? nullptr : bends_.data(),
            g.nx,
            g.ny,
            g.nz};
  }
  [[nodiscard]] Forward<float, Extinction, Path> forward() const { return {table(), y_.data(), extinction_}; }
  [[nodiscard]] Slice rays_of(int subset) const {
    const auto s = static_cast<std::size_t>(subset);
    return {problem_.list.subset_begin[s], problem_.list.subset_begin[s + 1]};
  }
  [[nodiscard]] std::size_t first_sample(int subset) const {
    return problem_.list.first_sample(rays_of(subset).begin);
  }
  static unsigned blocks_for(std::size_t rays) { return static_cast<unsigned>((rays + kBlock - 1) / kBlock); }

  template <class Scatter>
  void scatter(int subset, const Scatter& functor) {
    const Slice rays = rays_of(subset);
    const std::size_t begin = problem_.list.first_run(rays.begin);
    const std::size_t end = problem_.list.first_run(rays.end);
    if (begin == end) return;
    scatter_runs<<<blocks_for(end - begin), kBlock>>>(functor, begin, end);
    check_cuda(cudaGetLastError(), "scatter_runs");
  }

  const Problem& problem_;
  Optics optics_;
  Extinction extinction_;
  CudaBuffer<float> origins_;
  CudaBuffer<MarchRay> rays_;
  CudaBuffer<Run> runs_;
  CudaBuffer<Bend> bends_;
  CudaBuffer<Rgba> seen_, background_, offset_, x_, y_, next_y_, gradient_;
  std::vector<Rgba> offset_host_;
  CudaBuffer<float> weight_, field_weight_, reference_;
  CudaBuffer<Rgba> residual_, target_, samples_;
};

template <class Extinction>
std::unique_ptr<Engine> make_with(const Problem& problem, const Optics& optics, Extinction extinction) {
  if (problem.list.bends.empty())
    return std::make_unique<CudaEngine<Extinction, StraightPath>>(problem, optics, extinction);
  return std::make_unique<CudaEngine<Extinction, CurvedPath>>(problem, optics, extinction);
}

}  // namespace

std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, const Optics& optics) {
  switch (optics.absorb) {
    case Absorb::field:
      return make_with(problem, optics, FieldExtinction<float>{});
    case Absorb::constant:
      return make_with(problem, optics, ConstantExtinction<float>{optics.sigma});
    case Absorb::nothing:
      break;
  }
  return make_with(problem, optics, NoExtinction<float>{});
}

}  // namespace emberlock
