// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "smear_sync/align/align.h"

namespace emberlock::smear {

/// AlignWords::dial: what is said to whoever sets the strobe by its dial, or what was seen of it. Empty where
/// the decision has no advice, or the strobe no dial.
std::string dial_words(const AlignDecision& decision, const std::vector<AlignCamera>& cameras,
                       const AlignOptions& options);

}  // namespace emberlock::smear
