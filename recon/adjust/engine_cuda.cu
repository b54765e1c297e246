// SPDX-License-Identifier: Apache-2.0
// The engine's launches on a GPU, of the functors that the CPU runs, except for sums into key points: these
// are gathered (gather.h), so results have the same bits on every run.
#include <algorithm>
#include <optional>
#include <stdexcept>

#include "recon/adjust/cuda_sweep.h"
#include "recon/adjust/engine.h"
#include "recon/adjust/engine_parts.h"
#include "recon/adjust/gpu_blur.h"
#include "recon/adjust/gpu_problem.h"
#include "recon/adjust/sort_cuda.h"
#include "recon/compute/cuda_graph.h"
#include "recon/compute/cuda_launch.h"
#include "recon/compute/cuda_snapshot.h"
#include "recon/compute/cuda_sum.h"
#include "recon/effects/exposure.h"
#include "recon/kernels/field.h"
#include "recon/kernels/gather.h"
#include "recon/kernels/update.h"

namespace emberlock::recon {
namespace {

/// The volume of an engine, whatever marches through it.
template <class Real>
class CudaVolume {
 public:
  explicit CudaVolume(std::size_t size) : x_(size) {}
  [[nodiscard]] const CudaBuffer<Quad<Real>>& volume() const { return x_; }

 protected:
  CudaBuffer<Quad<Real>> x_;
};

/// One combination of the shipped ones.
template <class Real, class Extinction, class Path>
class CudaEngine final : public Engine, public CudaVolume<Real> {
 public:
  CudaEngine(const Problem& problem, const Optics& optics, Extinction extinction, EngineMemory memory)
      : CudaVolume<Real>(memory == EngineMemory::steps ? problem.grid().size() : 0),
        problem_(problem),
        memory_(memory),
        optics_(optics),
        extinction_(extinction),
        on_gpu_(GpuProblem::of(problem)),
        y_(x_.size()),
        next_y_(x_.size()),
        gradient_(x_.size()),
        weight_(x_.size()),
        stiffness_(x_.size()),
        residual_(problem.rays()),
        samples_(CudaBuffer<Quad<Real>>::unfilled(Extinction::kField ? problem.most_samples() : 0)) {
    const ExposureBlur blur(optics.exposure, problem.grid());
    if (!blur.identity()) {
      blur_.emplace(blur, problem.grid());
      exposed_gradient_ = CudaBuffer<Quad<Real>>(x_.size());
    }
    if (memory == EngineMemory::steps) prepare_sums();
  }

  [[nodiscard]] std::vector<Rgba> get() const override { return converted<float>(x_.download()); }
  [[nodiscard]] std::vector<Rgba> recent() override {
    if (!snapshot_) snapshot_.emplace(size());
    const Quad<Real>* arrived = snapshot_->latest();
    std::vector<Rgba> x;
    if (arrived != nullptr) x = converted<float>(std::vector<Quad<Real>>(arrived, arrived + size()));
    snapshot_->start(x_);
    return x;
  }
  [[nodiscard]] std::vector<Rgba> residuals() const override {
    return converted<float>(residual_.download());
  }
  [[nodiscard]] Squares black_squares(std::size_t first_ray, std::size_t last_ray) const override {
    return squares_of(
        sum_on_cuda(BlackTerm{on_gpu_->seen.data(), on_gpu_->background.data()}, first_ray, last_ray));
  }
  [[nodiscard]] Weighed weigh(const std::vector<WeighedBox>& boxes, std::size_t rays, int stride) override {
    const CudaBuffer<WeighedBox> on_gpu_boxes(boxes);
    const ViewPixels* views = on_gpu_->views.data();
    const MarchRay* of_rays = on_gpu_->rays->rays.data();
    const std::uint32_t* pixels = on_gpu_->rays->pixels.data();
    const CudaBuffer<float>& weights = ray_weights_.emplace_back(CudaBuffer<float>::unfilled(rays));
    launch(rays, WeighRays{views, on_gpu_boxes.data(), of_rays, pixels, weights.data()}, "weighing rays");
    const std::size_t rows = most_rows(boxes);
    return {ray_weights_.size() - 1,
            squares_of(sum_on_cuda(BlackOfRay{views, of_rays, pixels, weights.data()}, 0, rays)),
            squares_of(sum_on_cuda<1>(BlackOfRow{views, on_gpu_boxes.data(), rows, stride}, 0,
                                      rows * boxes.size()))};
  }
  [[nodiscard]] std::vector<Rgba> gradient() const override { return converted<float>(gradient_.download()); }

  void set_offset(const std::vector<Rgba>& offset) override { offset_.upload(offset); }

  void set_weights(const std::vector<float>& weights) override {
    weight_.upload({weights.begin(), weights.end()});
    gradient_.clear();
  }

  void raise_weights(float scale) override { raise(weight_, 0, scale); }
  [[nodiscard]] std::vector<float> weights() const override { return as_floats(weight_); }

  void stiffen(float most, float soft) override {
    each_key_point(
        Stiffen<Real>{problem_.grid(), weight_.data(), y_.data(), stiffness_.data(), Real(most), Real(soft)},
        "stiffening");
  }

 private:
  using Radiance = Forward<Real, Extinction, Path>;

  [[nodiscard]] Squares sum_squares(std::size_t first_ray, std::size_t last_ray) const override {
    return squares_of(sum_on_cuda(SquareTerm<Real>{residual_.data(), nullptr}, first_ray, last_ray));
  }
  [[nodiscard]] Squares sum_squares(std::size_t weights) const override {
    const CudaBuffer<float>& of_rays = ray_weights_.at(weights);
    return squares_of(sum_on_cuda(SquareTerm<Real>{residual_.data(), of_rays.data()}, 0, of_rays.size()));
  }
  void put(const std::vector<Rgba>& x) override {
    x_.upload(converted<Real>(x));
    if (memory_ == EngineMemory::residuals) return;
    y_.copy_from(x_);
    next_y_.copy_from(x_);
  }
  [[nodiscard]] std::size_t grid_points() const override { return problem_.grid().size(); }
  [[nodiscard]] std::size_t held_points() const override { return x_.size(); }
  void march_other(const ResidualEngine& other, int subset) override {
    shown_ = &dynamic_cast<const CudaVolume<Real>&>(other).volume();
    march_residual(subset);
    shown_ = &y_;
  }
  void march_residual(int subset) override {
    residual(subset, PixelResidual<Real>{on_gpu_->seen.data(), on_gpu_->background.data(), offset_.data(),
                                         Real(optics_.white)});
  }
  void march_against(const std::vector<Rgba>& target, int subset, Behind behind) override {
    aim_.upload(target);
    march_against_aim(subset, behind);
  }
  void march_against_aim(int subset, Behind behind) override {
    if (aim_.size() != residual_.size()) aim_ = CudaBuffer<Rgba>(residual_.size());
    const Rgba* background = behind == Behind::background ? on_gpu_->background.data() : nullptr;
    residual(subset, PixelResidual<Real>{aim_.data(), background, nullptr, 0});
  }
  void residual(int subset, const PixelResidual<Real>& pixel) {
    const KeepResidual<Real> keep{pixel, residual_.data()};
    if constexpr (Extinction::kField) {
      const FieldForward<Real, Path> march{on_gpu_->rays->table(), exposed(), samples_.data(),
                                           first_sample(subset)};
      each_ray(subset, MarchByResidual<FieldForward<Real, Path>, KeepResidual<Real>>{march, keep});
    } else {
      each_ray(subset, MarchAndKeep<Radiance, KeepResidual<Real>>{radiance(), keep});
    }
  }
  void march_radiance(int subset) override {
    each_ray(subset, MarchAndKeep<Radiance, KeepRadiance<Real>>{radiance(), {residual_.data()}});
  }

  void spread(int subset) override {
    if constexpr (Extinction::kField) {
      lay_aside(subset, FieldWeight<Real>{residual_.data(), samples_.data(), first_sample(subset)});
    } else {
      lay_aside(subset, AdjointWeight<Real, Extinction>{residual_.data(), extinction_});
    }
    if (!blur_) return add_up(subset, gradient_, Trilinear{});
    exposed_gradient_.clear();
    add_up(subset, exposed_gradient_, Trilinear{});
    launch(size(), AddAt<Real>{blur_->adjoint(exposed_gradient_), gradient_.data()}, "adding up");
  }

  void copy_solution(const Engine& other) override {
    const auto& from = dynamic_cast<const CudaEngine&>(other);
    if (from.problem_.grid().edge == problem_.grid().edge)
      x_.copy_from(from.x_);
    else
      each_key_point(refinement<Real>(from.problem_, problem_, share(), from.x_.data(), x_.data()),
                     "refining");
    look_from_x();
  }
  void put_expected_extinction(float even, float soot) override {
    const float mean =
        soot > 0 ? mean_of(sum_on_cuda(LuminanceTerm<Real>{share(), x_.data()}, 0, size())) : 0;
    launch(size(), ExpectExtinction<Real>{share(), x_.data(), even, soot, mean}, "expecting extinction");
    look_from_x();
  }
  void put_even_light(float thinned) override {
    launch(size(), LightEvenly<Real>{share(), x_.data(), y_.data(), thinned}, "lighting evenly");
  }
  void put_thicker(float by) override {
    launch(size(), Thicken<Real>{share(), x_.data(), y_.data(), by}, "thickening");
  }
  [[nodiscard]] float seen_over_shown(std::size_t last_ray) const override {
    return ratio(sum_on_cuda(
        SeenTerm<Real>{on_gpu_->seen.data(), on_gpu_->background.data(), residual_.data()}, 0, last_ray));
  }
  float settle_weights(float share, float factor) override { return settle(weight_, share, factor); }
  float settle_curvature(float share, float factor) override { return settle(field_weight_, share, factor); }
  float settle(CudaBuffer<Real>& weights, float least, float factor) {
    const float mean = mean_of(sum_on_cuda(WeightTerm<Real>{weights.data()}, 0, size()));
    launch(size(), SettleWeight<Real>{share(), weights.data(), Real(least * mean), Real(factor)},
           "settling weights");
    gradient_.clear();
    return mean;
  }
  float put_reference() override {
    graphs_.clear();  // they know the memory that goes
    reference_ = CudaBuffer<Real>::unfilled(size());
    field_weight_ = CudaBuffer<Real>(size());
    gradient_.clear();
    launch(size(), TakeReference<Real>{share(), x_.data(), reference_.data()}, "taking the extinction");
    return mean_of(sum_on_cuda(ExtinctionTerm<Real>{share(), x_.data()}, 0, size()));
  }
  void aim_at_residuals() override {
    if (aim_.size() != residual_.size()) aim_ = CudaBuffer<Rgba>::unfilled(residual_.size());
    launch(aim_.size(), Convert<Real, float>{residual_.data(), aim_.data()}, "aiming");
  }
  void aim_at_slope(float rise) override {
    launch(aim_.size(), AimAtSlope<Real>{residual_.data(), on_gpu_->background.data(), rise, aim_.data()},
           "aiming");
  }
  void look_from_x() {
    forget_look_ahead();
    next_y_.copy_from(x_);
  }

  void copy_to_mark() override {
    if (marked_.size() != size()) marked_ = CudaBuffer<Quad<Real>>::unfilled(size());
    marked_.copy_from(x_);
  }
  void swap_mark_and_kept() override { kept_.swap(marked_); }
  void copy_from_kept() override { return_to(kept_); }
  void copy_to_saved() override {
    if (saved_.size() != size()) saved_ = CudaBuffer<Quad<Real>>::unfilled(size());
    saved_.copy_from(x_);
  }
  void copy_from_saved() override { return_to(saved_); }
  void return_to(const CudaBuffer<Quad<Real>>& earlier) {
    x_.copy_from(earlier);
    look_from_x();
  }
  void forget_look_ahead() override { y_.copy_from(x_); }

  void step_emission(const Step& step) override { update(emission_step(step)); }
  /// A pass is always the same launches but for the momenta, which the launches read from the GPU's memory.
  void sweep_subsets(const std::vector<SubsetStep>& steps, const FieldStep* field) override {
    std::vector<float> momenta;
    momenta.reserve(steps.size());
    for (const SubsetStep& s : steps) momenta.push_back(s.step.momentum);
    if (momenta_.size() != momenta.size()) graphs_.clear();  // they read from the memory that goes
    if (momenta != uploaded_momenta_) momenta_.upload(momenta);
    uploaded_momenta_ = std::move(momenta);
    Sweep sweep{y_.data(), offset_.data(), steps, field != nullptr ? std::optional(*field) : std::nullopt};
    const auto same = [&](const auto& known) { return known.first == sweep; };
    auto graph = std::find_if(graphs_.begin(), graphs_.end(), same);
    if (graph == graphs_.end()) {
      constexpr std::size_t kMost = 4;
      if (graphs_.size() == kMost) graphs_.erase(graphs_.begin());
      graphs_.emplace_back(std::move(sweep), CudaGraph([&] {
                             for (std::size_t n = 0; n < steps.size(); ++n) {
                               momentum_ = momenta_.data() + n;
                               sweep_subset(steps[n], field);
                             }
                             momentum_ = nullptr;
                           }));
      graph = graphs_.end() - 1;
    } else if (steps.size() % 2 != 0) {
      y_.swap(next_y_);  // as recording does, step by step
    }
    graph->second.launch();
  }
  [[nodiscard]] bool takes_a_field() const override { return Extinction::kField; }
  [[nodiscard]] bool takes_paper_steps() const override { return kPaperSteps; }
  void put_field(const std::vector<float>& weights, const std::vector<float>& reference) override {
    graphs_.clear();  // they know the memory that goes
    field_weight_.upload({weights.begin(), weights.end()});
    reference_.upload({reference.begin(), reference.end()});
    gradient_.clear();
  }
  void raise_curvature(float scale) override { raise(field_weight_, 3, scale); }
  [[nodiscard]] std::vector<float> curvature() const override { return as_floats(field_weight_); }
  void step_field(const FieldStep& step) override {
    update(DescendField<Real>{emission_step(step.emission), field_weight_.data(), reference_.data(),
                              Real(step.variation), Real(step.soft), Real(step.most)});
  }

  void step_paper([[maybe_unused]] int subset, [[maybe_unused]] const PaperStep& step) override {
    if constexpr (kPaperSteps) {
      lay_aside(subset, PaperWeight<Extinction>{
                            residual_.data(), extinction_, {step.gain, step.deviation, step.stream}});
      add_up(subset, x_, Fade{step.decay});
      y_.copy_from(x_);
    }
  }

  static constexpr bool kPaperSteps =
      std::is_same_v<Real, float> && !Extinction::kField && std::is_same_v<Path, StraightPath>;

  [[nodiscard]] std::size_t size() const { return problem_.grid().size(); }
  /// y, or B y where the exposure is long enough to matter.
  [[nodiscard]] const Quad<Real>* exposed() { return blur_ ? blur_->forward(*shown_) : shown_->data(); }
  [[nodiscard]] Radiance radiance() { return {on_gpu_->rays->table(), exposed(), extinction_}; }
  [[nodiscard]] Descend<Real> emission_step(const Step& step) {
    return {problem_.grid(),  weight_.data(),    x_.data(),        y_.data(),           next_y_.data(),
            gradient_.data(), stiffness_.data(), Real(step.scale), Real(step.momentum), Real(step.length)};
  }
  void raise(CudaBuffer<Real>& weights, int lane, float scale) {
    launch(size(), RaiseWeight<Real>{weights.data(), gradient_.data(), lane, Real(scale)}, "raising weights");
  }
  [[nodiscard]] static std::vector<float> as_floats(const CudaBuffer<Real>& values) {
    const std::vector<Real> host = values.download();
    return {host.begin(), host.end()};
  }
  template <class Update>
  void update(const Update& step) {
    if (momentum_ != nullptr)
      each_key_point(WithMomentum<Update>{step, momentum_}, "stepping");
    else
      each_key_point(step, "stepping");
    y_.swap(next_y_);
  }
  template <class Act>
  void each_key_point(const Act& act, const char* what) {
    launch(size(), ActAt<Act>{act, problem_.grid()}, what);
  }

  [[nodiscard]] const float* share() const { return on_gpu_->share.data(); }
  /// What comes before a subset.
  [[nodiscard]] const RayCounts& before(int subset) const {
    return problem_.list.before[static_cast<std::size_t>(subset)];
  }
  [[nodiscard]] std::size_t first_sample(int subset) const { return before(subset).samples; }
  template <class Act>
  void each_ray(int subset, const Act& act) {
    launch(before(subset).rays, before(subset + 1).rays, act, "marching");
  }

  /// Which samples' contributions each voxel sums, and space for contributions and sums.
  void prepare_sums() {
    std::size_t most_voxels = 0;
    for (int s = 0; s < problem_.list.subsets(); ++s) {
      const std::size_t count = first_sample(s + 1) - first_sample(s);
      const auto voxels = CudaBuffer<std::uint32_t>::unfilled(count);
      run_of_sample_.push_back(CudaBuffer<std::uint32_t>::unfilled(count));
      launch(before(s).runs, before(s + 1).runs, NameVoxels<Real, Path>{samples_of(s), voxels.data()},
             "naming voxels");
      by_voxel_.push_back(sort_by_voxel(voxels, size()));
      most_voxels = std::max(most_voxels, by_voxel_.back().voxels());
    }
    deposits_ = CudaBuffer<Deposit<Real>>::unfilled(problem_.most_samples());
    corner_sums_ = CudaBuffer<Quad<Real>>::unfilled(8 * most_voxels);
  }
  [[nodiscard]] SubsetSamples samples_of(int subset) const {
    return {on_gpu_->rays->table(), first_sample(subset),
            run_of_sample_[static_cast<std::size_t>(subset)].data()};
  }
  template <class Weight>
  void lay_aside(int subset, const Weight& weight) {
    launch(first_sample(subset), first_sample(subset + 1),
           LayAside<Real, Path, Weight>{samples_of(subset), weight, deposits_.data()}, "weighing samples");
  }
  template <class Spread>
  void add_up(int subset, const CudaBuffer<Quad<Real>>& target, const Spread& spread) {
    const Grid& g = problem_.grid();
    const SamplesByVoxel by_voxel = by_voxel_[static_cast<std::size_t>(subset)].view();
    if (by_voxel.voxels == 0) return;
    launch(by_voxel.voxels, SumCorners<Real, Spread>{by_voxel, deposits_.data(), corner_sums_.data(), spread},
           "summing samples");
    launch(size(), AddCorners<Real>{g.nx, g.ny, by_voxel, corner_sums_.data(), target.data()},
           "adding up voxels");
  }

  const Problem& problem_;
  EngineMemory memory_;
  Optics optics_;
  Extinction extinction_;
  std::shared_ptr<const GpuProblem> on_gpu_;
  CudaBuffer<Rgba> offset_, aim_;  // null where there is none
  std::vector<CudaBuffer<float>> ray_weights_;
  using CudaVolume<Real>::x_;
  CudaBuffer<Quad<Real>> y_, next_y_, gradient_, marked_, kept_, saved_;
  const CudaBuffer<Quad<Real>>* shown_ = &y_;  // what is marched
  CudaBuffer<Real> weight_, stiffness_, field_weight_, reference_;
  CudaBuffer<Quad<Real>> residual_, samples_;             // samples of one subset
  std::vector<CudaBuffer<std::uint32_t>> run_of_sample_;  // one a subset
  std::vector<SortedSamples> by_voxel_;                   // one a subset
  CudaBuffer<Deposit<Real>> deposits_;                    // of one subset
  CudaBuffer<Quad<Real>> corner_sums_;                    // of one subset
  std::optional<GpuBlur<Real>> blur_;                     // where the exposure is long enough to matter
  CudaBuffer<Quad<Real>> exposed_gradient_;
  std::optional<CudaSnapshot<Quad<Real>>> snapshot_;
  CudaBuffer<float> momenta_;  // of a sweep's steps
  std::vector<float> uploaded_momenta_;
  const float* momentum_ = nullptr;  // while one is recorded: of the next step
  std::vector<std::pair<Sweep, CudaGraph>> graphs_;
};

template <class Real, class Extinction>
std::unique_ptr<Engine> make_with(const Problem& problem, const Optics& optics, Extinction extinction,
                                  EngineMemory memory) {
  if (!problem.list.curved)
    return std::make_unique<CudaEngine<Real, Extinction, StraightPath>>(problem, optics, extinction, memory);
  return std::make_unique<CudaEngine<Real, Extinction, CurvedPath>>(problem, optics, extinction, memory);
}

template <class Real>
std::unique_ptr<Engine> make_in(const Problem& problem, const Optics& optics, EngineMemory memory) {
  switch (optics.absorb) {
    case Absorb::field:
      return make_with<Real>(problem, optics, FieldExtinction<Real>{}, memory);
    case Absorb::constant:
      return make_with<Real>(problem, optics, ConstantExtinction<Real>{Real(optics.sigma)}, memory);
    case Absorb::nothing:
      return make_with<Real>(problem, optics, NoExtinction<Real>{}, memory);
  }
  throw std::logic_error("an extinction that the CUDA engine doesn't know");
}

}  // namespace

std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, const Optics& optics, Precision precision,
                                         EngineMemory memory) {
  return precision == Precision::float64 ? make_in<double>(problem, optics, memory)
                                         : make_in<float>(problem, optics, memory);
}

}  // namespace emberlock::recon
