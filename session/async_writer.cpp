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

/// What all threads use. The writer itself lets distinct cameras write at the same time.
struct AsyncWriter::Shared {
  Shared(SessionWriter w, const AsyncWriterOptions& o) : writer(std::move(w)), options(o) {}

  void note(const Status& status) {
    if (status) return;
    const std::scoped_lock lock(mutex);
    if (!failure) failure = status.error();
  }

  SessionWriter writer;
  const AsyncWriterOptions options;
  std::mutex append_mutex;
  std::mutex mutex;
  std::optional<Error> failure;  ///< guarded by mutex
};

/// Has the disk hold what was handed on, again and again.
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
  /// A disk that is slow gets time between two syncs, too.
  void work() {
    constexpr auto kPause = std::chrono::milliseconds(50);
    std::unique_lock lock(mutex_);
    while (!ended_) {
      const Clock::time_point begun = Clock::now();
      lock.unlock();
      shared_.note(shared_.writer.sync());
      lock.lock();
      wake_.wait_until(lock, std::max(begun + as_duration(kSyncInterval), Clock::now() + kPause),
                       [this] { return ended_; });
    }
  }

  Shared& shared_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool ended_ = false;
  std::thread thread_;  ///< last: it uses all of the above
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
    now.written = written_.frames;
    now.safe = std::min(shared_.writer.safe(camera_), written_.frames);
    now.queued = now.arrived - std::min(now.arrived, lost(LossCause::queue) + written_.refused + now.written);
    now.queue_fill = std::min(fill(0), 1.0);
    now.bytes = written_.bytes;
    forget_what_is_settled(now.safe);
    if (!at_risk_.empty()) now.at_risk = since(at_risk_.front());
    now.counts.set_recorded(now.safe);
    now.counts.set_transport(lost(LossCause::transport));
    now.counts.set_underrun(lost(LossCause::underrun));
    now.counts.set_queue(lost(LossCause::queue));
    now.counts.set_disk(written_.refused + lost(LossCause::disk));
    now.counts.set_passed_over(lost(LossCause::passed_over));
    const std::uint64_t by_driver = now.counts.transport() + now.counts.underrun() + now.counts.passed_over();
    now.counts.set_camera_gap(arrivals_.missing() - std::min(arrivals_.missing(), by_driver));
    return now;
  }

  /// Ends the thread once the queue is empty, and tells the writer what it couldn't see.
  void finish() {
    end(Ending::drain);
    const std::scoped_lock lock(mutex_);
    shared_.writer.set_arrivals(camera_, arrivals_);
    for (const auto& [cause, frames] : lost_) shared_.writer.count_lost(camera_, cause, frames);
  }

  /// What has become of the frames so far; asked by the thread that encodes, or once that has ended.
  void look() {
    const std::scoped_lock lock(mutex_);
    written_ = shared_.writer.written(camera_);
    forget_what_is_settled(std::min(shared_.writer.safe(camera_), written_.frames));
  }

 private:
  enum class Ending { drain, drop };
  struct Waiting {
    Frame frame;
    Clock::time_point since;
  };

  static std::uint64_t bytes_of(const Frame& frame) { return frame.image ? frame.image->bytes().size() : 0; }

  /// How full the queue would be with so much more.
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

  /// Of the frames that were taken so many are safe, or given up, in their order.
  void forget_what_is_settled(std::uint64_t safe) {
    for (; settled_ < safe + written_.refused && !at_risk_.empty(); ++settled_) at_risk_.pop_front();
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

  void encode() {
    while (!is_over()) {
      if (const auto frame = pop()) {
        shared_.note(shared_.writer.write(camera_, *frame));
        if (!flush_due_) flush_due_ = Clock::now() + as_duration(kFlushInterval);
      }
      if (flush_due_ && Clock::now() >= *flush_due_) {
        flush_due_.reset();
        shared_.note(shared_.writer.flush(camera_));
      }
      look();
    }
    shared_.note(shared_.writer.flush(camera_));
    look();
  }

  Shared& shared_;
  const std::size_t camera_;
  std::optional<Clock::time_point> flush_due_;  ///< the thread's own: there is something to flush
  std::mutex mutex_;                            ///< guards what follows
  std::condition_variable wake_;
  std::condition_variable room_;
  std::deque<Waiting> queue_;
  std::uint64_t queued_bytes_ = 0;
  bool ended_ = false;
  Arrivals arrivals_;
  std::map<LossCause, std::uint64_t> lost_;
  WrittenSoFar written_;
  std::deque<Clock::time_point> at_risk_;  ///< when frames arrived that aren't safe yet
  std::uint64_t settled_ = 0;
  std::thread thread_;  ///< last: it uses all of the above
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

CameraProgress AsyncWriter::progress(std::size_t camera) const { return lanes_.at(camera)->progress(); }

Result<v1::Manifest> AsyncWriter::finish() {
  for (const auto& lane : lanes_) lane->finish();
  syncer_.reset();
  auto manifest = shared_->writer.finish();
  for (const auto& lane : lanes_) lane->look();
  return manifest;
}

}  // namespace emberlock::session
