// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "emberlock/v1/session.pb.h"
#include "session/host_clock.h"

namespace emberlock::session {

/// Events of one host's part of a session.
struct PartEvents {
  std::vector<v1::Event> events;
  HostClock clock;  ///< of their instants
  int cameras = 0;  ///< in its manifest
};

struct JoinedEvents {
  std::vector<v1::Event> events;
  std::uint64_t left_out = 0;
};

/// One session's events of its parts', the leading host's first, then in the order of their cameras: by their
/// instants on the session's clock, those of one part in the order in which it has them. Decisions go by
/// cameras' places in their own part. The leader's cameras keep theirs; what the others tell of the lock that
/// a decision of the leader's tells of is taken into it, in the joined order, with the worst pair of all.
/// Others' further decisions and their alignments' settings have no place in it: left out, and counted.
JoinedEvents join_events(std::vector<PartEvents> parts);

}  // namespace emberlock::session
