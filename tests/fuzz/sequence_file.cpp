// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <string>
#include <string_view>

#include "report/sequence_report.h"
#include "tests/fuzz/target.h"

// A sequence's frames.json, by which an interrupted one goes on.
FUZZ_TARGET(sequence_file) {
  using namespace emberlock;
  const auto told = report::parse_sequence({reinterpret_cast<const char*>(data), size}, "fuzz/frames.json");
  if (!told) {
    if (told.error().where.empty()) std::abort();
    return 0;
  }
  const std::string json = report::sequence_json(*told);
  const auto again = report::parse_sequence(json, "fuzz/frames.json");
  if (!again || report::sequence_json(*again) != json) std::abort();
  (void)report::sequence_html(*told, "fuzz");
  (void)report::sequence_csv(*told);
  return 0;
}
