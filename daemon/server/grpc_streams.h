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
#include "daemon/server/job.h"

// gRPC's streams to clients. All that gRPC tells a stream, and all that changes on the board, only wakes the
// pump; its thread alone asks feeds, writes and finishes. So no stream needs a lock, and no writer of the
// board ever runs gRPC's code.
namespace emberlock::daemon {

/// What the pump drives. Deletes itself when gRPC is done with it.
class PumpedStream {
 public:
  virtual ~PumpedStream() = default;
  /// Writes if it can and must. Returns when it wants to be asked again without being woken, if so.
  virtual std::optional<TimePoint> write(TimePoint now) = 0;
  /// Nothing is in flight, and the client has gone or has got all.
  [[nodiscard]] virtual bool over() const = 0;
  /// The last call: it may be deleted before this returns.
  virtual void finish() = 0;
};

class StreamPump {
 public:
  explicit StreamPump(std::size_t most);
  StreamPump(const StreamPump&) = delete;
  StreamPump& operator=(const StreamPump&) = delete;
  /// All streams have finished.
  ~StreamPump();

  /// False when there are too many.
  [[nodiscard]] bool add(PumpedStream* stream);
  /// Something changed. Returns at once; from any thread.
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

/// A stream of what a feed has: one write in flight, the newest alone.
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

class JobStream final : public FeedStream<v1::JobProgress> {
 public:
  JobStream(StreamPump& pump, std::shared_ptr<Job> job) : FeedStream(pump), job_(std::move(job)) {}
  ~JobStream() override { job_->cancel(); }
  JobStream(const JobStream&) = delete;
  JobStream& operator=(const JobStream&) = delete;

  void OnCancel() override {
    job_->cancel();
    FeedStream::OnCancel();
  }

 private:
  Next<v1::JobProgress> next(TimePoint /*now*/) override {
    auto progress = job_->take();
    if (!progress) return {};
    return {.message = std::make_shared<const v1::JobProgress>(*std::move(progress))};
  }
  [[nodiscard]] std::optional<grpc::Status> ended() const override {
    const auto ended = job_->ended();
    return ended ? std::optional(grpc_status(*ended)) : std::nullopt;
  }
  std::shared_ptr<Job> job_;
};

}  // namespace emberlock::daemon
