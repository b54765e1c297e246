// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "base/time_point.h"

namespace emberlock {

/// An instant of the wall clock, also before 1970, as ISO 8601 text in UTC with milliseconds:
/// "2026-11-22T02:50:00.123Z".
std::string utc_text(TimePoint wall_clock);

}  // namespace emberlock
