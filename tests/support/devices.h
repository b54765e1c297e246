#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

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

/// A test that runs on each device: Device::automatic, the default of all options, is that one.
class OnEachDevice : public testing::TestWithParam<Device> {
 protected:
  OnEachDevice() { ::setenv("EMBERLOCK_DEVICE", device_name(GetParam()).c_str(), 1); }
  ~OnEachDevice() override { ::unsetenv("EMBERLOCK_DEVICE"); }
};

/// The one that such a test runs on.
inline Device device_here() { return OnEachDevice::GetParam(); }

/// Suite `name` for TEST_P.
#define ON_EACH_DEVICE(name)                                            \
  class name : public OnEachDevice {};                                  \
  INSTANTIATE_TEST_SUITE_P(Devices, name, testing::ValuesIn(devices()), \
                           [](const auto& on) { return device_name(on.param); })

}  // namespace emberlock
