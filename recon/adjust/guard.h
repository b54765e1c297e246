// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <exception>
#include <limits>
#include <utility>

#include "base/result.h"

namespace emberlock::recon {

/// An iteration that its guard gave up. Of kind `not_converged`.
class Diverged : public std::exception {
 public:
  Diverged(double error, double best);
  [[nodiscard]] const Error& error() const { return error_; }
  [[nodiscard]] const char* what() const noexcept override { return error_.what.c_str(); }

 private:
  Error error_;
};

/// Watches an iteration's error and knows nothing of why it should fall. Where it rises beyond what the
/// iteration began with, or isn't a finite number, the steps are too long: the iteration goes back to its
/// best and takes shorter ones, a few times; then it has failed.
class Guard {
 public:
  enum class Finding {
    best,      ///< the lowest so far: worth keeping
    fair,      ///< not the lowest, but below the beginning
    diverged,  ///< go back to the best and halve the steps
  };
  static constexpr int kMostHalvings = 8;

  /// `black`: the error of a volume without light, which no result may exceed. What the iteration really
  /// begins with may be better: then the first error counts.
  explicit Guard(double black) : black_(black), start_(black) {}
  /// Throws Diverged where that happens once more than kMostHalvings times.
  Finding look(double error);
  /// Whether look() would have nothing against it.
  [[nodiscard]] bool allows(double error) const { return is_bearable(error, start_); }
  /// What the iteration went back to shows this error. Later ones may be as large: a look at several steps
  /// together sees less than what the first of them began with.
  void went_back_to(double error);
  /// What is minimised has changed, so that errors before say nothing of those to come: they are held
  /// against `black` once more. What was halved stays so, and counts on.
  void begin_anew();
  /// At most `start`, beyond rounding and what the order of subsets lets an error waver by.
  static bool is_bearable(double error, double start);
  [[nodiscard]] int halvings() const { return halvings_; }

 private:
  double black_;
  double start_;
  double best_ = std::numeric_limits<double>::infinity();
  int halvings_ = 0;
};

}  // namespace emberlock::recon
