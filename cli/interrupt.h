// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <chrono>
#include <csignal>

namespace emberlock::cli {

/// While it exists, the first Ctrl-C only sets a flag, so that a run can end properly; another one, more than
/// a second later, kills. What starts a program may hand on the same Ctrl-C (`timeout` and npm do): within
/// the second it counts once. Only one at a time.
class Interrupt {
 public:
  enum class Heeds {
    ctrl_c,           ///< SIGINT
    termination_too,  ///< and SIGTERM, by which mpirun and Slurm end what they started
  };
  using Clock = std::chrono::steady_clock;
  using Now = Clock::time_point (*)();  ///< clock_gettime or less: a signal's handler calls it
  explicit Interrupt(Heeds heeds = Heeds::ctrl_c, Now now = Clock::now) : heeds_(heeds) {
    asked_at_ = 0;
    now_ = now;
    struct sigaction action {};
    action.sa_handler = ask;
    ::sigaction(SIGINT, &action, &before_);
    if (heeds_ == Heeds::termination_too) ::sigaction(SIGTERM, &action, &before_termination_);
  }
  ~Interrupt() {
    ::sigaction(SIGINT, &before_, nullptr);
    if (heeds_ == Heeds::termination_too) ::sigaction(SIGTERM, &before_termination_, nullptr);
    asked_at_ = 0;
  }
  Interrupt(const Interrupt&) = delete;
  Interrupt& operator=(const Interrupt&) = delete;

  /// Also false when no Interrupt exists.
  [[nodiscard]] static bool asked() { return asked_at_ != 0; }

 private:
  static void ask(int signal) {
    const Clock::rep now = now_.load()().time_since_epoch().count();
    Clock::rep first = 0;
    if (asked_at_.compare_exchange_strong(first, now) ||
        Clock::duration(now - first) <= std::chrono::seconds(1))
      return;
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }

  static inline std::atomic<Clock::rep> asked_at_ = 0;
  static inline std::atomic<Now> now_ = Clock::now;
  static_assert(decltype(asked_at_)::is_always_lock_free && decltype(now_)::is_always_lock_free,
                "a signal's handler uses both");
  Heeds heeds_;
  struct sigaction before_ {
  }, before_termination_{};
};

}  // namespace emberlock::cli
