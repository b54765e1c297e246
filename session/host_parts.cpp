// SPDX-License-Identifier: Apache-2.0
#include "session/host_parts.h"

#include "session/events.h"
#include "session/files.h"

namespace emberlock::session {

Status write_host_parts(const std::filesystem::path& folder, const std::vector<v1::HostPart>& parts) {
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd held, hold_finished(folder, Alone::yes));
  EMBERLOCK_ASSIGN_OR_RETURN(v1::Manifest manifest, read_manifest(folder));
  manifest.mutable_hosts()->Assign(parts.begin(), parts.end());
  return write_manifest(folder, manifest);
}

}  // namespace emberlock::session
