#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "recon/adjust/problem.h"
#include "recon/compute/device.h"
#include "recon/render/march_table.h"

namespace emberlock {

/// Holds a problem's volume and does the heavy steps of the solvers, on one device. x is the solution, y the
/// point that residuals are taken at (x itself, or a look-ahead of it).
class Engine {
 public:
  struct Step {
    float scale;  ///< of the gradient: all rays over the rays that it was taken from
    float momentum;
  };
  struct PaperStep {
    float gain, decay, deviation;
    std::uint64_t stream;
  };

  Engine() = default;
  virtual ~Engine() = default;
  Engine(Engine&&) = delete;
  Engine& operator=(Engine&&) = delete;

  virtual void set(const std::vector<Rgba>& x) = 0;  ///< x and y
  [[nodiscard]] virtual std::vector<Rgba> get() const = 0;
  /// x for whoever watches: never makes the device wait. Each call starts a copy and gives the last that has
  /// arrived, so x as it was some calls ago; empty before the first has.
  [[nodiscard]] virtual std::vector<Rgba> recent() = 0;
  /// residual = A y - seen for the subset's rays.
  virtual void residual(int subset) = 0;
  /// What another pass adds to the radiance of each ray; part of residual() from here on.
  virtual void set_offset(const std::vector<Rgba>& offset) = 0;
  /// residual = A y.
  virtual void project(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> residuals() const = 0;
  /// gradient += A^T residual; under Absorb::field lane 3 is the slope by extinction, and residual() must
  /// have come last.
  virtual void backproject(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> gradient() const = 0;
  virtual void clear_gradient() = 0;
  /// The weights of descend(): one a key point, 0 for those that take no part. Clears the gradient.
  virtual void set_weights(const std::vector<float>& weights) = 0;
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
  virtual void descend_field(const FieldStep& step) = 0;
  /// residual = A y - target, for targets other than what was seen.
  virtual void residual_against(const std::vector<Rgba>& target, int subset) = 0;
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

/// On the pool's device. The problem and the pool must outlive the engine. Throws a DeviceError.
std::unique_ptr<Engine> make_engine(const Problem& problem, const Optics& optics, Precision precision,
                                    Pool& pool);
std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, const Optics& optics, Precision precision);

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

}  // namespace emberlock
