// SPDX-License-Identifier: Apache-2.0
#include "rig/recording_rate.h"

#include "session/index.h"

namespace emberlock::rig {

double bytes_per_second(std::span<const drivers::CameraInfo> cameras, session::Encoding encoding) {
  constexpr double kContainer = 64;      // bytes that NUT and Matroska add per frame
  constexpr double kNoiseInFfv1 = 1.25;  // the maximum in the tests
  double sum = 0;
  for (const drivers::CameraInfo& camera : cameras) {
    const double pixels =
        static_cast<double>(camera.layout.row_bytes()) * static_cast<double>(camera.layout.size.height);
    const double frame = pixels * (encoding == session::Encoding::ffv1 ? kNoiseInFfv1 : 1) + kContainer +
                         session::kIndexRecordBytes;
    sum += frame * camera.frame_rate.value();
  }
  return sum;
}

}  // namespace emberlock::rig
