// SPDX-License-Identifier: Apache-2.0
#include "recon/compute/device.h"

#include <charconv>
#include <cstdlib>
#include <string>

#include "recon/compute/cuda_device.h"

namespace emberlock::recon {

Result<Precision> parse_precision(std::string_view name) {
  if (name == "float32") return Precision::float32;
  if (name == "float64") return Precision::float64;
  return Error{ErrorKind::bad_input, "unknown precision '" + std::string(name) + "'", "precision",
               "Use float32 or float64"};
}

std::string_view name(Precision precision) { return precision == Precision::float32 ? "float32" : "float64"; }

std::string name(Device device) {
  if (device == Device::automatic) return "auto";
  if (device == Device::cpu) return "cpu";
  return device.gpu == 0 ? "cuda" : "cuda:" + std::to_string(device.gpu);
}

Result<Device> parse_device(std::string_view name) {
  if (name == "auto") return Device(Device::automatic);
  if (name == "cpu") return Device(Device::cpu);
  if (name == "cuda") return Device(Device::cuda);
  constexpr std::string_view kNumbered = "cuda:";
  if (name.substr(0, kNumbered.size()) == kNumbered) {
    int gpu = -1;
    const char* end = name.data() + name.size();
    const auto [last, error] = std::from_chars(name.data() + kNumbered.size(), end, gpu);
    if (error == std::errc() && last == end && gpu >= 0) return Device(Device::cuda, gpu);
  }
  return Error{ErrorKind::bad_input, "unknown device '" + std::string(name) + "'", "device",
               "Use auto, cpu, cuda, or cuda:N for the GPU of this number"};
}

Result<Device> resolve(Device choice) {
  const char* named = choice == Device::automatic ? std::getenv("EMBERLOCK_DEVICE") : nullptr;
  if (named != nullptr) {
    EMBERLOCK_ASSIGN_OR_RETURN(choice, parse_device(named));
  }
  if (choice == Device::cpu || (choice == Device::automatic && kGpuInSoftware)) return Device(Device::cpu);
  const Status cuda = cuda_status(choice.gpu);
  if (cuda.ok()) return Device(Device::cuda, choice.gpu);
  if (choice == Device::automatic) return Device(Device::cpu);
  return cuda.error();
}

#ifndef EMBERLOCK_HAVE_CUDA
Status cuda_status(int /*gpu*/) {
  return Error{ErrorKind::device, "this build has no CUDA backend", "device cuda",
               "Build where nvcc is on PATH, or use --device cpu"};
}
void use_gpu(int /*gpu*/) {}
void reserve_gpu_memory(std::size_t /*bytes*/) {}
std::size_t reserved_gpu_memory() { return 0; }
void finish_gpu_work() {}
GpuWork gpu_work() { return {}; }
#endif

}  // namespace emberlock::recon
