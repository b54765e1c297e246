// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <string_view>

#include "recon/batch/plan.h"
#include "recon/batch/pulse.h"
#include "tests/fuzz/target.h"

// What a batch's folder says of its plan and its workers, by which other ranks and later runs go on.
FUZZ_TARGET(batch_plan) {
  using namespace emberlock;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto worker = recon::parse_worker(text, "fuzz/worker")) {
    const auto again = recon::parse_worker(recon::to_json(*worker), "fuzz/worker");
    if (!again || again->name() != worker->name()) std::abort();
  }
  const auto plan = recon::parse_plan(text, "fuzz/plan.json");
  if (!plan) {
    if (plan.error().where.empty()) std::abort();
    return 0;
  }
  if (!recon::same_run(*plan, *plan, "fuzz").ok() || recon::chunks_of(*plan).empty()) std::abort();
  const auto again = recon::parse_plan(recon::to_json(*plan), "fuzz/plan.json");
  if (!again || recon::to_json(*again) != recon::to_json(*plan)) std::abort();
  return 0;
}
