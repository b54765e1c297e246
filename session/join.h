// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "base/output_folder.h"
#include "base/progress.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"

// One session of the parts that several hosts recorded of it, each with its own cameras and on its own clock.
namespace emberlock::session {

/// The verb that writes the folder.
inline constexpr OutputVerb kJoin{"sessions join"};

/// A part that the leading host's manifest names and that isn't given.
enum class Missing {
  is_an_error,
  is_left_out,  ///< the joined session's manifest goes on naming it, so that it can be joined later
};

struct Joined {
  v1::Manifest manifest;
  std::vector<v1::HostPart> hosts;    ///< whose parts are in it, as the leading host's manifest tells of them
  std::uint64_t events_left_out = 0;  ///< of the others: join_events.h
};

/// Joins the parts of one recording, in any order: the leading host's, whose manifest has `hosts`, and the
/// others'. `out`, which must be missing or empty, appears when the session is whole, on the disk and read
/// back, or not at all. The leader's cameras come first, then the others' in the order of its `hosts`; files
/// of cameras are copied as they are, with the stamps of their hosts' clocks, and the manifest tells each
/// camera's clock, by which SessionReader shows them on the session's. No part can be recorded or changed by
/// another process meanwhile. Errors: bad_input (a folder that is no session, or given twice; parts of
/// several sessions or purposes; not exactly one that leads; one that wasn't recorded for another host, or
/// that the leader doesn't name; other cameras than it names, or one twice; no or a wild reading of a host's
/// clock; a missing part; times.json in some parts alone; the target is in the way), refused (a part isn't
/// finished, is damaged, or another process writes it; cancelled by the observer), io.
Result<Joined> join_sessions(const std::vector<std::filesystem::path>& parts,
                             const std::filesystem::path& out, Missing missing,
                             const Observer& observer = {});

}  // namespace emberlock::session
