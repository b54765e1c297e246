// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

// Who leaves a full room; pure. Whoever comes is let in, and of those inside one leaves, of the group that
// has most. So nobody shuts others out by coming often: a newcomer displaces somebody of a group only when no
// other group has more, and within it the one who waited longest.
namespace emberlock::daemon {

struct Guest {
  std::string group;        ///< who it is, as far as that is known
  int rank = 0;             ///< lower ranks leave first, whatever their groups
  std::uint64_t since = 0;  ///< the smaller, the longer it waits
};

/// Its place among `guests`; absent: there are none.
inline std::optional<std::size_t> who_leaves(const std::vector<Guest>& guests) {
  if (guests.empty()) return std::nullopt;
  const int rank = std::min_element(guests.begin(), guests.end(), [](const Guest& a, const Guest& b) {
                     return a.rank < b.rank;
                   })->rank;
  std::map<std::string, std::size_t> groups;
  for (const Guest& guest : guests) groups[guest.group] += guest.rank == rank ? 1 : 0;
  const auto leaves_before = [&](const Guest& a, const Guest& b) {
    if (a.rank != b.rank) return a.rank < b.rank;
    if (groups.at(a.group) != groups.at(b.group)) return groups.at(a.group) > groups.at(b.group);
    return a.since < b.since;
  };
  return static_cast<std::size_t>(std::min_element(guests.begin(), guests.end(), leaves_before) -
                                  guests.begin());
}

}  // namespace emberlock::daemon
