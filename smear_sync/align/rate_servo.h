// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "base/quantity.h"
#include "base/shutter.h"
#include "smear_sync/align/phase_track.h"

namespace emberlock::smear {

// The servo of one camera's frame rate: a sample in, an adjustment and a state out, as linuxptp's servos
// have it. What needs memory (the phase, the rate, trims under way) is PhaseTrack's, so a step is a function
// of its sample.

struct ServoSample {
  /// tau of the target less the camera's, at the instant at which an order of now comes into force: what is
  /// still to go.
  Seconds error;
  Seconds sigma;            ///< standard error of that
  PartsPerMillion holding;  ///< the trim at which the camera keeps its distance to the target
};

enum class ServoState {
  slewing,   ///< at full rate, further than the next step reaches
  settling,  ///< the next step arrives
  locked,    ///< there, but for what the noise makes it seem to be off
};

std::string_view name(ServoState state);

struct ServoStep {
  PartsPerMillion trim;  ///< a multiple of the step, within the range
  ServoState state = ServoState::slewing;
};

/// Full rate while the target is out of reach of one step of `interval`; then just what arrives; then, while
/// the error is within its noise, a quarter of that, so that the noise isn't followed.
ServoStep rate_servo(const ServoSample& sample, const FrameRateTrim& camera, Seconds interval);

}  // namespace emberlock::smear
