// SPDX-License-Identifier: Apache-2.0
#include "session/join.h"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "base/file.h"
#include "base/result_list.h"
#include "base/unique_fd.h"
#include "session/events.h"
#include "session/file_copies.h"
#include "session/files.h"
#include "session/host_clock.h"
#include "session/join_events.h"
#include "session/reader.h"
#include "session/shutter_times.h"
#include "session/verify.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

/// One host's, held against changes.
struct JoinPart {
  fs::path folder;
  UniqueFd held;
  SessionReader session;

  [[nodiscard]] const v1::Manifest& manifest() const { return session.manifest(); }
  [[nodiscard]] bool leads() const { return manifest().hosts_size() > 0; }
  [[nodiscard]] std::set<std::string> camera_ids() const {
    std::set<std::string> ids;
    for (const v1::CameraStream& camera : manifest().cameras()) ids.insert(camera.camera_id());
    return ids;
  }
};

/// A part with what the leading host's manifest tells of it; the leader's own with nothing.
struct PlacedPart {
  const JoinPart* part;
  v1::HostPart told;
  HostClock clock;
};

/// Which parts make the session, the leader's first, and which are missing.
struct JoinPlan {
  std::vector<PlacedPart> parts;
  std::vector<v1::HostPart> missing;
};

constexpr double kCopied = 0.5;  // share of the time: the rest reads every frame

Error wrong_part(const fs::path& folder, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), folder.string(), std::move(remedy)};
}

std::set<std::string> camera_ids_of(const v1::HostPart& host) {
  return {host.camera_ids().begin(), host.camera_ids().end()};
}

Result<std::vector<JoinPart>> open_parts(const std::vector<fs::path>& folders) {
  std::vector<JoinPart> parts;
  for (const fs::path& folder : folders) {
    EMBERLOCK_ASSIGN_OR_RETURN(UniqueFd held, hold_finished(folder, Alone::no));
    EMBERLOCK_ASSIGN_OR_RETURN(SessionReader session, SessionReader::open(folder));
    for (const JoinPart& other : parts) {
      std::error_code ec;
      if (fs::equivalent(other.folder, folder, ec))
        return wrong_part(folder, "is given twice", "Name each part once");
    }
    parts.push_back({folder, std::move(held), std::move(session)});
  }
  return parts;
}

Result<const JoinPart*> leader_of(const std::vector<JoinPart>& parts) {
  const JoinPart* leader = nullptr;
  for (const JoinPart& part : parts) {
    if (!part.leads()) continue;
    if (leader != nullptr)
      return wrong_part(part.folder, "is a leading host's part, and so is " + leader->folder.string(),
                        "Join the parts of one session at a time");
    leader = &part;
  }
  if (leader != nullptr) return leader;
  return wrong_part(parts.empty() ? fs::path() : parts.front().folder,
                    "none of the parts names those of other hosts",
                    "Name the leading host's too: its manifest.json has \"hosts\"");
}

/// Parts of the leader's session, none of whose cameras is in two.
Status check_together(const std::vector<JoinPart>& parts, const JoinPart& leader) {
  const v1::Manifest& first = leader.manifest();
  std::set<std::string> cameras = leader.camera_ids();
  for (const JoinPart& part : parts) {
    if (&part == &leader) continue;
    const v1::Manifest& manifest = part.manifest();
    if (manifest.session_id() != first.session_id())
      return wrong_part(part.folder,
                        fmt::format("is of the session \"{}\", and {} of \"{}\"", manifest.session_id(),
                                    leader.folder.string(), first.session_id()),
                        "Join the parts of one session");
    if (manifest.led_by().empty())
      return wrong_part(part.folder, "wasn't recorded for another host: its manifest has no \"led_by\"",
                        "Join the parts of one session");
    if (manifest.purpose() != first.purpose())
      return wrong_part(part.folder,
                        fmt::format("is a recording for \"{}\", and {} for \"{}\"", manifest.purpose(),
                                    leader.folder.string(), first.purpose()),
                        "Join the parts of one session");
    for (const std::string& id : part.camera_ids())
      if (!cameras.insert(id).second)
        return wrong_part(part.folder, "another part has the camera " + id + " too",
                          "Leave one of them out: a camera's name is its folder's");
  }
  return {};
}

Error missing_parts(const JoinPart& leader, const std::vector<v1::HostPart>& missing) {
  std::vector<std::string> names;
  names.reserve(missing.size());
  for (const v1::HostPart& host : missing)
    names.push_back(fmt::format("\"{}\" of {}", host.session(), host.host()));
  return wrong_part(leader.folder,
                    fmt::format("{} missing of what its manifest names: {}",
                                names.size() == 1 ? "a part is" : "parts are", fmt::join(names, ", ")),
                    "Copy them here and name them too, or go on without: --without-missing");
}

/// The part that has a host's cameras, and no others; null where none has any of them.
Result<const JoinPart*> part_of_host(const std::vector<JoinPart>& parts, const JoinPart& leader,
                                     const v1::HostPart& host) {
  const std::set<std::string> wanted = camera_ids_of(host);
  for (const JoinPart& part : parts) {
    const std::set<std::string> has = part.camera_ids();
    const auto is_wanted = [&](const std::string& id) { return wanted.contains(id); };
    if (&part == &leader || std::none_of(has.begin(), has.end(), is_wanted)) continue;
    if (has == wanted) return &part;
    return wrong_part(part.folder,
                      fmt::format("has the cameras {}, and {} recorded {}", fmt::join(has, ", "), host.host(),
                                  fmt::join(wanted, ", ")),
                      "Name the folder that this host recorded");
  }
  return nullptr;
}

Result<JoinPlan> plan_join(const std::vector<JoinPart>& parts, Missing missing) {
  EMBERLOCK_ASSIGN_OR_RETURN(const JoinPart* leader, leader_of(parts));
  EMBERLOCK_RETURN_IF_ERROR(check_together(parts, *leader));
  JoinPlan plan;
  plan.parts.push_back({leader, {}, {}});
  for (const v1::HostPart& host : leader->manifest().hosts()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const JoinPart* part, part_of_host(parts, *leader, host));
    if (part == nullptr) {
      plan.missing.push_back(host);
      continue;
    }
    const std::string where = manifest_path(leader->folder).string() + ", host " + host.host();
    if (host.clock().empty())
      return Error{ErrorKind::bad_input, "its clock was never read, so that its frames belong to no others",
                   where, "Leave its part out: --without-missing"};
    EMBERLOCK_ASSIGN_OR_RETURN(HostClock clock, HostClock::of(host.clock(), where));
    plan.parts.push_back({part, host, std::move(clock)});
  }
  for (const JoinPart& part : parts) {
    const auto is_it = [&](const PlacedPart& placed) { return placed.part == &part; };
    if (std::none_of(plan.parts.begin(), plan.parts.end(), is_it))
      return wrong_part(part.folder, "the leading host's manifest names no part with its cameras",
                        "Name parts of " + leader->folder.string() + " alone");
  }
  if (missing == Missing::is_an_error && !plan.missing.empty()) return missing_parts(*leader, plan.missing);
  return plan;
}

v1::Manifest joined_manifest(const JoinPlan& plan) {
  v1::Manifest manifest = plan.parts.front().part->manifest();
  manifest.clear_hosts();
  for (const v1::HostPart& host : plan.missing) *manifest.add_hosts() = host;
  for (const PlacedPart& placed : plan.parts) {
    if (placed.part->manifest().state() == v1::Manifest::SALVAGED) manifest.set_state(v1::Manifest::SALVAGED);
    if (&placed == &plan.parts.front()) continue;
    for (const v1::CameraStream& camera : placed.part->manifest().cameras()) {
      v1::CameraStream& stream = *manifest.add_cameras();
      stream = camera;
      *stream.mutable_clock() = placed.told.clock();
    }
  }
  return manifest;
}

JoinedEvents joined_events(const JoinPlan& plan) {
  std::vector<PartEvents> parts;
  for (const PlacedPart& placed : plan.parts)
    parts.push_back({placed.part->session.events(), placed.clock, placed.part->manifest().cameras_size()});
  return join_events(std::move(parts));
}

/// Nothing where no part has times.
Result<std::optional<v1::ShutterTimes>> joined_times(const JoinPlan& plan) {
  std::optional<v1::ShutterTimes> joined;
  std::optional<fs::path> without;
  for (const PlacedPart& placed : plan.parts) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<v1::ShutterTimes> times,
                               read_shutter_times(placed.part->session));
    if (!times) without = placed.part->folder;
    if (!times) continue;
    if (!joined) joined.emplace();
    joined->MergeFrom(*times);
  }
  if (joined && without)
    return wrong_part(*without, "has no times.json, and another part has one",
                      "Move the other one away: all frames then count as taken by their stamps");
  return joined;
}

/// What is copied: a camera's folder, with all in it.
struct CopiedCamera {
  fs::path from;
  std::string camera_id;
  FolderFiles files;
};

Status copy_cameras(const JoinPlan& plan, const fs::path& to, const Observer& observer) {
  std::vector<CopiedCamera> cameras;
  std::uint64_t bytes = 0;
  for (const PlacedPart& placed : plan.parts) {
    for (const std::string& id : placed.part->camera_ids()) {
      const fs::path from = placed.part->folder / id;
      EMBERLOCK_ASSIGN_OR_RETURN(FolderFiles files, files_in(from));
      bytes += files.bytes();
      cameras.push_back({from, id, std::move(files)});
    }
  }
  CopyTally tally(2 * bytes, observer);
  for (const CopiedCamera& camera : cameras) {
    std::error_code ec;
    fs::create_directory(to / camera.camera_id, ec);
    if (ec)
      return Error{ErrorKind::io, "cannot be created: " + ec.message(), (to / camera.camera_id).string()};
    EMBERLOCK_RETURN_IF_ERROR(copy_files(camera.from, camera.files, to / camera.camera_id, tally));
  }
  return {};
}

/// The manifest last: without it there is no session.
Status write_joined(const fs::path& folder, const v1::Manifest& manifest,
                    const std::vector<v1::Event>& events, const std::optional<v1::ShutterTimes>& times) {
  if (times) EMBERLOCK_RETURN_IF_ERROR(write_shutter_times(folder, *times));
  std::string bytes;
  for (const v1::Event& event : events) bytes += encode(event);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(events_path(folder), bytes));
  EMBERLOCK_RETURN_IF_ERROR(write_manifest(folder, manifest));
  EMBERLOCK_ASSIGN_OR_RETURN(const SessionReader joined, SessionReader::open(folder));
  EMBERLOCK_RETURN_IF_ERROR(read_shutter_times(joined));
  return {};
}

/// A part may have been damaged since it was recorded: the first of its faults, by its own folder.
Status expect_whole(const fs::path& joined, const JoinPlan& plan, const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const SessionCheck check, verify_session(joined, observer));
  EMBERLOCK_RETURN_IF_ERROR(observe(observer, 1, "read back"));
  if (check.readable) return {};
  const auto damaged = [](const fs::path& part, const std::string& what) {
    return Error{ErrorKind::refused, what, part.string(),
                 "Restore it from a copy, or let `emberlock sessions repair` keep what is good of it"};
  };
  for (const CameraCheck& camera : check.cameras)
    for (const PlacedPart& placed : plan.parts)
      if (!camera.problems.empty() && placed.part->camera_ids().contains(camera.camera_id))
        return damaged(placed.part->folder, camera.problems.front());
  return damaged(plan.parts.front().part->folder,
                 check.problems.empty() ? "the joined session isn't whole" : check.problems.front());
}

}  // namespace

Result<Joined> join_sessions(const std::vector<fs::path>& parts, const fs::path& out, Missing missing,
                             const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<JoinPart> opened, open_parts(parts));
  EMBERLOCK_ASSIGN_OR_RETURN(const JoinPlan plan, plan_join(opened, missing));
  Joined joined;
  joined.manifest = joined_manifest(plan);
  EMBERLOCK_RETURN_IF_ERROR(check_manifest(joined.manifest, manifest_path(out).string()));
  for (const PlacedPart& placed : plan.parts)
    if (&placed != &plan.parts.front()) joined.hosts.push_back(placed.told);
  const JoinedEvents events = joined_events(plan);
  joined.events_left_out = events.left_out;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<v1::ShutterTimes> times, joined_times(plan));
  EMBERLOCK_RETURN_IF_ERROR(check_apart(out, parts));
  EMBERLOCK_RETURN_IF_ERROR(check_new_folder(out));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create({out, kJoin, parts}));
  EMBERLOCK_RETURN_IF_ERROR(copy_cameras(plan, folder.path(), part_of(observer, 0, kCopied)));
  EMBERLOCK_RETURN_IF_ERROR(write_joined(folder.path(), joined.manifest, events.events, times));
  EMBERLOCK_RETURN_IF_ERROR(expect_whole(folder.path(), plan, part_of(observer, kCopied, kNearlyDone)));
  EMBERLOCK_RETURN_IF_ERROR(folder.commit());
  // A session is nobody's earlier result: no verb may replace it.
  std::error_code ec;
  fs::remove(out / kResultList, ec);
  static_cast<void>(observe(observer, 1, "joined"));
  return joined;
}

}  // namespace emberlock::session
