#include "daemon/recordings/transcoder.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include "base/priority.h"
#include "session/salvage.h"

namespace emberlock {
namespace fs = std::filesystem;

bool is_uncompressed(const fs::path& session) {
  std::error_code ec;
  for (fs::recursive_directory_iterator at(session, ec), end; !ec && at != end; at.increment(ec)) {
    if (at->path().extension() == ".nut") return true;
  }
  return false;
}

Transcoder::Transcoder(Done done) : done_(std::move(done)), thread_([this] { work(); }) {}

Transcoder::~Transcoder() {
  {
    const std::scoped_lock lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

void Transcoder::add(fs::path session) {
  {
    const std::scoped_lock lock(mutex_);
    if (std::find(queue_.begin(), queue_.end(), session) != queue_.end()) return;
    queue_.push_back(std::move(session));
  }
  changed_.notify_all();
}

void Transcoder::pause() {
  const std::scoped_lock lock(mutex_);
  paused_ = true;
}

void Transcoder::resume() {
  {
    const std::scoped_lock lock(mutex_);
    paused_ = false;
  }
  changed_.notify_all();
}

Transcoder::Progress Transcoder::progress() const {
  const std::scoped_lock lock(mutex_);
  Progress now;
  now.paused = paused_;
  now.waiting = queue_.size() - (working_ ? 1 : 0);
  if (working_) {
    now.session = queue_.front().filename().string();
    now.fraction = fraction_;
  }
  return now;
}

void Transcoder::drain() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return queue_.empty() || paused_; });
}

/// The next session to work on; none at the end.
std::optional<fs::path> Transcoder::next() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [this] { return ending_ || (!paused_ && !queue_.empty()); });
  if (ending_) return std::nullopt;
  working_ = true;
  fraction_ = 0;
  return queue_.front();
}

/// Asked before each frame.
bool Transcoder::go_on(double fraction) {
  std::unique_lock lock(mutex_);
  fraction_ = fraction;
  changed_.wait(lock, [this] { return ending_ || !paused_; });
  return !ending_;
}

void Transcoder::work() {
  give_way();
  while (const auto session = next()) {
    const Status outcome =
        is_uncompressed(*session)
            ? transcode(*session, [this](double fraction, std::string_view) { return go_on(fraction); })
            : Status{};
    if (done_) done_(session->filename().string(), outcome);
    {
      const std::scoped_lock lock(mutex_);
      queue_.pop_front();
      working_ = false;
    }
    changed_.notify_all();
  }
}

}  // namespace emberlock
