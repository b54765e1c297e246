// SPDX-License-Identifier: Apache-2.0
#include "daemon/live/live_volumes.h"

#include <cerrno>
#include <chrono>
#include <csignal>
#include <iterator>
#include <memory>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <unistd.h>

#include "base/clock.h"
#include "daemon/engine/words.h"
#include "daemon/reconstruction/child_output.h"
#include "daemon/reconstruction/process.h"
#include "daemon/reconstruction/request.h"
#include "session/child_messages.h"

namespace emberlock::daemon {
namespace {

constexpr int kLowest = 19;  // niceness

/// Sends what goes now. False: nobody reads any more.
bool send_now(int fd, std::string& bytes) {
  const ssize_t n = ::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
  if (n < 0) return errno == EINTR || errno == EAGAIN;
  bytes.erase(0, static_cast<std::size_t>(n));
  return true;
}

}  // namespace

Status check_live(const v1::LiveRequest& request) {
  constexpr std::uint32_t kMostEvery = 1'000'000;
  constexpr std::uint32_t kMostVoxels = 1024;
  constexpr std::uint32_t kFewestVoxels = 8;
  if (request.every() > kMostEvery)
    return refuse_field("live.every", "is out of range", fmt::format("Give 1 to {}, or 0", kMostEvery));
  if (request.voxels() != 0 && (request.voxels() < kFewestVoxels || request.voxels() > kMostVoxels))
    return refuse_field(
        "live.voxels", "is out of range",
        fmt::format("Give {} to {}, or 0: as many as the machine holds", kFewestVoxels, kMostVoxels));
  return {};
}

LiveVolumes::LiveVolumes(LiveOptions options, Board& board)
    : options_(std::move(options)), board_(board), woken_(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)) {}

LiveVolumes::~LiveVolumes() {
  stop();
  if (thread_.joinable()) thread_.join();
}

void LiveVolumes::wake() const {
  const std::uint64_t one = 1;
  static_cast<void>(::write(woken_.get(), &one, sizeof(one)));
}

void LiveVolumes::start(const std::filesystem::path& session, const v1::LiveRequest& request) {
  stop();
  if (thread_.joinable()) thread_.join();
  ending_ = false;
  v1::LiveInput input;
  v1::LiveInput::Session& told = *input.mutable_session();
  told.set_folder(std::filesystem::absolute(session).string());
  *told.mutable_request() = request;
  told.set_device(options_.device);
  told.set_threads(options_.threads);
  {
    const std::lock_guard lock(mutex_);
    state_.emplace(session.filename().string(), request);
    offered_.reset();
    runs_ = true;
  }
  thread_ = std::thread([this, input] { run(input); });
}

void LiveVolumes::offer(std::vector<std::uint64_t> safe, const RecordingLoad& load) {
  {
    const std::lock_guard lock(mutex_);
    if (!runs_) return;
    offered_ = Offered{std::move(safe), load};
  }
  wake();
}

void LiveVolumes::stop() {
  ending_ = true;
  {
    const std::lock_guard lock(mutex_);
    if (state_) state_->ended();
    runs_ = false;
  }
  wake();
}

bool LiveVolumes::runs() const {
  const std::lock_guard lock(mutex_);
  return runs_;
}

std::optional<v1::LiveStatus> LiveVolumes::status() const {
  const std::lock_guard lock(mutex_);
  if (!state_) return std::nullopt;
  v1::LiveStatus status = state_->status();
  status.set_reason(words(state_->reason()));
  return status;
}

void LiveVolumes::run(const v1::LiveInput& session) {
  std::string last_words;
  ChildEnd end;
  // The child dies with the thread that started it, as the kernel counts parents: this one.
  auto child = ChildProcess::spawn_fed({options_.program.string(), "reconstruct-live", "--progress-fd",
                                        std::to_string(ChildProcess::kMessagesFd)},
                                       kLowest);
  if (child.ok()) {
    end = watch(*child, session, last_words);
  } else {
    end.why = ChildEnd::Why::not_started;
    end.words = child.error().message();
  }
  tell_end(end, last_words);
}

void LiveVolumes::tell_end(const ChildEnd& end, const std::string& last_words) {
  std::string why;
  {
    const std::lock_guard lock(mutex_);
    const bool wanted = ending_ || state_->status().state() == v1::LiveStatus::STOPPED;
    if (!wanted) state_->failed(end, last_words);
    runs_ = false;
    if (!ending_) why = words(state_->reason());
  }
  if (!why.empty()) board_.notice(v1::AMBER, live_notice(why));
}

void LiveVolumes::take(v1::ChildMessage&& message) {
  std::optional<v1::IterationPreview> preview;
  {
    const std::lock_guard lock(mutex_);
    preview = state_->take(std::move(message), SteadyClock().now());
  }
  if (preview) board_.show(std::make_shared<const v1::IterationPreview>(std::move(*preview)));
}

std::string LiveVolumes::take_offer(const ChildProcess& child, LiveYield& yield, bool idle) {
  const std::lock_guard lock(mutex_);
  if (!offered_) return {};
  const bool ran = state_->status().state() != v1::LiveStatus::PAUSED;
  const LiveYield::Verdict verdict = yield.look(offered_->load, SteadyClock().now());
  state_->yield(verdict, yield.reason());
  if (verdict == LiveYield::Verdict::stop) child.signal(SIGKILL);
  if (verdict == LiveYield::Verdict::pause && ran) child.signal(SIGSTOP);
  if (verdict == LiveYield::Verdict::run && !ran) child.signal(SIGCONT);
  if (verdict != LiveYield::Verdict::run || !idle) return {};
  v1::LiveInput input;
  for (const std::uint64_t frames : offered_->safe) input.mutable_synced()->add_frames(frames);
  offered_.reset();
  return session::framed(input);
}

ChildEnd LiveVolumes::watch(ChildProcess& child, const v1::LiveInput& session, std::string& last_words) {
  constexpr int kLook = 200;  // ms
  ChildEnd end;
  LastWords words;
  session::ChildMessageParser parser;
  LiveYield yield;
  std::string unsent = session::framed(session);
  TimePoint heard = SteadyClock().now();
  const auto condemn = [&](ChildEnd::Why why, std::string text) {
    end.why = why;
    end.words = std::move(text);
    child.signal(SIGKILL);
  };
  int messages = child.messages();  // -1: it has closed them
  int errors = child.errors();
  const auto read_messages = [&] {
    Status parsed;
    const ReadEnd at = read_all(messages, [&](std::string_view bytes) {
      heard = SteadyClock().now();
      if (parsed.ok())
        parsed = parser.add(bytes, [&](v1::ChildMessage&& message) { take(std::move(message)); });
    });
    if (at == ReadEnd::closed || !parsed.ok()) messages = -1;
    if (!parsed.ok() && end.why == ChildEnd::Why::by_itself)
      condemn(ChildEnd::Why::unreadable, parsed.error().what);
  };
  for (;;) {
    pollfd polled[] = {{child.exited(), POLLIN, 0},
                       {messages, POLLIN, 0},
                       {errors, POLLIN, 0},
                       {woken_.get(), POLLIN, 0},
                       {unsent.empty() ? -1 : child.input(), POLLOUT, 0}};
    ::poll(polled, std::size(polled), kLook);
    const bool exited = polled[0].revents != 0;
    if (ending_) child.signal(SIGKILL);
    std::uint64_t woken = 0;
    static_cast<void>(::read(woken_.get(), &woken, sizeof(woken)));
    if (messages >= 0) read_messages();
    if (errors >= 0 && read_all(errors, [&](std::string_view bytes) { words.add(bytes); }) == ReadEnd::closed)
      errors = -1;
    if (exited || ending_) break;
    // A child that stands still reads nothing: it is told the newest when it goes on.
    unsent += take_offer(child, yield, unsent.empty());
    if (!unsent.empty() && !send_now(child.input(), unsent)) unsent.clear();
    if (const auto shown = status(); shown->state() == v1::LiveStatus::PAUSED) heard = SteadyClock().now();
    if (SteadyClock().now() - heard > options_.silence && end.why == ChildEnd::Why::by_itself)
      condemn(ChildEnd::Why::silent, {});
  }
  const ChildProcess::Exit exit = child.reap();
  end.code = exit.code;
  end.signal = exit.signal;
  last_words = words.text();
  return end;
}

}  // namespace emberlock::daemon
