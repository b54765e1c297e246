// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace emberlock::smear {

/// How probable a row of lit and unlit flashes is, whoever made it: a hand before the lamp, a torch, a burst,
/// a code. Each flash is predicted from those before it by several rules at once, which count by how well
/// they did so far (a Bayesian mixture whose rule may change on the way: fixed share, Herbster and Warmuth
/// 1998): that it is lit as often after its like as before (Markov, learnt on the way); that its run lasts as
/// long as runs did before; that it repeats what was `d` flashes ago, for each d given. So what repeats costs
/// next to nothing the second time, and proves nothing: one more turn of a periodic pattern is no evidence.
class PatternModel {
 public:
  /// `lags`: the d, each >= 1.
  explicit PatternModel(std::vector<std::size_t> lags);

  /// The log of the probability of what was seen of the next flash, given all before: of likelihoods > 0 of
  /// what was seen, were it lit and were it not. Equal ones are a flash of which nothing was seen.
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
  std::array<Counts, 2> after_{};                          ///< by what went before
  std::array<std::array<Counts, kLongestRun>, 2> runs_{};  ///< and by how long it had lasted
  Bit last_ = unknown;
  int run_ = 0;               ///< how long it has lasted; 0: its beginning wasn't seen
  std::vector<double> past_;  ///< that each flash was lit; negative: nothing was seen of it
  std::vector<std::size_t> lags_;
  std::vector<double> prior_, weights_;  ///< Markov, runs, copies by lag
  std::vector<double> chances_;          ///< that the flash is lit, by rule
};

}  // namespace emberlock::smear
