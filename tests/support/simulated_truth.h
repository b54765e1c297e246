// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <vector>

#include "base/result.h"
#include "recon/export/volume_file.h"
#include "recon/pipeline/scene.h"
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
  GlowTruth out{std::vector<float>(grid.size()), std::vector<float>(grid.size()),
                std::vector<float>(3 * grid.size())};
  const recon::Grid& from = truth.grid;
  const int n[3] = {from.nx, from.ny, from.nz};
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const int at[3] = {i, j, k};
        int low[3];
        float part[3];
        bool inside = true;
        for (int d = 0; d < 3; ++d) {
          const float x =
              (grid.origin[d] + grid.edge * static_cast<float>(at[d]) - from.origin[d]) / from.edge;
          inside = inside && x >= 0 && x < static_cast<float>(n[d] - 1);
          low[d] = inside ? static_cast<int>(x) : 0;
          part[d] = x - static_cast<float>(low[d]);
        }
        if (!inside) continue;
        const std::size_t p = grid.index(i, j, k);
        for (int corner = 0; corner < 8; ++corner) {
          float weight = 1;
          int place[3];
          for (int d = 0; d < 3; ++d) {
            const int upper = corner >> d & 1;
            place[d] = low[d] + upper;
            weight *= upper != 0 ? part[d] : 1 - part[d];
          }
          const std::size_t q = from.index(place[0], place[1], place[2]);
          out.kelvin[p] += weight * kelvin[q];
          out.absorption[p] += weight * truth.extinction[q];
          for (std::size_t c = 0; c < 3; ++c) out.emission[3 * p + c] += weight * truth.emission[3 * q + c];
        }
      }
  return out;
}

}  // namespace emberlock::test
