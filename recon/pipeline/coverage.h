// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "recon/preprocess/view.h"

namespace emberlock::recon {

/// Why the error that will be reported may say little about the volume, in sentences for the user; none when
/// all is well. Looks at how many input views there are, how far apart they stand as seen from the box,
/// opposite views counting as one (they see the same silhouette), and whether a view is held out.
std::vector<std::string> coverage_warnings(const Scene& scene);

}  // namespace emberlock::recon
