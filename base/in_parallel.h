// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock {

/// Calls `part` for each number below `count`, on one thread per processor, the calling thread included. The
/// other threads get its priority. `observer` is told the overall progress, by one thread at a time. After a
/// failure no further part begins, and the parts that run are told to stop. Returns the first failure.
Status in_parallel(std::size_t count, const Observer& observer,
                   const std::function<Status(std::size_t number, const Observer& observer)>& part);

}  // namespace emberlock
