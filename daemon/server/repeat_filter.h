// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <optional>
#include <string>
#include <utility>

#include "base/quantity.h"
#include "base/time_point.h"

namespace emberlock::daemon {

/// Lets a message of each kind pass once in kApart: a host whose handshake fails tries again twice a second,
/// for hours. Thread-safe.
class RepeatFilter {
 public:
  static constexpr Seconds kApart{60};

  /// How many of this kind were held back since the last one that passed; nullopt: this one is held back too.
  /// A kind is a place in a program: its file and line.
  std::optional<std::uint64_t> pass(const std::string& file, int line, TimePoint now);

 private:
  struct Kind {
    TimePoint passed;
    std::uint64_t held_back = 0;
  };
  std::mutex mutex_;
  std::map<std::pair<std::string, int>, Kind> kinds_;
};

}  // namespace emberlock::daemon
