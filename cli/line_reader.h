// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "base/quantity.h"

namespace emberlock::cli {

/// Lines that arrive on a descriptor, as far as they are there: never waits but when told to.
class LineReader {
 public:
  /// `fd` stays open and belongs to the caller.
  explicit LineReader(int fd) : fd_(fd) {}

  /// The lines that were finished since the last call, without empty ones; the last one may lack its end
  /// where the input ends. One of more than 64 MiB ends the input.
  std::vector<std::string> take();
  /// Until something arrives, the input ends, or so long.
  void wait(Seconds longest) const;
  /// Whether nothing comes any more, and all was taken.
  [[nodiscard]] bool ended() const { return ended_; }

 private:
  int fd_;
  bool ended_ = false;
  std::string begun_;  // a line
};

}  // namespace emberlock::cli
