// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace emberlock {

/// Gives this thread the lowest priority for processor and disk: for background work while something is
/// recorded. Permanent, since an unprivileged thread can't raise its priority again.
void give_way();

}  // namespace emberlock
