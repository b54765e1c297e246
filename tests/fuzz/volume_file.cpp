// SPDX-License-Identifier: Apache-2.0
#include "recon/export/volume_file.h"

#include <cstddef>
#include <filesystem>
#include <string>

#include <sys/mman.h>
#include <unistd.h>

#include "base/unique_fd.h"
#include "recon/export/vdb_identity.h"
#include "tests/fuzz/target.h"

// A volume.vdb whose identifier is made to fit its bytes, as anybody can, is read or refused, whatever sizes
// it states.
FUZZ_TARGET(volume_file) {
  using namespace emberlock;
  constexpr std::size_t kIdentified = 57;
  if (size < kIdentified) return 0;
  static const UniqueFd file(::memfd_create("input", MFD_CLOEXEC));
  static const std::filesystem::path path = "/proc/self/fd/" + std::to_string(file.get());
  if (::ftruncate(file.get(), 0) != 0) return 0;
  if (::pwrite(file.get(), data, size, 0) != static_cast<ssize_t>(size)) return 0;
  recon::identify_by_content(path);
  static_cast<void>(recon::read_volume(path));
  static_cast<void>(recon::read_lighting(path));
  static_cast<void>(recon::read_shared_volume(path));
  return 0;
}
