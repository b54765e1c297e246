// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>

#include "recon/preprocess/colour_readings.h"
#include "tests/fuzz/target.h"

/// Whatever a colour.json holds: an error that says where and what to do, or rectangles with extent.
FUZZ_TARGET(colour_plan) {
  using namespace emberlock;
  const auto plan = recon::parse_colour_plan({reinterpret_cast<const char*>(data), size}, "fuzz/colour.json");
  if (!plan) {
    if (plan.error().where.empty() || plan.error().remedy.empty()) std::abort();
    return 0;
  }
  for (const auto* owners : {&plan->patches, &plan->pictures})
    for (const auto& [owner, places] : *owners)
      for (const auto& [patch, place] : places)
        if (place.x < 0 || place.y < 0 || place.width < 1 || place.height < 1) std::abort();
  return 0;
}
