// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdlib>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "recon/compute/cuda_device.h"
#include "recon/compute/device.h"

namespace emberlock {

/// What this machine can run.
inline std::vector<recon::Device> every_device() {
  std::vector<recon::Device> found = {recon::Device::cpu};
  if (recon::cuda_status().ok()) found.push_back(recon::Device::cuda);
  return found;
}

/// Tests that hold on every device are instantiated over these. Under sanitizers a GPU in software is too
/// slow for most of them: only suites that run each of its passes once take every_device() there.
inline std::vector<recon::Device> devices() {
#ifdef EMBERLOCK_SANITIZED
  return {recon::Device::cpu};
#else
  return every_device();
#endif
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

/// The devices besides the CPU, to be compared with it; often none.
inline std::vector<recon::Device> others_of(const std::vector<recon::Device>& all) {
  return {all.begin() + 1, all.end()};
}
inline std::vector<recon::Device> other_devices() { return others_of(every_device()); }

/// The one that such a test runs on.
inline recon::Device device_here() { return OnEachDevice::GetParam(); }

/// Suite `name` for TEST_P.
#define ON_EACH_DEVICE(name) EMBERLOCK_SUITE_ON(name, devices())
/// Under sanitizers too.
#define ON_EACH_DEVICE_SANITIZED_TOO(name) EMBERLOCK_SUITE_ON(name, every_device())
#define EMBERLOCK_SUITE_ON(name, on_devices)                             \
  class name : public OnEachDevice {};                                   \
  INSTANTIATE_TEST_SUITE_P(Devices, name, testing::ValuesIn(on_devices), \
                           [](const auto& on) { return device_name(on.param); })

}  // namespace emberlock
