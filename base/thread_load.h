// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "base/quantity.h"

namespace emberlock {

/// What a thread has had of the processors since it began.
struct ThreadLoad {
  Seconds ran;
  Seconds waited;  ///< ready to run, while others had them; zero where the kernel doesn't tell
};

/// The calling thread's id in this process.
int thread_id();

/// Of a thread of this process, by its id; absent once it has ended.
std::optional<ThreadLoad> thread_load(int id);

}  // namespace emberlock
