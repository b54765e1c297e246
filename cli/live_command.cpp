// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <condition_variable>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <memory>
#include <mutex>
#include <new>
#include <optional>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include <poll.h>
#include <sched.h>
#include <sys/syscall.h>
#include <unistd.h>

#include "base/clock.h"
#include "cli/commands.h"
#include "cli/progress_stream.h"
#include "recon/pipeline/live_run.h"
#include "session/child_messages.h"

namespace emberlock::cli {
namespace {

Error unlike_daemon(std::string what) {
  return {ErrorKind::bad_input, std::move(what), "stdin", "emberlockd starts this program"};
}

/// Processor, disk and memory: what a recording beside this wants, it gets. Where the system doesn't know
/// one of them, the niceness that the daemon set remains.
void yield_to_all() {
  const sched_param lowest{};
  static_cast<void>(::sched_setscheduler(0, SCHED_IDLE, &lowest));
  constexpr int kThisProcess = 1;  // IOPRIO_WHO_PROCESS, of a header that glibc hasn't
  constexpr int kIdle = 3 << 13;   // IOPRIO_PRIO_VALUE(IOPRIO_CLASS_IDLE, 0)
  static_cast<void>(::syscall(SYS_ioprio_set, kThisProcess, 0, kIdle));
  std::ofstream("/proc/self/oom_score_adj") << 1000;
}

/// What the daemon tells, as a thread reads it: of what is on the disk the newest alone.
class LiveInputs {
 public:
  LiveInputs() : thread_([this] { read(); }) {}
  LiveInputs(const LiveInputs&) = delete;
  LiveInputs& operator=(const LiveInputs&) = delete;
  ~LiveInputs() {
    {
      const std::lock_guard lock(mutex_);
      leaving_ = true;
    }
    thread_.join();
  }

  /// Waits for it. Error: it doesn't come first.
  Result<v1::LiveInput::Session> session() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return session_ || synced_ || ended_; });
    if (!broken_.ok()) return broken_.error();
    if (!session_) return unlike_daemon("no session comes first");
    return *session_;
  }
  /// Waits for a newer one. Nothing at the end.
  Result<std::optional<std::vector<std::uint64_t>>> synced() {
    std::unique_lock lock(mutex_);
    changed_.wait(lock, [this] { return synced_ || ended_; });
    if (!broken_.ok()) return broken_.error();
    if (ended_) return std::optional<std::vector<std::uint64_t>>();
    return std::exchange(synced_, std::nullopt);
  }
  [[nodiscard]] bool ended() const {
    const std::lock_guard lock(mutex_);
    return ended_;
  }

 private:
  void take(v1::LiveInput&& input) {
    if (input.has_session()) session_ = std::move(*input.mutable_session());
    if (input.has_synced()) synced_.emplace(input.synced().frames().begin(), input.synced().frames().end());
  }

  /// Until the input ends, or nobody waits for it any more.
  void read() {
    constexpr int kLook = 50;  // ms
    session::LiveInputParser parser;
    char bytes[1 << 12];
    for (bool open = true; open;) {
      pollfd input{STDIN_FILENO, POLLIN, 0};
      const bool some = ::poll(&input, 1, kLook) > 0;
      const ssize_t n = some ? ::read(STDIN_FILENO, bytes, std::size(bytes)) : 0;
      const std::lock_guard lock(mutex_);
      if (leaving_) return;
      if (!some || (n < 0 && errno == EINTR)) continue;
      open = n > 0;
      if (open)
        broken_ = parser.add(std::string_view(bytes, static_cast<std::size_t>(n)),
                             [this](v1::LiveInput&& message) { take(std::move(message)); });
      open = open && broken_.ok();
      ended_ = !open;
      changed_.notify_all();
    }
  }

  mutable std::mutex mutex_;  // of what follows
  std::condition_variable changed_;
  std::optional<v1::LiveInput::Session> session_;
  std::optional<std::vector<std::uint64_t>> synced_;
  Status broken_;
  bool ended_ = false;
  bool leaving_ = false;
  std::thread thread_;  // last: it uses all of the above
};

Result<recon::LiveOptions> live_options(const v1::LiveInput::Session& told) {
  recon::LiveOptions options;
  options.every = told.request().every();
  if (told.request().voxels() > 0) options.voxels = static_cast<int>(told.request().voxels());
  EMBERLOCK_ASSIGN_OR_RETURN(options.compute.device,
                             recon::parse_device(told.device().empty() ? "auto" : told.device()));
  EMBERLOCK_ASSIGN_OR_RETURN(options.compute.device, recon::resolve(options.compute.device));
  options.compute.threads = told.threads();
  return options;
}

/// Until its input ends, or nobody reads any more.
Status follow_recording(ProgressStream& stream) try {
  LiveInputs inputs;
  EMBERLOCK_ASSIGN_OR_RETURN(const v1::LiveInput::Session told, inputs.session());
  EMBERLOCK_ASSIGN_OR_RETURN(recon::LiveOptions options, live_options(told));
  options.stop = [&inputs] { return inputs.ended(); };
  stream.loading(options.compute.device);
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader reader, session::SessionReader::follow(told.folder()));
  const SteadyClock clock;
  recon::LiveRun run(std::move(reader), std::move(options), clock);
  while (!stream.broken()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const auto synced, inputs.synced());
    if (!synced) break;
    EMBERLOCK_ASSIGN_OR_RETURN(const auto volume, run.step(*synced));
    if (volume && !inputs.ended()) stream.live(*volume);
  }
  return {};
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::refused, "not enough memory", "live volumes", "Give fewer voxels"};
}

void run_live(int fd) {
  yield_to_all();
  auto stream = ProgressStream::open(fd);
  if (!stream) fail(stream.error());
  if (const Status done = follow_recording(*stream); !done.ok()) {
    stream->failed(done.error());
    fail(done.error());
  }
}

}  // namespace

void add_reconstruct_live(const Verb& app) {
  auto fd = std::make_shared<int>(-1);
  const Verb verb =
      app.add_verb("reconstruct-live", "Reconstructs the newest frames of a recording that goes on").hide();
  verb.add_option("--progress-fd", *fd, "Where volumes go: an open descriptor").require();
  verb.set_action([fd] { run_live(*fd); });
}

}  // namespace emberlock::cli
