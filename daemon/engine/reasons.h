// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "emberlock/v1/status.pb.h"

// Why the machine is as it is, what is wrong, what it tells and what it refuses: codes with the numbers and
// names that they need. words.h alone makes sentences of them.
namespace emberlock::daemon {

/// Reasons that need no number.
enum class Why {
  nothing_asked,
  measuring_row_time,
  filming_strobe,
  stopped,  ///< by the operator
  cancelled,
  devices_back,
  checking_lock,  ///< after a recording
  renewing_lock,  ///< as somebody asked for
  replay_over,
  shutting_down,
  // The alignment waits for a device:
  camera_away,
  strobe_away,
  camera_was_away,  ///< while it was recorded
  // Nobody knows whether the lock still holds:
  phase_unknown,     ///< a camera went away, and came back with another phase or will
  may_have_drifted,  ///< and no check could be made
  // What devices say:
  camera_lost,
  camera_hangs,
  no_camera_left,
  leader_gone,  ///< nothing was heard of the host that leads for too long
  last = leader_gone,
};

/// A camera that doesn't film.
struct SilentCamera {
  std::string id;
  v1::CameraStatus::State state = v1::CameraStatus::LOST;
};

struct RecordingOf {
  std::string session;
};
struct ReconstructionOf {
  std::string session;
};
/// What the alignment says of its last round.
struct AlignmentSays {
  std::string text;
  std::string remedy = {};  ///< of a run that is refused or given up
};
struct TimeOver {
  Seconds length;
};
struct NoFrames {
  Seconds silence;
  std::vector<SilentCamera> cameras;  ///< empty: some film
};
struct DiskRefused {
  Error error;
  bool retried = false;  ///< the recording goes on
};
/// What became of a recording.
struct Outcome {
  enum class Code {
    whole,       ///< the counts of camera, queue and file agree, and the disk took all
    incomplete,  ///< they don't, or it didn't
    nothing,     ///< not one frame came from any camera
  };
  Code code = Code::incomplete;
  std::string verdict = {};                ///< the recorder's, of `whole` and `incomplete`
  std::vector<SilentCamera> cameras = {};  ///< of `nothing`, where none films
};
struct ClockMoved {
  Seconds by;
};
/// On the disk, for recording.
struct RoomLeft {
  Seconds time;
};
/// More work than a part of the machine does in time.
enum class Bottleneck {
  processor,
  disk,
  bus,  ///< the cameras', or their network
  last = bus,
};
struct Overload {
  Bottleneck what = Bottleneck::processor;
  std::uint64_t lost = 0;  ///< frames, within `span`
  std::uint64_t made = 0;  ///< by all cameras, within `span`
  Seconds span;
};
struct ReconstructionDone {
  std::string result;  ///< its folder
};
/// What the process that reconstructs says of its failure.
struct ReconstructionFailed {
  std::string text;
};

/// Another host's part of a recording.
struct HostPartIs {
  v1::HostPart part;
};

using Reason = std::variant<Why, Error, RecordingOf, ReconstructionOf, AlignmentSays, TimeOver, NoFrames,
                            DiskRefused, Outcome, ClockMoved, RoomLeft, Overload, ReconstructionDone,
                            ReconstructionFailed, HostPartIs>;

/// Who a fault concerns: by these it is raised once, and mended.
struct FaultKey {
  v1::Fault::Kind kind = v1::Fault::KIND_UNSPECIFIED;
  std::string subject = {};  ///< a camera, the strobe, a session; empty: the whole
};

struct Fault {
  std::uint64_t id = 0;
  FaultKey key;
  v1::Light light = v1::RED;
  Reason reason;
  std::string since_utc;
  bool over = false;
};

/// A line for the journal.
struct Remark {
  enum class Code {
    recording,
    recording_ends,
    recorded,       ///< here, or another host's part
    not_handed_on,  ///< for reconstruction
    replay_over,    ///< of a camera
    flashes_show,   ///< in the recording: nobody but an operator can switch the strobe off
    locked,
    aligning_in_time,  ///< before the lock is lost
    reconstructing,
    reconstruction_ended,
    compressed,
    not_compressed,  ///< cancelled
    not_salvaged,
    fault,
    fault_over,
    last = fault_over,
  };
  v1::Light light = v1::GREEN;
  Code code = Code::recording;
  std::string subject = {};  ///< a session, a camera, what a fault concerns
  Reason reason = {};
  v1::Fault::Kind kind = v1::Fault::KIND_UNSPECIFIED;  ///< of `fault` and `fault_over`
};

/// How long a take may be.
struct TakeLength {
  Seconds asked{0};                     ///< 0: until it is stopped
  std::optional<Seconds> sure = {};     ///< for which the lock holds; absent: no end is seen
  std::optional<Seconds> renewed = {};  ///< what that would be if cameras were reset now, where known
  [[nodiscard]] bool too_long() const { return sure && (asked > *sure || *sure <= Seconds(0)); }
};

/// Why something that was asked for isn't done.
struct MachineRefusal {
  enum class Code {
    recording_runs,
    is_recorded,  ///< `session`
    renewing_lock,
    aligning,
    not_locked,
    nothing_recorded,
    is_reconstructed,  ///< `session`
    nothing_reconstructed,
    no_such_fault,
    take_too_long,  ///< `take`
    last = take_too_long,
  };
  Code code = Code::recording_runs;
  std::string session = {};
  std::uint64_t fault = 0;  ///< of `no_such_fault`
  TakeLength take = {};
};

}  // namespace emberlock::daemon
