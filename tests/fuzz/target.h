// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

// All fuzz targets are one program, so that the daemon and the verbs are linked once. The name by which it is
// started chooses the target: bin/fuzz_NAME is a link to bin/fuzz. So libFuzzer's own child processes keep
// the choice.
namespace emberlock::fuzz {

using Run = int (*)(const std::uint8_t* data, std::size_t size);

/// A target under its name.
struct Target {
  Target(const char* name, Run run);
};

}  // namespace emberlock::fuzz

/// Defines tests/fuzz/NAME.cpp's target: a function of the input's `data` and `size` that returns 0, and
/// aborts where something doesn't hold.
#define FUZZ_TARGET(name)                                                  \
  static int fuzz_##name(const std::uint8_t* data, std::size_t size);      \
  static const emberlock::fuzz::Target target_##name(#name, &fuzz_##name); \
  static int fuzz_##name(const std::uint8_t* data, std::size_t size)
