// SPDX-License-Identifier: Apache-2.0
#include "recon/export/medium_grid.h"

#include <algorithm>

namespace emberlock::recon {
namespace {

/// Calls act(voxel, its lowest corner) in the order of memory.
template <class Act>
void each_voxel(const Grid& grid, const Act& act) {
  std::size_t voxel = 0;
  for (int k = 0; k < grid.nz - 1; ++k)
    for (int j = 0; j < grid.ny - 1; ++j)
      for (int i = 0; i < grid.nx - 1; ++i) act(voxel++, grid.index(i, j, k));
}

}  // namespace

std::vector<float> medium_values(const Volume& volume) {
  std::vector<float> values(volume.grid.size());
  each_voxel(volume.grid, [&](std::size_t voxel, std::size_t p) { values[p] = volume.inside[voxel]; });
  return values;
}

Result<std::vector<std::uint8_t>> voxels_of_medium(const std::vector<float>& values, const Grid& grid,
                                                   const std::filesystem::path& path) {
  if (values.size() != grid.size())
    return Error{ErrorKind::bad_input, "medium is of another size than emission", path.string(),
                 "Name a volume.vdb that `emberlock reconstruct` wrote"};
  std::vector<std::uint8_t> inside;
  each_voxel(grid, [&](std::size_t, std::size_t p) { inside.push_back(values[p] > 0 ? 1 : 0); });
  return inside;
}

Status fold_medium(SharedVolume& volume, const std::filesystem::path& path) {
  const SharedGrid* medium = volume.find(kMedium);
  if (medium == nullptr) return {};
  Volume shape{volume.grid, {}, {}, {}};
  EMBERLOCK_ASSIGN_OR_RETURN(shape.inside, voxels_of_medium(medium->values, volume.grid, path));
  const std::vector<float> share = shares_inside(shape);
  std::erase_if(volume.grids, [](const SharedGrid& grid) { return grid.name == kMedium; });
  for (SharedGrid& grid : volume.grids) {
    if (grid.name != "emission" && grid.name != "density") continue;
    const std::size_t channels = grid.values.size() / share.size();
    for (std::size_t i = 0; i < grid.values.size(); ++i) grid.values[i] *= share[i / channels];
  }
  return {};
}

}  // namespace emberlock::recon
