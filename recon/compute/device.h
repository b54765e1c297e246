#pragma once

#include <string_view>

#include "base/result.h"

namespace emberlock {

enum class Device {
  automatic,  ///< CUDA where it was built and a GPU answers, the CPU otherwise
  cpu,
  cuda,
};

/// Of the march and of all that is stored at key points.
enum class Precision { float32, float64 };

/// Where and how wide to compute. Results are bit-identical for every number of threads on the CPU.
struct ComputeOptions {
  Device device = Device::automatic;
  int threads = 0;  ///< CPU threads, 1..256; 0 takes every core
};

/// "auto", "cpu" or "cuda"; an Error that lists them otherwise.
Result<Device> parse_device(std::string_view name);

/// The device that a choice means on this machine: cpu or cuda, never automatic. An Error of kind `device`
/// says why CUDA can't run (not built in, no driver, no GPU).
Result<Device> resolve(Device choice);

}  // namespace emberlock
