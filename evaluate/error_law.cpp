// SPDX-License-Identifier: Apache-2.0
#include "evaluate/error_law.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <fmt/format.h>

namespace emberlock::evaluate {
namespace {

constexpr double kLawPi = std::numbers::pi;
constexpr double kUncertain = 0.03;  // of a picture's frequencies: what a solver leaves though it is told
constexpr double kOwnSide = 0.2;     // of a picture that the opposite one doesn't tell
constexpr int kSpokes = 6;           // directions of frequency in a judge's picture
constexpr double kFirstReach = 0.5;
constexpr double kReachStep = 1.1;
constexpr int kReaches = 28;       // up to 6.6: beyond it even_planes() could tell less with one camera more
constexpr double kBlurPower = 2;   // of the square of the error by motion blur
constexpr double kChanged = 0.08;  // rise, in heights, after which the flame is another one: sync saturates
constexpr int kDescents = 2000;

Eigen::Vector3d law_direction(double azimuth, double elevation) {
  return {std::cos(elevation) * std::cos(azimuth), std::cos(elevation) * std::sin(azimuth),
          std::sin(elevation)};
}

double correlation(const Eigen::Vector3d& distance) { return std::exp(-0.5 * distance.squaredNorm()); }

/// What the pictures from two directions have in common by their sides: the flame takes light, so its near
/// side outshines the far one.
double of_sides(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return 1 - 0.5 * kOwnSide * (1 - a.dot(b));
}

/// The variance that is left of one frequency of a judge's picture, of 1.
double left_open(const std::vector<Eigen::Vector3d>& cameras, const Eigen::Vector3d& judge,
                 const Eigen::Vector3d& frequency) {
  const std::size_t n = cameras.size();
  std::vector<Eigen::Vector3d> nearest;
  nearest.reserve(n);
  for (const Eigen::Vector3d& camera : cameras)
    nearest.emplace_back(frequency - frequency.dot(camera) * camera);
  const auto size = static_cast<Eigen::Index>(n);
  Eigen::MatrixXd among(size, size);
  Eigen::VectorXd with(size);
  for (std::size_t i = 0; i < n; ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    with(row) = of_sides(judge, cameras[i]) * correlation(frequency - nearest[i]);
    for (std::size_t j = 0; j < n; ++j)
      among(row, static_cast<Eigen::Index>(j)) =
          of_sides(cameras[i], cameras[j]) * correlation(nearest[i] - nearest[j]);
    among(row, row) += kUncertain;
  }
  return std::max(0.0, 1 - with.dot(among.llt().solve(with)));
}

/// What multiplies a law's strengths; `open` is unseen().
ErrorSquares basis(const TwinRig& rig, double open) {
  return {open,
          rig.pixel * rig.pixel,
          rig.noise * rig.noise / static_cast<double>(rig.towards.size()),
          std::pow(rig.exposed, kBlurPower),
          rig.late * rig.late / (1 + std::pow(rig.late / kChanged, 2)),
          1};
}

/// Non-negative least squares of sum_j x_j rows_ij = 1 by descent along one coordinate after the other.
ErrorSquares least_squares(const std::vector<ErrorSquares>& rows) {
  ErrorSquares x{};
  std::vector<double> left(rows.size(), 1);
  ErrorSquares norm{};
  for (const ErrorSquares& row : rows)
    for (std::size_t j = 0; j < kErrorParts; ++j) norm[j] += row[j] * row[j];
  for (int descent = 0; descent < kDescents; ++descent)
    for (std::size_t j = 0; j < kErrorParts; ++j) {
      if (!(norm[j] > 0)) continue;
      double slope = 0;
      for (std::size_t i = 0; i < rows.size(); ++i) slope += rows[i][j] * left[i];
      const double step = std::max(-x[j], slope / norm[j]);
      x[j] += step;
      for (std::size_t i = 0; i < rows.size(); ++i) left[i] -= step * rows[i][j];
    }
  return x;
}

double off(const ErrorLaw& law, const ErrorSquares& terms, double error) {
  double square = 0;
  for (std::size_t j = 0; j < kErrorParts; ++j) square += law.strength[j] * terms[j];
  return std::sqrt(square) / error - 1;
}

/// Of each reach what the rigs leave open.
using Openness = std::vector<std::vector<double>>;

double reach_of_step(std::size_t step) {
  return kFirstReach * std::pow(kReachStep, static_cast<double>(step));
}

/// The best of all reaches, without the rig of index `without` (none: rigs.size()).
ErrorLaw best_fit(const std::vector<MeasuredRig>& rigs, const Openness& open, std::size_t without) {
  ErrorLaw best;
  double least = INFINITY;
  for (std::size_t r = 0; r < open.size(); ++r) {
    std::vector<ErrorSquares> rows;
    for (std::size_t i = 0; i < rigs.size(); ++i) {
      if (i == without) continue;
      rows.push_back(basis(rigs[i].rig, open[r][i]));
      for (double& term : rows.back()) term /= rigs[i].error * rigs[i].error;
    }
    const ErrorLaw law{reach_of_step(r), least_squares(rows), 0};
    double sum = 0;
    for (const ErrorSquares& row : rows) sum += std::pow(off(law, row, 1), 2);
    if (sum < least) {
      least = sum;
      best = law;
    }
  }
  return best;
}

Status check_measured(const std::vector<MeasuredRig>& rigs) {
  const auto refused = [](const std::string& what) {
    return Error{ErrorKind::bad_input, what, "the error law", "Measure rigs that differ in every part"};
  };
  if (rigs.size() < kErrorParts + 2) return refused(fmt::format("{} rigs don't tell it", rigs.size()));
  for (const MeasuredRig& m : rigs) {
    if (m.rig.towards.empty()) return refused("a rig has no cameras");
    if (!std::isfinite(m.error) || !(m.error > 0)) return refused(fmt::format("an error is {:g}", m.error));
  }
  return {};
}

}  // namespace

std::string_view name(ErrorPart part) {
  constexpr std::array<std::string_view, kErrorParts> kNames{"views",    "pixels", "noise",
                                                             "exposure", "sync",   "rest"};
  return kNames[static_cast<std::size_t>(part)];
}

double total(const ErrorSquares& squares) {
  return std::sqrt(std::accumulate(squares.begin(), squares.end(), 0.0));
}

std::vector<Eigen::Vector3d> judge_directions() {
  constexpr int kJudges = 12;
  std::vector<Eigen::Vector3d> all;
  all.reserve(kJudges);
  for (int i = 0; i < kJudges; ++i)
    all.push_back(law_direction((i * 360.0 / kJudges + 7) * kLawPi / 180, (i % 3 - 1) * 15 * kLawPi / 180));
  return all;
}

double unseen(const std::vector<Eigen::Vector3d>& cameras, double reach) {
  const std::vector<Eigen::Vector3d> judges = judge_directions();
  double sum = 0;
  for (const Eigen::Vector3d& judge : judges) {
    const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(judge).normalized();
    const Eigen::Vector3d up = judge.cross(right);
    for (int s = 0; s < kSpokes; ++s) {
      const double angle = (s + 0.5) * kLawPi / kSpokes;
      sum += left_open(cameras, judge, reach * (std::cos(angle) * right + std::sin(angle) * up));
    }
  }
  return sum / static_cast<double>(judges.size() * kSpokes);
}

double uncertainty(const ErrorLaw& law) { return std::hypot(law.spread, kJointSpread); }

ErrorSquares predict(const ErrorLaw& law, const TwinRig& rig) {
  ErrorSquares squares = basis(rig, unseen(rig.towards, law.reach));
  for (std::size_t j = 0; j < kErrorParts; ++j) squares[j] *= law.strength[j];
  return squares;
}

Result<ErrorLaw> fit_error_law(const std::vector<MeasuredRig>& rigs) {
  EMBERLOCK_RETURN_IF_ERROR(check_measured(rigs));
  Openness open(kReaches);
  for (std::size_t r = 0; r < open.size(); ++r)
    for (const MeasuredRig& m : rigs) open[r].push_back(unseen(m.rig.towards, reach_of_step(r)));
  ErrorLaw law = best_fit(rigs, open, rigs.size());
  double sum = 0;
  for (std::size_t i = 0; i < rigs.size(); ++i) {
    const ErrorLaw without = best_fit(rigs, open, i);
    sum += std::pow(total(predict(without, rigs[i].rig)) / rigs[i].error - 1, 2);
  }
  law.spread = std::sqrt(sum / static_cast<double>(rigs.size()));
  return law;
}

double balanced_exposure(const ErrorLaw& law, std::size_t cameras, double noise) {
  const double blur = law.strength[static_cast<std::size_t>(ErrorPart::exposure)];
  const double grain =
      law.strength[static_cast<std::size_t>(ErrorPart::noise)] * noise * noise / static_cast<double>(cameras);
  return std::pow(grain / (kBlurPower * blur), 1 / (kBlurPower + 1));
}

std::vector<Eigen::Vector3d> even_planes(int cameras) {
  std::vector<Eigen::Vector3d> all;
  all.reserve(static_cast<std::size_t>(std::max(0, cameras)));
  for (int k = 0; k < cameras; ++k)
    all.push_back(
        law_direction(k * (kLawPi + kLawPi / cameras), (k % 4 == 0 || k % 4 == 3 ? 10 : -10) * kLawPi / 180));
  return all;
}

}  // namespace emberlock::evaluate
