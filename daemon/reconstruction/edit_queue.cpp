// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/edit_queue.h"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdint>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "session/child_messages.h"

namespace emberlock::daemon {
namespace {

Error nobody_listens() {
  return {ErrorKind::refused, "no stylization takes steps now", "stylization",
          "Start one, and wait for its flame"};
}

}  // namespace

EditQueue::EditQueue() : woken_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

Result<UniqueFd> EditQueue::open() {
  int ends[2];
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0)
    return Error{ErrorKind::io, "cannot make a socket: " + std::generic_category().message(errno),
                 "stylization"};
  const std::lock_guard lock(mutex_);
  to_child_ = UniqueFd(ends[0]);
  unsent_.clear();
  finishing_ = false;
  return UniqueFd(ends[1]);
}

Result<v1::StylizationStatus> EditQueue::ask(const v1::EditRequest& request, Seconds longest) {
  if (request.ByteSizeLong() > session::kLargestChildMessage)
    return Error{ErrorKind::bad_input, "the step is too large", "stylization",
                 fmt::format("Give at most {} MiB, pictures included", session::kLargestChildMessage >> 20)};
  const auto asked = std::make_shared<Asked>();
  std::unique_lock lock(mutex_);
  if (!listens()) return nobody_listens();
  unsent_ += session::framed(request);
  asked_.push_back(asked);
  wake();
  const auto over = [&] { return asked->answer || asked->gone; };
  if (!answered_.wait_for(lock, std::chrono::duration<double>(longest.value()), over))
    return Error{ErrorKind::timed_out, "the step waits for a pass that takes long", "stylization",
                 "It will be taken; see what the next preview shows"};
  if (asked->gone)
    return Error{ErrorKind::refused, "the stylization ended before it took the step", "stylization",
                 "The status says why"};
  if (asked->answer->has_taken()) return asked->answer->taken();
  const v1::ChildMessage::Edited::Refusal& refused = asked->answer->refused();
  return Error{ErrorKind::bad_input, refused.what(), refused.where(), refused.remedy()};
}

Status EditQueue::finish() {
  const std::lock_guard lock(mutex_);
  if (!listens()) return nobody_listens();
  finishing_ = true;
  wake();
  return {};
}

int EditQueue::blocked() const {
  const std::lock_guard lock(mutex_);
  return to_child_ && !unsent_.empty() ? to_child_.get() : -1;
}

void EditQueue::send() {
  std::uint64_t times = 0;
  static_cast<void>(::read(woken_.get(), &times, sizeof times));
  const std::lock_guard lock(mutex_);
  std::size_t sent = 0;
  while (to_child_ && sent < unsent_.size()) {
    const ssize_t n =
        ::send(to_child_.get(), unsent_.data() + sent, unsent_.size() - sent, MSG_NOSIGNAL | MSG_DONTWAIT);
    if (n < 0 && errno == EINTR) continue;
    if (n < 0 && errno == EAGAIN) break;
    if (n <= 0) to_child_ = {};  // the child went, or goes
    sent += static_cast<std::size_t>(std::max<ssize_t>(0, n));
  }
  unsent_.erase(0, sent);
  if (finishing_ && unsent_.empty()) to_child_ = {};
}

void EditQueue::take(const v1::ChildMessage::Edited& answer) {
  const std::lock_guard lock(mutex_);
  if (asked_.empty()) return;
  asked_.front()->answer = answer;
  asked_.pop_front();
  answered_.notify_all();
}

void EditQueue::close() {
  const std::lock_guard lock(mutex_);
  to_child_ = {};
  unsent_.clear();
  for (const auto& asked : std::exchange(asked_, {})) asked->gone = true;
  answered_.notify_all();
}

void EditQueue::wake() const {
  const std::uint64_t once = 1;
  static_cast<void>(::write(woken_.get(), &once, sizeof once));
}

}  // namespace emberlock::daemon
