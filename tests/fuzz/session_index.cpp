#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "session/index.h"

// Any bytes parse or are refused, and what was parsed encodes to records that parse again.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto parsed = emberlock::parse_index({reinterpret_cast<const char*>(data), size}, "input");
  if (!parsed.ok()) return 0;
  std::string again = emberlock::encode_index_header();
  for (const emberlock::IndexRecord& record : parsed->records) {
    const auto bytes = emberlock::encode(record);
    again.append(bytes.data(), bytes.size());
  }
  const auto twice = emberlock::parse_index(again, "input");
  if (!twice.ok() || twice->records != parsed->records) std::abort();
  return 0;
}
