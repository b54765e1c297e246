// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include "recon/adjust/engine.h"
#include "recon/adjust/engine_parts.h"
#include "recon/effects/exposure.h"
#include "recon/kernels/paper.h"

namespace emberlock::recon {
namespace {

template <class Real>
class CpuEngine final : public Engine {
 public:
  CpuEngine(const Problem& problem, const Optics& optics, Pool& pool, EngineMemory memory)
      : problem_(problem),
        optics_(optics),
        travel_(problem.list.curved ? Travel::curved : Travel::straight),
        memory_(memory),
        pool_(pool),
        x_(memory == EngineMemory::steps ? problem.grid().size() : 0),
        y_(x_.size()),
        next_y_(x_.size()),
        gradient_(x_.size()),
        weight_(x_.size()),
        stiffness_(x_.size()),
        residual_(problem.rays()) {
    const ExposureBlur blur(optics.exposure, problem.grid());
    if (!blur.identity()) blur_ = blur;
    if (optics.absorb == Absorb::field) samples_.resize(problem.most_samples());
  }

  [[nodiscard]] std::vector<Rgba> get() const override { return converted<float>(x_); }
  [[nodiscard]] std::vector<Rgba> recent() override { return get(); }
  [[nodiscard]] std::vector<Rgba> residuals() const override { return converted<float>(residual_); }
  [[nodiscard]] Squares black_squares(std::size_t first_ray, std::size_t last_ray) const override {
    return squares_of(sum(BlackTerm{problem_.seen.data(), background()}, first_ray, last_ray));
  }
  [[nodiscard]] Weighed weigh(const std::vector<WeighedBox>& boxes, std::size_t rays, int stride) override {
    const std::vector<ViewPixels> views = problem_.view_pixels();
    const RayList& list = problem_.list;
    std::vector<float>& weights = ray_weights_.emplace_back(rays);
    const WeighRays act{views.data(), boxes.data(), list.rays.data(), list.pixels.data(), weights.data()};
    each_of(rays, act);
    const std::size_t rows = most_rows(boxes);
    return {ray_weights_.size() - 1,
            squares_of(
                sum(BlackOfRay{views.data(), list.rays.data(), list.pixels.data(), weights.data()}, 0, rays)),
            squares_of(sum<1>(BlackOfRow{views.data(), boxes.data(), rows, stride}, 0, rows * boxes.size()))};
  }
  [[nodiscard]] std::vector<Rgba> gradient() const override { return converted<float>(gradient_); }

  void set_offset(const std::vector<Rgba>& offset) override { offset_ = offset; }
  void set_weights(const std::vector<float>& weights) override {
    weight_.assign(weights.begin(), weights.end());
    clear_gradient();
  }
  void raise_weights(float scale) override { raise(weight_, 0, scale); }
  [[nodiscard]] std::vector<float> weights() const override { return {weight_.begin(), weight_.end()}; }

  void stiffen(float most, float soft) override {
    each_row(table_.stiffen, Stiffen<Real>{problem_.grid(), weight_.data(), y_.data(), stiffness_.data(),
                                           Real(most), Real(soft)});
  }

 private:
  [[nodiscard]] Squares sum_squares(std::size_t first_ray, std::size_t last_ray) const override {
    return squares_of(sum(SquareTerm<Real>{residual_.data(), nullptr}, first_ray, last_ray));
  }
  [[nodiscard]] Squares sum_squares(std::size_t weights) const override {
    const std::vector<float>& of_rays = ray_weights_.at(weights);
    return squares_of(sum(SquareTerm<Real>{residual_.data(), of_rays.data()}, 0, of_rays.size()));
  }
  template <std::size_t kElements = 32, class Term>
  [[nodiscard]] Quad<double> sum(const Term& term, std::size_t first, std::size_t last) const {
    SumChunk<Term, kElements> act{term, first, last, nullptr};
    std::vector<Quad<double>> sums(act.chunks());
    act.sums = sums.data();
    each_of(sums.size(), act);
    Quad<double> all;
    for (const Quad<double>& chunk : sums) all = all + chunk;
    return all;
  }
  template <class Act>
  void each_of(std::size_t count, const Act& act) const {
    constexpr int kTasks = 64;
    pool_.run(kTasks, [&](int task) {
      const Slice mine = slice(count, kTasks, task);
      for (std::size_t i = mine.begin; i < mine.end; ++i) act(i);
    });
  }
  [[nodiscard]] const Rgba* background() const {
    return problem_.background.empty() ? nullptr : problem_.background.data();
  }

  void put(const std::vector<Rgba>& x) override {
    x_ = converted<Real>(x);
    if (memory_ == EngineMemory::steps) y_ = next_y_ = x_;
  }
  [[nodiscard]] std::size_t grid_points() const override { return problem_.grid().size(); }
  [[nodiscard]] std::size_t held_points() const override { return x_.size(); }
  void march_other(const ResidualEngine& other, int subset) override {
    shown_ = &dynamic_cast<const CpuEngine&>(other).x_;
    march_residual(subset);
    shown_ = &y_;
  }
  void march_residual(int subset) override {
    residual(subset, problem_.pixel_residual<Real>(offset_, optics_.white));
  }
  void march_against(const std::vector<Rgba>& target, int subset, Behind behind) override {
    residual(subset, PixelResidual<Real>{target.data(), behind == Behind::background ? background() : nullptr,
                                         nullptr, 0});
  }
  void march_against_aim(int subset, Behind behind) override {
    aim_.resize(residual_.size());
    march_against(aim_, subset, behind);
  }
  void residual(int subset, const PixelResidual<Real>& pixel) {
    expose();
    if (optics_.absorb == Absorb::field) {
      const auto march = table_.field_forward[static_cast<int>(travel_)];
      each_slice(subset, [&](std::size_t begin, std::size_t end) { march(work(subset), pixel, begin, end); });
      return;
    }
    const auto march = table_.forward_of(optics_.absorb, travel_);
    each_slice(subset, [&](std::size_t begin, std::size_t end) {
      march(work(subset), begin, end);
      for (std::size_t r = begin; r < end; ++r) residual_[r] = pixel(r, residual_[r]);
    });
  }
  void march_radiance(int subset) override {
    expose();
    const auto march = table_.forward_of(optics_.absorb, travel_);
    each_slice(subset, [&](std::size_t begin, std::size_t end) { march(work(subset), begin, end); });
  }

  void spread(int subset) override {
    const auto march = table_.adjoint_of(optics_.absorb, travel_);
    std::vector<Quad<Real>>
        before;  // with an exposure: what the gradient was, before the transpose of B adds to it
    if (blur_) {
      before.resize(gradient_.size());
      before.swap(gradient_);
    }
    each_slab(subset,
              [&](const std::uint32_t* runs, std::size_t count) { march(work(subset), runs, count); });
    if (!blur_) return;
    gradient_ = converted<Real>(blur_->adjoint(converted<float>(gradient_), pool_));
    for (std::size_t p = 0; p < before.size(); ++p) gradient_[p] = gradient_[p] + before[p];
  }

  void copy_solution(const Engine& other) override {
    const auto& from = dynamic_cast<const CpuEngine&>(other);
    if (from.problem_.grid().edge == problem_.grid().edge) {
      x_ = from.x_;
    } else {
      const RefineLight<Real> refine =
          refinement<Real>(from.problem_, problem_, problem_.share.data(), from.x_.data(), x_.data());
      std::fill(x_.begin(), x_.end(), Quad<Real>{});
      each_row([&](int i, int j, int k) { refine(i, j, k); });
    }
    y_ = next_y_ = x_;
  }
  void put_expected_extinction(float even, float soot) override {
    const float mean =
        soot > 0 ? mean_of(sum(LuminanceTerm<Real>{problem_.share.data(), x_.data()}, 0, x_.size())) : 0;
    each_of(x_.size(), ExpectExtinction<Real>{problem_.share.data(), x_.data(), even, soot, mean});
    y_ = next_y_ = x_;
  }
  void put_even_light(float thinned) override {
    each_of(x_.size(), LightEvenly<Real>{problem_.share.data(), x_.data(), y_.data(), thinned});
  }
  void put_thicker(float by) override {
    each_of(x_.size(), Thicken<Real>{problem_.share.data(), x_.data(), y_.data(), by});
  }
  [[nodiscard]] float seen_over_shown(std::size_t last_ray) const override {
    return ratio(sum(SeenTerm<Real>{problem_.seen.data(), background(), residual_.data()}, 0, last_ray));
  }
  float settle_weights(float share, float factor) override { return settle(weight_, share, factor); }
  float settle_curvature(float share, float factor) override { return settle(field_weight_, share, factor); }
  float settle(std::vector<Real>& weights, float share, float factor) {
    const float mean = mean_of(sum(WeightTerm<Real>{weights.data()}, 0, weights.size()));
    each_of(weights.size(),
            SettleWeight<Real>{problem_.share.data(), weights.data(), Real(share * mean), Real(factor)});
    clear_gradient();
    return mean;
  }
  float put_reference() override {
    reference_.resize(x_.size());
    field_weight_.assign(x_.size(), 0);
    clear_gradient();
    each_of(x_.size(), TakeReference<Real>{problem_.share.data(), x_.data(), reference_.data()});
    return mean_of(sum(ExtinctionTerm<Real>{problem_.share.data(), x_.data()}, 0, x_.size()));
  }
  void aim_at_residuals() override {
    aim_.resize(residual_.size());
    each_of(aim_.size(), Convert<Real, float>{residual_.data(), aim_.data()});
  }
  void aim_at_slope(float rise) override {
    each_of(aim_.size(), AimAtSlope<Real>{residual_.data(), background(), rise, aim_.data()});
  }

  void copy_to_mark() override { marked_ = x_; }
  void swap_mark_and_kept() override { kept_.swap(marked_); }
  void copy_from_kept() override { x_ = y_ = next_y_ = kept_; }
  void copy_to_saved() override { saved_ = x_; }
  void copy_from_saved() override { x_ = y_ = next_y_ = saved_; }
  void forget_look_ahead() override { y_ = x_; }

  [[nodiscard]] bool takes_a_field() const override { return optics_.absorb == Absorb::field; }
  [[nodiscard]] bool takes_paper_steps() const override {
    return std::is_same_v<Real, float> && optics_.absorb != Absorb::field && travel_ == Travel::straight;
  }
  void step_emission(const Step& step) override { update(table_.update, emission_step(step)); }

  void put_field(const std::vector<float>& weights, const std::vector<float>& reference) override {
    field_weight_.assign(weights.begin(), weights.end());
    reference_.assign(reference.begin(), reference.end());
    clear_gradient();
  }
  void raise_curvature(float scale) override { raise(field_weight_, 3, scale); }
  [[nodiscard]] std::vector<float> curvature() const override {
    return {field_weight_.begin(), field_weight_.end()};
  }
  void step_field(const FieldStep& step) override {
    update(table_.field_update,
           DescendField<Real>{emission_step(step.emission), field_weight_.data(), reference_.data(),
                              Real(step.variation), Real(step.soft), Real(step.most)});
  }

  void step_paper(int subset, const PaperStep& step) override {
    if constexpr (std::is_same_v<Real, float>) {
      if (optics_.absorb == Absorb::constant)
        adjust_by(subset, step, ConstantExtinction<float>{optics_.sigma});
      else
        adjust_by(subset, step, NoExtinction<float>{});
    }
  }

  void clear_gradient() { std::fill(gradient_.begin(), gradient_.end(), Quad<Real>{}); }
  /// B y, where the exposure is long enough to matter.
  void expose() {
    if (blur_) blurred_ = converted<Real>(blur_->forward(converted<float>(*shown_), pool_));
  }
  [[nodiscard]] Descend<Real> emission_step(const Step& step) {
    return {problem_.grid(),  weight_.data(),    x_.data(),        y_.data(),           next_y_.data(),
            gradient_.data(), stiffness_.data(), Real(step.scale), Real(step.momentum), Real(step.length)};
  }
  void raise(std::vector<Real>& weights, int lane, float scale) {
    const RaiseWeight<Real> act{weights.data(), gradient_.data(), lane, Real(scale)};
    constexpr int kTasks = 64;
    pool_.run(kTasks, [&](int task) {
      const Slice points = slice(weights.size(), kTasks, task);
      for (std::size_t p = points.begin; p < points.end; ++p) act(p);
    });
  }
  template <class Entry, class Update>
  void update(Entry entry, const Update& step) {
    each_row(entry, step);
    y_.swap(next_y_);
  }
  template <class Entry, class Act>
  void each_row(Entry entry, const Act& act) {
    each_span([&](int begin, int end, int j, int k) { entry(act, begin, end, j, k); });
  }
  template <class Act>
  void each_row(const Act& act) {
    each_span([&](int begin, int end, int j, int k) {
      for (int i = begin; i < end; ++i) act(i, j, k);
    });
  }
  template <class Act>
  void each_span(const Act& act) {
    const Grid& g = problem_.grid();
    pool_.run(g.nz, [&](int k) {
      for (int j = 0; j < g.ny; ++j) {
        const Slice span = problem_.row_span[static_cast<std::size_t>(j) +
                                             static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(k)];
        act(static_cast<int>(span.begin), static_cast<int>(span.end), j, k);
      }
    });
  }
  [[nodiscard]] MarchWork<Real> work(int subset) {
    const std::size_t first = problem_.list.before[static_cast<std::size_t>(subset)].samples;
    return {problem_.list.table(),
            blur_ ? blurred_.data() : shown_->data(),
            Real(optics_.sigma),
            residual_.data(),
            gradient_.data(),
            samples_.data(),
            first};
  }
  template <class Do>
  void each_slice(int subset, const Do& act) {
    const auto s = static_cast<std::size_t>(subset);
    const std::size_t first = problem_.list.subset_begin[s];
    const std::size_t size = problem_.list.subset_begin[s + 1] - first;
    constexpr int kTasks = 64;
    pool_.run(kTasks, [&](int task) {
      const Slice rays = slice(size, kTasks, task);
      if (rays.begin < rays.end) act(first + rays.begin, first + rays.end);
    });
  }

  /// Even slabs, then odd ones: no two that run at the same time share a key point.
  template <class Do>
  void each_slab(int subset, const Do& act) {
    const SlabRuns& slabs = problem_.slabs[static_cast<std::size_t>(subset)];
    const int count = problem_.slab_count();
    for (int parity = 0; parity < 2; ++parity) {
      pool_.run((count + 1 - parity) / 2, [&](int task) {
        const int slab = 2 * task + parity;
        const auto s = static_cast<std::size_t>(slab);
        const std::size_t size = slabs.begin[s + 1] - slabs.begin[s];
        if (size > 0) act(&slabs.run[slabs.begin[s]], size);
      });
    }
  }

  template <class Extinction>
  void adjust_by(int subset, const PaperStep& step, const Extinction& extinction) {
    const RayTable table = problem_.list.table();
    const PaperAdjust<Extinction> adjustment{table,
                                             residual_.data(),
                                             extinction,
                                             {step.gain, step.deviation, step.stream},
                                             {table, x_.data(), {step.decay}}};
    each_slab(subset, [&](const std::uint32_t* runs, std::size_t count) {
      for (std::size_t n = 0; n < count; ++n) adjustment(runs[n]);
    });
    y_ = x_;
  }

  const Problem& problem_;
  Optics optics_;
  Travel travel_;
  EngineMemory memory_;
  Pool& pool_;
  const MarchTable<Real>& table_ = march_table<Real>();
  std::vector<Quad<Real>> x_, y_, next_y_, gradient_, marked_, kept_, saved_;
  const std::vector<Quad<Real>>* shown_ = &y_;  // what is marched
  std::vector<Real> weight_, stiffness_, field_weight_, reference_;
  std::vector<Quad<Real>> residual_;
  std::vector<Quad<Real>> samples_;  // of one subset
  std::vector<Rgba> offset_, aim_;
  std::vector<std::vector<float>> ray_weights_;
  std::optional<ExposureBlur> blur_;  // where the exposure is long enough to matter
  std::vector<Quad<Real>> blurred_;   // B y
};

}  // namespace

Optics absorbing_optics(float sigma) {
  Optics optics;
  if (sigma > 0) {
    optics.absorb = Absorb::constant;
    optics.sigma = sigma;
  }
  return optics;
}

namespace {

std::unique_ptr<Engine> make_here(const Problem& problem, const Optics& optics, Precision precision,
                                  Pool& pool, EngineMemory memory) {
  if constexpr (kCudaBuilt) {
    if (pool.device() == Device::cuda) return make_cuda_engine(problem, optics, precision, memory);
  }
  if (precision == Precision::float64)
    return std::make_unique<CpuEngine<double>>(problem, optics, pool, memory);
  return std::make_unique<CpuEngine<float>>(problem, optics, pool, memory);
}

}  // namespace

std::unique_ptr<Engine> make_engine(const Problem& problem, const Optics& optics, Precision precision,
                                    Pool& pool) {
  return make_here(problem, optics, precision, pool, EngineMemory::steps);
}

std::unique_ptr<ResidualEngine> make_residual_engine(const Problem& problem, const Optics& optics,
                                                     Precision precision, Pool& pool) {
  return make_here(problem, optics, precision, pool, EngineMemory::residuals);
}

}  // namespace emberlock::recon
