// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <type_traits>
#include <vector>

#include "recon/adjust/problem.h"
#include "recon/compute/device.h"
#include "recon/render/march_table.h"

namespace emberlock::recon {

/// Holds a volume x on one device, and says what it shows beyond what was seen. All calls that need another
/// one before them throw std::logic_error where that is missing, on every device: the program is wrong.
class ResidualEngine {
 public:
  ResidualEngine() = default;
  virtual ~ResidualEngine() = default;
  ResidualEngine(ResidualEngine&&) = delete;
  ResidualEngine& operator=(ResidualEngine&&) = delete;

  void set(const std::vector<Rgba>& x);
  /// residual = A x - seen for the subset's rays, x being `other`'s, which is read where it lies: nothing is
  /// copied. Both have the same grid, precision and device; `other` has been set.
  void residual_of(const ResidualEngine& other, int subset);
  /// What another pass adds to the radiance of each ray; part of all residuals against what was seen from
  /// here on.
  virtual void set_offset(const std::vector<Rgba>& offset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> residuals() const = 0;
  /// Sums of the squared residuals for R, G and B, of a range of the rays. All sums are made where their
  /// terms lie, in an order that no thread count changes.
  using Squares = std::array<double, 3>;
  [[nodiscard]] Squares squares(std::size_t first_ray, std::size_t last_ray) const;
  /// The same of no light at all, behind which the whole background shines.
  [[nodiscard]] virtual Squares black_squares(std::size_t first_ray, std::size_t last_ray) const = 0;
  /// Boxes of the views, one each, that errors are taken over: what a ray counts by its pixel, of the first
  /// so many rays, and over all pixels whose coordinates are multiples of a stride what no light at all
  /// leaves.
  struct Weighed {
    std::size_t number = 0;    ///< for weighted_squares()
    Squares black_of_rays{};   ///< of the pixels that rays see
    Squares black_of_boxes{};  ///< of all pixels
  };
  [[nodiscard]] virtual Weighed weigh(const std::vector<WeighedBox>& boxes, std::size_t rays, int stride) = 0;
  /// squares() of the rays that were weighed, each by what it counts.
  [[nodiscard]] Squares weighted_squares(std::size_t number) const;

 protected:
  /// The subsets whose residuals are those of y as it is now, the last one last.
  std::vector<int> marched_;

 private:
  [[nodiscard]] virtual Squares sum_squares(std::size_t first_ray, std::size_t last_ray) const = 0;
  [[nodiscard]] virtual Squares sum_squares(std::size_t weights) const = 0;
  virtual void put(const std::vector<Rgba>& x) = 0;
  virtual void march_other(const ResidualEngine& other, int subset) = 0;
  [[nodiscard]] virtual std::size_t grid_points() const = 0;
  [[nodiscard]] virtual std::size_t held_points() const = 0;  ///< as many, or none before set()
};

/// Does the heavy steps of the solvers. x is the solution, y the point that residuals are taken at (x itself,
/// or a look-ahead of it); set() sets both. Begins with darkness.
class Engine : public ResidualEngine {
 public:
  struct Step {
    float scale = 1;  ///< of the gradient: all rays over the rays that it was taken from
    float momentum = 0;
    float length = 1;  ///< of the step over that which the weights and the ties allow
  };
  /// What lies behind the medium, in residual_against().
  enum class Behind { nothing, background };
  struct PaperStep {
    float gain, decay, deviation;
    std::uint64_t stream;
  };

  [[nodiscard]] virtual std::vector<Rgba> get() const = 0;  ///< x
  /// x for whoever watches: never makes the device wait. Each call starts a copy and gives the last that has
  /// arrived, so x as it was some calls ago; empty before the first has.
  [[nodiscard]] virtual std::vector<Rgba> recent() = 0;
  /// residual = A y - seen for the subset's rays.
  void residual(int subset);
  /// residual = A y - target, for targets other than what was seen. With Behind::background A y includes the
  /// background's light that the medium lets through.
  void residual_against(const std::vector<Rgba>& target, int subset, Behind behind);
  /// The same for a target that lies with the residuals: at first nothing at all, see aim_at_slope().
  void residual_against_aim(int subset, Behind behind);
  /// residual = A y.
  void project(int subset);
  /// gradient += A^T residual; under Absorb::field lane 3 is the slope by extinction. The subset's residual()
  /// or residual_against() must have come last, and y be as it was.
  void backproject(int subset);
  [[nodiscard]] virtual std::vector<Rgba> gradient() const = 0;
  /// x as it is now, for keep(): one copy, on the device.
  void mark();
  /// What was marked, and not kept yet, is what restore() goes back to: nothing is copied.
  void keep();
  /// x and y become what was kept last.
  void restore();
  /// x as it is now, for go_back(): one more copy, on the device, in memory that is taken when first called.
  void save();
  /// x and y become what was saved last.
  void go_back();
  /// y = x: the look-ahead is forgotten.
  void rest();
  // How a level begins. What follows changes y alone where it says so; rest() brings it back to x.

  /// x and y become those of an engine of the same grid, or of one half as fine; both of one precision and
  /// device.
  void start_from(const Engine& other);
  /// Lane 3 of x and y becomes what is expected a voxel edge: ExpectExtinction.
  void expect_extinction(float even, float soot);
  /// y = 1 in the medium, thinned.
  void light_evenly(float thinned);
  /// The mean light that is seen beside the background over the mean that the residuals show, 0 where that is
  /// none.
  [[nodiscard]] virtual float seen_over_shown(std::size_t last_ray) const = 0;
  /// weights = factor * (weights + share * mean) where any ray comes; the mean, as it was, of those above 0.
  virtual float settle_weights(float share, float factor) = 0;
  /// After set_field() or take_reference(): the same of the curvature by the extinction.
  float settle_field_weights(float share, float factor);
  /// What the extinction is thought to be from here on is what x says; clears its weights, and the gradient.
  /// The mean over the medium.
  float take_reference();
  /// y = x with more extinction in the medium.
  void thicken(float by);
  /// What the residuals, from project(), hold is what residual_against_aim() aims at.
  virtual void aim_at_residuals() = 0;
  /// From there and what project() shows now: a residual against the aim, before the background, is the slope
  /// of what the rays show by the extinction, which rose by so much in between.
  virtual void aim_at_slope(float rise) = 0;

  /// The weights of descend(): one a key point, 0 for those that take no part, as all are before. Clears the
  /// gradient.
  virtual void set_weights(const std::vector<float>& weights) = 0;
  /// weights = max(weights, scale * lane 0 of the gradient), which is cleared. From a subset's gradient of
  /// A x at x = 1 this is how weights come to majorise every subset.
  virtual void raise_weights(float scale) = 0;
  [[nodiscard]] virtual std::vector<float> weights() const = 0;
  /// Renews how firmly descend() ties key points to each other, see Stiffen: by `most` at most, in units of
  /// the weights, falling where the light changes by more than `soft` a voxel edge.
  virtual void stiffen(float most, float soft) = 0;
  void descend(const Step& step);

  struct FieldStep {
    Step emission;
    float variation = 0;  ///< of the extinction's total variation
    float soft = 0;       ///< differences below it count quadratically, a voxel edge
    float most = 0;       ///< extinction, a voxel edge
  };
  /// Where the extinction is unknown too (Absorb::field): curvature of the residual by it, and what it is
  /// thought to be, one a key point. Clears the gradient.
  void set_field(const std::vector<float>& weights, const std::vector<float>& reference);
  /// After set_field(): as raise_weights() and weights(), from lane 3: the curvature by the extinction.
  void raise_field_weights(float scale);
  [[nodiscard]] std::vector<float> field_weights() const;
  /// After set_field(): emission and extinction at once.
  void descend_field(const FieldStep& step);
  /// For each of these subsets, in their order: residual(), backproject() and descend(), or descend_field()
  /// with the same emission step where a field is given.
  struct SubsetStep {
    int subset = 0;
    Step step = {1, 0};
  };
  void sweep(const std::vector<SubsetStep>& steps, const FieldStep* field = nullptr);
  /// x and y += the paper's adjustment from the subset's residual(), since when y must be as it was. Only in
  /// float32, along straight rays and with none or constant extinction.
  void adjust(int subset, const PaperStep& step);

 private:
  virtual void march_residual(int subset) = 0;
  virtual void march_against(const std::vector<Rgba>& target, int subset, Behind behind) = 0;
  virtual void march_against_aim(int subset, Behind behind) = 0;
  virtual void march_radiance(int subset) = 0;
  virtual void copy_solution(const Engine& other) = 0;
  virtual void put_expected_extinction(float even, float soot) = 0;
  virtual void put_even_light(float thinned) = 0;
  virtual void put_thicker(float by) = 0;
  virtual float settle_curvature(float share, float factor) = 0;
  virtual float put_reference() = 0;
  virtual void spread(int subset) = 0;  ///< the gradient's sum
  virtual void copy_to_mark() = 0;
  virtual void swap_mark_and_kept() = 0;
  virtual void copy_from_kept() = 0;
  virtual void copy_to_saved() = 0;
  virtual void copy_from_saved() = 0;
  virtual void forget_look_ahead() = 0;
  virtual void step_emission(const Step& step) = 0;
  [[nodiscard]] virtual bool takes_a_field() const = 0;
  [[nodiscard]] virtual bool takes_paper_steps() const = 0;
  virtual void put_field(const std::vector<float>& weights, const std::vector<float>& reference) = 0;
  virtual void raise_curvature(float scale) = 0;
  [[nodiscard]] virtual std::vector<float> curvature() const = 0;
  virtual void step_field(const FieldStep& step) = 0;
  virtual void sweep_subsets(const std::vector<SubsetStep>& steps, const FieldStep* field);

 protected:
  /// One of a sweep's: what sweep_subsets() does for each.
  void sweep_subset(const SubsetStep& step, const FieldStep* field);

 private:
  virtual void step_paper(int subset, const PaperStep& step) = 0;

  bool is_marked_ = false;
  bool is_kept_ = false;
  bool is_saved_ = false;
  bool has_field_ = false;
};

/// What light does on its way through a problem's medium, as the engine needs it.
struct Optics {
  Absorb absorb = Absorb::nothing;
  float sigma = 0;  ///< of constant extinction, a voxel edge; with Absorb::field it is lane 3 of x
  float white = 0;  ///< captured values from here on are bounds; 0: none are
  Exposure exposure;
};
/// Constant extinction of sigma a voxel edge, or none where it is 0.
Optics absorbing_optics(float sigma);

/// On the pool's device. The problem and the pool must outlive the engine. Throws a DeviceError.
std::unique_ptr<Engine> make_engine(const Problem& problem, const Optics& optics, Precision precision,
                                    Pool& pool);
/// The same, with memory for no more than a volume that it is told to set().
std::unique_ptr<ResidualEngine> make_residual_engine(const Problem& problem, const Optics& optics,
                                                     Precision precision, Pool& pool);

/// How much memory an engine takes: for a solver's steps, or for residuals alone.
enum class EngineMemory { steps, residuals };
std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, const Optics& optics, Precision precision,
                                         EngineMemory memory);

/// In another precision.
template <class To, class From>
std::vector<Quad<To>> converted(const std::vector<Quad<From>>& from) {
  if constexpr (std::is_same_v<To, From>) {
    return from;
  } else {
    std::vector<Quad<To>> to(from.size());
    for (std::size_t i = 0; i < from.size(); ++i)
      for (int c = 0; c < 4; ++c) to[i].c[c] = static_cast<To>(from[i].c[c]);
    return to;
  }
}

}  // namespace emberlock::recon
