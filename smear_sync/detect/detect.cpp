// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/detect.h"

#include <fmt/format.h>

#include "smear_sync/detect/judge.h"
#include "smear_sync/detect/look.h"

namespace emberlock::smear {

SmearReading detect(const ImageView& frame, const DetectOptions& options) {
  if (const std::string why = detail::unreadable(frame); !why.empty()) return detail::nothing(why);
  const detail::Plane plane = detail::to_plane(frame);
  const detail::Look look = detail::whole_look(plane, options);
  return detail::read_lamps(plane, look.background, look.search, options);
}

}  // namespace emberlock::smear
