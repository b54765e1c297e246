#include <algorithm>

#include "recon/adjust/engine.h"
#include "recon/kernels/march.h"
#include "recon/kernels/paper.h"
#include "recon/kernels/update.h"

namespace emberlock {
namespace {

template <class Extinction>
class CpuEngine final : public Engine {
 public:
  CpuEngine(const Problem& problem, Extinction extinction, Pool& pool)
      : problem_(problem),
        extinction_(extinction),
        pool_(pool),
        x_(problem.grid().size()),
        y_(x_.size()),
        next_y_(x_.size()),
        gradient_(x_.size()),
        weight_(x_.size()),
        residual_(problem.list.rays.size()) {}

  void set(const std::vector<Rgba>& x) override { x_ = y_ = next_y_ = x; }
  [[nodiscard]] std::vector<Rgba> get() const override { return x_; }
  [[nodiscard]] std::vector<Rgba> residuals() const override { return residual_; }
  [[nodiscard]] std::vector<Rgba> gradient() const override { return gradient_; }

  void residual(int subset) override {
    each_ray(subset,
             [&](std::size_t r, const Rgba& radiance) { residual_[r] = radiance - problem_.seen[r]; });
  }
  void project(int subset) override {
    each_ray(subset, [&](std::size_t r, const Rgba& radiance) { residual_[r] = radiance; });
  }

  void backproject(int subset) override {
    each_slab(subset,
              Adjoint<Extinction>{problem_.list.table(), residual_.data(), gradient_.data(), extinction_});
  }

  void set_weights(const std::vector<float>& weights) override {
    weight_ = weights;
    std::fill(gradient_.begin(), gradient_.end(), Rgba{});
  }

  void descend(const Step& step) override {
    const Grid& g = problem_.grid();
    const Descend update{g.nx,       g.ny,           g.nz,           weight_.data(),
                         x_.data(),  y_.data(),      next_y_.data(), gradient_.data(),
                         step.scale, step.smoothing, step.momentum};
    pool_.run(g.nz, [&](int k) {
      for (int j = 0; j < g.ny; ++j) {
        const Slice span = problem_.row_span[static_cast<std::size_t>(j) +
                                             static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(k)];
        for (std::size_t i = span.begin; i < span.end; ++i) update(static_cast<int>(i), j, k);
      }
    });
    y_.swap(next_y_);
  }

  void adjust(int subset, const PaperStep& step) override {
    each_slab(subset, PaperAdjust<Extinction>{problem_.list.table(), residual_.data(), x_.data(), extinction_,
                                              step.gain, step.decay, step.deviation, step.stream});
    y_ = x_;
  }

 private:
  template <class Store>
  void each_ray(int subset, const Store& store) {
    const auto s = static_cast<std::size_t>(subset);
    const std::size_t first = problem_.list.subset_begin[s];
    const std::size_t size = problem_.list.subset_begin[s + 1] - first;
    const Forward<Extinction> forward{problem_.list.table(), y_.data(), extinction_};
    constexpr int kTasks = 64;
    pool_.run(kTasks, [&](int task) {
      const Slice rays = slice(size, kTasks, task);
      for (std::size_t r = first + rays.begin; r < first + rays.end; ++r) store(r, forward(r));
    });
  }

  /// Even slabs, then odd ones: no two that run at the same time share a key point.
  template <class Scatter>
  void each_slab(int subset, const Scatter& scatter) {
    const SlabRays& slabs = problem_.slabs[static_cast<std::size_t>(subset)];
    const int count = problem_.slab_count();
    for (int parity = 0; parity < 2; ++parity) {
      pool_.run((count + 1 - parity) / 2, [&](int task) {
        const int slab = 2 * task + parity;
        const auto s = static_cast<std::size_t>(slab);
        for (std::size_t n = slabs.begin[s]; n < slabs.begin[s + 1]; ++n)
          scatter(slabs.ray[n], slab * Problem::kSlab, (slab + 1) * Problem::kSlab);
      });
    }
  }

  const Problem& problem_;
  Extinction extinction_;
  Pool& pool_;
  std::vector<Rgba> x_, y_, next_y_, gradient_;
  std::vector<float> weight_;
  std::vector<Rgba> residual_;
};

}  // namespace

std::unique_ptr<Engine> make_engine(const Problem& problem, float sigma, [[maybe_unused]] Device device,
                                    Pool& pool) {
#ifdef EMBERLOCK_HAVE_CUDA
  if (device == Device::cuda) return make_cuda_engine(problem, sigma);
#endif
  if (sigma > 0)
    return std::make_unique<CpuEngine<ConstantExtinction>>(problem, ConstantExtinction{sigma}, pool);
  return std::make_unique<CpuEngine<NoExtinction>>(problem, NoExtinction{}, pool);
}

}  // namespace emberlock
