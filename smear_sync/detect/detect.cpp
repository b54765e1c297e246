// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/detect.h"

#include <fmt/format.h>

#include "smear_sync/detect/classify.h"
#include "smear_sync/detect/frame_scan.h"

namespace emberlock::smear {

SmearReading detect(const ImageView& frame, const DetectOptions& options) {
  if (const std::string why = detail::unreadable(frame); !why.empty()) return detail::nothing(why);
  const detail::Plane plane = detail::to_plane(frame);
  const detail::FrameScan scan = detail::scan_frame(plane, options);
  return detail::read_lamps(plane, scan.background, scan.search, options);
}

}  // namespace emberlock::smear
