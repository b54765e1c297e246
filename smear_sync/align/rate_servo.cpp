// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/align/rate_servo.h"

#include <algorithm>
#include <cmath>

#include "base/one_to_one.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<ServoState, std::string_view, 3> kServoNames{
    {{{ServoState::slewing, "slewing"}, {ServoState::settling, "settling"}, {ServoState::locked, "locked"}}}};

constexpr double kWithinNoise = 2;    // standard errors
constexpr double kLockedGain = 0.25;  // of the error, in one interval

PartsPerMillion rounded(double ppm, const FrameRateTrim& camera) {
  const double step = camera.step.value();
  const double most = std::floor(camera.range.value() / step + 1e-9);
  return PartsPerMillion(std::clamp(std::round(ppm / step), -most, most) * step);
}

}  // namespace

std::string_view name(ServoState state) { return kServoNames.second_of(state).value_or("unknown"); }

ServoStep rate_servo(const ServoSample& sample, const FrameRateTrim& camera, Seconds interval) {
  const double arriving = sample.error / interval * 1e6;
  const double wanted = sample.holding.value() + arriving;
  if (std::abs(wanted) > camera.range.value()) return {rounded(wanted, camera), ServoState::slewing};
  if (abs(sample.error) > kWithinNoise * sample.sigma) return {rounded(wanted, camera), ServoState::settling};
  return {rounded(sample.holding.value() + kLockedGain * arriving, camera), ServoState::locked};
}

}  // namespace emberlock::smear
