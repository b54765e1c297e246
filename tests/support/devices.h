#pragma once

#include <string>
#include <vector>

#include "recon/compute/cuda_device.h"
#include "recon/compute/device.h"

namespace emberlock {

/// What this machine can run: tests that hold on every device are instantiated over these.
inline std::vector<Device> devices() {
  std::vector<Device> found = {Device::cpu};
  if (cuda_status().ok()) found.push_back(Device::cuda);
  return found;
}

inline std::string device_name(Device device) { return device == Device::cuda ? "cuda" : "cpu"; }

}  // namespace emberlock
