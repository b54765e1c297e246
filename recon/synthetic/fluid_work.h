// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "recon/compute/device.h"
#include "recon/compute/pool.h"
#include "recon/kernels/fluid_pressure.h"
#include "recon/synthetic/fluid_work_cuda.h"

namespace emberlock::recon {

/// Memory of the device that a FluidWork computes on, filled with zero bytes. T is trivially copyable.
template <class T>
class FluidArray {
 public:
  FluidArray() = default;
  FluidArray(std::size_t size, Device device) : size_(size), on_gpu_(device == Device::cuda) {
    if constexpr (kCudaBuilt)
      if (on_gpu_) gpu_ = gpu_memory(size * sizeof(T));
    if (!on_gpu_) cpu_.resize(size);
  }

  [[nodiscard]] T* data() { return on_gpu_ ? static_cast<T*>(gpu_.get()) : cpu_.data(); }
  [[nodiscard]] const T* data() const { return on_gpu_ ? static_cast<const T*>(gpu_.get()) : cpu_.data(); }
  [[nodiscard]] std::size_t size() const { return size_; }
  /// Takes size() values.
  void fill(const std::vector<T>& from) {
    if constexpr (kCudaBuilt)
      if (on_gpu_) copy_to_gpu(gpu_.get(), from.data(), size_ * sizeof(T));
    if (!on_gpu_) cpu_ = from;
  }
  [[nodiscard]] std::vector<T> values() const {
    if (!on_gpu_) return cpu_;
    std::vector<T> to(size_);
    if constexpr (kCudaBuilt) copy_from_gpu(to.data(), gpu_.get(), size_ * sizeof(T));
    return to;
  }
  void swap(FluidArray& o) noexcept {
    std::swap(size_, o.size_);
    std::swap(on_gpu_, o.on_gpu_);
    cpu_.swap(o.cpu_);
    gpu_.swap(o.gpu_);
  }

 private:
  std::size_t size_ = 0;
  bool on_gpu_ = false;
  std::vector<T> cpu_;
  GpuMemory gpu_{nullptr, nullptr};
};

/// Runs the passes of a fluid (functors of recon/kernels) on the CPU's pool or on a GPU. A plane of cells is
/// a task and sums are added up in the order of the rows, so the bits don't depend on the number of threads.
/// One caller at a time; on a GPU always the same thread, whose stream is used.
class FluidWork {
 public:
  explicit FluidWork(const ComputeOptions& compute) : pool_(compute) {}

  [[nodiscard]] Device device() const { return pool_.device(); }
  template <class T>
  [[nodiscard]] FluidArray<T> array(std::size_t size) const {
    return FluidArray<T>(size, pool_.device());
  }

  /// Calls act(i, j, k) for all of a box of indices, concurrently in any order. The calls read nothing that
  /// other calls of the pass write.
  template <class Act>
  void each(FluidRange range, const Act& act) {
    if (pool_.device() == Device::cuda) {
      if constexpr (kCudaBuilt) each_on_gpu(range, act);
      return;
    }
    const auto plane = [&](int k) {
      for (int j = 0; j < range.ny; ++j) {
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC ivdep
#endif
        for (int i = 0; i < range.nx; ++i) act(i, j, k);
      }
    };
    constexpr std::size_t kWorthATask = 4096;
    if (range.size() < kWorthATask)
      for (int k = 0; k < range.nz; ++k) plane(k);
    else
      pool_.run(range.nz, plane);
  }
  template <class Act>
  void cells(const FluidGrid& g, const Act& act) {
    each({g.nx, g.ny, g.nz}, act);
  }
  /// The faces of an axis, those on the boundary included.
  template <int Axis, class Act>
  void faces(const FluidGrid& g, const Act& act) {
    each({g.nx + (Axis == 0 ? 1 : 0), g.ny + (Axis == 1 ? 1 : 0), g.nz + (Axis == 2 ? 1 : 0)}, act);
  }

  /// The sum of term(cell) over all cells of a grid.
  template <class Term>
  FluidSums sum(const FluidGrid& g, const Term& term) {
    return over_rows(g, SumRow<Term>{term, g, rows(g)}, false);
  }
  /// The greatest of term(cell), lane by lane, and 0.
  template <class Term>
  FluidSums greatest(const FluidGrid& g, const Term& term) {
    return over_rows(g, GreatestOfRow<Term>{term, g, rows(g)}, true);
  }

 private:
  FluidSums* rows(const FluidGrid& g) {
    const std::size_t needed = static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(g.nz);
    if (rows_.size() < needed) rows_ = array<FluidSums>(needed);
    return rows_.data();
  }
  template <class Rows>
  FluidSums over_rows(const FluidGrid& g, const Rows& act, bool greatest) {
    each({1, g.ny, g.nz}, act);
    const std::size_t count = static_cast<std::size_t>(g.ny) * static_cast<std::size_t>(g.nz);
    FluidSums all;
    const FluidSums* from = rows_.data();
    std::vector<FluidSums> copied;
    if (device() == Device::cuda) {
      copied.resize(count);
      if constexpr (kCudaBuilt) copy_from_gpu(copied.data(), from, count * sizeof(FluidSums));
      from = copied.data();
    }
    for (std::size_t i = 0; i < count; ++i) all = greatest ? greater_of(all, from[i]) : all + from[i];
    return all;
  }

  Pool pool_;
  FluidArray<FluidSums> rows_;
};

}  // namespace emberlock::recon
