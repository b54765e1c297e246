// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera_thread.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <utility>

#include <fmt/format.h>

#include "base/clock.h"
#include "base/log.h"
#include "drivers/call_watch.h"
#include "drivers/frame_queue.h"

namespace emberlock::drivers {
namespace {

using Time = std::chrono::steady_clock::time_point;

Time now() { return std::chrono::steady_clock::now(); }
Time after(Time t, Seconds wait) {
  constexpr Seconds kLongestWait{1e8};
  return t + std::chrono::nanoseconds(std::llround(std::clamp(wait, Seconds(0), kLongestWait).value() * 1e9));
}
Seconds since(Time t) { return Seconds(std::chrono::duration<double>(now() - t).count()); }

/// Duration of one wait for a frame; short, so that commands are executed soon.
constexpr Seconds kSlice = milliseconds(20);

/// The kinds of calls into the camera.
enum class Task { start, stop, next_frame, reset_shutter, trim_rate };
constexpr std::array<std::string_view, 5> kTasks{"start", "stop", "next_frame", "reset_shutter", "trim_rate"};
std::string_view name(Task task) { return kTasks[static_cast<std::size_t>(task)]; }

}  // namespace

/// State shared by the thread and its owner. Only the thread uses the camera.
class CameraThread::Worker : public std::enable_shared_from_this<Worker> {
 public:
  Worker(std::unique_ptr<Camera> camera, CameraThreadOptions options)
      : options_(std::move(options)),
        info_(camera->info()),
        id_(info_.id),
        camera_(std::move(camera)),
        queue_(options_.queue_frames) {}

  void launch() {
    std::thread([self = shared_from_this()] { self->run(); }).detach();
  }

  /// Tells the thread to end. Returns whether it did in time.
  bool finish() {
    std::unique_lock lock(mutex_);
    quit_ = true;
    thread_wakes_.notify_all();
    return owner_wakes_.wait_until(lock, after(now(), options_.call_deadline), [this] { return done_; });
  }

  State state() const {
    const std::lock_guard lock(mutex_);
    if (hangs()) return State::quarantined;
    if (!filming_) return over_ ? State::ended : State::idle;
    return lost_ ? State::lost : State::filming;
  }

  bool overworked() const {
    const std::lock_guard lock(mutex_);
    return calls_.late(now()) && !hangs();
  }

  std::optional<Error> trouble() const {
    const std::lock_guard lock(mutex_);
    if (hangs()) return hanging();
    return filming_ && lost_ ? lost_by_ : std::nullopt;
  }

  const CameraInfo& info() const { return info_; }

  FrameCounts counts() const {
    const std::lock_guard lock(mutex_);
    return queue_.counts(of_camera_);
  }

  FrameCounts feed(FrameSink sink) {
    const std::lock_guard lock(mutex_);
    const FrameCounts before = queue_.counts(of_camera_);
    queue_.feed(std::move(sink), of_camera_);
    return before;
  }

  /// Has the thread call `act` and waits for the result. If it takes too long, the call is cancelled.
  Status call(Task task, std::function<Status(Camera&)> act) {
    std::unique_lock lock(mutex_);
    if (hangs()) return hanging();
    const auto answer = std::make_shared<std::optional<Status>>();
    const auto given_up = std::make_shared<bool>(false);
    order(task, now(), [act = std::move(act), answer, given_up, this](Camera& camera) {
      {
        const std::lock_guard inner(mutex_);
        if (*given_up) return;
      }
      Status status = act(camera);
      const std::lock_guard inner(mutex_);
      *answer = std::move(status);
    });
    // The thread may have to finish a wait for a frame first.
    const Time until = after(now(), options_.call_deadline + kSlice);
    owner_wakes_.wait_until(lock, until, [&] { return answer->has_value(); });
    if (answer->has_value()) return **answer;
    *given_up = true;
    return hangs() ? hanging() : silent(task);
  }

  Status start() {
    std::uint64_t film = 0;
    {
      const std::lock_guard lock(mutex_);
      if (filming_ && !hangs()) return {};
      film = ++film_;
    }
    Status started = call(Task::start, [film, this](Camera& camera) {
      Status status = camera.start();
      const std::lock_guard lock(mutex_);
      if (film != film_) return status;  // too late: the owner has stopped or restarted the camera
      filming_ = status.ok();
      lost_ = false;
      over_.reset();
      if (status) learn(camera.info());
      return status;
    });
    const std::lock_guard lock(mutex_);
    adopt_info();
    if (started) return started;
    ++film_;
    if (options_.absent == CameraThreadOptions::Absent::fails) return started;
    filming_ = true;
    lose(started.error());
    thread_wakes_.notify_all();
    return {};
  }

  /// Works also when the camera hangs: it is stopped when the call returns.
  Status stop() {
    std::unique_lock lock(mutex_);
    filming_ = false;
    lost_ = false;
    over_.reset();
    ++film_;
    orders_.clear();
    resets_to_do_ = 0;
    queue_.clear();
    const auto stopped = std::make_shared<bool>(false);
    order(Task::stop, now(), [stopped, this](Camera& camera) {
      camera.stop();
      const std::lock_guard inner(mutex_);
      *stopped = true;
    });
    const Time until = after(now(), options_.call_deadline + kSlice);
    while (!*stopped && now() < until && !hangs()) {
      owner_wakes_.wait_until(lock, calls_.next_look(now(), until));
    }
    if (*stopped) return {};
    return hangs() ? hanging() : silent(Task::stop);
  }

  Result<Frame> next_frame(Seconds deadline) {
    std::unique_lock lock(mutex_);
    const Time until = after(now(), deadline);
    while (queue_.empty() && now() < until && !hangs()) {
      owner_wakes_.wait_until(lock, calls_.next_look(now(), until));
    }
    adopt_info();
    if (auto next = queue_.take()) return *std::move(next);
    if (hangs()) return hanging();
    if (!filming_) {
      return over_.value_or(Error{ErrorKind::device, "it does not film", where(), "start() it first"});
    }
    if (lost_) {
      return away();
    }
    return Error{ErrorKind::timed_out, fmt::format("no frame within {:g} s", deadline.value()), where(),
                 "wait longer than a frame period; see whether its lamp says that it films"};
  }

  std::uint64_t pass_over(TimePoint until) {
    const std::lock_guard lock(mutex_);
    return queue_.pass_over(until);
  }

  Status reset(TimePoint at) {
    const std::lock_guard lock(mutex_);
    if (info_.reset == ShutterReset::none) {
      return Error{ErrorKind::device, "its shutter can't be reset", where(),
                   "choose a camera whose reset is by_hand or on_command"};
    }
    if (hangs()) return hanging();
    if (!filming_) return Error{ErrorKind::device, "it does not film", where(), "start() it first"};
    if (lost_) return away();
    ++resets_to_do_;
    const Time begins = after(now(), at - SteadyClock().now());
    order(Task::reset_shutter, begins, [at, film = film_, this](Camera& camera) {
      const Status status = camera.reset_shutter(at);
      const std::lock_guard inner(mutex_);
      if (film != film_) return;
      queue_.drop_frames();
      if (resets_to_do_ > 0) --resets_to_do_;
      if (!status) lose(status.error());
    });
    queue_.drop_frames();
    return {};
  }

 private:
  struct Order {
    Task task;
    Time begins;  ///< when it is due
    std::function<void(Camera&)> act;
  };

  // These require the lock.

  [[nodiscard]] std::string where() const { return "camera " + id_; }
  [[nodiscard]] bool hangs() const { return calls_.hangs(now()); }
  [[nodiscard]] Error hanging() const {
    return {ErrorKind::device, calls_.words(now()), where(),
            "unplug it or switch it off and on again; the other cameras go on"};
  }
  [[nodiscard]] Error away() const {
    return {ErrorKind::timed_out, fmt::format("it has been away for {:.1f} s", since(lost_since_).value()),
            where(), "plug it in again, or switch it on; it films on by itself"};
  }
  [[nodiscard]] Error silent(Task task) const {
    return {ErrorKind::timed_out,
            fmt::format("{} wasn't done within {:g} s", name(task), options_.call_deadline.value()), where(),
            calls_.late(now()) && !hangs() ? "the processor has too much to do: end other programs"
                                           : "unplug it or switch it off and on again"};
  }
  void order(Task task, Time begins, std::function<void(Camera&)> act) {
    orders_.push_back({task, begins, std::move(act)});
    thread_wakes_.notify_all();
  }
  void lose(const Error& error) {
    log(LogCategory::drivers).warn("{}", error.message());
    lost_ = true;
    lost_by_ = error;
    lost_since_ = now();
    retry_at_ = after(now(), options_.retry);
    queue_.add(error);
    std::erase_if(orders_, [](const Order& order) { return order.task == Task::reset_shutter; });
    resets_to_do_ = 0;
  }
  void learn(const CameraInfo& info) { learnt_info_ = info; }
  void adopt_info() {
    if (learnt_info_) info_ = *std::exchange(learnt_info_, std::nullopt);
  }
  /// Calls the camera without holding the lock; state() can then see that it hangs.
  template <class Act>
  auto busy(std::unique_lock<std::mutex>& lock, Task with, Time begins, const Act& act) {
    calls_.begin(name(with), now(), after(std::max(begins, now()), options_.call_deadline));
    lock.unlock();
    struct Done {
      std::unique_lock<std::mutex>& lock;
      Worker& worker;
      ~Done() {
        const FrameCounts counted = worker.camera_->counts();
        lock.lock();
        worker.of_camera_ = counted;
        worker.calls_.end();
        worker.owner_wakes_.notify_all();
      }
    } const done{lock, *this};
    return act(*camera_);
  }

  /// The first order that is due. An order for an instant is passed to the camera slightly earlier, so that
  /// the thread needn't wake at exactly that instant.
  std::optional<Order> due() {
    const Time soon = after(now(), options_.reset_ahead);
    const auto first = std::find_if(orders_.begin(), orders_.end(),
                                    [&](const Order& order) { return order.begins <= soon; });
    if (first == orders_.end()) return {};
    Order found = std::move(*first);
    orders_.erase(first);
    return found;
  }

  /// How long the thread may wait for a frame.
  [[nodiscard]] Seconds until_next_order() const {
    Seconds wait = kSlice;
    for (const Order& order : orders_) wait = std::min(wait, -since(order.begins) - options_.reset_ahead);
    return std::max(wait, Seconds(0));
  }

  void run() {
    std::unique_lock lock(mutex_);
    calls_.adopt_thread();
    while (!quit_) {
      if (const auto order = due()) {
        busy(lock, order->task, order->begins, order->act);
      } else if (filming_ && !lost_) {
        take_frame(lock);
      } else if (filming_ && now() >= retry_at_) {
        look_for_it(lock);
      } else if (filming_) {
        thread_wakes_.wait_until(lock, retry_at_);
      } else {
        thread_wakes_.wait(lock);
      }
    }
    busy(lock, Task::stop, now(), [](Camera& camera) { camera.stop(); });
    calls_.begin(name(Task::stop), now(), after(now(), options_.call_deadline));
    lock.unlock();
    camera_.reset();
    lock.lock();
    calls_.end();
    done_ = true;
    owner_wakes_.notify_all();
  }

  void take_frame(std::unique_lock<std::mutex>& lock) {
    const std::uint64_t film = film_;
    const Seconds slice = until_next_order();
    Result<Frame> next = busy(lock, Task::next_frame, after(now(), slice), [slice, this](Camera& camera) {
      Result<Frame> frame = camera.next_frame(slice);
      if (frame && options_.on_frame) options_.on_frame(*frame);
      return frame;
    });
    if (next && (resets_to_do_ > 0 || film != film_)) return queue_.pass_over();
    if (next) return queue_.add(std::move(*next), of_camera_);
    if (film != film_ || next.error().kind == ErrorKind::timed_out) return;
    if (next.error().kind == ErrorKind::device) return lose(next.error());
    if (next.error().kind == ErrorKind::out_of_data) {
      filming_ = false;
      over_ = next.error();
    }
    queue_.add_once(next.error());
  }

  void look_for_it(std::unique_lock<std::mutex>& lock) {
    const Status back = busy(lock, Task::start, now(), [](Camera& camera) { return camera.start(); });
    retry_at_ = after(now(), options_.retry);
    if (!back) {
      lost_by_ = back.error();
      return;
    }
    lost_ = false;
    learn(camera_->info());
    log(LogCategory::drivers).warn("{}: it is back after {:.1f} s", where(), since(lost_since_).value());
  }

  const CameraThreadOptions options_;
  CameraInfo info_;  ///< used by the owner only
  const std::string id_;
  std::unique_ptr<Camera> camera_;

  mutable std::mutex mutex_;
  std::condition_variable thread_wakes_;
  std::condition_variable owner_wakes_;
  std::deque<Order> orders_;
  FrameQueue queue_;
  FrameCounts of_camera_;
  int resets_to_do_ = 0;
  std::uint64_t film_ = 0;  ///< number of starts and stops; calls begun before the last one are obsolete
  bool filming_ = false;    ///< as requested by the owner
  bool lost_ = false;
  std::optional<Error> over_;  ///< the error at the end of a recording
  std::optional<Error> lost_by_;
  std::optional<CameraInfo> learnt_info_;
  Time lost_since_;
  Time retry_at_;
  CallWatch calls_;  ///< into the camera
  bool quit_ = false;
  bool done_ = false;
};

CameraThread::CameraThread(std::unique_ptr<Camera> camera, CameraThreadOptions options)
    : worker_(std::make_shared<Worker>(std::move(camera), std::move(options))) {
  worker_->launch();
}

CameraThread::~CameraThread() {
  if (!worker_->finish())
    log(LogCategory::drivers).error("camera {}: it hangs and is left behind", worker_->info().id);
}

CameraThread::State CameraThread::state() const { return worker_->state(); }
bool CameraThread::overworked() const { return worker_->overworked(); }
std::optional<Error> CameraThread::trouble() const { return worker_->trouble(); }
const CameraInfo& CameraThread::info() const { return worker_->info(); }
FrameCounts CameraThread::counts() const { return worker_->counts(); }
Status CameraThread::start() { return worker_->start(); }
void CameraThread::stop() {
  if (const Status stopped = worker_->stop(); !stopped)
    log(LogCategory::drivers).error("{}", stopped.error().message());
}
Result<Frame> CameraThread::next_frame(Seconds deadline) { return worker_->next_frame(deadline); }
std::uint64_t CameraThread::pass_over(TimePoint until) { return worker_->pass_over(until); }
FrameCounts CameraThread::feed(FrameSink sink) { return worker_->feed(std::move(sink)); }
Status CameraThread::reset_shutter(TimePoint at) { return worker_->reset(at); }
Status CameraThread::trim_rate(PartsPerMillion trim) {
  return worker_->call(Task::trim_rate, [trim](Camera& camera) { return camera.trim_rate(trim); });
}

}  // namespace emberlock::drivers
