// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <limits>
#include <utility>

#include "base/result.h"

namespace emberlock::recon {

/// Thrown when the guard gives up an iteration; of kind `not_converged`.
class Diverged : public std::exception {
 public:
  Diverged(double error, double best);
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.what.c_str(); }

 private:
  Error error_;
};

/// Checks an iteration's error, independently of any proof that it falls. If the error rises above its
/// initial value, or isn't finite, the steps are too long: the iteration returns to its best state and halves
/// its steps. After a limited number of these it fails.
class Guard {
 public:
  enum class Finding {
    best,      ///< the lowest so far: save this state
    fair,      ///< not the lowest, but below the initial value
    diverged,  ///< return to the best state and halve the steps
  };
  static constexpr int kMostHalvings = 8;

  /// `black`: the error of a volume without light, which no result may exceed. If the iteration starts with a
  /// smaller error, that one is the limit.
  explicit Guard(double black) : black_(black), start_(black) {}
  /// Throws Diverged when it would be the (kMostHalvings + 1)-th return.
  Finding look(double error);
  /// Whether look() would accept this error.
  [[nodiscard]] bool allows(double error) const { return is_bearable(error, start_); }
  /// Sets the error of the state to which the iteration returned. Later errors may be as large: a check after
  /// several steps may not see the error that the first of them began with.
  void went_back_to(double error);
  /// The objective has changed, so earlier errors aren't comparable: the limit is `black` again. Halvings
  /// still count.
  void begin_anew();
  /// error <= `start`, with tolerance for rounding and for fluctuations due to the order of subsets.
  static bool is_bearable(double error, double start);
  [[nodiscard]] int halvings() const { return halvings_; }
  /// The lowest error that look() was shown; infinite before the first.
  [[nodiscard]] double best() const { return best_; }

 private:
  double black_;
  double start_;
  double best_ = std::numeric_limits<double>::infinity();
  int halvings_ = 0;
};

}  // namespace emberlock::recon
