// SPDX-License-Identifier: Apache-2.0
#include "daemon/server/grpc_streams.h"

#include <algorithm>
#include <chrono>

namespace emberlock::daemon {

StreamPump::StreamPump(std::size_t most) : most_(most), thread_([this] { pump(); }) {}

StreamPump::~StreamPump() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  woken_.notify_one();
  thread_.join();
}

bool StreamPump::add(PumpedStream* stream) {
  {
    const std::lock_guard lock(mutex_);
    if (streams_.size() >= most_) return false;
    streams_.push_back(stream);
  }
  wake();
  return true;
}

void StreamPump::wake() {
  {
    const std::lock_guard lock(mutex_);
    if (streams_.empty()) return;
    awake_ = true;
  }
  woken_.notify_one();
}

std::size_t StreamPump::streams() const {
  const std::lock_guard lock(mutex_);
  return streams_.size();
}

std::optional<TimePoint> StreamPump::write_all() {
  std::vector<PumpedStream*> streams;
  {
    const std::lock_guard lock(mutex_);
    streams = streams_;
  }
  std::optional<TimePoint> again;
  for (PumpedStream* stream : streams) {
    if (const auto at = stream->write(SteadyClock().now())) again = std::min(again.value_or(*at), *at);
    if (!stream->over()) continue;
    {
      const std::lock_guard lock(mutex_);
      std::erase(streams_, stream);
    }
    stream->finish();
  }
  return again;
}

void StreamPump::pump() {
  std::optional<TimePoint> again;
  while (true) {
    {
      std::unique_lock lock(mutex_);
      const auto woken = [this] { return awake_ || ending_; };
      if (again)
        woken_.wait_for(
            lock, std::chrono::nanoseconds(std::max<std::int64_t>(0, again->ns - SteadyClock().now().ns)),
            woken);
      else
        woken_.wait(lock, woken);
      if (ending_) return;
      awake_ = false;
    }
    again = write_all();
  }
}

}  // namespace emberlock::daemon
