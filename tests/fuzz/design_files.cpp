// SPDX-License-Identifier: Apache-2.0
#include "cli/design_files.h"

#include <cmath>
#include <cstdlib>
#include <string_view>

#include "tests/fuzz/target.h"

// What other machines' `bench` and earlier designs left, from which `design` goes on.
FUZZ_TARGET(design_files) {
  using namespace emberlock;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto bench = cli::parse_bench_file(text, "fuzz/bench.json");
  if (bench ? !std::isfinite(bench->frame.value()) || !(bench->frame > Seconds(0))
            : bench.error().where.empty())
    std::abort();
  const auto law = cli::parse_error_law(text, "fuzz/report.json");
  if (!law) return 0;
  const evaluate::TwinRig rig{evaluate::even_planes(3), 0.01, 1, 0.01, 0.01};
  if (!(evaluate::total(evaluate::predict(*law, rig)) >= 0)) std::abort();
  return 0;
}
