// SPDX-License-Identifier: Apache-2.0
#include "session/unindexed.h"

#include <algorithm>
#include <charconv>
#include <set>
#include <system_error>
#include <tuple>
#include <utility>

#include "session/files.h"
#include "session/segment.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

using Place = std::pair<std::uint32_t, std::uint32_t>;  ///< segment, milliseconds

Place place_of(const IndexRecord& record) { return {record.segment, record.segment_ms}; }

/// Numbers of the segments in the camera's folder.
std::set<std::uint32_t> segments_in(const fs::path& folder, const std::string& camera_id) {
  std::set<std::uint32_t> numbers;
  std::error_code ec;
  for (fs::directory_iterator at(folder / camera_id, ec), end; !ec && at != end; at.increment(ec)) {
    const std::string stem = at->path().stem().string();
    const fs::path extension = at->path().extension();
    std::uint32_t number = 0;
    const auto [last, error] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
    const bool named = error == std::errc() && last == stem.data() + stem.size();
    if (named && (extension == ".mkv" || extension == ".nut")) numbers.insert(number);
  }
  return numbers;
}

}  // namespace

std::vector<IndexRecord> unindexed_frames(const fs::path& folder, const std::string& camera_id,
                                          const std::vector<IndexRecord>& index, Search search) {
  std::set<Place> known;
  for (const IndexRecord& record : index) known.insert(place_of(record));
  std::vector<IndexRecord> found;
  for (const std::uint32_t number : segments_in(folder, camera_id)) {
    const bool behind = index.empty() || number >= index.back().segment;
    const fs::path path = find_segment(folder, camera_id, number);
    if (path.empty() || (search == Search::behind_the_index && !behind)) continue;
    for (const IndexRecord& record : records_in(path)) {
      if (record.segment == number && known.insert(place_of(record)).second) found.push_back(record);
    }
  }
  return merged({}, found);
}

std::vector<IndexRecord> merged(const std::vector<IndexRecord>& index,
                                const std::vector<IndexRecord>& found) {
  const auto before = [](const IndexRecord& a, const IndexRecord& b) { return place_of(a) < place_of(b); };
  std::vector<IndexRecord> others = found;
  std::sort(others.begin(), others.end(), before);
  std::vector<IndexRecord> all;
  auto next = index.begin();
  for (const IndexRecord& other : others) {
    while (next != index.end() && !before(other, *next)) all.push_back(*next++);
    const bool fits =
        (all.empty() || follows(all.back(), other)) && (next == index.end() || follows(other, *next));
    if (fits) all.push_back(other);
  }
  all.insert(all.end(), next, index.end());
  return all;
}

}  // namespace emberlock::session
