// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "emberlock/v1/child.pb.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

/// How a child came to its end.
struct ChildEnd {
  enum class Why {
    by_itself,  ///< `code` or `signal` says how
    cancelled,
    silent,      ///< it hung, and was killed
    unreadable,  ///< what it sent can't be understood, and it was killed
    not_started,
  };
  Why why = Why::by_itself;
  int code = 0;            ///< its exit status
  int signal = 0;          ///< not 0: it died by it
  std::string words = {};  ///< of `silent`, `unreadable` and `not_started`
};

/// Whether what is shown of a volume holds together: it comes from another process.
bool is_sound(const v1::VolumePreview& volume);

/// What a reconstruction's messages and end say of it: pure.
class ReconstructionState {
 public:
  static constexpr int kIterations = 1000;  ///< the status has so many of the newest

  /// `begun` has id, session and device as they were asked for.
  explicit ReconstructionState(v1::ReconstructionStatus begun);

  /// What the board shall show of it, if anything.
  std::optional<v1::IterationPreview> take(v1::ChildMessage&& message);
  /// `last_words`: what it wrote to stderr, its last lines.
  void end(const ChildEnd& end, const std::string& last_words);

  [[nodiscard]] const v1::ReconstructionStatus& status() const { return status_; }

 private:
  [[nodiscard]] std::string failure(const ChildEnd& end, const std::string& last_words) const;

  v1::ReconstructionStatus status_;
  std::string told_;  ///< the failure that it told itself
  bool done_ = false;
};

/// A reconstruction of one frame, or of a sequence of them by one child after the other: pure. A frame that
/// fails doesn't end a sequence, unless no child can be started, or the first frames all fail
/// (session/frame_range.h).
class SequenceState {
 public:
  /// `begun` as of ReconstructionState. `frames`: none where it isn't a sequence, whose results are in
  /// `folder`.
  SequenceState(v1::ReconstructionStatus begun, const std::vector<std::uint64_t>& frames, std::string folder);

  /// The frame at hand is the next one. False: there is none, or the sequence has ended.
  bool next();
  /// Of a sequence the frame at hand.
  [[nodiscard]] std::optional<std::uint64_t> frame() const;

  /// Those of the child that is at the frame at hand, as of ReconstructionState.
  std::optional<v1::IterationPreview> take(v1::ChildMessage&& message);
  void end(const ChildEnd& end, const std::string& last_words);

  /// Whether the frame at hand has its result.
  [[nodiscard]] bool has_result() const { return child_.status().state() == v1::ReconstructionStatus::DONE; }
  [[nodiscard]] double fraction() const;
  [[nodiscard]] std::string doing() const;
  [[nodiscard]] v1::ReconstructionStatus status() const;

 private:
  using State = v1::ReconstructionStatus::State;

  [[nodiscard]] bool is_sequence() const { return !frames_.empty(); }
  [[nodiscard]] State state() const;
  [[nodiscard]] std::size_t count(State state) const;
  [[nodiscard]] std::string error() const;

  v1::ReconstructionStatus begun_;
  std::vector<v1::SequenceFrame> frames_;
  std::string folder_;
  std::size_t begun_frames_ = 0;  ///< the last of these is at hand
  bool cancelled_ = false;
  bool given_up_ = false;
  ReconstructionState child_;
};

}  // namespace emberlock::daemon
