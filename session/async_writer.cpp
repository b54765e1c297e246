#include "session/async_writer.h"

#include <algorithm>
#include <condition_variable>
#include <deque>
#include <map>
#include <mutex>
#include <thread>
#include <utility>

namespace emberlock {

/// What all lanes use. The writer itself lets distinct cameras write at the same time.
struct AsyncWriter::Shared {
  explicit Shared(SessionWriter w) : writer(std::move(w)) {}

  void note_failure(const Error& error) {
    const std::scoped_lock lock(mutex);
    if (!failure) failure = error;
  }

  SessionWriter writer;
  std::mutex append_mutex;
  std::mutex mutex;
  std::optional<Error> failure;  ///< guarded by mutex
};

/// One camera's queue and encoder thread.
class AsyncWriter::Lane {
 public:
  Lane(Shared& shared, std::size_t camera, std::size_t bound)
      : shared_(shared), camera_(camera), bound_(bound), thread_([this] { encode(); }) {}
  Lane(const Lane&) = delete;
  Lane& operator=(const Lane&) = delete;
  ~Lane() { end(Ending::drop); }

  bool push(Frame frame) {
    {
      const std::scoped_lock lock(mutex_);
      if (ended_) return false;
      arrivals_.add(frame.stamp.frame_id);
      if (queue_.size() >= bound_) {
        ++lost_[LossCause::queue];
        return false;
      }
      queue_.push_back(std::move(frame));
    }
    wake_.notify_one();
    return true;
  }

  void count_lost(LossCause cause, std::uint64_t frames) {
    const std::scoped_lock lock(mutex_);
    lost_[cause] += frames;
  }

  CameraProgress progress() const {
    const std::scoped_lock lock(mutex_);
    CameraProgress now{static_cast<double>(queue_.size()) / static_cast<double>(bound_), written_.bytes, {}};
    const auto lost = [&](LossCause cause) {
      const auto found = lost_.find(cause);
      return found == lost_.end() ? 0 : found->second;
    };
    now.counts.set_recorded(written_.frames);
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
    shared_.writer.set_arrivals(camera_, arrivals_);
    for (const auto& [cause, frames] : lost_) shared_.writer.count_lost(camera_, cause, frames);
  }

 private:
  enum class Ending { drain, drop };

  void end(Ending ending) {
    {
      const std::scoped_lock lock(mutex_);
      ended_ = true;
      if (ending == Ending::drop) queue_.clear();
    }
    wake_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  std::optional<Frame> pop() {
    std::unique_lock lock(mutex_);
    wake_.wait(lock, [this] { return ended_ || !queue_.empty(); });
    if (queue_.empty()) return std::nullopt;
    Frame frame = std::move(queue_.front());
    queue_.pop_front();
    return frame;
  }

  void encode() {
    while (const auto frame = pop()) {
      const Status written = shared_.writer.write(camera_, *frame);
      if (!written) shared_.note_failure(written.error());
      const std::scoped_lock lock(mutex_);
      written_ = shared_.writer.written(camera_);
    }
  }

  Shared& shared_;
  const std::size_t camera_;
  const std::size_t bound_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  std::deque<Frame> queue_;
  bool ended_ = false;
  Arrivals arrivals_;
  std::map<LossCause, std::uint64_t> lost_;
  WrittenSoFar written_;
  std::thread thread_;  ///< last: it uses all of the above
};

AsyncWriter::AsyncWriter(SessionWriter writer, AsyncWriterOptions options)
    : shared_(std::make_unique<Shared>(std::move(writer))) {
  const std::size_t bound = std::max<std::size_t>(options.queue_frames, 1);
  const std::size_t cameras = shared_->writer.camera_count();
  for (std::size_t i = 0; i < cameras; ++i) lanes_.push_back(std::make_unique<Lane>(*shared_, i, bound));
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
  return shared_->writer.finish();
}

}  // namespace emberlock
