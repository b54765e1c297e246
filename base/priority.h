// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace emberlock {

/// From now on this thread gets what processor and disk the others leave: for work that may take its time
/// while something is recorded. For good: a thread that isn't privileged can't take it back.
void give_way();

}  // namespace emberlock
