// SPDX-License-Identifier: Apache-2.0
#include "base/priority.h"

#include <sys/resource.h>
#include <unistd.h>

#include "base/log.h"

namespace emberlock {

void give_way() {
  constexpr int kLowest = 19;
  // On Linux each thread has its own priority, which also orders its disk accesses.
  if (::setpriority(PRIO_PROCESS, static_cast<id_t>(::gettid()), kLowest) != 0)
    log(LogCategory::base).warn("a thread that should give way runs at normal priority");
}

}  // namespace emberlock
