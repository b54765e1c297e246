// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "base/result.h"
#include "daemon/engine/reasons.h"
#include "emberlock/v1/status.pb.h"

namespace emberlock::daemon {

// The daemon's states as a pure function: what was, and what happened or is asked for, give what is, and what
// to do. It has no clock, thread or device; engine/conductor.h carries out what it orders and tells it what
// came of that.
//
//             align                row time              aligned
//   IDLE ───────────► CALIBRATING ─────────► ALIGNING ───────────► LOCKED ─┐ a check found all in tolerance
//    ▲ ▲                  │ ▲                   │ ▲ a check found one out  │ │
//    │ └──── stop, refused, given up ───────────┘ └────────────────────────┴─┘
//    │                    │ └─ a camera came back                          │ record
//    │  all written       ▼ (any of them)                                  ▼
//    └──── FINISHING ◄── CAPTURING ◄───────────────────────────────────────┘
//
// FINISHING leads back to where the recording began. A reconstruction runs beside all of it. Cameras that
// would leave tolerance before long are reset in time: for the second or so that this takes it is ALIGNING,
// but no lock is lost.

enum class Lock { absent, held };

struct MachineState {
  v1::Phase phase = v1::IDLE;
  Reason reason = Why::nothing_asked;
  bool renews = false;       ///< of ALIGNING: nobody left tolerance, those that would have are being reset
  Lock lock = Lock::absent;  ///< of CAPTURING and FINISHING: whether it began locked
  std::string session;       ///< of CAPTURING and FINISHING
  bool reconstruct_after = false;  ///< the recording is handed on once it is finished
  std::string reconstructing;      ///< the session of the running reconstruction; empty: none runs
  std::vector<Fault> faults;       ///< by id; those that are over stay until acknowledged
  std::uint64_t next_fault = 1;
};

// What is asked for.
struct AskAlign {};
struct AskRenew {};  ///< of the lock, before a take that is longer than it holds
struct AskIdle {};   ///< to end the alignment, or to let go of the lock
struct AskRecord {
  std::string session;
  bool unlocked = false;  ///< even though the cameras aren't locked, or may not be for so long
  bool reconstruct = false;
  TakeLength length = {};
};
struct AskStopRecording {};
struct AskReconstruct {
  std::string session;
};
struct AskCancelReconstruction {};
struct AskAcknowledge {
  std::uint64_t fault = 0;  ///< 0: all that are over
};

// What happened.
struct RowTimeMeasured {};
struct RoundDone {
  v1::AlignmentStatus::Verdict verdict = v1::AlignmentStatus::VERDICT_UNSPECIFIED;
  Reason reason;
  bool renews = false;   ///< of GO_ON: nobody has left tolerance, those that would are being reset
  bool in_time = false;  ///< of GO_ON: that begins, and without `renews` nobody knows how long it takes
};
/// The alignment stopped for a reason that isn't its own: a device. It begins again once `Recovered`.
struct AlignmentBroken {
  Why why = Why::camera_away;
};
struct Recovered {};
/// The last check promised the lock until now, and none could be made since.
struct LockExpired {
  Why why = Why::may_have_drifted;
};
struct RecordingBegun {};
struct RecordingRefused {
  Error error;
};
/// It has to end: the disk, or no camera is left, or its time is over.
struct RecordingEnds {
  Reason reason;
};
struct RecordingFinished {
  Outcome outcome;
};
/// The recording that a camera replays is over.
struct CameraEnded {
  std::string id;
};
struct ReconstructionEnded {
  bool ok = false;  ///< done, or cancelled
  Reason reason;
};
struct FaultRaised {
  FaultKey key;
  v1::Light light = v1::RED;
  Reason reason;
};
struct FaultMended {
  FaultKey key;
};

using MachineEvent =
    std::variant<AskAlign, AskRenew, AskIdle, AskRecord, AskStopRecording, AskReconstruct,
                 AskCancelReconstruction, AskAcknowledge, RowTimeMeasured, RoundDone, AlignmentBroken,
                 Recovered, LockExpired, RecordingBegun, RecordingRefused, RecordingEnds, RecordingFinished,
                 CameraEnded, ReconstructionEnded, FaultRaised, FaultMended>;

enum class Action {
  begin_alignment,  ///< anew, from the row time on
  end_alignment,
  check_lock,  ///< film a round now
  begin_recording,
  finish_recording,
  begin_reconstruction,
  cancel_reconstruction,
};

struct MachineStep {
  MachineState state;
  std::vector<Action> actions;  ///< in this order
  std::vector<Remark> remarks;
  std::optional<MachineRefusal> refusal;  ///< of what was asked for; nothing has changed then
};

/// `utc` is when it happened (ISO 8601), for faults.
MachineStep step(const MachineState& state, const MachineEvent& event, const std::string& utc);

/// Of the whole: the worst fault that isn't over, else by phase.
v1::Light light(const MachineState& state);

}  // namespace emberlock::daemon
