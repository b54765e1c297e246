// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "recon/compute/device.h"
#include "recon/hull/ray_list.h"
#include "recon/render/march_table.h"

namespace emberlock {

/// The kernels of the marches over all rays of a list.
template <class Real>
class Marches {
 public:
  using Values = std::vector<recon::Quad<Real>>;
  struct Field {
    Values residual;  ///< against what was seen, one a ray
    Values samples;   ///< what FieldForward leaves
  };

  Marches() = default;
  virtual ~Marches() = default;
  Marches(Marches&&) = delete;
  Marches& operator=(Marches&&) = delete;

  /// Radiance, and transmittance in lane 3, of each ray; `sigma` of constant extinction.
  [[nodiscard]] virtual Values forward(recon::Absorb absorb, const Values& volume, Real sigma) const = 0;
  [[nodiscard]] Values forward(recon::Absorb absorb, const Values& volume) const {
    return forward(absorb, volume, 0);
  }
  /// A^T residual at the key points, under no or constant extinction.
  [[nodiscard]] virtual Values adjoint(recon::Absorb absorb, const Values& residual, Real sigma) const = 0;
  /// What `pixel` points to lies in the CPU's memory, one a ray.
  [[nodiscard]] virtual Field field_forward(const Values& volume,
                                            const recon::PixelResidual<Real>& pixel) const = 0;
  /// Of 1/2 |residual|^2 by emission (lanes 0..2) and extinction (lane 3).
  [[nodiscard]] virtual Values field_adjoint(const Field& field) const = 0;
};

/// Those of one table, on the calling thread.
template <class Real>
class Marcher final : public Marches<Real> {
 public:
  using Values = typename Marches<Real>::Values;
  using Field = typename Marches<Real>::Field;
  using Marches<Real>::forward;

  explicit Marcher(const recon::RayList& list,
                   const recon::MarchTable<Real>& table = recon::march_table<Real>())
      : list_(list), table_(table), travel_(list.curved ? recon::Travel::curved : recon::Travel::straight) {}

  [[nodiscard]] Values forward(recon::Absorb absorb, const Values& volume, Real sigma) const override {
    Values seen(list_.rays.size());
    recon::MarchWork<Real> work = work_on(volume, sigma);
    work.residual = seen.data();
    table_.forward_of(absorb, travel_)(work, 0, seen.size());
    return seen;
  }
  [[nodiscard]] Values adjoint(recon::Absorb absorb, const Values& residual, Real sigma) const override {
    Values seen = residual;
    recon::MarchWork<Real> work = work_on({}, sigma);
    work.residual = seen.data();
    return scatter(absorb, work);
  }
  [[nodiscard]] Field field_forward(const Values& volume,
                                    const recon::PixelResidual<Real>& pixel) const override {
    Field field{Values(list_.rays.size()), Values(list_.count().samples)};
    recon::MarchWork<Real> work = work_on(volume, 0);
    work.residual = field.residual.data();
    work.samples = field.samples.data();
    table_.field_forward[static_cast<int>(travel_)](work, pixel, 0, list_.rays.size());
    return field;
  }
  [[nodiscard]] Values field_adjoint(const Field& field) const override {
    Field left = field;
    recon::MarchWork<Real> work = work_on({}, 0);
    work.residual = left.residual.data();
    work.samples = left.samples.data();
    return scatter(recon::Absorb::field, work);
  }

 private:
  [[nodiscard]] recon::MarchWork<Real> work_on(const Values& volume, Real sigma) const {
    recon::MarchWork<Real> work;
    work.rays = list_.table();
    work.volume = volume.data();
    work.sigma = sigma;
    return work;
  }
  Values scatter(recon::Absorb absorb, recon::MarchWork<Real>& work) const {
    Values gradient(list_.grid.size());
    work.gradient = gradient.data();
    for (std::uint32_t n = 0; n < list_.runs.size(); ++n) table_.adjoint_of(absorb, travel_)(work, &n, 1);
    return gradient;
  }

  const recon::RayList& list_;
  const recon::MarchTable<Real>& table_;
  recon::Travel travel_;
};

// On the GPU, by launches of the functors that the engine launches; in cuda_marches.cu, where there is CUDA.
template <class Real>
std::unique_ptr<Marches<Real>> cuda_marches(const recon::RayList& list);
void cuda_step(const recon::Stiffen<double>& step);
void cuda_step(const recon::Descend<double>& step);
void cuda_step(const recon::DescendField<double>& step);

/// On a device that this machine has. The list must outlive them.
template <class Real>
std::unique_ptr<Marches<Real>> marches_on([[maybe_unused]] recon::Device device, const recon::RayList& list) {
#ifdef EMBERLOCK_HAVE_CUDA
  if (device == recon::Device::cuda) return cuda_marches<Real>(list);
#endif
  return std::make_unique<Marcher<Real>>(list);
}

inline const recon::Grid& grid_of(const recon::Stiffen<double>& step) { return step.grid; }
inline const recon::Grid& grid_of(const recon::Descend<double>& step) { return step.grid; }
inline const recon::Grid& grid_of(const recon::DescendField<double>& step) { return step.emission.grid; }
inline auto row_entry(const recon::Stiffen<double>& /*step*/) { return recon::march_table<double>().stiffen; }
inline auto row_entry(const recon::Descend<double>& /*step*/) { return recon::march_table<double>().update; }
inline auto row_entry(const recon::DescendField<double>& /*step*/) {
  return recon::march_table<double>().field_update;
}

/// A step at every key point, on a device that this machine has. Its pointers are the CPU's.
template <class Step>
void step_on([[maybe_unused]] recon::Device device, const Step& step) {
#ifdef EMBERLOCK_HAVE_CUDA
  if (device == recon::Device::cuda) return cuda_step(step);
#endif
  const recon::Grid& g = grid_of(step);
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j) row_entry(step)(step, 0, g.nx, j, k);
}

}  // namespace emberlock
