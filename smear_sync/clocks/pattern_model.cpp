// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/pattern_model.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace emberlock::smear {
namespace {

constexpr double kMarkov =
    0.6;  // initial weight, as a share of what the copies leave; the rest is for the run lengths
constexpr double kCopy = 1e-3;         // initial weight of each copy
constexpr double kAllCopies = 0.3;     // largest total of these
constexpr double kShare = 0.02;        // share of each rule's weight that is redistributed at each flash
constexpr double kCopySlip = 0.02;     // probability that a copy fails
constexpr double kSureOf = 0.75;       // a flash counts as lit (or unlit) above this probability
constexpr double kFewCounts = 0.5;     // of Krichevsky and Trofimov
constexpr std::size_t kFirstCopy = 2;  // index of the rule

}  // namespace

PatternModel::PatternModel(std::vector<std::size_t> lags) : lags_(std::move(lags)) {
  const double copy = std::min(kCopy, kAllCopies / static_cast<double>(lags_.size() + 1));
  prior_.assign(kFirstCopy + lags_.size(), copy);
  const double others = 1 - copy * static_cast<double>(lags_.size());
  prior_[0] = others * kMarkov;
  prior_[1] = others * (1 - kMarkov);
  weights_ = prior_;
  chances_.resize(prior_.size());
}

double PatternModel::markov() const {
  if (last_ == unknown) return 0.5;
  const Counts& counts = after_[static_cast<std::size_t>(last_)];
  const double change = (counts.changed + kFewCounts) / (counts.changed + counts.went_on + 2 * kFewCounts);
  return last_ == lit ? 1 - change : change;
}

double PatternModel::renewal(double markov) const {
  if (last_ == unknown || run_ == 0) return markov;
  const Counts& counts =
      runs_[static_cast<std::size_t>(last_)][static_cast<std::size_t>(std::min(run_, kLongestRun) - 1)];
  const double change_markov = last_ == lit ? 1 - markov : markov;
  const double change = (counts.changed + change_markov) / (counts.changed + counts.went_on + 1);
  return last_ == lit ? 1 - change : change;
}

double PatternModel::next(double if_lit, double if_unlit) {
  if (if_lit == if_unlit) {
    learn(-1);
    return std::log(if_lit);
  }
  const double by_markov = markov();
  chances_[0] = by_markov;
  chances_[1] = renewal(by_markov);
  // A copy of an unobserved flash predicts no better than the others.
  const std::size_t seen = past_.size();
  for (std::size_t rule = kFirstCopy; rule < chances_.size(); ++rule) {
    const std::size_t lag = lags_[rule - kFirstCopy];
    const double original = lag <= seen ? past_[seen - lag] : -1;
    chances_[rule] = original < 0 ? by_markov : kCopySlip + (1 - 2 * kCopySlip) * original;
  }
  double sum = 0;
  double of_lit = 0;
  for (std::size_t rule = 0; rule < weights_.size(); ++rule) {
    const double when_lit = weights_[rule] * chances_[rule] * if_lit;
    const double when_unlit = weights_[rule] * (1 - chances_[rule]) * if_unlit;
    weights_[rule] = when_lit + when_unlit;
    of_lit += when_lit;
    sum += weights_[rule];
  }
  for (std::size_t rule = 0; rule < weights_.size(); ++rule)
    weights_[rule] = (1 - kShare) * weights_[rule] / sum + kShare * prior_[rule];
  learn(of_lit / sum);
  return std::log(sum);
}

void PatternModel::learn(double chance) {
  past_.push_back(chance);
  const Bit bit = chance > kSureOf ? lit : chance >= 0 && chance < 1 - kSureOf ? unlit : unknown;
  if (bit == unknown) {
    run_ = 0;
    return;
  }
  if (last_ != unknown) {
    const bool same = bit == last_;
    Counts& counts = after_[static_cast<std::size_t>(last_)];
    (same ? counts.went_on : counts.changed) += 1;
    if (run_ > 0) {
      Counts& of_run =
          runs_[static_cast<std::size_t>(last_)][static_cast<std::size_t>(std::min(run_, kLongestRun) - 1)];
      (same ? of_run.went_on : of_run.changed) += 1;
    }
    run_ = !same ? 1 : run_ > 0 ? run_ + 1 : 0;
  }
  last_ = bit;
}

}  // namespace emberlock::smear
