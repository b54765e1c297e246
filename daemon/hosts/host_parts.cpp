// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/host_parts.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "session/files.h"
#include "session/host_parts.h"

namespace emberlock::daemon {
namespace {

constexpr auto kBetweenLooks = std::chrono::milliseconds(250);
/// A part that ends so much earlier than the recording is short.
constexpr Seconds kShort = milliseconds(500);
constexpr PartsPerMillion kMostDrift{1000};  ///< of two clocks, as session/host_clock.h has it

bool is_wanting(const v1::HostPart& part) {
  return part.state() == v1::HostPart::MISSING || part.state() == v1::HostPart::SHORT;
}

void set(v1::HostPart& part, v1::HostPart::State state, std::string why) {
  part.set_state(state);
  part.set_why(std::move(why));
}

/// Adds what the host's clock shows now, if one clock can have shown that and what it showed before: either
/// machine may have been started anew.
void read_clock(const RemoteHost& host, v1::HostPart& part) {
  const auto now = host.clock(SteadyClock().now());
  if (!now) return;
  if (part.clock_size() > 0) {
    const v1::ClockReading& before = part.clock(part.clock_size() - 1);
    const auto since = static_cast<double>(now->at_ns()) - static_cast<double>(before.at_ns());
    const double off = static_cast<double>(now->ahead_ns()) - static_cast<double>(before.ahead_ns());
    const auto sigmas = static_cast<double>(now->sigma_ns() + before.sigma_ns());
    if (since <= 0 || std::abs(off) > 1e-6 * kMostDrift.value() * since + sigmas) return;
  }
  *part.add_clock() = *now;
}

/// What the other host's clock showed, on this one's, by the newest reading.
std::optional<TimePoint> here(const v1::HostPart& part, std::int64_t there_ns) {
  if (part.clock_size() == 0 || there_ns == 0) return std::nullopt;
  return TimePoint{there_ns - part.clock(part.clock_size() - 1).ahead_ns()};
}

/// As long as two of its cameras' frames last, at least.
Seconds short_by(const std::optional<v1::PartRequest>& request) {
  Seconds by = kShort;
  if (!request) return by;
  for (const v1::CameraStream& camera : request->manifest().cameras())
    if (camera.frame_rate_hz() > 0) by = std::max(by, 2 * period(Hertz(camera.frame_rate_hz())));
  return by;
}

}  // namespace

HostParts::HostParts(Hosts hosts, std::string leader) : hosts_(std::move(hosts)), leader_(std::move(leader)) {
  if (any()) thread_ = std::thread([this] { run(); });
}

HostParts::~HostParts() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  wakes_.notify_all();
  if (thread_.joinable()) thread_.join();
  beginning_.clear();  // waits for them
}

std::vector<std::string> HostParts::addresses() const {
  std::vector<std::string> all;
  for (const auto& host : hosts_) all.push_back(host->address());
  return all;
}

std::optional<v1::ClockReading> HostParts::clock(const std::string& address) const {
  for (const auto& host : hosts_)
    if (host->address() == address) return host->clock(SteadyClock().now());
  return std::nullopt;
}

std::vector<v1::HostStatus> HostParts::hosts() const {
  std::vector<v1::HostStatus> all;
  for (const auto& host : hosts_) all.push_back(host->status());
  const std::lock_guard lock(mutex_);
  for (v1::HostStatus& status : all)
    for (const Take& take : takes_)
      for (const Part& part : take.parts)
        if (part.known.host() == status.host() && is_wanting(part.known))
          status.set_parts_wanting(status.parts_wanting() + 1);
  return all;
}

void HostParts::begin(Part& part, const std::filesystem::path& folder) {
  // Without its clock it couldn't be said from when on.
  if (!part.host->connected() || !part.host->clock(SteadyClock().now()))
    return set(part.known, v1::HostPart::MISSING, part.host->trouble());
  v1::PartRequest request = *part.request;
  const TimePoint from{request.from_ns()};
  request.set_from_ns(part.host->there(std::max(from, SteadyClock().now())).ns);
  request.set_name(folder.filename().string());
  const auto begun = part.host->record(std::move(request));
  if (!begun.ok()) return set(part.known, v1::HostPart::MISSING, begun.error().what);
  part.begun = true;
  part.late = std::max(SteadyClock().now() - from, Seconds(0));
  part.known.set_session(begun->session());
  if (begun->camera_ids_size() > 0) *part.known.mutable_camera_ids() = begun->camera_ids();
  set(part.known, v1::HostPart::RECORDING, "");
  if (part.known.clock_size() == 0) read_clock(*part.host, part.known);
}

void HostParts::begin(const std::filesystem::path& folder, const std::vector<v1::PartRequest>& requests,
                      const std::vector<v1::HostPart>& known) {
  const std::lock_guard lock(mutex_);
  // A host that doesn't answer may still be asked for an earlier take. The engine's thread calls this, and
  // doesn't wait for that.
  std::erase_if(beginning_, [](const std::future<void>& one) {
    return one.wait_for(std::chrono::seconds(0)) == std::future_status::ready;
  });
  // One of this name that was there before was taken away.
  std::erase_if(takes_, [&](const Take& take) { return take.folder == folder; });
  Take& take = takes_.emplace_back(Take{.folder = folder});
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    take.session_id = requests[i].manifest().session_id();
    Part& part = take.parts.emplace_back(Part{.host = hosts_[i], .request = requests[i], .known = known[i]});
    part.busy = true;
    auto begin_part = [this, part, folder, i, session = take.session_id]() mutable {
      begin(part, folder);
      const std::lock_guard inner(mutex_);
      part.busy = false;
      take_over(session, i, std::move(part));
    };
    beginning_.push_back(std::async(std::launch::async, std::move(begin_part)));
  }
}

void HostParts::end(const std::filesystem::path& folder, TimePoint at) {
  const std::lock_guard lock(mutex_);
  if (Take* take = find(folder)) take->ended = at;
  hurries_ = true;
  wakes_.notify_all();
}

Status HostParts::close(const std::filesystem::path& folder, Seconds patience) {
  std::unique_lock lock(mutex_);
  // One whose host doesn't answer isn't waited for.
  const auto known = [&] {
    const Take* take = find(folder);
    return take == nullptr || std::all_of(take->parts.begin(), take->parts.end(), [](const Part& part) {
             return part.settled || part.known.state() == v1::HostPart::MISSING;
           });
  };
  looked_.wait_for(lock, std::chrono::duration<double>(patience.value()), known);
  Take* take = find(folder);
  if (take == nullptr) return {};
  take->closed = true;
  take->behind = true;
  for (Part& part : take->parts)
    if (!part.settled && part.known.state() == v1::HostPart::RECORDING)
      set(part.known, v1::HostPart::MISSING, "it is still being finished there");
  write_behind(lock);
  take = find(folder);
  return take == nullptr || !take->behind
             ? Status{}
             : Status(Error{ErrorKind::refused, "what is known of other hosts' parts isn't written yet",
                            folder.string(), "It is tried again by itself"});
}

void HostParts::take_up(const std::vector<std::filesystem::path>& folders) {
  const std::lock_guard lock(mutex_);
  for (const std::filesystem::path& folder : folders) {
    const auto manifest = session::read_manifest(folder);
    if (!manifest) continue;
    Take take{.folder = folder, .session_id = manifest->session_id(), .restarted = true, .closed = true};
    for (const v1::HostPart& known : manifest->hosts()) {
      Part part{.host = nullptr, .request = std::nullopt, .known = known};
      part.settled = known.state() == v1::HostPart::WHOLE || known.state() == v1::HostPart::SHORT;
      part.begun = known.state() != v1::HostPart::RECORDING;
      for (const auto& host : hosts_)
        if (host->address() == known.host()) part.host = host;
      take.parts.push_back(std::move(part));
    }
    const bool all_settled =
        std::all_of(take.parts.begin(), take.parts.end(), [](const Part& part) { return part.settled; });
    if (!all_settled) takes_.push_back(std::move(take));
  }
}

std::vector<v1::HostPart> HostParts::of(const std::filesystem::path& folder) const {
  const std::lock_guard lock(mutex_);
  std::vector<v1::HostPart> all;
  for (const Take& take : takes_)
    if (take.folder == folder)
      for (const Part& part : take.parts) all.push_back(part.known);
  return all;
}

std::vector<PartNews> HostParts::news() {
  const std::lock_guard lock(mutex_);
  return std::exchange(news_, {});
}

HostParts::Take* HostParts::find(const std::filesystem::path& folder) {
  const auto found =
      std::find_if(takes_.begin(), takes_.end(), [&](const Take& take) { return take.folder == folder; });
  return found == takes_.end() ? nullptr : &*found;
}

void HostParts::take_over(const std::string& session_id, std::size_t place, Part part) {
  const auto take = std::find_if(takes_.begin(), takes_.end(),
                                 [&](const Take& one) { return one.session_id == session_id; });
  if (take == takes_.end()) return;
  Part& kept = take->parts[place];
  const bool wanting = is_wanting(part.known);
  const bool news = wanting != kept.wanting || (part.settled && !kept.settled);
  if (news) news_.push_back({take->folder.filename().string(), part.known});
  take->behind = take->behind || news;
  kept = std::move(part);
  kept.wanting = wanting;
}

/// Without the lock while the disk works. What fails is tried again.
void HostParts::write_behind(std::unique_lock<std::mutex>& lock) {
  for (std::size_t t = 0; t < takes_.size(); ++t) {
    if (!takes_[t].closed || !takes_[t].behind) continue;
    const std::string session = takes_[t].session_id;
    const std::filesystem::path folder = takes_[t].folder;
    std::vector<v1::HostPart> parts;
    for (const Part& part : takes_[t].parts) parts.push_back(part.known);
    takes_[t].behind = false;
    lock.unlock();
    const bool written = session::write_host_parts(folder, parts).ok();
    lock.lock();
    for (Take& take : takes_)
      if (take.session_id == session && !written) take.behind = true;
  }
}

void HostParts::settle(const Take& take, const v1::HostPart& there, Part& part) {
  part.settled = true;
  read_clock(*part.host, part.known);
  part.known.set_frames(there.frames());
  part.known.set_lost(there.lost());
  part.known.set_until_ns(there.until_ns());
  if (there.camera_ids_size() > 0) *part.known.mutable_camera_ids() = there.camera_ids();
  if (there.state() == v1::HostPart::SHORT) return set(part.known, v1::HostPart::SHORT, there.why());
  if (there.until_ns() == 0) return set(part.known, v1::HostPart::SHORT, "one of its cameras has no frames");
  const Seconds by = short_by(part.request);
  if (part.late > by)
    return set(part.known, v1::HostPart::SHORT,
               fmt::format("its frames begin up to {:.1f} s after the recording does", part.late.value()));
  const auto until = here(part.known, there.until_ns());
  if (take.ended && until && *take.ended - *until > by)
    return set(
        part.known, v1::HostPart::SHORT,
        fmt::format("its frames end {:.1f} s before the recording does", (*take.ended - *until).value()));
  set(part.known, v1::HostPart::WHOLE, "");
}

/// The answer that would have said when it began was lost: before now.
void HostParts::find_begun(Part& part) {
  if (part.begun) return;
  part.begun = true;
  if (part.request)
    part.late = std::max(SteadyClock().now() - TimePoint{part.request->from_ns()}, Seconds(0));
}

HostParts::Part HostParts::asked(const Take& take, Part part) {
  using State = v1::HostPart;
  if (part.host == nullptr) {
    set(part.known, State::MISSING, "its host isn't one of the rig's any more, so it isn't asked");
    return part;
  }
  if (!part.host->connected()) {
    set(part.known, State::MISSING, part.host->trouble());
    return part;
  }
  const auto there = part.host->part(take.session_id, part.known.session());
  if (!there.ok()) {
    set(part.known, State::MISSING, there.error().what);
  } else if (!*there && !take.ended && part.request && !part.begun) {
    begin(part, take.folder);
  } else if (!*there && part.begun) {
    set(part.known, State::MISSING, "its host doesn't find it: is its disk mounted?");
  } else if (!*there) {
    part.settled = true;
    set(part.known, State::SHORT, "nothing of it was recorded there");
  } else if ((*there)->state() == State::RECORDING) {
    find_begun(part);
    set(part.known, State::RECORDING, "");
    part.known.set_session((*there)->session());
    part.known.set_frames((*there)->frames());
    if (take.ended || take.restarted)
      static_cast<void>(part.host->stop_part(take.session_id, part.known.session(),
                                             take.ended.value_or(SteadyClock().now())));
  } else if (take.ended || take.restarted || (*there)->state() == State::SHORT) {
    find_begun(part);
    settle(take, **there, part);
  }  // else it ended by its own clock, a moment before this host's recording
  return part;
}

void HostParts::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    hurries_ = false;
    // The newest first: it may have to be begun.
    for (std::size_t t = takes_.size(); t-- > 0;) {
      for (std::size_t p = 0; t < takes_.size() && p < takes_[t].parts.size() && !ending_; ++p) {
        const Take take = takes_[t];
        if (take.parts[p].settled || take.parts[p].busy) continue;
        lock.unlock();
        Part part = asked(take, take.parts[p]);
        lock.lock();
        take_over(take.session_id, p, std::move(part));
      }
    }
    looked_.notify_all();
    write_behind(lock);
    std::erase_if(takes_, [](const Take& take) {
      return take.closed && !take.behind &&
             std::all_of(take.parts.begin(), take.parts.end(), [](const Part& part) { return part.settled; });
    });
    wakes_.wait_for(lock, kBetweenLooks, [this] { return ending_ || hurries_; });
  }
}

}  // namespace emberlock::daemon
