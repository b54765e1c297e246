// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <vector>

#include <gtest/gtest.h>

#include "recon/export/volume_file.h"

namespace emberlock::test {

/// A volume that glows at one key point.
inline std::filesystem::path make_hot_volume(const std::filesystem::path& path) {
  recon::Volume volume;
  volume.grid = {{0, 0, 0}, 0.01F, 3, 3, 3};
  volume.emission.assign(3 * volume.grid.size(), 0.0F);
  volume.extinction.assign(volume.grid.size(), 0.0F);
  volume.extinction[13] = 5;
  std::vector<float> kelvin(volume.grid.size());
  kelvin[13] = 1500;
  const std::vector<recon::NamedGrid> further = {{"temperature", "K", kelvin},
                                                 {"temperature_sigma", "K", kelvin}};
  std::filesystem::create_directories(path.parent_path());
  EXPECT_TRUE(recon::write_volume(volume, path, further).ok());
  return path;
}

}  // namespace emberlock::test
