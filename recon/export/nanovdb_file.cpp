// SPDX-License-Identifier: Apache-2.0
// The only file that includes NanoVDB's headers, which need no OpenVDB.
#include "recon/export/nanovdb_file.h"

#include <cstddef>
#include <exception>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include <nanovdb/util/GridBuilder.h>
#include <nanovdb/util/IO.h>

namespace emberlock::recon {
namespace {

template <class Value, class ValueAt>
nanovdb::GridHandle<> nano_grid(const Grid& grid, const std::string& name, nanovdb::GridClass kind,
                                const ValueAt& value_at) {
  nanovdb::GridBuilder<Value> builder(Value(0.0F), kind);
  auto accessor = builder.getAccessor();
  for (int k = 0; k < grid.nz; ++k)
    for (int j = 0; j < grid.ny; ++j)
      for (int i = 0; i < grid.nx; ++i) {
        const Value value = value_at(grid.index(i, j, k));
        if (value != Value(0.0F)) accessor.setValue({i, j, k}, value);
      }
  const auto at = [&](int axis) { return static_cast<double>(grid.origin[axis]); };
  return builder.getHandle(static_cast<double>(grid.edge), {at(0), at(1), at(2)}, name);
}

nanovdb::GridHandle<> nano_grid(const Grid& grid, const SharedGrid& from) {
  const std::vector<float>& v = from.values;
  if (v.size() == grid.size())
    return nano_grid<float>(grid, from.name, nanovdb::GridClass::FogVolume,
                            [&](std::size_t p) { return v[p]; });
  return nano_grid<nanovdb::Vec3f>(grid, from.name, nanovdb::GridClass::Unknown, [&](std::size_t p) {
    return nanovdb::Vec3f(v[3 * p], v[3 * p + 1], v[3 * p + 2]);
  });
}

}  // namespace

Status write_nanovdb(const SharedVolume& volume, const std::filesystem::path& path) try {
  std::vector<nanovdb::GridHandle<>> grids;
  grids.reserve(volume.grids.size());
  for (const SharedGrid& grid : volume.grids) grids.push_back(nano_grid(volume.grid, grid));
  std::ofstream file(path, std::ios::binary);
  file.exceptions(std::ios::failbit | std::ios::badbit);  // NanoVDB itself looks at few of its writes
  nanovdb::io::writeGrids<nanovdb::HostBuffer, std::vector>(file, grids, nanovdb::io::Codec::NONE);
  file.close();
  return {};
} catch (const std::bad_alloc&) {
  throw;
} catch (const std::exception& e) {
  return Error{ErrorKind::io, std::string("cannot write: ") + e.what(), path.string(),
               "Check that the folder is writable and the disk has room"};
}

}  // namespace emberlock::recon
