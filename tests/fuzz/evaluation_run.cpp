// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <string>
#include <string_view>

#include "evaluate/paper/run_file.h"
#include "tests/fuzz/target.h"

// A run.json, by which an interrupted `evaluate paper` goes on.
FUZZ_TARGET(evaluation_run) {
  using namespace emberlock;
  const auto run = evaluate::parse_run({reinterpret_cast<const char*>(data), size}, "fuzz", "fuzz/run.json");
  if (!run) {
    if (run.error().where.empty()) std::abort();
    return 0;
  }
  const std::string json = evaluate::run_json(*run, "fuzz");
  const auto again = evaluate::parse_run(json, "fuzz", "fuzz/run.json");
  if (!again || evaluate::run_json(*again, "fuzz") != json) std::abort();
  (void)evaluate::folder_name(*run);
  return 0;
}
