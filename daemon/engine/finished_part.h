// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/result.h"
#include "emberlock/v1/hosts.pb.h"
#include "session/store.h"

namespace emberlock::daemon {

/// So many sessions may be called like one take, at a host that lends its cameras.
inline constexpr int kMostOfAName = 99;

/// Returns the nth name for a part: the take's, then that with a number, shortened where both would be too
/// long.
std::string name_part(const std::string& name, int n);

/// Finds this host's part of a session that isn't being recorded any more, and describes what it holds. Reads
/// the session's manifest and index, so a thread that serves a recording doesn't call it. Error: out_of_data
/// (there is no such part), or those of the manifest.
Result<v1::HostPart> find_finished_part(const session::SessionStore& store,
                                        const v1::FindPartRequest& request);

}  // namespace emberlock::daemon
