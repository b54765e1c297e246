// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "session/writer.h"

namespace emberlock::session {

/// What becomes of a frame for which its queue has no room.
enum class WhenFull {
  lose,  ///< it is lost, and counted: cameras don't wait
  wait,  ///< push() waits: for frames from a simulation, which can
};

/// A queue is full once its frames take `queue_bytes`, or the oldest has waited for `queue_time`.
struct AsyncWriterOptions {
  std::uint64_t queue_bytes = std::uint64_t{64} << 20;  ///< a camera; one frame may wait however large it is
  /// > 0. A power cut takes what waits, too: with kSyncInterval and a sync itself this stays below a second.
  Seconds queue_time{0.5};
  WhenFull when_full = WhenFull::lose;
};

/// What encoders have done is handed to the operating system this often, and what was handed is synced this
/// long after the last sync began, off the cameras' and the encoders' threads.
inline constexpr Seconds kFlushInterval{0.1};
inline constexpr Seconds kSyncInterval{0.2};

/// How far one camera's part of a recording has come: arrived = queued + written + what queue and disk lost.
struct CameraProgress {
  std::uint64_t arrived = 0;  ///< frames, pushed
  std::uint64_t queued = 0;   ///< in memory: wait, or are with the encoder. A killed recorder loses them
  std::uint64_t written = 0;  ///< with the operating system. A power cut may lose them
  std::uint64_t safe = 0;     ///< on the disk, and synced; they are among the written
  Seconds at_risk{0};         ///< since the oldest frame that isn't safe arrived
  double queue_fill = 0;      ///< 0..1, by bytes or by time, whichever is more
  std::uint64_t bytes = 0;    ///< handed to the operating system: segments and index
  /// As finish() would tell them if it ended now: recorded is what is safe. Frames that wait are in none yet.
  v1::Counts counts;
};

/// A SessionWriter behind one encoder thread and one bounded queue a camera, and one thread that syncs. With
/// WhenFull::lose push() never waits for encoder or disk: a full queue loses the frame, counted under its
/// cause. Frames of one camera are pushed by one thread at a time; everything else may be called from any
/// thread.
class AsyncWriter {
 public:
  explicit AsyncWriter(SessionWriter writer, AsyncWriterOptions options = {});
  AsyncWriter(const AsyncWriter&) = delete;
  AsyncWriter& operator=(const AsyncWriter&) = delete;
  ~AsyncWriter();  ///< without finish(): queued frames are dropped, the session stays RECORDING

  /// False when the queue was full and the frame is lost. Nothing is written after finish().
  [[nodiscard]] bool push(std::size_t camera, Frame frame);
  /// As SessionWriter::count_lost.
  void count_lost(std::size_t camera, LossCause cause, std::uint64_t frames);
  Status append(const v1::Event& event);
  /// The first failure of an encoder or of the disk, while recording goes on.
  [[nodiscard]] std::optional<Error> failure() const;
  [[nodiscard]] CameraProgress progress(std::size_t camera) const;

  /// Drains the queues, ends the threads and finishes the session.
  Result<v1::Manifest> finish();

 private:
  class Lane;
  struct Shared;
  class Syncer;
  std::unique_ptr<Shared> shared_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::unique_ptr<Syncer> syncer_;
};

}  // namespace emberlock::session
