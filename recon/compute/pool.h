// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>

#include "recon/compute/device.h"

namespace emberlock::recon {

/// A pool of CPU threads, and the device that heavy passes run on beside them. The work is cut into tasks by
/// the caller, never by the number of threads, so results whose tasks write to separate places, or are
/// combined in the order of the tasks, have the same bits for any number of threads. One caller at a time.
class Pool {
 public:
  /// 0 threads takes every core. The device is resolved: cpu, or cuda where resolve() gave it.
  explicit Pool(int threads, Device device = Device::cpu);
  /// Throws a DeviceError where resolve() has one.
  explicit Pool(const ComputeOptions& compute);
  ~Pool();
  Pool(Pool&&) = delete;
  Pool& operator=(Pool&&) = delete;

  [[nodiscard]] Device device() const { return device_; }

  /// Calls task(0) .. task(tasks - 1), each once, in any order and at the same time; returns when all have
  /// ended.
  void run(int tasks, const std::function<void(int)>& task);

 private:
  struct Arena;
  std::unique_ptr<Arena> arena_;
  Device device_;
};

/// Element range of task `task` out of `tasks` nearly equal ones.
struct Slice {
  std::size_t begin, end;
};
constexpr Slice slice(std::size_t size, int tasks, int task) {
  const auto n = static_cast<std::size_t>(tasks);
  const auto i = static_cast<std::size_t>(task);
  return {size * i / n, size * (i + 1) / n};
}

}  // namespace emberlock::recon
