// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

// Chooses which connection is closed when the limit is reached. Pure. A new one is always accepted, and one
// of the group with the most connections is closed, the one that has waited longest. So a group that connects
// often can't shut others out: it displaces a group's connection only if no other group has more.
namespace emberlock::daemon {

struct Occupant {
  std::string group;        ///< identity of the client, as far as it is known
  int rank = 0;             ///< lower ranks are evicted first, in any group
  std::uint64_t since = 0;  ///< order of the last activity; smaller is earlier
};

/// Index in `occupants`; nullopt if it is empty.
inline std::optional<std::size_t> choose_evicted(const std::vector<Occupant>& occupants) {
  if (occupants.empty()) return std::nullopt;
  const int rank =
      std::min_element(occupants.begin(), occupants.end(), [](const Occupant& a, const Occupant& b) {
        return a.rank < b.rank;
      })->rank;
  std::map<std::string, std::size_t> groups;
  for (const Occupant& occupant : occupants) groups[occupant.group] += occupant.rank == rank ? 1 : 0;
  const auto leaves_before = [&](const Occupant& a, const Occupant& b) {
    if (a.rank != b.rank) return a.rank < b.rank;
    if (groups.at(a.group) != groups.at(b.group)) return groups.at(a.group) > groups.at(b.group);
    return a.since < b.since;
  };
  return static_cast<std::size_t>(std::min_element(occupants.begin(), occupants.end(), leaves_before) -
                                  occupants.begin());
}

}  // namespace emberlock::daemon
