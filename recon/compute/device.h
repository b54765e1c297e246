// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <compare>
#include <exception>
#include <string>
#include <string_view>
#include <utility>

#include "base/result.h"

namespace emberlock::recon {

/// Where the heavy passes run.
struct Device {
  enum Kind {
    automatic,  ///< CUDA if it was built and a GPU answers, else the CPU
    cpu,
    cuda,
  };
  // NOLINTNEXTLINE(google-explicit-constructor): a kind is a device, the first of its kind
  constexpr Device(Kind of = automatic, int number = 0) : kind(of), gpu(number) {}
  Kind kind;
  int gpu;  ///< of `cuda`: which GPU, as the driver counts them from 0
  friend auto operator<=>(const Device&, const Device&) = default;
  friend bool operator==(const Device&, const Device&) = default;
  friend bool operator==(const Device& device, Kind of) { return device.kind == of; }
};
/// "auto", "cpu", "cuda" (the first GPU), "cuda:1", ...
std::string name(Device device);

/// Whether this build can launch on a GPU. If not, no Pool has Device::cuda.
#ifdef EMBERLOCK_HAVE_CUDA
inline constexpr bool kCudaBuilt = true;
#else
inline constexpr bool kCudaBuilt = false;
#endif

/// Whether its GPU is one in software (EMBERLOCK_CUDA=SOFTWARE), for tests: nobody gets it who doesn't name
/// it.
#ifdef EMBERLOCK_GPU_IN_SOFTWARE
inline constexpr bool kGpuInSoftware = true;
#else
inline constexpr bool kGpuInSoftware = false;
#endif

/// Precision of the march and of all values at key points.
enum class Precision { float32, float64 };

/// "float32" or "float64"; an Error that lists them otherwise.
Result<Precision> parse_precision(std::string_view name);
std::string_view name(Precision precision);

/// Device and number of threads. On the CPU results are bit-identical for any number of threads.
struct ComputeOptions {
  Device device = Device::automatic;
  int threads = 0;  ///< CPU threads, 1..256; 0: all cores
};

/// A device failed, isn't usable, or has too little memory. Functions that return a Result convert it to its
/// Error.
class DeviceError : public std::exception {
 public:
  explicit DeviceError(Error error) : error_(std::move(error)) {}
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.what.c_str(); }

 private:
  Error error_;
};

/// The device of this name(); otherwise the Error lists what there is.
Result<Device> parse_device(std::string_view name);

/// The device selected on this machine: cpu or cuda, never automatic. An Error of kind `device` says why CUDA
/// isn't usable (not built, no driver, no such GPU). EMBERLOCK_DEVICE=cpu|cuda|cuda:N in the environment
/// overrides automatic, for tests and comparisons.
Result<Device> resolve(Device choice);

}  // namespace emberlock::recon
