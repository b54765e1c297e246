// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/unmixing.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Dense>

namespace emberlock::recon {
namespace {

constexpr double kSeen = 9;      // chi-square by which an emitter must lower it: three sigma
constexpr double kTwoSigma = 4;  // chi-square
constexpr int kWalk = 64;        // temperatures, evenly in 1 / T, on the way to a mixture's bounds
constexpr int kHalvings = 24;
constexpr Kelvin kColdestBesideLines{1000}, kHottestBesideLines{3000};
constexpr double kSingular = 1e-10;
constexpr int kMostEmitters = 1 + static_cast<int>(kMostLines);
constexpr Unmixer::Choice kWithSoot = 1;

int emitters_in(Unmixer::Choice choice) {
  int n = 0;
  for (; choice != 0; choice &= choice - 1) ++n;
  return n;
}
int unknowns_in(Unmixer::Choice choice) { return emitters_in(choice) + ((choice & kWithSoot) != 0 ? 1 : 0); }

/// Least squares of amounts that aren't negative: how much they lower chi-square.
struct Lowered {
  double by = 0;
  Unmixer::Amounts amounts = {};
};
Lowered best_amounts(const Eigen::Matrix3d& gram, const Eigen::Vector3d& right, Unmixer::Choice choice) {
  // Of unit diagonal; who isn't chosen has an amount of 0.
  Eigen::Vector3d unit = Eigen::Vector3d::Zero();
  for (int i = 0; i < kMostEmitters; ++i)
    if ((choice >> i & 1U) != 0 && gram(i, i) > 0) unit[i] = 1 / std::sqrt(gram(i, i));
  Eigen::Matrix3d square = unit.asDiagonal() * gram * unit.asDiagonal();
  square.diagonal().setOnes();
  const Eigen::Vector3d column = unit.cwiseProduct(right);
  const Eigen::Vector3d amount = square.inverse() * column;
  Lowered out;
  if (square.determinant() > kSingular && amount.minCoeff() >= 0) {
    out.by = amount.dot(column);
    Eigen::Vector3d::Map(out.amounts.data()) = unit.cwiseProduct(amount);
    return out;
  }
  // The function is convex: its least is on the border, where one of them is 0.
  for (int i = 0; i < kMostEmitters; ++i) {
    if (unit[i] == 0) continue;
    const Lowered without = best_amounts(gram, right, choice & ~(1U << i));
    if (without.by > out.by) out = without;
  }
  return out;
}

double sum(const std::array<double, 3>& levels) { return levels[0] + levels[1] + levels[2]; }

}  // namespace

struct Unmixer::Explanation {
  Choice choice = 0;
  Reading reading;
  Amounts amounts = {};
  [[nodiscard]] double score() const { return reading.chi_square + kSeen * emitters_in(choice); }
};

Unmixer::Unmixer(const Thermometer& meter, std::vector<std::array<double, 3>> lines)
    : meter_(&meter), lines_(std::move(lines)) {
  for (std::array<double, 3>& line : lines_) {
    const double all = sum(shown_alone(line));
    for (double& v : line) v /= all > 0 ? all : 1;
  }
}

double Unmixer::chi_square(const Glow& glow, double kelvin, Choice choice, Amounts* amounts) const {
  const EmitterTable& table = meter_->table();
  const EmitterLevels levels = table.at(Kelvin(kelvin));
  // In units of an absorption of 1/m where that is known, else of the levels.
  const double scale = table.absolute() ? std::exp(levels.log_scale) : 1;
  Eigen::Matrix3d columns = Eigen::Matrix3d::Zero();
  columns.col(0) = scale * Eigen::Vector3d::Map(levels.value.data());
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    // What a line takes from a channel shows where there is something to take from.
    const std::array<double, 3> line = (choice & kWithSoot) != 0 ? lines_[i] : shown_alone(lines_[i]);
    columns.col(static_cast<Eigen::Index>(i) + 1) = Eigen::Vector3d::Map(line.data());
  }
  const Eigen::Matrix3d weighted = glow.information * columns;
  Eigen::Matrix3d gram = columns.transpose() * weighted;
  Eigen::Vector3d right = weighted.transpose() * glow.level;
  double data_square = glow.level.dot(glow.information * glow.level);
  if (absorption_counts(glow, table)) {
    const double weight = 1 / (glow.absorption_sigma * glow.absorption_sigma);
    gram(0, 0) += weight;
    right[0] += weight * glow.absorption;
    data_square += weight * glow.absorption * glow.absorption;
  }
  const Lowered best = best_amounts(gram, right, choice);
  if (amounts != nullptr) *amounts = best.amounts;
  return data_square - best.by;
}

/// How far from a temperature an explanation with lines allows others, to two sigma; infinite where it allows
/// an end of the temperatures.
double Unmixer::reach(const Glow& glow, const Explanation& with, double kelvin) const {
  const double limit = with.reading.chi_square + kTwoSigma;
  const double centre = 1 / with.reading.kelvin;
  const auto within = [&](double inverse) { return chi_square(glow, 1 / inverse, with.choice) <= limit; };
  double farthest = 0;
  for (const Kelvin end : {kColdestBesideLines, kHottestBesideLines}) {
    // Walks in from the end, so that another valley as likely counts too.
    double outside = 1 / end.value();
    if (within(outside)) return INFINITY;
    double inside = centre;
    const double step = (centre - outside) / kWalk;
    for (int i = 1; i < kWalk; ++i) {
      if (within(outside + step)) {
        inside = outside + step;
        break;
      }
      outside += step;
    }
    for (int i = 0; i < kHalvings; ++i) {
      const double middle = (outside + inside) / 2;
      (within(middle) ? inside : outside) = middle;
    }
    farthest = std::max(farthest, std::abs(1 / inside - kelvin));
  }
  return farthest;
}

Unmixer::Explanation Unmixer::explain(const Glow& glow, Choice choice, int data) const {
  Explanation out;
  out.choice = choice;
  const EmitterTable& table = meter_->table();
  const int freedom = data - unknowns_in(choice);
  if (choice == kWithSoot) {
    out.reading = meter_->read(glow);
  } else if ((choice & kWithSoot) != 0) {
    out.reading = most_likely(kColdestBesideLines, kHottestBesideLines, freedom,
                              [&](double kelvin) { return chi_square(glow, kelvin, choice); });
  }
  const double kelvin = out.reading.kelvin > 0 ? out.reading.kelvin : table.coldest().value();
  out.reading.chi_square = chi_square(glow, kelvin, choice, &out.amounts);
  out.reading.freedom = freedom;
  out.reading.absorption = out.amounts[0];
  return out;
}

Unmixed Unmixer::read(const Glow& glow) const {
  Unmixed out;
  const int data = data_of(glow, meter_->table());
  constexpr int kLeastData = 3;  // soot's amount and temperature, and one line's amount
  if (data < kLeastData || !(glow.level.maxCoeff() > 0)) return out;
  std::vector<Explanation> all;
  const Choice end = Choice{2} << lines_.size();
  for (Choice choice = 1; choice < end; ++choice)
    if (unknowns_in(choice) <= data) all.push_back(explain(glow, choice, data));
  const Explanation& best = *std::min_element(
      all.begin(), all.end(), [](const auto& a, const auto& b) { return a.score() < b.score(); });
  out.reading = best.reading;
  const bool fits = best.reading.chi_square <= kNoBody * std::max(1, best.reading.freedom);
  const bool rivalled = std::any_of(all.begin(), all.end(), [&](const Explanation& e) {
    return e.choice != best.choice && emitters_in(e.choice) == emitters_in(best.choice) &&
           e.score() < best.score() + kSeen;
  });
  out.kind = !fits                            ? Unmixed::Kind::neither
             : rivalled                       ? Unmixed::Kind::alike
             : best.choice == kWithSoot       ? Unmixed::Kind::soot
             : (best.choice & kWithSoot) != 0 ? Unmixed::Kind::mixed
                                              : Unmixed::Kind::lines;
  if ((out.kind == Unmixed::Kind::soot || out.kind == Unmixed::Kind::mixed) && best.reading.kelvin > 0)
    for (const Explanation& e : all)
      if (e.choice != kWithSoot && (e.choice & best.choice) == best.choice && e.reading.kelvin > 0)
        out.reading.sigma = std::max(out.reading.sigma, reach(glow, e, best.reading.kelvin) / 2);
  if (out.kind != Unmixed::Kind::mixed && out.kind != Unmixed::Kind::lines) return out;
  const EmitterLevels levels = meter_->table().at(Kelvin(std::max(1.0, best.reading.kelvin)));
  const double soot = best.amounts[0] * (meter_->table().absolute() ? std::exp(levels.log_scale) : 1);
  double light = soot;
  for (std::size_t i = 0; i < lines_.size(); ++i) light += best.amounts[i + 1];
  for (std::size_t i = 0; i < lines_.size(); ++i) {
    out.share[i] = best.amounts[i + 1] / light;
    out.seen[i] = (best.choice >> (i + 1) & 1U) != 0;
  }
  return out;
}

LineChoice choose_line(const Thermometer& meter, const CameraResponse& response,
                       const std::vector<Glow>& glows) {
  struct Candidate {
    const LineEmitter* emitter;
    double chi_square;
  };
  std::vector<Candidate> candidates;
  for (const LineEmitter& emitter : line_emitters()) {
    if (glows.empty() || !is_seen(response, emitter)) continue;
    const Unmixer unmixer(meter, {levels_of(response, emitter)});
    double left = 0;
    for (const Glow& glow : glows) left += std::min(kNoBody, unmixer.read(glow).reading.chi_square);
    candidates.push_back({&emitter, left / static_cast<double>(glows.size())});
  }
  std::sort(candidates.begin(), candidates.end(),
            [](const Candidate& a, const Candidate& b) { return a.chi_square < b.chi_square; });
  LineChoice out;
  if (candidates.empty() || !(candidates.front().chi_square < kNoBody / 2)) return out;
  for (const Candidate& c : candidates)
    if (c.chi_square < candidates.front().chi_square + 1) out.rivals.push_back(c.emitter);
  if (out.rivals.size() > 1) return out;
  out.chosen = candidates.front().emitter;
  out.rivals.clear();
  return out;
}

}  // namespace emberlock::recon
