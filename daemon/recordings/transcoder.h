#pragma once

#include <condition_variable>
#include <deque>
#include <filesystem>
#include <functional>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/result.h"

namespace emberlock {

/// Turns finished raw sessions into FFV1 (session/salvage.h, transcode) one after the other, on one thread of
/// the lowest priority. Every frame is read back before an uncompressed segment goes; whatever ends it early,
/// the session stays readable, and adding it again goes on from there. Any thread may call.
class Transcoder {
 public:
  /// Told once for each session, from the transcoder's thread. Error `refused`: ended by the destructor, or
  /// in use by another process.
  using Done = std::function<void(const std::string& session, const Status& outcome)>;

  struct Progress {
    std::string session;  ///< in work; empty: none
    double fraction = 0;  ///< of it
    std::size_t waiting = 0;
    bool paused = false;
  };

  explicit Transcoder(Done done = {});
  Transcoder(const Transcoder&) = delete;
  Transcoder& operator=(const Transcoder&) = delete;
  ~Transcoder();  ///< ends what is in work within a frame

  /// A session with nothing uncompressed is done at once; one that is in the queue already isn't added.
  void add(std::filesystem::path session);
  /// While a recording runs: stands still from the next frame on.
  void pause();
  void resume();
  [[nodiscard]] Progress progress() const;
  /// Waits until nothing is left to do; not while paused.
  void drain();

 private:
  void work();
  std::optional<std::filesystem::path> next();
  bool go_on(double fraction);

  const Done done_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::filesystem::path> queue_;  ///< the first is in work while working_
  bool working_ = false;
  bool paused_ = false;
  bool ending_ = false;
  double fraction_ = 0;
  std::thread thread_;  ///< last: it uses all of the above
};

/// Whether a session holds uncompressed segments, so that it should be transcoded.
bool is_uncompressed(const std::filesystem::path& session);

}  // namespace emberlock
