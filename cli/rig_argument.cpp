// SPDX-License-Identifier: Apache-2.0
#include "cli/rig_argument.h"

#include <cstdio>

namespace emberlock::cli {

Result<v1::Rig> import_rig_argument(const std::filesystem::path& path) {
  recon::ImportNotes notes;
  auto rig = recon::import_rig(path, &notes);
  if (!rig) return rig;
  for (const std::string& note : notes) std::fprintf(stderr, "%-16s %s\n", "note", note.c_str());
  return rig;
}

}  // namespace emberlock::cli
