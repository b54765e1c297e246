// The engine's launches on a GPU. The functors are those of the CPU; sums into key points are atomic, so
// their order, and the last bits of a result, differ from run to run.
#include "recon/adjust/engine.h"
#include "recon/compute/cuda_buffer.h"
#include "recon/kernels/march.h"
#include "recon/kernels/paper.h"
#include "recon/kernels/update.h"

namespace emberlock {
namespace {

constexpr unsigned kBlock = 128;
constexpr int kAllLayers = 1 << 30;

struct AddAtomically {
  HOST_DEVICE void operator()([[maybe_unused]] Rgba& target, [[maybe_unused]] const Rgba& value) const {
#ifdef __CUDA_ARCH__
    for (int c = 0; c < 4; ++c) atomicAdd(&target.c[c], value.c[c]);
#endif
  }
};

template <class Extinction>
__global__ void march_rays(Forward<Extinction> forward, const Rgba* seen, Rgba* residual, std::size_t first,
                           std::size_t last) {
  const std::size_t ray = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < last) residual[ray] = seen == nullptr ? forward(ray) : forward(ray) - seen[ray];
}

template <class Scatter>
__global__ void scatter_rays(Scatter scatter, std::size_t first, std::size_t last) {
  const std::size_t ray = first + blockIdx.x * std::size_t{blockDim.x} + threadIdx.x;
  if (ray < last) scatter(ray, 0, kAllLayers);
}

__global__ void update_keys(Descend descend) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < descend.nx) descend(i, static_cast<int>(blockIdx.y), static_cast<int>(blockIdx.z));
}

template <class Extinction>
class CudaEngine final : public Engine {
 public:
  CudaEngine(const Problem& problem, Extinction extinction)
      : problem_(problem),
        extinction_(extinction),
        origins_(problem.list.origins),
        rays_(problem.list.rays),
        runs_(problem.list.runs),
        seen_(problem.seen),
        x_(problem.grid().size()),
        y_(problem.grid().size()),
        next_y_(problem.grid().size()),
        gradient_(problem.grid().size()),
        weight_(problem.grid().size()),
        residual_(problem.list.rays.size()) {}

  void set(const std::vector<Rgba>& x) override {
    x_.upload(x);
    y_.copy_from(x_);
    next_y_.copy_from(x_);
  }
  [[nodiscard]] std::vector<Rgba> get() const override { return x_.download(); }
  [[nodiscard]] std::vector<Rgba> residuals() const override { return residual_.download(); }
  [[nodiscard]] std::vector<Rgba> gradient() const override { return gradient_.download(); }

  void residual(int subset) override { march(subset, seen_.data()); }
  void project(int subset) override { march(subset, nullptr); }

  void backproject(int subset) override {
    scatter(subset,
            Adjoint<Extinction, AddAtomically>{table(), residual_.data(), gradient_.data(), extinction_});
  }

  void set_weights(const std::vector<float>& weights) override {
    weight_.upload(weights);
    gradient_.clear();
  }

  void descend(const Step& step) override {
    const Grid& g = problem_.grid();
    const Descend update{g.nx,       g.ny,           g.nz,           weight_.data(),
                         x_.data(),  y_.data(),      next_y_.data(), gradient_.data(),
                         step.scale, step.smoothing, step.momentum};
    const dim3 blocks((static_cast<unsigned>(g.nx) + kBlock - 1) / kBlock, static_cast<unsigned>(g.ny),
                      static_cast<unsigned>(g.nz));
    update_keys<<<blocks, kBlock>>>(update);
    check_cuda(cudaGetLastError(), "update_keys");
    y_.swap(next_y_);
  }

  void adjust(int subset, const PaperStep& step) override {
    scatter(subset,
            PaperAdjust<Extinction, AddAtomically>{table(), residual_.data(), x_.data(), extinction_,
                                                   step.gain, step.decay, step.deviation, step.stream});
    y_.copy_from(x_);
  }

 private:
  [[nodiscard]] RayTable table() const {
    const Grid& g = problem_.grid();
    return {origins_.data(), rays_.data(), runs_.data(), g.nx, g.ny, g.nz};
  }
  [[nodiscard]] std::size_t first(int subset) const {
    return problem_.list.subset_begin[static_cast<std::size_t>(subset)];
  }
  static unsigned blocks_for(std::size_t rays) { return static_cast<unsigned>((rays + kBlock - 1) / kBlock); }

  void march(int subset, const Rgba* seen) {
    const std::size_t begin = first(subset);
    const std::size_t end = first(subset + 1);
    if (begin == end) return;
    march_rays<<<blocks_for(end - begin), kBlock>>>(Forward<Extinction>{table(), y_.data(), extinction_},
                                                    seen, residual_.data(), begin, end);
    check_cuda(cudaGetLastError(), "march_rays");
  }
  template <class Scatter>
  void scatter(int subset, const Scatter& functor) {
    const std::size_t begin = first(subset);
    const std::size_t end = first(subset + 1);
    if (begin == end) return;
    scatter_rays<<<blocks_for(end - begin), kBlock>>>(functor, begin, end);
    check_cuda(cudaGetLastError(), "scatter_rays");
  }

  const Problem& problem_;
  Extinction extinction_;
  CudaBuffer<float> origins_;
  CudaBuffer<MarchRay> rays_;
  CudaBuffer<Run> runs_;
  CudaBuffer<Rgba> seen_, x_, y_, next_y_, gradient_;
  CudaBuffer<float> weight_;
  CudaBuffer<Rgba> residual_;
};

}  // namespace

std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, float sigma) {
  if (sigma > 0) return std::make_unique<CudaEngine<ConstantExtinction>>(problem, ConstantExtinction{sigma});
  return std::make_unique<CudaEngine<NoExtinction>>(problem, NoExtinction{});
}

}  // namespace emberlock
