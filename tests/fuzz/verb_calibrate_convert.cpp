// SPDX-License-Identifier: Apache-2.0
#include "tests/support/fuzz_verbs.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  return emberlock::test::fuzz_calibrate_convert(data, size);
}
