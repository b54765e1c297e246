// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <string_view>

#include "session/index.h"
#include "tests/fuzz/target.h"

// Any bytes parse or are refused, and what was parsed encodes to records that parse again.
FUZZ_TARGET(session_index) {
  const auto parsed = emberlock::session::parse_index({reinterpret_cast<const char*>(data), size}, "input");
  if (!parsed.ok()) return 0;
  std::string again = emberlock::session::encode_index_header();
  for (const emberlock::session::IndexRecord& record : parsed->records) {
    const auto bytes = emberlock::session::encode(record);
    again.append(bytes.data(), bytes.size());
  }
  const auto twice = emberlock::session::parse_index(again, "input");
  if (!twice.ok() || twice->records != parsed->records) std::abort();
  return 0;
}
