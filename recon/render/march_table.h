// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "recon/kernels/march.h"
#include "recon/kernels/residual.h"
#include "recon/kernels/update.h"

namespace emberlock::recon {

/// The data of a march; each entry of MarchTable says which members it uses.
template <class Real>
struct MarchWork {
  RayTable rays;
  const Quad<Real>* volume = nullptr;
  Real sigma = 0;                  ///< of constant extinction, per voxel edge
  Quad<Real>* residual = nullptr;  ///< one per ray
  Quad<Real>* gradient = nullptr;  ///< one per key point
  Quad<Real>* samples = nullptr;   ///< for field extinction, see FieldForward
  std::size_t first_sample = 0;
};

/// The shipped combinations of extinction and paths.
enum class Absorb { nothing, constant, field };
enum class Travel { straight, curved };

/// The kernels compiled for one level of vector instructions. Each entry processes its part of the work on
/// the calling thread.
template <class Real>
struct MarchTable {
  /// residual = radiance and transmittance of rays [begin, end).
  using ForwardEntry = void (*)(const MarchWork<Real>&, std::size_t begin, std::size_t end);
  /// gradient += transpose, over the listed runs of one slab. Only without extinction and with constant
  /// extinction.
  using AdjointEntry = void (*)(const MarchWork<Real>&, const std::uint32_t* runs, std::size_t count);
  /// Residuals and samples of rays [begin, end).
  using FieldEntry = void (*)(const MarchWork<Real>&, const PixelResidual<Real>&, std::size_t begin,
                              std::size_t end);
  /// One row of key points [begin, end) x {j} x {k}.
  using StiffenEntry = void (*)(const Stiffen<Real>&, int begin, int end, int j, int k);
  using UpdateEntry = void (*)(const Descend<Real>&, int begin, int end, int j, int k);
  using FieldUpdateEntry = void (*)(const DescendField<Real>&, int begin, int end, int j, int k);

  ForwardEntry forward[3][2];
  AdjointEntry adjoint[3][2];  ///< for a field: from `samples`
  FieldEntry field_forward[2];
  StiffenEntry stiffen;
  UpdateEntry update;
  FieldUpdateEntry field_update;

  [[nodiscard]] ForwardEntry forward_of(Absorb a, Travel t) const {
    return forward[static_cast<int>(a)][static_cast<int>(t)];
  }
  [[nodiscard]] AdjointEntry adjoint_of(Absorb a, Travel t) const {
    return adjoint[static_cast<int>(a)][static_cast<int>(t)];
  }
};

/// Levels of vector instructions (x86-64's microarchitecture levels): SSE2, SSE4.2, AVX2 with FMA, AVX-512.
/// Other processors have only the baseline.
enum class Isa { baseline, v2, v3, v4 };
/// The highest level that this CPU supports.
Isa best_isa();

/// The table for best_isa(). EMBERLOCK_ISA=baseline|v2|v3|v4 in the environment limits it, for tests and
/// comparisons.
template <class Real>
const MarchTable<Real>& march_table();
/// The table for a level, at most best_isa().
template <class Real>
const MarchTable<Real>& march_table(Isa level);
/// "baseline", "v2", "v3" or "v4": the level of march_table().
const char* march_table_name();

}  // namespace emberlock::recon
