// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace emberlock::recon {

enum class Device {
  automatic,  ///< CUDA where it was built and a GPU answers, the CPU otherwise
  cpu,
  cuda,
};

/// Whether this build has the launches on a GPU: where it hasn't, no Pool says Device::cuda.
#ifdef EMBERLOCK_HAVE_CUDA
inline constexpr bool kCudaBuilt = true;
#else
inline constexpr bool kCudaBuilt = false;
#endif

/// Of the march and of all that is stored at key points.
enum class Precision { float32, float64 };

/// Where and how wide to compute. Results are bit-identical for every number of threads on the CPU.
struct ComputeOptions {
  Device device = Device::automatic;
  int threads = 0;  ///< CPU threads, 1..256; 0 takes every core
};

/// A device that fails, can't run, or has too little memory. Functions that give a Result turn it into its
/// Error.
class DeviceError : public std::exception {
 public:
  explicit DeviceError(Error error) : error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.what.c_str(); }

 private:
  Error error_;
};

/// "auto", "cpu" or "cuda"; an Error that lists them otherwise.
Result<Device> parse_device(std::string_view name);

/// The device that a choice means on this machine: cpu or cuda, never automatic. An Error of kind `device`
/// says why CUDA can't run (not built in, no driver, no GPU). EMBERLOCK_DEVICE=cpu|cuda in the environment is
/// what automatic means, for tests and comparisons.
Result<Device> resolve(Device choice);

}  // namespace emberlock::recon
