// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

namespace emberlock::cli {

/// Which of a progress' reports become lines where nothing can be drawn in place.
class ProgressLines {
 public:
  /// Whether the report is due: a new tenth, and a second since the last line of any progress. `now` is in
  /// seconds; `last_line`, shared by all, is when it was.
  bool due(double fraction, double now, std::optional<double>& last_line) {
    const int tenth = static_cast<int>(fraction * 10);
    if (tenth == tenth_shown_ || (last_line && now - *last_line < 1)) return false;
    tenth_shown_ = tenth;
    last_line = now;
    return true;
  }

 private:
  int tenth_shown_ = -1;
};

}  // namespace emberlock::cli
