// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/finished_part.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>

#include <fmt/format.h>

#include "daemon/engine/recorder.h"
#include "session/files.h"
#include "session/name.h"
#include "session/reader.h"

namespace emberlock::daemon {
namespace {

/// Returns the instant to which the frames of each camera reach; 0 where one has none.
std::int64_t find_end(const session::SessionReader& session) {
  std::int64_t until = std::numeric_limits<std::int64_t>::max();
  for (std::size_t i = 0; i < session.camera_count(); ++i) {
    const auto& stamps = session.stamps(i);
    until = std::min(until, stamps.empty() ? 0 : stamps.back().monotonic_time.ns);
  }
  return until;
}

/// Describes a part that isn't being recorded any more.
Result<v1::HostPart> describe_finished_part(const std::filesystem::path& folder,
                                            const v1::Manifest& manifest) {
  v1::HostPart part;
  part.set_session(folder.filename().string());
  part.set_state(v1::HostPart::RECORDING);
  if (manifest.state() == v1::Manifest::RECORDING) return part;  // being finished, or salvaged
  for (const v1::CameraStream& camera : manifest.cameras()) {
    part.set_frames(part.frames() + camera.counts().recorded());
    part.set_lost(part.lost() + lost(camera.counts()));
  }
  const auto session = session::SessionReader::open(folder);
  if (session.ok()) part.set_until_ns(find_end(*session));
  const bool salvaged = manifest.state() == v1::Manifest::SALVAGED;
  part.set_state(salvaged || !session.ok() ? v1::HostPart::SHORT : v1::HostPart::WHOLE);
  if (salvaged)
    part.set_why("its emberlockd ended in the midst of it; what had reached the disk was salvaged");
  if (!session.ok()) part.set_why(session.error().message());
  return part;
}

}  // namespace

std::string name_part(const std::string& name, int n) {
  std::string stem = session::stored_name(name);
  if (n == 1) return stem;
  const std::string number = fmt::format(" {}", n);
  while (!stem.empty() && !session::check_session_name(stem + number)) stem.pop_back();
  return stem + number;
}

Result<v1::HostPart> find_finished_part(const session::SessionStore& store,
                                        const v1::FindPartRequest& request) {
  Error none{ErrorKind::out_of_data, "it has no part of this session", request.name(), "Look for it there"};
  // The answer that would have said which of these names it has may have been lost.
  for (int n = 1; n <= kMostOfAName; ++n) {
    const auto folder = store.path_of(name_part(request.name(), n));
    if (!folder.ok()) continue;
    const auto manifest = session::read_manifest(*folder);
    if (manifest.ok() && manifest->session_id() == request.session_id())
      return describe_finished_part(*folder, *manifest);
    if (!manifest.ok() && n == 1) none = manifest.error();
  }
  return none;
}

}  // namespace emberlock::daemon
