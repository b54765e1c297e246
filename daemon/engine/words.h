// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "base/strobe_dial.h"
#include "daemon/engine/reasons.h"
#include "daemon/live/reasons.h"
#include "emberlock/v1/status.pb.h"

// All sentences that the engine says, made from its codes and numbers. Pure.
namespace emberlock::daemon {

/// As the status and the journal show it.
std::string words(const Reason& reason);
/// "left went away, right doesn't answer"
std::string words(const std::vector<SilentCamera>& cameras);
std::string words(const Remark& remark);
/// Of kind `refused`, with what to do instead.
Error words(const MachineRefusal& refusal);

/// Of a fault: what is wrong, and what to do about it.
std::string words(v1::Fault::Kind kind, const Reason& reason);
std::string remedy(v1::Fault::Kind kind, const Reason& reason);
/// What to do, and with what.
std::string remedy(const Fault& fault);
v1::Fault to_proto(const Fault& fault);

/// What the operator does now.
enum class NextStep {
  align,
  record,
  stop_recording,
  press_shutter,  ///< of `camera`
  last = press_shutter,
};
std::string words(NextStep step, const std::string& camera = {});
/// Of recording from now on, or on: how long that is sure to be worth it.
struct LockLeft {
  std::optional<Seconds> sure;    ///< absent: no end is seen
  std::optional<Seconds> likely;  ///< likewise
  std::string leaves_first;       ///< the camera
};
std::string words(NextStep step, const LockLeft& left);

/// Why a camera's light is what it is.
std::string words(v1::CameraStatus::State state);
/// Of one whose frames were lost lately, or don't come as often as they were asked for.
struct FramesMissed {
  std::uint64_t lost = 0;
  Seconds span;
};
std::string words(const FramesMissed& missed);
struct RateOff {
  Hertz comes, asked;
};
std::string words(const RateOff& rate);
/// Of a strobe that somebody sets by hand, before the frames tell of it; without a rate while nothing is
/// aligned.
std::string words(const StrobeDial& dial, std::optional<Hertz> rate);
/// Of live volumes: why they pause, ended or don't keep up; nothing where all is well.
std::string words(const LiveReason& reason);
/// The same for the journal, of what goes on without them.
std::string live_notice(const std::string& why);
/// Of a rig without calibration, of which they can't be made.
Error not_calibrated(const std::string& camera);
/// What of a session was saved, for the journal.
std::string words(const std::string& session, const v1::SalvageReport& report);

}  // namespace emberlock::daemon
