// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace emberlock::smear {

/// The probability of a sequence of lit and unlit flashes of any origin: a hand in front of the lamp, a
/// torch, a burst, a code. Each flash is predicted from the flashes before it by several rules, which are
/// weighted by their success so far (a Bayesian mixture in which the best rule may change: fixed share,
/// Herbster and Warmuth 1998). The rules: the flash depends on the one before (Markov chain, learnt during
/// the sequence); runs have the same lengths as earlier ones; the flash repeats the one `d` flashes ago, for
/// each given d. So a repetition has a probability close to 1 and is no evidence: another turn of a periodic
/// pattern proves nothing.
class PatternModel {
 public:
  /// `lags`: the values of d, each >= 1.
  explicit PatternModel(std::vector<std::size_t> lags);

  /// The log-probability of the observation of the next flash, given all before. The arguments are the
  /// likelihoods (> 0) of the observation if the flash was lit, and if it wasn't; equal values mean that
  /// nothing was observed.
  double next(double if_lit, double if_unlit);

 private:
  static constexpr int kLongestRun = 64;
  enum Bit : signed char { unlit = 0, lit = 1, unknown = -1 };

  [[nodiscard]] double markov() const;
  [[nodiscard]] double renewal(double markov) const;
  void learn(double chance);

  struct Counts {
    double went_on = 0, changed = 0;
  };
  std::array<Counts, 2> after_{};                          ///< by the state before
  std::array<std::array<Counts, kLongestRun>, 2> runs_{};  ///< and by the length of its run
  Bit last_ = unknown;
  int run_ = 0;               ///< length of the current run; 0: its beginning wasn't observed
  std::vector<double> past_;  ///< probability that each flash was lit; negative: not observed
  std::vector<std::size_t> lags_;
  std::vector<double> prior_, weights_;  ///< by rule: Markov, runs, one per lag
  std::vector<double> chances_;          ///< probability of a lit flash, by rule
};

}  // namespace emberlock::smear
