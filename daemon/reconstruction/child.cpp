// SPDX-License-Identifier: Apache-2.0
#include "daemon/reconstruction/child.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <csignal>
#include <limits>
#include <system_error>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <poll.h>
#include <unistd.h>

#include "base/clock.h"
#include "daemon/reconstruction/child_output.h"
#include "daemon/reconstruction/process.h"
#include "daemon/reconstruction/request.h"
#include "session/child_messages.h"
#include "session/files.h"
#include "session/frame_range.h"
#include "session/name.h"

namespace emberlock::daemon {
namespace fs = std::filesystem;
namespace {

using Steady = std::chrono::steady_clock;

constexpr auto kUnknown = std::numeric_limits<std::uint64_t>::max();  // a number of frames

Steady::duration duration(Seconds seconds) {
  return std::chrono::duration_cast<Steady::duration>(std::chrono::duration<double>(seconds.value()));
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(Steady::now().time_since_epoch()).count();
}

constexpr int kLook = 100;  // ms, between two looks whether it shall end

}  // namespace

fs::path ReconstructionChild::result_of(const v1::ReconstructRequest& request) const {
  const std::string frame = request.has_frame() ? fmt::format("frame-{}", request.frame()) : "middle-frame";
  const fs::path folder = fs::absolute(options_.results / request.session());
  if (!request.stylize()) return folder / frame;
  std::error_code ec;
  fs::path result = folder / (frame + "-stylized");
  for (int n = 2; fs::exists(result, ec); ++n) result = folder / fmt::format("{}-stylized-{}", frame, n);
  return result;
}

Status ReconstructionChild::check(const v1::ReconstructRequest& request) const {
  EMBERLOCK_RETURN_IF_ERROR(check_request(request));
  const auto frames = frames_of(request);
  return frames.ok() ? Status() : frames.error();
}

Result<std::vector<std::uint64_t>> ReconstructionChild::frames_of(
    const v1::ReconstructRequest& request) const {
  if (!request.has_last_frame()) {
    if (request.every() != 0)
      return refuse_field("every", "is for sequences", "Give last_frame too, or leave it away");
    return std::vector<std::uint64_t>();
  }
  if (!request.has_frame())
    return refuse_field("last_frame", "a sequence has a first frame too", "Give frame, or leave it away");
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::Manifest manifest,
                             session::read_manifest(options_.sessions / request.session()));
  std::uint64_t recorded = manifest.cameras().empty() ? 0 : manifest.cameras(0).counts().recorded();
  // Not counted before it is finished; the child says what to do about it.
  if (manifest.state() == v1::Manifest::RECORDING) recorded = kUnknown;
  const session::FrameRange range{request.frame(), request.last_frame(),
                                  std::max<std::uint64_t>(1, request.every())};
  return session::frames_of(range, recorded, "last_frame");
}

std::vector<std::string> ReconstructionChild::command_for(const v1::ReconstructRequest& request) const {
  const v1::ReconstructRequest& unasked = options_.unasked;
  const std::string& device = !request.device().empty() ? request.device() : unasked.device();
  const double budget = request.budget_s() > 0 ? request.budget_s() : unasked.budget_s();
  const std::uint32_t voxels = request.voxels() > 0 ? request.voxels() : unasked.voxels();
  const auto& hold_out = request.hold_out().empty() ? unasked.hold_out() : request.hold_out();
  std::vector<std::string> command = {options_.program.string(),
                                      request.stylize() ? "stylize" : "reconstruct",
                                      fs::absolute(options_.sessions / request.session()).string()};
  const auto option = [&](const char* name, std::string value) {
    command.insert(command.end(), {name, std::move(value)});
  };
  option("--out", result_of(request).string());
  option("--progress-fd", std::to_string(ChildProcess::kMessagesFd));
  if (!device.empty()) option("--device", device);
  if (request.has_frame()) option("--frame", std::to_string(request.frame()));
  if (budget > 0 && !request.stylize()) option("--budget", fmt::format("{}", budget));
  if (voxels > 0) option("--voxels", std::to_string(voxels));
  if (!hold_out.empty()) option("--hold-out", fmt::format("{}", fmt::join(hold_out, ",")));
  if (!request.quantity().empty()) option("--quantity", request.quantity());
  if (!request.emitter().empty()) option("--emitter", request.emitter());
  if (!request.lines().empty()) option("--lines", request.lines());
  if (request.has_response()) option("--response", "/dev/stdin");
  if (request.errors()) command.emplace_back("--errors");
  if (options_.threads > 0) option("--threads", std::to_string(options_.threads));
  return command;
}

Result<v1::ReconstructionStatus> ReconstructionChild::start(const v1::ReconstructRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(session::check_session_name(request.session()));
  std::error_code ec;
  if (!fs::is_regular_file(session::manifest_path(options_.sessions / request.session()), ec)) {
    return Error{ErrorKind::bad_input, "there is no such session", request.session(),
                 "Look at `emberlock sessions list`"};
  }
  EMBERLOCK_RETURN_IF_ERROR(check_request(request));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<std::uint64_t> frames, frames_of(request));
  {
    const std::lock_guard lock(mutex_);
    if (runs()) {
      return Error{ErrorKind::refused, "one runs already, of session " + state_->status().session(),
                   "reconstruction", "Wait for it, or cancel it"};
    }
    EMBERLOCK_ASSIGN_OR_RETURN(
        job_, jobs_.add({v1::Job::RECONSTRUCT, request.session(), [this, request](const Observer& observer) {
                           return supervise(request, observer);
                         }}));
    v1::ReconstructionStatus begun;
    begun.set_id(fmt::format("{} {}", request.session(), utc_now()));
    begun.set_session(request.session());
    begun.set_device(!request.device().empty() ? request.device() : options_.unasked.device());
    kept_.begin(begun.id());
    state_.emplace(std::move(begun), frames, fs::absolute(options_.results / request.session()).string());
    begun_ns_ = now_ns();
    cancelling_ = false;
    running_ = true;
    stylizes_ = request.stylize();
  }
  return *status();
}

Status ReconstructionChild::check_editable() const {
  const std::lock_guard lock(mutex_);
  if (!runs() || !stylizes_)
    return Error{ErrorKind::refused, "none runs", "stylization", "Start one of a session's frame"};
  if (!state_->status().has_stylization())
    return Error{ErrorKind::refused, "its flame isn't reconstructed yet", "stylization",
                 "Wait for its first preview"};
  return {};
}

Result<v1::StylizationStatus> ReconstructionChild::edit(const v1::EditRequest& request) {
  constexpr Seconds kLongest{60};
  EMBERLOCK_RETURN_IF_ERROR(check_editable());
  return edits_.ask(request, kLongest);
}

Result<v1::ReconstructionStatus> ReconstructionChild::finish() {
  EMBERLOCK_RETURN_IF_ERROR(check_editable());
  EMBERLOCK_RETURN_IF_ERROR(edits_.finish());
  return *status();
}

Result<v1::ReconstructionStatus> ReconstructionChild::cancel() {
  {
    const std::lock_guard lock(mutex_);
    if (!runs()) {
      return Error{ErrorKind::refused, "none runs", "reconstruction", "There is nothing to cancel"};
    }
    cancelling_ = true;
    job_->cancel();
  }
  return *status();
}

void ReconstructionChild::end() {
  ending_ = true;
  const std::lock_guard lock(mutex_);
  if (job_) job_->cancel();
}

std::optional<v1::ReconstructionStatus> ReconstructionChild::status() const {
  const std::lock_guard lock(mutex_);
  if (!state_) return std::nullopt;
  v1::ReconstructionStatus status = state_->status();
  if (running_ && !runs()) {  // cancelled before it began
    SequenceState cancelled = *state_;
    cancelled.end({.why = ChildEnd::Why::cancelled}, {});
    status = cancelled.status();
  }
  if (runs() && cancelling_) status.set_doing("being cancelled");
  status.set_seconds(runs() ? static_cast<double>(now_ns() - begun_ns_) * 1e-9 : seconds_);
  return status;
}

std::shared_ptr<const v1::IterationPreview> ReconstructionChild::frame(const v1::FrameRequest& one) const {
  const std::lock_guard lock(mutex_);
  return kept_.find(one);
}

JobResult ReconstructionChild::supervise(v1::ReconstructRequest request, const Observer& observer) {
  const auto next = [&] {
    const std::lock_guard lock(mutex_);
    if (!state_->next()) return false;
    if (const auto frame = state_->frame()) request.set_frame(*frame);
    return true;
  };
  while (next()) reconstruct(request, observer);
  const std::lock_guard lock(mutex_);
  seconds_ = static_cast<double>(now_ns() - begun_ns_) * 1e-9;
  running_ = false;
  const v1::ReconstructionStatus status = state_->status();
  if (status.state() == v1::ReconstructionStatus::CANCELLED)
    return Error{ErrorKind::refused, "ended early, as asked", status.session()};
  if (status.state() != v1::ReconstructionStatus::DONE)
    return Error{ErrorKind::device, status.error(), status.session()};
  v1::JobOutcome outcome;
  outcome.set_ok(true);
  return outcome;
}

Result<ChildProcess> ReconstructionChild::spawn(const v1::ReconstructRequest& request) {
  if (!request.stylize())
    return ChildProcess::spawn(command_for(request), options_.niceness, input_for(request));
  EMBERLOCK_ASSIGN_OR_RETURN(const UniqueFd steps, edits_.open());
  return ChildProcess::spawn(command_for(request), options_.niceness, steps);
}

void ReconstructionChild::reconstruct(const v1::ReconstructRequest& request, const Observer& observer) {
  LastWords last_words;
  ChildEnd end;
  // The child dies with the thread that started it, as the kernel counts parents: this one, which watches it.
  if (auto process = spawn(request); process.ok()) {
    end = watch(
        *process, [&](std::string_view bytes) { last_words.add(bytes); }, observer);
  } else {
    end.why = ChildEnd::Why::not_started;
    end.words = process.error().message();
  }
  edits_.close();
  const std::lock_guard lock(mutex_);
  state_->end(end, last_words.text());
  const auto volume = std::exchange(newest_volume_, std::nullopt);
  if (volume && state_->has_result()) kept_.keep(*volume);
}

bool ReconstructionChild::tell(const Observer& observer) {
  double fraction = 0;
  std::string doing;
  {
    const std::lock_guard lock(mutex_);
    fraction = state_->fraction();
    doing = state_->doing();
  }
  return observer(fraction, doing);
}

void ReconstructionChild::take(v1::ChildMessage&& message) {
  std::optional<v1::IterationPreview> preview;
  const v1::ChildMessage::Edited answer = message.edited();
  const bool answers = message.has_edited();
  {
    const std::lock_guard lock(mutex_);
    preview = state_->take(std::move(message));
    if (preview && preview->has_frame() && preview->has_volume()) newest_volume_ = preview;
  }
  if (answers) edits_.take(answer);
  if (preview) board_.show(std::make_shared<const v1::IterationPreview>(std::move(*preview)));
}

ChildEnd ReconstructionChild::watch(ChildProcess& process, const TakeBytes& take_words,
                                    const Observer& observer) {
  ChildEnd end;
  session::ChildMessageParser parser;
  Steady::time_point heard = Steady::now();
  std::optional<Steady::time_point> kill_at;
  const auto condemn = [&](ChildEnd::Why why, std::string words) {
    end.why = why;
    end.words = std::move(words);
    process.signal(SIGKILL);
  };
  pollfd polled[] = {{process.exited(), POLLIN, 0},
                     {process.messages(), POLLIN, 0},
                     {process.errors(), POLLIN, 0},
                     {edits_.woken(), POLLIN, 0},
                     {-1, POLLOUT, 0}};
  const pollfd& exited = polled[0];
  pollfd& messages = polled[1];
  pollfd& errors = polled[2];
  pollfd& blocked_steps = polled[4];
  const auto read_messages = [&] {
    Status parsed;
    const ReadEnd at = read_all(messages.fd, [&](std::string_view bytes) {
      if (!parsed) return;
      parsed = parser.add(bytes, [&](v1::ChildMessage&& message) {
        heard = Steady::now();
        take(std::move(message));
      });
    });
    if (at == ReadEnd::closed || !parsed) messages.fd = -1;
    if (!parsed && end.why == ChildEnd::Why::by_itself)
      condemn(ChildEnd::Why::unreadable,
              "it sent what can't be understood, " + parsed.error().what + ", and was killed");
  };
  const auto read_errors = [&] {
    if (read_all(errors.fd, take_words) == ReadEnd::closed) errors.fd = -1;
  };

  while (exited.revents == 0) {
    blocked_steps.fd = edits_.blocked();
    ::poll(polled, std::size(polled), kLook);
    edits_.send();
    if (ending_) condemn(ChildEnd::Why::cancelled, {});
    if (!tell(observer) && end.why == ChildEnd::Why::by_itself) {
      end.why = ChildEnd::Why::cancelled;
      process.signal(SIGTERM);
      kill_at = Steady::now() + duration(options_.grace);
      const std::lock_guard lock(mutex_);
      cancelling_ = true;
    }
    if (messages.fd >= 0 && messages.revents != 0) read_messages();
    if (errors.fd >= 0 && errors.revents != 0) read_errors();
    const Steady::time_point now = Steady::now();
    if (kill_at && now >= *kill_at) {
      process.signal(SIGKILL);
      kill_at.reset();
    }
    if (end.why == ChildEnd::Why::by_itself && now >= heard + duration(options_.silence))
      condemn(ChildEnd::Why::silent,
              fmt::format("it told nothing for {:g} s and was killed", options_.silence.value()));
  }
  // What it wrote just before it went.
  if (messages.fd >= 0) read_messages();
  if (errors.fd >= 0) read_errors();
  const ChildProcess::Exit exit = process.reap();
  end.code = exit.code;
  end.signal = exit.signal;
  return end;
}

}  // namespace emberlock::daemon
