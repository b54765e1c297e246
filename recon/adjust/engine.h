// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "recon/adjust/problem.h"
#include "recon/compute/device.h"
#include "recon/render/march_table.h"

namespace emberlock::recon {

/// Holds a problem's volume and does the heavy steps of the solvers, on one device. x is the solution, y the
/// point that residuals are taken at (x itself, or a look-ahead of it).
class Engine {
 public:
  struct Step {
    float scale;  ///< of the gradient: all rays over the rays that it was taken from
    float momentum;
    float length = 1;  ///< of the step over that which the weights and the ties allow
  };
  /// What lies behind the medium, in residual_against().
  enum class Behind { nothing, background };
  struct PaperStep {
    float gain, decay, deviation;
    std::uint64_t stream;
  };

  Engine() = default;
  virtual ~Engine() = default;
  Engine(Engine&&) = delete;
  Engine& operator=(Engine&&) = delete;

  virtual void set(const std::vector<Rgba>& x) = 0;   ///< x and y
  virtual void hold(const std::vector<Rgba>& x) = 0;  ///< x alone: enough for who judges
  [[nodiscard]] virtual std::vector<Rgba> get() const = 0;
  /// x for whoever watches: never makes the device wait. Each call starts a copy and gives the last that has
  /// arrived, so x as it was some calls ago; empty before the first has.
  [[nodiscard]] virtual std::vector<Rgba> recent() = 0;
  /// residual = A y - seen for the subset's rays.
  virtual void residual(int subset) = 0;
  /// residual = A x - seen, x being another engine's, which is read where it lies: nothing is copied. Both
  /// have the same grid, precision and device.
  virtual void residual_of(const Engine& other, int subset) = 0;
  /// What another pass adds to the radiance of each ray; part of residual() from here on.
  virtual void set_offset(const std::vector<Rgba>& offset) = 0;
  /// residual = A y.
  virtual void project(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> residuals() const = 0;
  /// Those of one subset's rays alone.
  [[nodiscard]] virtual std::vector<Rgba> residuals(int subset) const = 0;
  /// gradient += A^T residual; under Absorb::field lane 3 is the slope by extinction, and residual() must
  /// have come last.
  virtual void backproject(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> gradient() const = 0;
  /// x as it is now, for keep(): one copy, on the device.
  virtual void mark() = 0;
  /// What was marked last, and not kept yet, is what restore() goes back to: nothing is copied.
  virtual void keep() = 0;
  /// x and y become what was kept last.
  virtual void restore() = 0;
  /// y = x: the look-ahead is forgotten.
  virtual void rest() = 0;
  /// The weights of descend(): one a key point, 0 for those that take no part. Clears the gradient.
  virtual void set_weights(const std::vector<float>& weights) = 0;
  /// weights = max(weights, scale * lane 0 of the gradient), which is cleared. From a subset's gradient of
  /// A x at x = 1 this is how weights come to majorise every subset.
  virtual void raise_weights(float scale) = 0;
  [[nodiscard]] virtual std::vector<float> weights() const = 0;
  /// Renews how firmly descend() ties key points to each other, see Stiffen: by `most` at most, in units of
  /// the weights, falling where the light changes by more than `soft` a voxel edge.
  virtual void stiffen(float most, float soft) = 0;
  virtual void descend(const Step& step) = 0;

  struct FieldStep {
    Step emission;
    float variation;  ///< of the extinction's total variation
    float soft;       ///< differences below it count quadratically, a voxel edge
    float most;       ///< extinction, a voxel edge
  };
  /// Where the extinction is unknown too: curvature of the residual by it, and what it is thought to be, one
  /// a key point.
  /// Clears the gradient.
  virtual void set_field(const std::vector<float>& weights, const std::vector<float>& reference) = 0;
  /// As raise_weights() and weights(), from lane 3: the curvature by the extinction.
  virtual void raise_field_weights(float scale) = 0;
  [[nodiscard]] virtual std::vector<float> field_weights() const = 0;
  virtual void descend_field(const FieldStep& step) = 0;
  /// residual = A y - target, for targets other than what was seen. With Behind::background A y includes the
  /// background's light that the medium lets through.
  virtual void residual_against(const std::vector<Rgba>& target, int subset, Behind behind) = 0;
  /// x and y += the paper's adjustment from the subset's residuals.
  virtual void adjust(int subset, const PaperStep& step) = 0;
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

/// What an engine is for. One that only judges has memory for no more than what it is told to hold(), and
/// can't step: residual_of(), set_offset() and residuals() are all else that it does.
enum class EngineRole { solve, judge };

/// On the pool's device. The problem and the pool must outlive the engine. Throws a DeviceError.
std::unique_ptr<Engine> make_engine(const Problem& problem, const Optics& optics, Precision precision,
                                    Pool& pool, EngineRole role = EngineRole::solve);
std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, const Optics& optics, Precision precision,
                                         EngineRole role);

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
