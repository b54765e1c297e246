// SPDX-License-Identifier: Apache-2.0
#include "session/async_writer.h"

#include <algorithm>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

#include "base/thread_load.h"

namespace emberlock::session {
namespace {

using Clock = std::chrono::steady_clock;

Clock::duration as_duration(Seconds s) {
  return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s.value()));
}

Seconds since(Clock::time_point t) {
  return Seconds(std::chrono::duration<double>(Clock::now() - t).count());
}

}  // namespace

/// State shared by all threads. The writer itself allows different cameras to write at the same time.
struct AsyncWriter::Shared {
  Shared(SessionWriter w, const AsyncWriterOptions& o) : writer(std::move(w)), options(o) {}

  void note(const Status& status) {
    if (status) return;
    const std::scoped_lock lock(mutex);
    if (!failure) failure = status.error();
  }

  void note_events(const Status& status) {
    const std::scoped_lock lock(mutex);
    if (!status && !events_failed) events_failed = Clock::now();
    if (status) events_failed.reset();
    events = status;
  }

  SessionWriter writer;
  const AsyncWriterOptions options;
  std::mutex append_mutex;
  std::mutex mutex;
  // These are guarded by mutex.
  std::optional<Error> failure;
  Status events;  ///< what the newest sync found of them
  std::optional<Clock::time_point> events_failed;
};

/// Thread that syncs what was handed to the operating system, periodically.
class AsyncWriter::Syncer {
 public:
  explicit Syncer(Shared& shared) : shared_(shared), thread_([this] { work(); }) {}
  Syncer(const Syncer&) = delete;
  Syncer& operator=(const Syncer&) = delete;
  ~Syncer() {
    {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
    }
    wake_.notify_one();
    thread_.join();
  }

 private:
  /// Pauses between two syncs even when the disk is slow.
  void work() {
    constexpr auto kPause = std::chrono::milliseconds(50);
    std::unique_lock lock(mutex_);
    while (!ended_) {
      const Clock::time_point begun = Clock::now();
      lock.unlock();
      shared_.note(shared_.writer.sync());
      shared_.note_events(shared_.writer.events_failure());
      lock.lock();
      wake_.wait_until(lock, std::max(begun + as_duration(kSyncInterval), Clock::now() + kPause),
                       [this] { return ended_; });
    }
  }

  Shared& shared_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ended_ = false;
  std::thread thread_;  ///< last member: the thread uses all of the above
};

/// One camera's queue and encoder thread.
class AsyncWriter::Lane {
 public:
  Lane(Shared& shared, std::size_t camera)
      : shared_(shared), camera_(camera), thread_([this] { encode(); }) {}
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;
  ~Lane() { end(Ending::drop); }

  bool push(Frame frame) {
    {
      std::unique_lock lock(mutex_);
      if (shared_.options.when_full == WhenFull::wait)
        room_.wait(lock, [&] { return ended_ || !is_full(bytes_of(frame)); });
      if (ended_) return false;
      arrivals_.add(frame.stamp.frame_id);
      if (is_full(bytes_of(frame))) {
        ++lost_[LossCause::queue];
        return false;
      }
      queued_bytes_ += bytes_of(frame);
      const Clock::time_point now = Clock::now();
      queue_.push_back({std::move(frame), now});
      at_risk_.push_back(now);
    }
    wake_.notify_one();
    return true;
  }

  void count_lost(LossCause cause, std::uint64_t frames) {
    const std::scoped_lock lock(mutex_);
    lost_[cause] += frames;
  }

  CameraProgress progress() {
    const std::scoped_lock lock(mutex_);
    CameraProgress now;
    now.arrived = arrivals_.delivered();
    now.written = written_.written;
    now.safe = std::min(shared_.writer.safe(camera_), written_.written);
    now.queued =
        now.arrived - std::min(now.arrived, lost(LossCause::queue) + written_.counts.disk() + now.written);
    now.queue_fill = std::min(fill(0), 1.0);
    now.bytes = written_.bytes;
    forget_what_is_settled(now.safe);
    if (!at_risk_.empty()) now.at_risk = since(at_risk_.front());
    now.counts.set_recorded(now.safe);
    now.counts.set_transport(lost(LossCause::transport));
    now.counts.set_underrun(lost(LossCause::underrun));
    now.counts.set_queue(lost(LossCause::queue));
    now.counts.set_disk(written_.counts.disk() + lost(LossCause::disk));
    now.counts.set_passed_over(lost(LossCause::passed_over));
    const std::uint64_t by_driver = now.counts.transport() + now.counts.underrun() + now.counts.passed_over();
    now.counts.set_camera_gap(arrivals_.missing() - std::min(arrivals_.missing(), by_driver));
    return now;
  }

  std::optional<DiskTrouble> trouble() {
    const std::scoped_lock lock(mutex_);
    return written_.trouble;
  }

  WriterLoad load() {
    const std::scoped_lock lock(mutex_);
    const Seconds busy = busy_ + (busy_since_ ? since(*busy_since_) : Seconds(0));
    if (const auto now = thread_load(thread_id_)) worked_ = now->ran + now->waited;  // else it has ended
    return {worked_, std::max(busy - worked_, Seconds(0))};
  }

  /// Lets the thread end once the queue is empty. Whether it has, after waiting so long at most.
  bool drained(std::chrono::milliseconds longest) {
    std::unique_lock lock(mutex_);
    ended_ = true;
    wake_.notify_one();
    return room_.wait_for(lock, longest, [this] { return encoded_; });
  }

  /// Ends the thread once the queue is empty, and passes the writer the counts that it couldn't see.
  void finish() {
    end(Ending::drain);
    const std::scoped_lock lock(mutex_);
    shared_.writer.set_arrivals(camera_, arrivals_);
    for (const auto& [cause, frames] : lost_) shared_.writer.count_lost(camera_, cause, frames);
  }

  /// Updates the counts. Called by the encoding thread, or after it ended.
  void look() {
    const std::scoped_lock lock(mutex_);
    written_ = shared_.writer.progress(camera_);
    forget_what_is_settled(std::min(shared_.writer.safe(camera_), written_.written));
  }

 private:
  enum class Ending { drain, drop };
  struct Waiting {
    Frame frame;
    Clock::time_point since;
  };

  static std::uint64_t bytes_of(const Frame& frame) { return frame.image ? frame.image->bytes().size() : 0; }

  /// How full the queue would be with this many more bytes.
  [[nodiscard]] double fill(std::uint64_t more) const {
    if (queue_.empty()) return 0;
    const double by_bytes = static_cast<double>(queued_bytes_ + more) /
                            static_cast<double>(std::max<std::uint64_t>(shared_.options.queue_bytes, 1));
    return std::max(by_bytes, since(queue_.front().since) / shared_.options.queue_time);
  }
  [[nodiscard]] bool is_full(std::uint64_t more) const { return fill(more) > 1; }

  [[nodiscard]] std::uint64_t lost(LossCause cause) const {
    const auto found = lost_.find(cause);
    return found == lost_.end() ? 0 : found->second;
  }

  /// Of the frames taken from the queue, drops those that are safe or given up, in order.
  void forget_what_is_settled(std::uint64_t safe) {
    for (; settled_ < safe + written_.counts.disk() && !at_risk_.empty(); ++settled_) at_risk_.pop_front();
  }

  void end(Ending ending) {
    {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      if (ending == Ending::drop) queue_.clear();
    }
    wake_.notify_one();
    room_.notify_all();
    if (thread_.joinable()) thread_.join();
  }

  /// The next frame; none when it is time to flush, or at the end.
  std::optional<Frame> pop() {
    std::unique_lock lock(mutex_);
    const auto has_work = [this] { return ended_ || !queue_.empty(); };
    if (flush_due_) {
      wake_.wait_until(lock, *flush_due_, has_work);
    } else {
      wake_.wait(lock, has_work);
    }
    if (queue_.empty()) return std::nullopt;
    Frame frame = std::move(queue_.front().frame);
    queue_.pop_front();
    queued_bytes_ -= bytes_of(frame);
    room_.notify_all();
    return frame;
  }

  [[nodiscard]] bool is_over() {
    const std::scoped_lock lock(mutex_);
    return ended_ && queue_.empty();
  }

  /// Begins or ends a stretch of work that isn't waiting for frames.
  void be_busy(bool busy) {
    const std::scoped_lock lock(mutex_);
    if (!busy && busy_since_) busy_ += since(*busy_since_);
    busy_since_ = busy ? std::optional(Clock::now()) : std::nullopt;
  }

  void encode() {
    {
      const std::scoped_lock lock(mutex_);
      thread_id_ = emberlock::thread_id();
    }
    while (!is_over()) {
      const auto frame = pop();
      be_busy(true);
      if (frame) {
        shared_.note(shared_.writer.write(camera_, *frame));
        if (!flush_due_) flush_due_ = Clock::now() + as_duration(kFlushInterval);
      }
      if (flush_due_ && Clock::now() >= *flush_due_) {
        flush_due_.reset();
        shared_.note(shared_.writer.flush(camera_));
      }
      look();
      be_busy(false);
    }
    shared_.note(shared_.writer.flush(camera_));
    look();
    {
      const std::scoped_lock lock(mutex_);
      encoded_ = true;
    }
    room_.notify_all();
  }

  Shared& shared_;
  const std::size_t camera_;
  std::optional<Clock::time_point>
      flush_due_;     ///< used by the encoding thread only: something is to be flushed then
  std::mutex mutex_;  ///< guards the members below
  std::condition_variable wake_;
  std::condition_variable room_;  ///< in the queue; or the thread has ended
  std::deque<Waiting> queue_;
  std::uint64_t queued_bytes_ = 0;
  bool ended_ = false;    ///< no frame comes any more
  bool encoded_ = false;  ///< the thread is done
  Arrivals arrivals_;
  std::map<LossCause, std::uint64_t> lost_;
  CameraProgress written_;                 ///< without the queue
  std::deque<Clock::time_point> at_risk_;  ///< arrival times of frames that aren't safe yet
  std::uint64_t settled_ = 0;
  int thread_id_ = -1;
  Seconds busy_, worked_;  ///< of the thread: with frames in hand; on or waiting for a processor
  std::optional<Clock::time_point> busy_since_;
  std::thread thread_;  ///< last member: the thread uses all of the above
};

AsyncWriter::AsyncWriter(SessionWriter writer, AsyncWriterOptions options)
    : shared_(std::make_unique<Shared>(std::move(writer), options)) {
  const std::size_t cameras = shared_->writer.camera_count();
  for (std::size_t i = 0; i < cameras; ++i) lanes_.push_back(std::make_unique<Lane>(*shared_, i));
  syncer_ = std::make_unique<Syncer>(*shared_);
}

AsyncWriter::~AsyncWriter() = default;

bool AsyncWriter::push(std::size_t camera, Frame frame) { return lanes_.at(camera)->push(std::move(frame)); }

void AsyncWriter::count_lost(std::size_t camera, LossCause cause, std::uint64_t frames) {
  lanes_.at(camera)->count_lost(cause, frames);
}

Status AsyncWriter::append(const v1::Event& event) {
  const std::scoped_lock lock(shared_->append_mutex);
  return shared_->writer.append(event);
}

std::optional<Error> AsyncWriter::failure() const {
  const std::scoped_lock lock(shared_->mutex);
  return shared_->failure;
}

std::optional<DiskTrouble> AsyncWriter::trouble() const {
  std::optional<DiskTrouble> worst;
  {
    const std::scoped_lock lock(shared_->mutex);
    if (shared_->events_failed) worst = DiskTrouble{shared_->events.error(), since(*shared_->events_failed)};
  }
  for (const auto& lane : lanes_) {
    std::optional<DiskTrouble> one = lane->trouble();
    const auto rank = [](const DiskTrouble& trouble) { return std::pair(trouble.is_final, trouble.lasting); };
    if (one && (!worst || rank(*worst) < rank(*one))) worst = std::move(one);
  }
  return worst;
}

CameraProgress AsyncWriter::progress(std::size_t camera) const { return lanes_.at(camera)->progress(); }

WriterLoad AsyncWriter::load() const {
  WriterLoad all;
  for (const auto& lane : lanes_) {
    const WriterLoad one = lane->load();
    all.worked += one.worked;
    all.blocked += one.blocked;
  }
  return all;
}

std::uint64_t AsyncWriter::queued() const {
  std::uint64_t queued = 0;
  for (const auto& lane : lanes_) queued += lane->progress().queued;
  return queued;
}

Result<v1::Manifest> AsyncWriter::finish(const Progress& progress) {
  constexpr std::chrono::milliseconds kLook{50};
  constexpr double kDrained = 0.9;  // of the progress
  const double at_first = std::max<double>(1, static_cast<double>(queued()));
  double told = -1;
  const auto all_drained = [&] {
    return std::all_of(lanes_.begin(), lanes_.end(),
                       [](const auto& lane) { return lane->drained(std::chrono::milliseconds(0)); });
  };
  for (const auto& lane : lanes_) static_cast<void>(lane->drained(std::chrono::milliseconds(0)));
  while (!all_drained()) {
    const double share = std::max(0.0, 1 - static_cast<double>(queued()) / at_first);
    if (std::exchange(told, share) != share) tell(progress, kDrained * share, "writes the last frames");
    for (const auto& lane : lanes_)
      if (!lane->drained(kLook)) break;
  }
  for (const auto& lane : lanes_) lane->finish();
  syncer_.reset();
  auto manifest = shared_->writer.finish([&progress](double fraction, std::string_view doing) {
    tell(progress, kDrained + fraction * (kNearlyDone - kDrained), doing);
  });
  for (const auto& lane : lanes_) lane->look();
  return manifest;
}

}  // namespace emberlock::session
