// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/row_clock.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

#include <Eigen/Dense>

#include "smear_sync/clocks/staircase.h"

namespace emberlock::smear {
namespace {

/// Whole-row shifts and the fit of a faint dot cause up to about a row; a dot further off isn't part of this
/// comb.
constexpr double kOutlier = 1.5;

struct Dot {
  double row = 0;
  double sigma = 0;
  double pitches = 0;  ///< number of pitches from its side's anchor
  bool used = false;
};

struct Comb {
  double frame = 0;  ///< index among all readings
  std::vector<Dot> above, below;
};

std::vector<Comb> combs(std::span<const SmearReading> frames) {
  std::vector<Comb> result;
  std::vector<double> lamps;
  for (const SmearReading& frame : frames) {
    if (frame.state == SmearState::comb && frame.lamp) lamps.push_back(frame.lamp->y.value());
  }
  const auto middle = lamps.begin() + static_cast<std::ptrdiff_t>(lamps.size() / 2);
  if (!lamps.empty()) std::nth_element(lamps.begin(), middle, lamps.end());
  const double lamp = lamps.empty() ? 0 : *middle;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    if (frames[i].state != SmearState::comb) continue;
    Comb comb;
    comb.frame = static_cast<double>(i) - static_cast<double>(frames.size()) / 2;
    for (const DotReading& dot : frames[i].dots) {
      (dot.side == Side::above ? comb.above : comb.below)
          .push_back({.row = dot.y.value() - lamp, .sigma = dot.sigma.value()});
    }
    if (comb.above.size() >= 2 || comb.below.size() >= 2) result.push_back(std::move(comb));
  }
  return result;
}

/// The pitch of which most gaps between neighbours are multiples. Gaps of a single pitch have the largest
/// weight, so that half the pitch, which divides every gap too, loses.
double first_pitch(const std::vector<Comb>& all) {
  std::vector<double> gaps;
  for (const Comb& comb : all) {
    for (const auto* side : {&comb.above, &comb.below}) {
      for (std::size_t i = 1; i < side->size(); ++i) gaps.push_back((*side)[i].row - (*side)[i - 1].row);
    }
  }
  // Every distinct gap is a candidate; a few hundred suffice.
  const std::size_t step = std::max<std::size_t>(1, gaps.size() / 300);
  double best = 0;
  double best_score = 0;
  for (std::size_t i = 0; i < gaps.size(); i += step) {
    const double pitch = gaps[i];
    if (pitch < 2) continue;
    double score = 0;
    double sum = 0;
    double count = 0;
    for (const double gap : gaps) {
      const double multiple = std::round(gap / pitch);
      if (multiple < 1 || std::abs(gap - multiple * pitch) > kOutlier * std::sqrt(multiple)) continue;
      score += 1 / multiple;
      sum += gap;
      count += multiple;
    }
    if (score <= best_score) continue;
    best_score = score;
    best = sum / count;
  }
  return best_score >= 0.3 * static_cast<double>(gaps.size()) ? best : 0;
}

/// Counts pitches from the dot that agrees with most others; returns that anchor's row.
double number(std::vector<Dot>& side, double pitch) {
  double anchor = 0;
  int most = -1;
  for (const Dot& candidate : side) {
    int agree = 0;
    for (const Dot& dot : side) {
      if (std::abs(wrap_symmetric(dot.row - candidate.row, pitch)) < kOutlier) ++agree;
    }
    if (agree <= most) continue;
    most = agree;
    anchor = candidate.row;
  }
  for (Dot& dot : side) {
    dot.pitches = std::round((dot.row - anchor) / pitch);
    dot.used = std::abs(dot.row - anchor - dot.pitches * pitch) < kOutlier;
  }
  return anchor;
}

/// Normal equations of one frame for (pitch, offset of the lower side), with its phase eliminated.
struct FrameNormal {
  Eigen::Matrix2d matrix = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  double squares = 0;
  int dots = 0;
};

FrameNormal reduce(const Comb& comb) {
  std::vector<Eigen::Vector3d> rows;  // pitches, lower side, row
  for (const Dot& d : comb.above) {
    if (d.used) rows.emplace_back(d.pitches, 0, d.row);
  }
  for (const Dot& d : comb.below) {
    if (d.used) rows.emplace_back(d.pitches, 1, d.row);
  }
  FrameNormal n;
  n.dots = static_cast<int>(rows.size());
  if (rows.empty()) return n;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const auto& r : rows) mean += r / static_cast<double>(rows.size());
  for (const auto& r : rows) {
    const Eigen::Vector3d d = r - mean;
    n.matrix += d.head<2>() * d.head<2>().transpose();
    n.right += d.head<2>() * d.z();
    n.squares += d.z() * d.z();
  }
  return n;
}

struct Fit {
  double pitch = 0;
  double offset = 0;  ///< of the lower side relative to the upper one, rows
  double sigma = 0;   ///< of the pitch
  int dots = 0;
  int frames = 0;
  bool both_sides = false;
};

Eigen::Vector2d solve(Eigen::Matrix2d matrix, const Eigen::Vector2d& right) {
  matrix.diagonal().array() += 1e-12;  // with one side only, the offset is free
  return matrix.ldlt().solve(right);
}

/// How much rounding to whole rows may shift the pitch, because the dots sample the row grid unevenly: the
/// two lowest harmonics of the sawtooth x - floor(x), sin(2 pi k x) / (pi k), propagated through the least
/// squares.
double rounding_error(const std::vector<Comb>& all, const Eigen::Matrix2d& covariance, double pitch,
                      double offset) {
  double worst = 0;
  for (const int harmonic : {1, 2}) {
    std::complex<double> sum = 0;
    for (const Comb& comb : all) {
      Eigen::Vector3d mean = Eigen::Vector3d::Zero();  // pitches, lower side, phase
      int count = 0;
      const auto each = [&](auto&& visit) {
        for (const Dot& d : comb.above) {
          if (d.used) visit(Eigen::Vector3d(d.pitches, 0, d.row - d.pitches * pitch));
        }
        for (const Dot& d : comb.below) {
          if (d.used) visit(Eigen::Vector3d(d.pitches, 1, d.row - d.pitches * pitch - offset));
        }
      };
      each([&](const Eigen::Vector3d& v) { mean += v, ++count; });
      if (count == 0) continue;
      mean /= count;
      each([&](const Eigen::Vector3d& v) {
        const double influence = covariance.row(0).dot((v - mean).head<2>());
        const double row = mean.z() + v.x() * pitch + v.y() * offset;
        sum += influence * std::polar(1.0, 2 * std::numbers::pi * harmonic * row);
      });
    }
    worst += std::abs(sum) / (std::numbers::pi * harmonic);
  }
  return worst;
}

Fit least_squares(const std::vector<Comb>& all) {
  std::vector<FrameNormal> frames;
  FrameNormal sum;
  for (const Comb& comb : all) {
    frames.push_back(reduce(comb));
    sum.matrix += frames.back().matrix;
    sum.right += frames.back().right;
    sum.squares += frames.back().squares;
    sum.dots += frames.back().dots;
  }
  const Eigen::Vector2d best = solve(sum.matrix, sum.right);
  Fit fit{.pitch = best.x(), .offset = best.y(), .dots = sum.dots, .frames = static_cast<int>(all.size())};
  fit.both_sides = sum.matrix(1, 1) > 0.1;  // rounding leaves less if no frame has dots on both sides
  const double residual = std::max(0.0, sum.squares - best.dot(sum.right));
  const int freedom = std::max(1, sum.dots - fit.frames - (fit.both_sides ? 2 : 1));
  const Eigen::Matrix2d covariance = (sum.matrix + 1e-12 * Eigen::Matrix2d::Identity()).inverse();
  fit.sigma = std::sqrt(residual / freedom * covariance(0, 0));
  fit.sigma = std::hypot(fit.sigma, rounding_error(all, covariance, fit.pitch, fit.offset));
  if (frames.size() < 4) return fit;
  // Variation between frames (jitter of the strobe) shows in the scatter between frames.
  double scatter = 0;
  for (const FrameNormal& f : frames) {
    const double without = solve(sum.matrix - f.matrix, sum.right - f.right).x();
    scatter += (without - fit.pitch) * (without - fit.pitch);
  }
  const auto n = static_cast<double>(frames.size());
  fit.sigma = std::max(fit.sigma, std::sqrt(scatter * (n - 1) / n));
  return fit;
}

Fit fit_pitch(std::vector<Comb>& all, double pitch) {
  Fit fit;
  for (int iteration = 0; iteration < 4; ++iteration) {
    std::optional<double> offset;
    for (Comb& comb : all) {
      const double above = number(comb.above, pitch);
      const double below = number(comb.below, pitch);
      if (comb.above.empty() || comb.below.empty()) continue;
      // The offset across the lamp is known up to whole pitches, the same in every frame.
      const double across = below - above;
      if (!offset) offset = across;
      const double whole = std::round((across - *offset) / pitch);
      for (Dot& dot : comb.below) dot.pitches += whole;
    }
    fit = least_squares(all);
    pitch = fit.pitch;
  }
  return fit;
}

/// The row of the comb's dot number 0 above the lamp.
double phase_of_comb(const Comb& comb, const Fit& fit) {
  double sum = 0;
  double count = 0;
  const auto add = [&](const std::vector<Dot>& side, double offset) {
    for (const Dot& d : side) {
      if (!d.used) continue;
      sum += d.row - d.pitches * fit.pitch - offset;
      ++count;
    }
  };
  add(comb.above, 0);
  add(comb.below, fit.offset);
  return count > 0 ? sum / count : std::nan("");
}

/// The walk of the comb from frame to frame, modulo the pitch: the one at which all combs concentrate.
double gathering_walk(const std::vector<Comb>& all, const Fit& fit) {
  const double frames = all.back().frame - all.front().frame + 1;
  const int steps = static_cast<int>(8 * frames);
  double best = 0;
  double most = -1;
  for (int i = 0; i < steps; ++i) {
    const double walk = fit.pitch * i / steps;
    std::complex<double> sum = 0;
    for (const Comb& comb : all) {
      const double phase = phase_of_comb(comb, fit);
      if (std::isnan(phase)) continue;
      sum += std::polar(1.0, 2 * std::numbers::pi * (phase - comb.frame * walk) / fit.pitch);
    }
    if (std::abs(sum) <= most) continue;
    most = std::abs(sum);
    best = walk;
  }
  return best;
}

/// All combs as one: row = place . (phase above, phase below, pitch, walk).
std::vector<StairPoint> one_comb(const std::vector<Comb>& all, const Fit& fit) {
  const double walk = gathering_walk(all, fit);
  std::complex<double> sum = 0;
  for (const Comb& comb : all) {
    const double phase = phase_of_comb(comb, fit);
    if (!std::isnan(phase))
      sum += std::polar(1.0, 2 * std::numbers::pi * (phase - comb.frame * walk) / fit.pitch);
  }
  const double first = std::arg(sum) / (2 * std::numbers::pi) * fit.pitch;
  std::vector<StairPoint> points;
  for (const Comb& comb : all) {
    const double phase = phase_of_comb(comb, fit);
    if (std::isnan(phase)) continue;
    const double whole = std::round((phase - comb.frame * walk - first) / fit.pitch);
    for (const auto* side : {&comb.above, &comb.below}) {
      const double below = side == &comb.below ? 1 : 0;
      for (const Dot& d : *side) {
        if (!d.used) continue;
        points.push_back({Eigen::Vector4d(1 - below, below, d.pitches + whole, comb.frame), d.row, d.sigma});
      }
    }
  }
  return points;
}

/// The same least squares for all frames as one walk with a single phase, then the fit to the staircase of
/// whole rows. nullopt if the frames aren't one walk (lost frames, a drifting strobe) or no staircase is
/// visible.
std::optional<StairFit> fit_as_one(const std::vector<Comb>& all, const Fit& fit, double width) {
  constexpr double kCoherent = 0.5;  // RMS, rows
  if (all.size() < 3 || !fit.both_sides) return std::nullopt;
  const std::vector<StairPoint> points = one_comb(all, fit);
  Eigen::Matrix4d matrix = 1e-9 * Eigen::Matrix4d::Identity();
  Eigen::Vector4d right = Eigen::Vector4d::Zero();
  for (const StairPoint& p : points) {
    matrix += p.place * p.place.transpose();
    right += p.place * p.u;
  }
  const Eigen::Vector4d line = matrix.ldlt().solve(right);
  double squares = 0;
  for (const StairPoint& p : points) squares += std::pow(p.u - p.place.dot(line), 2);
  if (squares > kCoherent * kCoherent * static_cast<double>(points.size())) return std::nullopt;
  // Three times the uncertainty by whole rows, plus the possible error of the lamp, which shifts both phases.
  Eigen::Matrix4d covariance = kOutlier * kOutlier * matrix.inverse();
  covariance.topLeftCorner<2, 2>().array() += 0.04;
  // A dot lies half a row before the middle of its row period.
  auto one = fit_stairs(
      points, {.line = line + Eigen::Vector4d(0.5, 0.5, 0, 0), .covariance = covariance, .width = width});
  // A staircase of another width than the flash's misleads the fit; the straight line is immune to that.
  const double straight_sigma =
      std::sqrt(squares / static_cast<double>(points.size()) * matrix.inverse()(2, 2));
  if (one && std::abs(one->line(2) - line(2)) > 3 * straight_sigma) one.reset();
  return one;
}

double longest_span(const std::vector<Comb>& all) {
  double span = 0;
  for (const Comb& comb : all) {
    for (const auto* side : {&comb.above, &comb.below}) {
      if (!side->empty()) span = std::max(span, side->back().pitches - side->front().pitches);
    }
  }
  return span;
}

}  // namespace

Result<RowClock> fit_row_clock(std::span<const SmearReading> frames, Hertz flash_rate,
                               std::optional<Seconds> frame_period, Seconds flash_width) {
  if (!std::isfinite(flash_rate.value()) || flash_rate.value() <= 0) {
    return Error{ErrorKind::bad_input, "the flash rate isn't a positive number", "flash_rate",
                 "give the strobe's rate in flashes a second"};
  }
  std::vector<Comb> all = combs(frames);
  std::size_t longest = 0;
  for (const Comb& c : all) longest = std::max({longest, c.above.size(), c.below.size()});
  if (longest < 3) {
    return Error{ErrorKind::bad_input, "no frame shows three dots or more on one side of the lamp", "comb",
                 "set the strobe's rate to about ten flashes a frame"};
  }
  const double start = first_pitch(all);
  if (start <= 0) {
    return Error{ErrorKind::bad_input, "the dots stand in no regular pitch", "comb",
                 "keep the strobe's rate constant and other lights off"};
  }
  Fit fit = fit_pitch(all, start);
  if (!std::isfinite(fit.pitch) || fit.pitch <= 0) {
    return Error{ErrorKind::bad_input, "the dots don't determine a pitch", "comb", "record more frames"};
  }
  bool near_integer = std::abs(wrap_symmetric(fit.pitch, 1)) * longest_span(all) < 1;
  const double width = flash_width.value() * flash_rate.value() * fit.pitch;
  if (const auto one = fit_as_one(all, fit, width)) {
    fit.pitch = one->line(2);
    fit.sigma = one->sigma(2);
    fit.offset = one->line(1) - one->line(0);
    near_integer = near_integer && fit.sigma * longest_span(all) > 0.1;
  }
  RowClock clock;
  clock.pitch = Rows(fit.pitch);
  clock.row_time = period(flash_rate) / clock.pitch;
  clock.sigma = clock.row_time * (fit.sigma / fit.pitch);
  clock.dots = fit.dots;
  clock.frames = fit.frames;
  clock.near_integer_pitch = near_integer;
  if (frame_period && fit.both_sides) {
    // Dots on the side after the wrap were shifted in the previous read phase: offset = K - T / t_row, modulo
    // p.
    clock.shifts_modulo_pitch =
        Rows(wrap_positive(fit.offset + (*frame_period / clock.row_time).value(), fit.pitch));
  }
  return clock;
}

}  // namespace emberlock::smear
