// SPDX-License-Identifier: Apache-2.0
#include "daemon/ar/results.h"

#include <algorithm>
#include <charconv>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "session/name.h"

namespace emberlock::daemon {
namespace {
namespace fs = std::filesystem;

constexpr const char* kMiddleFrame = "middle-frame";

/// Of "frame-12", as it is written.
std::optional<std::uint64_t> number_of(const std::string& folder) {
  constexpr std::string_view kPrefix = "frame-";
  if (!folder.starts_with(kPrefix)) return std::nullopt;
  std::uint64_t number = 0;
  const auto read = std::from_chars(folder.data() + kPrefix.size(), folder.data() + folder.size(), number);
  if (read.ec != std::errc() || folder != fmt::format("{}{}", kPrefix, number)) return std::nullopt;
  return number;
}

/// A folder, not a link to one.
bool is_folder(const fs::path& path) {
  std::error_code ec;
  return fs::is_directory(fs::symlink_status(path, ec));
}

struct Listed {
  v1::ListResultsResponse::Entry entry;
  fs::file_time_type newest = fs::file_time_type::min();
};

/// Nothing where a session has no results.
std::optional<Listed> results_of(const fs::path& session) {
  Listed listed;
  std::vector<std::uint64_t> frames;
  std::error_code ec;
  for (fs::directory_iterator at(session, ec), end; !ec && at != end; at.increment(ec)) {
    const std::string name = at->path().filename().string();
    const auto number = number_of(name);
    std::error_code missing;
    if ((!number && name != kMiddleFrame) || !is_folder(at->path()) ||
        !fs::is_regular_file(at->path() / "volume.vdb", missing))
      continue;
    if (number)
      frames.push_back(*number);
    else
      listed.entry.set_middle_frame(true);
    const fs::file_time_type written = fs::last_write_time(at->path(), missing);
    if (!missing) listed.newest = std::max(listed.newest, written);
  }
  if (frames.empty() && !listed.entry.middle_frame()) return std::nullopt;
  std::sort(frames.begin(), frames.end());
  listed.entry.mutable_frames()->Add(frames.begin(), frames.end());
  listed.entry.set_session(session.filename().string());
  return listed;
}

}  // namespace

v1::ListResultsResponse list_results(const fs::path& results) {
  std::vector<Listed> all;
  std::error_code ec;
  for (fs::directory_iterator at(results, ec), end; !ec && at != end; at.increment(ec)) {
    if (!session::check_session_name(at->path().filename().string()).ok() || !is_folder(at->path())) continue;
    if (auto listed = results_of(at->path())) all.push_back(std::move(*listed));
  }
  std::sort(all.begin(), all.end(), [](const Listed& a, const Listed& b) {
    return a.newest != b.newest ? a.newest > b.newest : a.entry.session() < b.entry.session();
  });
  v1::ListResultsResponse response;
  for (Listed& listed : all) *response.add_results() = std::move(listed.entry);
  return response;
}

Result<fs::path> find_result(const fs::path& results, const std::string& session, const std::string& result) {
  EMBERLOCK_RETURN_IF_ERROR(session::check_session_name(session));
  const fs::path folder = results / session;
  const auto listed = is_folder(folder) ? results_of(folder) : std::nullopt;
  const std::string where = result.empty() ? session : session + ", " + result;
  const Error none{ErrorKind::bad_input, "there is no such result", where,
                   "Reconstruct it first, or choose one of those listed"};
  if (!listed) return none;
  if (result.empty()) return listed->entry.frames().empty() ? Result<fs::path>(none) : folder;
  if (result == kMiddleFrame) return listed->entry.middle_frame() ? Result<fs::path>(folder / result) : none;
  const auto number = number_of(result);
  const auto& frames = listed->entry.frames();
  if (!number || !std::binary_search(frames.begin(), frames.end(), *number)) return none;
  return folder / result;
}

}  // namespace emberlock::daemon
