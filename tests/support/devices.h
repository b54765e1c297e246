// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "recon/compute/cuda_device.h"
#include "recon/compute/device.h"

namespace emberlock {

/// What this machine can run: tests that hold on every device are instantiated over these.
inline std::vector<recon::Device> devices() {
  std::vector<recon::Device> found = {recon::Device::cpu};
  if (recon::cuda_status().ok()) found.push_back(recon::Device::cuda);
  return found;
}

inline std::string device_name(recon::Device device) {
  return device == recon::Device::cuda ? "cuda" : "cpu";
}

/// A test that runs on each device: Device::automatic, the default of all options, is that one.
class OnEachDevice : public testing::TestWithParam<recon::Device> {
 protected:
  OnEachDevice() { ::setenv("EMBERLOCK_DEVICE", device_name(GetParam()).c_str(), 1); }
  ~OnEachDevice() override { ::unsetenv("EMBERLOCK_DEVICE"); }
};

/// What this machine can run beside the CPU, to be compared with it; often none.
inline std::vector<recon::Device> other_devices() {
  const std::vector<recon::Device> all = devices();
  return {all.begin() + 1, all.end()};
}

/// The one that such a test runs on.
inline recon::Device device_here() { return OnEachDevice::GetParam(); }

/// Suite `name` for TEST_P.
#define ON_EACH_DEVICE(name)                                            \
  class name : public OnEachDevice {};                                  \
  INSTANTIATE_TEST_SUITE_P(Devices, name, testing::ValuesIn(devices()), \
                           [](const auto& on) { return device_name(on.param); })

}  // namespace emberlock
