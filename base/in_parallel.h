// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <functional>

#include "base/progress.h"
#include "base/result.h"

namespace emberlock {

/// Does `part` for each number below `count`, on as many threads as the machine has processors, this one
/// among them; the others have its priority. `observer` is told of all of it, by one thread at a time. After
/// a failure no part is begun and those under way are ended: the first failure is the answer.
Status in_parallel(std::size_t count, const Observer& observer,
                   const std::function<Status(std::size_t number, const Observer& observer)>& part);

}  // namespace emberlock
