// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/scene.h"
#include "recon/render/at_key_points.h"
#include "tests/support/glowing_flame.h"

namespace emberlock::test {

/// A frame that `emberlock simulate flame` filmed, and what it was.
struct Simulated {
  recon::Scene scene;
  recon::Volume truth;
  std::vector<float> kelvin;
};

/// The last one of a folder.
inline Result<Simulated> last_simulated(const std::filesystem::path& folder) {
  recon::SceneOptions options;
  std::filesystem::path last;
  std::size_t frames = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder / "truth")) {
    last = std::max(last, entry.path());
    ++frames;
  }
  if (frames == 0) return Error{ErrorKind::bad_input, "no truth", folder.string(), "Simulate a flame there"};
  options.frame = frames - 1;
  Simulated out;
  EMBERLOCK_ASSIGN_OR_RETURN(out.scene, recon::load_scene(folder / "session", options));
  EMBERLOCK_ASSIGN_OR_RETURN(out.truth, recon::read_volume(last));
  EMBERLOCK_ASSIGN_OR_RETURN(out.kelvin, recon::read_grid(last, "temperature"));
  return out;
}

/// A simulated flame's truth at a reconstruction's key points; nothing outside.
inline GlowTruth truth_on(const recon::Grid& grid, const recon::Volume& truth,
                          const std::vector<float>& kelvin) {
  const auto there = [&](const std::vector<float>& values, std::size_t lanes) {
    return recon::at_key_points(grid, truth.grid, values, lanes);
  };
  return {there(kelvin, 1), there(truth.extinction, 1), there(truth.emission, 3)};
}

}  // namespace emberlock::test
