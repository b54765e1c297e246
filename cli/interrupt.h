// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

namespace emberlock::cli {

/// While it exists, the first Ctrl-C only sets a flag, so that a run can end properly; the second one kills.
/// Only one at a time.
class Interrupt {
 public:
  Interrupt() {
    asked_ = 0;
    struct sigaction action {};
    action.sa_handler = [](int) { asked_ = 1; };
    action.sa_flags = static_cast<int>(SA_RESETHAND);
    ::sigaction(SIGINT, &action, &before_);
  }
  ~Interrupt() {
    ::sigaction(SIGINT, &before_, nullptr);
    asked_ = 0;
  }
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Also false when no Interrupt exists.
  [[nodiscard]] static bool asked() { return asked_ != 0; }

 private:
  static inline volatile std::sig_atomic_t asked_ = 0;
  struct sigaction before_ {};
};

}  // namespace emberlock::cli
