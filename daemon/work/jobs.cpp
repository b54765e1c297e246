// SPDX-License-Identifier: Apache-2.0
#include "daemon/work/jobs.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

namespace emberlock::daemon {
namespace {

constexpr std::size_t kNoBound = std::numeric_limits<std::size_t>::max() / 2;  // may_add() has one

bool is_background(v1::Job::Kind kind) { return kind == v1::Job::SALVAGE || kind == v1::Job::COMPRESS; }

bool is_at_once(v1::Job::Kind kind) { return kind == v1::Job::FINISH || kind == v1::Job::RECONSTRUCT; }

/// Not one that was cancelled before it began, and that its thread hasn't come to yet.
bool is_on_its_way(const v1::Job& job) {
  return job.state() == v1::Job::WAITING || job.state() == v1::Job::RUNNING || job.state() == v1::Job::PAUSED;
}

}  // namespace

Jobs::Jobs(JobLimits limits)
    : limits_(limits),
      at_once_(2, kNoBound),
      asked_(limits.asked, kNoBound, Workers::Priority::lowest),
      background_(1, kNoBound, Workers::Priority::lowest) {}

Jobs::~Jobs() { end(); }

void Jobs::end() {
  const std::scoped_lock lock(mutex_);
  ending_ = true;
  for (const auto& entry : entries_)
    if (entry->job.kind != v1::Job::FINISH) entry->handle->cancel();
}

Workers& Jobs::threads_of(v1::Job::Kind kind) {
  if (is_background(kind)) return background_;
  return is_at_once(kind) ? at_once_ : asked_;
}

Status Jobs::may_add(v1::Job::Kind kind) const {
  if (ending_ && kind != v1::Job::FINISH)
    return Error{ErrorKind::refused, "it is shutting down", "emberlockd", "Start it again"};
  if (is_background(kind) || is_at_once(kind)) return {};
  const auto asked = std::count_if(entries_.begin(), entries_.end(), [](const auto& entry) {
    const v1::Job::Kind other = entry->job.kind;
    return !is_background(other) && !is_at_once(other) && !entry->handle->result();
  });
  if (static_cast<std::size_t>(asked) < limits_.asked + limits_.waiting) return {};
  return Error{ErrorKind::refused, "too many jobs are waiting", "emberlockd", "Try again when one has ended"};
}

Result<std::shared_ptr<JobHandle>> Jobs::add(Job job) {
  const std::scoped_lock lock(mutex_);
  if (is_background(job.kind)) {
    for (const auto& entry : entries_)
      if (entry->job.kind == job.kind && entry->job.session == job.session && !entry->handle->result())
        return entry->handle;
  }
  EMBERLOCK_RETURN_IF_ERROR(may_add(job.kind));
  v1::Job waiting;
  waiting.set_id(++last_id_);
  waiting.set_kind(job.kind);
  waiting.set_session(job.session);
  waiting.set_state(v1::Job::WAITING);
  const auto entry = std::make_shared<Entry>(Entry{std::move(job), std::make_shared<JobHandle>(waiting)});
  if (is_background(entry->job.kind)) entry->handle->pause(paused_);
  entries_.push_back(entry);
  static_cast<void>(threads_of(entry->job.kind).run([this, entry] { run(entry); }));
  return entry->handle;
}

/// On a thread of its kind.
void Jobs::run(const std::shared_ptr<Entry>& entry) {
  JobHandle& handle = *entry->handle;
  if (handle.begin()) {
    handle.end(entry->job.run(
        [&handle](double fraction, std::string_view doing) { return handle.go_on(fraction, doing); }));
  }
  const JobResult result = *handle.result();
  bool tells = false;
  {
    const std::scoped_lock lock(mutex_);
    std::erase(entries_, entry);
    tells = entry->job.ended && (result.ok() || !ending_);
    ++telling_;
  }
  if (tells) entry->job.ended(result);
  {
    const std::scoped_lock lock(mutex_);
    --telling_;
  }
  changed_.notify_all();
}

Status Jobs::cancel(std::uint64_t id) {
  const std::scoped_lock lock(mutex_);
  const auto refuse = [id](const char* what, const char* remedy) {
    return Error{ErrorKind::refused, what, "job " + std::to_string(id), remedy};
  };
  for (const auto& entry : entries_) {
    const v1::Job job = entry->handle->state();
    if (job.id() != id || !is_on_its_way(job)) continue;
    if (entry->job.kind == v1::Job::FINISH)
      return refuse("a recording's end can't be cancelled",
                    "Its last frames are in memory alone: wait for it");
    entry->handle->cancel();
    return {};
  }
  return refuse("there is none", "`emberlock jobs` lists them; it may have ended");
}

void Jobs::pause() {
  const std::scoped_lock lock(mutex_);
  paused_ = true;
  for (const auto& entry : entries_)
    if (is_background(entry->job.kind)) entry->handle->pause(true);
}

void Jobs::resume() {
  const std::scoped_lock lock(mutex_);
  paused_ = false;
  for (const auto& entry : entries_)
    if (is_background(entry->job.kind)) entry->handle->pause(false);
}

std::vector<v1::Job> Jobs::list() const {
  const std::scoped_lock lock(mutex_);
  std::vector<v1::Job> jobs;
  for (const auto& entry : entries_) {
    v1::Job job = entry->handle->state();
    if (is_on_its_way(job)) jobs.push_back(std::move(job));
  }
  return jobs;
}

std::optional<v1::Job> Jobs::find(v1::Job::Kind kind, std::string_view session) const {
  for (v1::Job& job : list())
    if (job.kind() == kind && job.session() == session) return std::move(job);
  return std::nullopt;
}

std::vector<v1::Job> Jobs::hanging(Seconds patience) const {
  std::vector<v1::Job> jobs = list();
  std::erase_if(jobs, [patience](const v1::Job& job) { return job.silent_s() <= patience.value(); });
  return jobs;
}

void Jobs::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return (entries_.empty() && telling_ == 0) || paused_; });
}

bool tolerates_hanging(v1::Phase phase, v1::Job::Kind kind) {
  return phase == v1::CAPTURING || (phase == v1::FINISHING && kind != v1::Job::FINISH);
}

}  // namespace emberlock::daemon
