#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/result.h"
#include "session/writer.h"

namespace emberlock {

struct AsyncWriterOptions {
  std::size_t queue_frames = 64;  ///< frames a camera that may wait for its encoder, >= 1
};

/// How far one camera's part of a recording has come.
struct CameraProgress {
  double queue_fill = 0;    ///< of the frames that may wait, 0..1
  std::uint64_t bytes = 0;  ///< handed to the disk: segments and index
  /// As finish() would tell them now; frames that wait are in none yet.
  v1::Counts counts;
};

/// A SessionWriter behind one encoder thread and one bounded queue a camera. push() never waits for encoder
/// or disk: a full queue loses the frame, counted under its cause. Frames of one camera are pushed by one
/// thread at a time; everything else may be called from any thread.
class AsyncWriter {
 public:
  explicit AsyncWriter(SessionWriter writer, AsyncWriterOptions options = {});
  AsyncWriter(const AsyncWriter&) = delete;
  AsyncWriter& operator=(const AsyncWriter&) = delete;
  ~AsyncWriter();  ///< without finish(): queued frames are dropped, the session stays RECORDING

  /// False when the queue was full and the frame is lost. Nothing is written after finish().
  bool push(std::size_t camera, Frame frame);
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
  std::unique_ptr<Shared> shared_;
  std::vector<std::unique_ptr<Lane>> lanes_;
};

}  // namespace emberlock
