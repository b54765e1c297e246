// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "session/writer.h"

namespace emberlock::session {

/// What happens to a frame when its queue is full.
enum class WhenFull {
  lose,  ///< the frame is lost and counted: cameras don't wait
  wait,  ///< push() waits: for simulated frames, which can wait
};

/// A queue is full when its frames take `queue_bytes`, or when the oldest has waited for `queue_time`.
struct AsyncWriterOptions {
  std::uint64_t queue_bytes = std::uint64_t{64} << 20;  ///< per camera; a single frame may be larger
  /// > 0. A power cut loses the queued frames too: together with kSyncInterval and the duration of a sync,
  /// this stays below a second.
  Seconds queue_time{0.5};
  WhenFull when_full = WhenFull::lose;
};

/// How often encoded frames are handed to the operating system, and the time from the start of one sync to
/// the next. Both run off the cameras' and the encoders' threads.
inline constexpr Seconds kFlushInterval{0.1};
inline constexpr Seconds kSyncInterval{0.2};

/// What became of the time in which frames were encoded and written, of all cameras, since the writer began.
struct WriterLoad {
  Seconds worked;   ///< by the processors, and waiting for one
  Seconds blocked;  ///< by the disk
  [[nodiscard]] bool waits_for_disk() const { return blocked > worked; }
  friend WriterLoad operator-(const WriterLoad& after, const WriterLoad& before) {
    return {after.worked - before.worked, after.blocked - before.blocked};
  }
};

/// A SessionWriter with, for each camera, an encoder thread and a bounded queue, and one thread that syncs.
/// With WhenFull::lose, push() never waits for encoder or disk: when the queue is full the frame is lost, and
/// counted under its cause. The frames of one camera are pushed by one thread at a time; everything else may
/// be called from any thread.
class AsyncWriter {
 public:
  explicit AsyncWriter(SessionWriter writer, AsyncWriterOptions options = {});
  AsyncWriter(const AsyncWriter&) = delete;
  AsyncWriter& operator=(const AsyncWriter&) = delete;
  ~AsyncWriter();  ///< without finish(): queued frames are dropped, the session stays RECORDING

  /// False when the queue was full and the frame is lost. Nothing is written after finish().
  [[nodiscard]] bool push(std::size_t camera, Frame frame);
  /// See SessionWriter::count_lost.
  void count_lost(std::size_t camera, LossCause cause, std::uint64_t frames);
  Status append(const v1::Event& event);
  /// The first failure of an encoder or of the disk. Recording continues after it.
  [[nodiscard]] std::optional<Error> failure() const;
  /// What is refused now, of any camera or of the events: the refusal that has lasted the longest.
  [[nodiscard]] std::optional<DiskTrouble> trouble() const;
  [[nodiscard]] CameraProgress progress(std::size_t camera) const;
  [[nodiscard]] WriterLoad load() const;

  /// Drains the queues, ends the threads and finishes the session. `progress` is told as often as frames are
  /// written: not while the disk stands still.
  Result<v1::Manifest> finish(const Progress& progress = {});

 private:
  [[nodiscard]] std::uint64_t queued() const;

  class Lane;
  struct Shared;
  class Syncer;
  std::unique_ptr<Shared> shared_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::unique_ptr<Syncer> syncer_;
};

}  // namespace emberlock::session
