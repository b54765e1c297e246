// SPDX-License-Identifier: Apache-2.0
#include "session/shutter_times.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <system_error>

#include <fmt/format.h>

#include "base/file.h"
#include "session/json_message.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr std::size_t kMaxTimesBytes = std::size_t{1} << 30;

constexpr const char* kMakeAgain =
    "Make it again with emberlock import, or remove it: the frames then count as taken at their instants";

Error wrong_times(const std::string& where, std::string what) {
  return {ErrorKind::bad_input, std::move(what), where, kMakeAgain};
}

Status check_numbers(const v1::ShutterTimes& times, const std::string& where) {
  for (const v1::ShutterTimes::Camera& camera : times.cameras()) {
    const std::string field = where + ", camera " + camera.camera_id();
    const bool finite = std::all_of(camera.late_s().begin(), camera.late_s().end(),
                                    [](double s) { return std::isfinite(s); });
    if (!finite) return wrong_times(field + ", field late_s", "a time isn't finite");
    if (!std::isfinite(camera.sigma_s()) || camera.sigma_s() < 0)
      return wrong_times(field + ", field sigma_s", "the standard error isn't finite, or below zero");
  }
  return {};
}

}  // namespace

fs::path shutter_times_path(const fs::path& folder) { return folder / "times.json"; }

Result<v1::ShutterTimes> parse_shutter_times(std::string_view json, const std::string& where) {
  v1::ShutterTimes times;
  EMBERLOCK_RETURN_IF_ERROR(read_json(json, times, "a session's times", where, kMakeAgain));
  EMBERLOCK_RETURN_IF_ERROR(check_numbers(times, where));
  return times;
}

Status write_shutter_times(const fs::path& folder, const v1::ShutterTimes& times) {
  const fs::path path = shutter_times_path(folder);
  EMBERLOCK_RETURN_IF_ERROR(check_numbers(times, path.string()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json,
                             json_of(times, Defaults::written, "the session's times", path.string()));
  return write_file_atomically(path, json);
}

Result<std::optional<v1::ShutterTimes>> read_shutter_times(const SessionReader& session) {
  const fs::path path = shutter_times_path(session.folder());
  const std::string where = path.string();
  std::error_code ec;
  if (!fs::exists(path, ec)) return std::optional<v1::ShutterTimes>();
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json, read_file(path, kMaxTimesBytes));
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::ShutterTimes read, parse_shutter_times(json, where));
  std::map<std::string, const v1::ShutterTimes::Camera*> by_id;
  for (const v1::ShutterTimes::Camera& camera : read.cameras()) {
    if (!by_id.emplace(camera.camera_id(), &camera).second)
      return wrong_times(where + ", camera " + camera.camera_id(), "the camera is there twice");
  }
  std::optional<v1::ShutterTimes> ordered(std::in_place);
  for (std::size_t c = 0; c < session.camera_count(); ++c) {
    const std::string& id = session.manifest().cameras(static_cast<int>(c)).camera_id();
    const auto found = by_id.find(id);
    if (found == by_id.end())
      return wrong_times(fmt::format("{}, camera {}", where, id), "the camera of the manifest has no times");
    const std::size_t frames = session.stamps(c).size();
    if (static_cast<std::size_t>(found->second->late_s_size()) != frames) {
      return wrong_times(
          fmt::format("{}, camera {}, field late_s", where, id),
          fmt::format("{} times, but the index has {} frames", found->second->late_s_size(), frames));
    }
    *ordered->add_cameras() = *found->second;
    by_id.erase(found);
  }
  if (!by_id.empty())
    return wrong_times(where + ", camera " + by_id.begin()->first, "the manifest has no such camera");
  return ordered;
}

}  // namespace emberlock::session
