// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <filesystem>
#include <mutex>
#include <optional>
#include <string>
#include <thread>

#include "base/frame.h"
#include "base/quantity.h"
#include "base/result.h"
#include "base/time_point.h"
#include "daemon/ar/ar_child.h"
#include "daemon/board.h"
#include "emberlock/v1/services.pb.h"

namespace emberlock::daemon {

struct LiveArOptions {
  std::filesystem::path program;  ///< `PROGRAM ar-live`: emberlock, beside the daemon
  std::filesystem::path results;  ///< RESULTS/SESSION/frame-N, or middle-frame
  int threads = 0;                ///< on the CPU; 0: every core
  int niceness = 10;              ///< 0..19: frames go first
  int width = 640;                ///< of pictures, maximum
  Hertz rate{30};                 ///< of pictures, maximum
  Seconds patience{30};           ///< with a child that tells nothing
};

/// A camera of the rig, as far as it matters here.
struct ArCamera {
  std::string id;
  ImageLayout layout;
  std::optional<v1::Calibration> calibration = {};
};

/// Puts a flame on a marker into the live pictures of one camera: the newest frame goes to a child process,
/// and its picture to the board in the place of the plain one. A frame that comes while one is drawn replaces
/// the one that waits. Frames are only read; without a watcher none is drawn. Thread-safe.
class LiveAr {
 public:
  /// `board` outlives it.
  LiveAr(LiveArOptions options, Board& board) : options_(std::move(options)), board_(board) {}
  LiveAr(const LiveAr&) = delete;
  LiveAr& operator=(const LiveAr&) = delete;
  ~LiveAr();

  /// Returns when the flame has been read. Errors: those of v1::Ar's Start.
  Result<v1::ArStatus> start(const v1::ArRequest& request, const ArCamera& camera);
  /// `refused` where none is shown.
  Result<v1::ArStatus> stop();
  /// Ends the one that is shown, and lets none begin any more; returns at once.
  void end();
  /// Of the one that is shown, else of the last; nothing before the first.
  [[nodiscard]] std::optional<v1::ArStatus> status() const;
  [[nodiscard]] v1::ListResultsResponse results() const;

  /// The camera's newest frame. False: it isn't taken, and is shown as it is. Any thread; returns at once.
  bool offer(const std::string& camera_id, const Frame& frame);

 private:
  void run(const v1::ArInput& scene, const ArCamera& camera);
  Status draw(ArChild& child, const ArCamera& camera, ImageSize size);
  std::optional<Frame> next_frame();
  void show(const Frame& frame, ImageSize size, v1::ArPicture&& picture);
  void set_state(v1::ArStatus::State state, const std::string& error = {});
  [[nodiscard]] bool ends() const { return ending_ || over_; }

  const LiveArOptions options_;
  Board& board_;
  std::mutex calls_;  ///< of start() and stop(); before mutex_
  std::atomic<bool> ending_ = false;
  std::atomic<bool> over_ = false;
  std::atomic<bool> shows_ = false;
  std::thread thread_;

  mutable std::mutex mutex_;  ///< of what follows
  std::condition_variable changed_;
  std::optional<v1::ArStatus> status_;
  Frame newest_;       ///< without an image if there is no new one
  TimePoint arrived_;  ///< it
  TimePoint taken_;    ///< arrival of the one that is drawn
  TimePoint due_;      ///< the next one
  struct Shown {
    TimePoint at;
    Seconds delay;
  };
  std::deque<Shown> shown_;  ///< lately
};

}  // namespace emberlock::daemon
