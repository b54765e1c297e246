// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include <grpcpp/support/server_callback.h>

#include "base/clock.h"
#include "daemon/server/errors.h"
#include "daemon/server/feeds.h"
#include "daemon/server/job_watch.h"

// gRPC's streams to clients. All gRPC events of a stream and all changes of the board only wake the pump;
// only its thread asks feeds, writes and finishes. So no stream needs a lock, and no thread that writes to
// the board runs gRPC's code.
namespace emberlock::daemon {

/// A stream driven by the pump. Deletes itself when gRPC has finished with it.
class PumpedStream {
 public:
  virtual ~PumpedStream() = default;
  /// Writes if possible and needed. Returns when it must be called again without a wake-up, if at all.
  virtual std::optional<TimePoint> write(TimePoint now) = 0;
  /// Nothing is being written, and the client has gone or has received everything.
  [[nodiscard]] virtual bool over() const = 0;
  /// The last call: the object may be deleted before it returns.
  virtual void finish() = 0;
};

class StreamPump {
 public:
  explicit StreamPump(std::size_t most);
  StreamPump(const StreamPump&) = delete;
  StreamPump& operator=(const StreamPump&) = delete;
  /// All streams must have finished.
  ~StreamPump();

  /// False when there are too many.
  [[nodiscard]] bool add(PumpedStream* stream);
  /// Something changed. Returns at once; any thread.
  void wake();
  [[nodiscard]] std::size_t streams() const;

 private:
  void pump();
  [[nodiscard]] std::optional<TimePoint> write_all();

  const std::size_t most_;
  mutable std::mutex mutex_;
  std::condition_variable woken_;
  bool awake_ = false;
  bool ending_ = false;
  std::vector<PumpedStream*> streams_;
  std::thread thread_;
};

/// A stream of a feed's messages: one write at a time, always the newest.
template <class Message>
class FeedStream : public grpc::ServerWriteReactor<Message>, public PumpedStream {
 public:
  explicit FeedStream(StreamPump& pump) : pump_(pump) {}

  std::optional<TimePoint> write(TimePoint now) override {
    if (writing_ || gone_) return std::nullopt;
    Next<Message> next = this->next(now);
    if (!next.message) return next.again;
    in_flight_ = std::move(next.message);
    writing_ = true;
    this->StartWrite(in_flight_.get());
    return std::nullopt;
  }
  [[nodiscard]] bool over() const override { return !writing_ && (gone_ || ended()); }
  void finish() override {
    this->Finish(gone_ ? grpc::Status::CANCELLED : ended().value_or(grpc::Status::OK));
  }

  void OnWriteDone(bool ok) override {
    if (!ok) gone_ = true;
    writing_ = false;
    pump_.wake();
  }
  void OnCancel() override {
    gone_ = true;
    pump_.wake();
  }
  void OnDone() override { delete this; }

 protected:
  virtual Next<Message> next(TimePoint now) = 0;
  [[nodiscard]] virtual std::optional<grpc::Status> ended() const { return std::nullopt; }

 private:
  StreamPump& pump_;
  std::shared_ptr<const Message> in_flight_;
  std::atomic<bool> writing_ = false;
  std::atomic<bool> gone_ = false;
};

template <class Message, class Feed>
class WatchStream final : public FeedStream<Message> {
 public:
  WatchStream(StreamPump& pump, Feed feed) : FeedStream<Message>(pump), feed_(std::move(feed)) {}

 private:
  Next<Message> next(TimePoint now) override { return feed_.next(now); }
  Feed feed_;
};

class JobStream final : public FeedStream<v1::Job> {
 public:
  JobStream(StreamPump& pump, std::shared_ptr<JobWatch> job) : FeedStream(pump), job_(std::move(job)) {}
  ~JobStream() override { job_->leave(); }
  JobStream(const JobStream&) = delete;
  JobStream& operator=(const JobStream&) = delete;

  void OnCancel() override {
    job_->leave();
    FeedStream::OnCancel();
  }

 private:
  Next<v1::Job> next(TimePoint /*now*/) override {
    auto state = job_->take();
    if (!state) return {};
    return {.message = std::make_shared<const v1::Job>(*std::move(state))};
  }
  [[nodiscard]] std::optional<grpc::Status> ended() const override {
    const auto ended = job_->ended();
    return ended ? std::optional(grpc_status(*ended)) : std::nullopt;
  }
  std::shared_ptr<JobWatch> job_;
};

}  // namespace emberlock::daemon
