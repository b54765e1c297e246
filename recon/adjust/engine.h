#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "recon/adjust/problem.h"
#include "recon/compute/device.h"

namespace emberlock {

/// Holds a problem's volume and does the heavy steps of the solvers, on one device. x is the solution, y the
/// point that residuals are taken at (x itself, or a look-ahead of it).
class Engine {
 public:
  struct Step {
    float scale;      ///< of the gradient: all rays over the rays that it was taken from
    float smoothing;  ///< weight of the Laplacian
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
  /// residual = A y - seen for the subset's rays.
  virtual void residual(int subset) = 0;
  /// residual = A y.
  virtual void project(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> residuals() const = 0;
  /// gradient += A^T residual.
  virtual void backproject(int subset) = 0;
  [[nodiscard]] virtual std::vector<Rgba> gradient() const = 0;
  /// The weights of descend(): one a key point, 0 for those that take no part. Clears the gradient.
  virtual void set_weights(const std::vector<float>& weights) = 0;
  virtual void descend(const Step& step) = 0;
  /// x and y += the paper's adjustment from the subset's residuals.
  virtual void adjust(int subset, const PaperStep& step) = 0;
};

/// `device` is resolved (cpu or cuda); `sigma` is the extinction a voxel edge. The problem and the pool must
/// outlive the engine.
std::unique_ptr<Engine> make_engine(const Problem& problem, float sigma, Device device, Pool& pool);

#ifdef EMBERLOCK_HAVE_CUDA
std::unique_ptr<Engine> make_cuda_engine(const Problem& problem, float sigma);
#endif

}  // namespace emberlock
