// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "recon/compute/device.h"

namespace emberlock::recon {

/// A pool of CPU threads, and the device for heavy passes. The caller divides the work into tasks,
/// independently of the number of threads. So results whose tasks write to separate places, or are combined
/// in the order of the tasks, are bit-identical for any number of threads. One caller at a time.
class Pool {
 public:
  /// 0 threads: all cores. The device must be resolved: cpu, or cuda if resolve() returned it; its GPU
  /// becomes that of the calling thread.
  explicit Pool(int threads, Device device = Device::cpu);
  /// Throws a DeviceError if resolve() fails.
  explicit Pool(const ComputeOptions& compute);
  ~Pool();
  Pool(Pool&&) = delete;
  Pool& operator=(Pool&&) = delete;

  [[nodiscard]] Device device() const { return device_; }

  /// Calls task(0) .. task(tasks - 1) once each, concurrently in any order; returns when all are done.
  void run(int tasks, const std::function<void(int)>& task);

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
  Device device_;
};

/// Calls act(0) .. act(count - 1), which compute on the pool's device and nowhere else: one after the other
/// on the CPU, whose threads each of them fills; at once on a GPU, which none of them fills, each by a thread
/// and in a stream of its own. Throws what the first of them threw.
void at_once(const Pool& pool, int count, const std::function<void(int)>& act);

/// The range of elements for task `task` of `tasks` nearly equal ones.
struct Slice {
  std::size_t begin, end;
};
constexpr Slice slice(std::size_t size, int tasks, int task) {
  const auto n = static_cast<std::size_t>(tasks);
  const auto i = static_cast<std::size_t>(task);
  return {size * i / n, size * (i + 1) / n};
}

}  // namespace emberlock::recon
