// SPDX-License-Identifier: Apache-2.0
#include "rig/align/stagger.h"

#include <cmath>
#include <string>

#include "smear_sync/align/stagger.h"

namespace emberlock::rig {
namespace {

/// Cameras whose nominal rates differ by more can't be held in step by resets.
constexpr double kSameRate = 500e-6;

}  // namespace

Result<Seconds> common_period(const std::vector<drivers::Camera*>& cameras) {
  if (cameras.empty())
    return Error{ErrorKind::bad_input, "there is no camera", "align", "connect at least two"};
  const Hertz rate = cameras.front()->info().frame_rate;
  for (const drivers::Camera* camera : cameras) {
    const Hertz own = camera->info().frame_rate;
    if (std::abs(own / rate - 1) <= kSameRate) continue;
    return Error{ErrorKind::bad_input,
                 "films at " + std::to_string(own.value()) + " frames/s, the first camera at " +
                     std::to_string(rate.value()),
                 "camera " + camera->info().id, "set all cameras to one frame rate"};
  }
  return period(rate);
}

Result<std::vector<Seconds>> stagger(const std::vector<drivers::Camera*>& cameras) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Seconds period, common_period(cameras));
  EMBERLOCK_RETURN_IF_ERROR(smear::check_stagger(cameras.size(), period, Seconds(0)));
  return smear::staggered_offsets(cameras.size(), period);
}

}  // namespace emberlock::rig
