// SPDX-License-Identifier: Apache-2.0
#include "daemon/hosts/host_parts.h"

#include <algorithm>
#include <chrono>
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

bool is_wanting(const v1::HostPart& part) {
  return part.state() == v1::HostPart::MISSING || part.state() == v1::HostPart::SHORT;
}

void set(v1::HostPart& part, v1::HostPart::State state, std::string why) {
  part.set_state(state);
  part.set_why(std::move(why));
}

void read_clock(const RemoteHost& host, v1::HostPart& part) {
  if (const auto reading = host.clock(SteadyClock().now())) *part.add_clock() = *reading;
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
}

std::vector<std::string> HostParts::addresses() const {
  std::vector<std::string> all;
  for (const auto& host : hosts_) all.push_back(host->address());
  return all;
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
  v1::PartRequest request = *part.request;
  const TimePoint from = std::max(TimePoint{request.from_ns()}, SteadyClock().now());
  request.set_from_ns(part.host->there(from).ns);
  request.set_name(folder.filename().string());
  const auto begun = part.host->record(std::move(request));
  if (!begun.ok()) return set(part.known, v1::HostPart::MISSING, begun.error().what);
  part.known.set_session(begun->session());
  part.late = from - TimePoint{part.request->from_ns()};
  set(part.known, v1::HostPart::RECORDING, "");
  if (part.known.clock_size() == 0) read_clock(*part.host, part.known);
}

std::vector<v1::HostPart> HostParts::begin(const std::filesystem::path& folder,
                                           const std::vector<v1::PartRequest>& requests) {
  Take take{.folder = folder};
  std::vector<std::thread> asking;
  take.parts.resize(hosts_.size());
  for (std::size_t i = 0; i < hosts_.size(); ++i) {
    Part& part = take.parts[i];
    part.host = hosts_[i];
    part.request = requests[i];
    part.known.set_host(hosts_[i]->address());
    part.known.set_session(folder.filename().string());
    for (const v1::CameraStream& camera : requests[i].manifest().cameras())
      part.known.add_camera_ids(camera.camera_id());
    take.session_id = requests[i].manifest().session_id();
    asking.emplace_back([&part, &folder] { begin(part, folder); });
  }
  for (std::thread& one : asking) one.join();
  std::vector<v1::HostPart> all;
  for (const Part& part : take.parts) all.push_back(part.known);
  const std::lock_guard lock(mutex_);
  takes_.push_back(std::move(take));
  Take& kept = takes_.back();
  for (std::size_t i = 0; i < kept.parts.size(); ++i) take_over(folder, i, kept.parts[i]);
  return all;
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
  return write(*take);
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
      part.wanting = is_wanting(known);
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

void HostParts::take_over(const std::filesystem::path& folder, std::size_t place, Part part) {
  Take* take = find(folder);
  if (take == nullptr) return;
  Part& kept = take->parts[place];
  const bool wanting = is_wanting(part.known);
  const bool news = wanting != kept.wanting || (part.settled && !kept.settled);
  if (news) news_.push_back({folder.filename().string(), part.known});
  take->behind = take->behind || news;
  kept = std::move(part);
  kept.wanting = wanting;
}

Status HostParts::write(Take& take) {
  std::vector<v1::HostPart> parts;
  for (const Part& part : take.parts) parts.push_back(part.known);
  EMBERLOCK_RETURN_IF_ERROR(session::write_host_parts(take.folder, parts));
  take.behind = false;
  return {};
}

void HostParts::settle(const Take& take, const v1::HostPart& there, Part& part) {
  part.settled = true;
  read_clock(*part.host, part.known);
  part.known.set_frames(there.frames());
  part.known.set_lost(there.lost());
  part.known.set_until_ns(there.until_ns());
  if (there.state() == v1::HostPart::SHORT) return set(part.known, v1::HostPart::SHORT, there.why());
  if (take.restarted) return set(part.known, v1::HostPart::WHOLE, "");
  if (!take.ended) return set(part.known, v1::HostPart::SHORT, "it ended before the recording did");
  const Seconds early = *take.ended - part.host->here({there.until_ns()});
  if (part.late > kShort)
    return set(part.known, v1::HostPart::SHORT,
               fmt::format("its frames begin {:.1f} s after the recording does", part.late.value()));
  if (early > kShort)
    return set(part.known, v1::HostPart::SHORT,
               fmt::format("its frames end {:.1f} s before the recording does", early.value()));
  set(part.known, v1::HostPart::WHOLE, "");
}

HostParts::Part HostParts::asked(const Take& take, Part part) {
  if (part.host == nullptr) {
    set(part.known, v1::HostPart::MISSING, "its host isn't one of the rig's any more, so it isn't asked");
    return part;
  }
  if (!part.host->connected()) {
    set(part.known, v1::HostPart::MISSING, part.host->trouble());
    return part;
  }
  const auto there = part.host->part(take.session_id, part.known.session());
  if (!there.ok()) {
    set(part.known, v1::HostPart::MISSING, there.error().what);
  } else if (!*there && !take.ended && part.request) {
    begin(part, take.folder);
  } else if (!*there) {
    part.settled = true;
    set(part.known, v1::HostPart::SHORT, "nothing of it was recorded there");
  } else if ((*there)->state() == v1::HostPart::RECORDING) {
    set(part.known, v1::HostPart::RECORDING, "");
    part.known.set_frames((*there)->frames());
    if (take.ended || take.restarted)
      static_cast<void>(part.host->stop_part(take.session_id, part.known.session(),
                                             take.ended.value_or(SteadyClock().now())));
  } else {
    settle(take, **there, part);
  }
  return part;
}

void HostParts::run() {
  std::unique_lock lock(mutex_);
  while (!ending_) {
    hurries_ = false;
    for (std::size_t t = 0; t < takes_.size(); ++t) {
      for (std::size_t p = 0; p < takes_[t].parts.size() && !ending_; ++p) {
        const Take take = takes_[t];
        if (take.parts[p].settled) continue;
        lock.unlock();
        Part part = asked(take, take.parts[p]);
        lock.lock();
        take_over(take.folder, p, std::move(part));
      }
    }
    looked_.notify_all();
    for (Take& take : takes_)
      if (take.closed && take.behind) static_cast<void>(write(take));  // else later
    std::erase_if(takes_, [](const Take& take) {
      return take.closed && !take.behind &&
             std::all_of(take.parts.begin(), take.parts.end(), [](const Part& part) { return part.settled; });
    });
    wakes_.wait_for(lock, kBetweenLooks, [this] { return ending_ || hurries_; });
  }
}

}  // namespace emberlock::daemon
