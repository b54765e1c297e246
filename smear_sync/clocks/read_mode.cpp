// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/read_mode.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <limits>
#include <numbers>
#include <set>
#include <vector>

#include <Eigen/Dense>
#include <fmt/format.h>

#include "base/square.h"

namespace emberlock::smear {
namespace {

constexpr double kRowScatter = 0.35;  // of one dot: whole rows, and the fit of a faint dot
constexpr double kReadScatter = 0.2;  // the latter alone
constexpr std::size_t kHarmonics = 12;
constexpr double kStrayRows = 1.5;  // a dot further off the walk isn't this strobe's
constexpr double kLeastPart = 0.7;  // share of the dots that must follow
constexpr double kDecisive = 25;    // difference of chi-squares: five standard deviations
constexpr std::size_t kFewestDots = 4;
constexpr int kFewestFrames = 3;
/// Another K is ruled out if it is this many standard errors off.
constexpr double kShiftSigmas = 4;
constexpr double kRateSigmas = 3;

struct SeenDot {
  double frame = 0;  ///< relative to the middle one
  double below = 0;  ///< distance below the lamp, rows; negative above
  double sigma = 0;
};

/// The walk of the dots for one direction: v = d (y - y_s) t_row concentrates at phi + c_side - i T modulo P.
struct Walk {
  double cost = std::numeric_limits<double>::infinity();
  double frame_period_change = 0;  ///< of T, seconds
  double frame_period_sigma = 0;
  std::array<double, 2> place{};  ///< seconds: of the side reached first, and of the side after the wrap
  std::array<int, 2> dots{};
  double apart_sigma = 0;  ///< of the difference of the places, seconds
  double residual = 0;     ///< RMS, rows
};

std::vector<SeenDot> dots_of(std::span<const FrameReading> frames) {
  std::vector<double> lamps;
  for (const FrameReading& f : frames) {
    if (f.reading.lamp && !f.reading.dots.empty()) lamps.push_back(f.reading.lamp->y.value());
  }
  std::vector<SeenDot> dots;
  if (lamps.empty()) return dots;
  // The lamp doesn't move: the median over frames is more accurate than a single frame.
  const auto middle = lamps.begin() + static_cast<std::ptrdiff_t>(lamps.size() / 2);
  std::nth_element(lamps.begin(), middle, lamps.end());
  const std::size_t half = frames.size() / 2;
  const auto centre = static_cast<double>(frames[half].frame);
  for (const FrameReading& f : frames) {
    const bool readable = f.reading.state == SmearState::dot || f.reading.state == SmearState::comb;
    if (!readable) continue;
    for (const DotReading& dot : f.reading.dots) {
      dots.push_back({static_cast<double>(f.frame) - centre, dot.y.value() - *middle, dot.sigma.value()});
    }
  }
  return dots;
}

class SeenFit {
 public:
  SeenFit(const std::vector<SeenDot>& dots, const ReadModeOptions& o)
      : dots_(dots),
        row_time_(o.row_time.value()),
        period_(1 / o.frame_rate.value()),
        flash_period_(1 / o.flash_rate.value()),
        rate_sigma_(o.rate_sigma.value() * 1e-6 * period_) {
    double first = 0;
    double last = 0;
    for (const SeenDot& d : dots) {
      first = std::min(first, d.frame);
      last = std::max(last, d.frame);
    }
    span_ = last - first;
  }

  /// The walk in one direction, with T free around the nominal value.
  [[nodiscard]] Walk along(int direction) const {
    const double change = gathering(direction);
    Walk walk;
    walk.frame_period_change = change;
    for (const int side : {0, 1})
      walk.place[static_cast<std::size_t>(side)] = densest_place(direction, side, change);
    for (int round = 0; round < 4; ++round)
      straighten(direction, round == 0 ? 4 * kStrayRows : kStrayRows, walk);
    state_errors(direction, walk);
    return walk;
  }

 private:
  [[nodiscard]] static int side(const SeenDot& dot, int direction) {
    return direction * dot.below < 0 ? 1 : 0;
  }
  [[nodiscard]] double seconds(const SeenDot& dot, int direction) const {
    return direction * dot.below * row_time_ + dot.frame * period_;
  }
  [[nodiscard]] std::complex<double> gathered(int direction, int which, double change) const {
    std::complex<double> sum = 0;
    for (const SeenDot& dot : dots_) {
      if (side(dot, direction) != which) continue;
      sum += std::polar(
          1.0, 2 * std::numbers::pi * (seconds(dot, direction) + dot.frame * change) / flash_period_);
    }
    return sum;
  }
  /// The change of T at which the dots of each side concentrate best.
  [[nodiscard]] double gathering(int direction) const {
    const double reach = kRateSigmas * rate_sigma_;
    const double step = flash_period_ / std::max(span_, 1.0) / 8;
    double best = 0;
    double most = -1;
    for (double at = -std::floor(reach / step) * step; at <= reach; at += step) {
      const double sum = std::abs(gathered(direction, 0, at)) + std::abs(gathered(direction, 1, at));
      if (sum > most) {
        most = sum;
        best = at;
      }
    }
    return best;
  }
  /// The place of the dots of one side, robust against stray dots: the median of the densest interval of P /
  /// 8. The step of gathering() may spread them that far.
  [[nodiscard]] double densest_place(int direction, int which, double change) const {
    std::vector<double> at;  // modulo P, and repeated once
    for (const SeenDot& dot : dots_) {
      if (side(dot, direction) == which)
        at.push_back(wrap_positive(seconds(dot, direction) + dot.frame * change, flash_period_));
    }
    const std::size_t count = at.size();
    std::sort(at.begin(), at.end());
    for (std::size_t i = 0; i < count; ++i) at.push_back(at[i] + flash_period_);
    const double stretch = std::max(flash_period_ / 8, 2 * kStrayRows * row_time_);
    std::size_t first = 0;
    std::size_t last = 0;
    for (std::size_t from = 0, to = 0; from < count; ++from) {
      while (to < from + count && at[to] - at[from] <= stretch) ++to;
      if (to - from > last - first) first = from, last = to;
    }
    return last > first ? at[(first + last) / 2] : 0;
  }
  /// Least squares for T and the places of both sides; T has its prior. The residual of a dot is limited to
  /// `stray` rows.
  void straighten(int direction, double stray, Walk& walk) const {
    Eigen::Matrix3d matrix = known_before();
    Eigen::Vector3d right(0, 0, -walk.frame_period_change * matrix(2, 2));
    walk.dots = {};
    double squares = 0;
    double cost = 0;
    for (const SeenDot& dot : dots_) {
      const auto s = static_cast<std::size_t>(side(dot, direction));
      const double at = seconds(dot, direction) + dot.frame * walk.frame_period_change;
      const double off = wrap_symmetric(at - walk.place[s], flash_period_);
      cost += std::min(square(off / row_time_), square(kStrayRows)) / square(kRowScatter);
      if (std::abs(off) > stray * row_time_) continue;
      Eigen::Vector3d v(s == 0 ? 1 : 0, s == 1 ? 1 : 0, -dot.frame);
      matrix += v * v.transpose();
      right += v * off;
      squares += square(off / row_time_);
      ++walk.dots[s];
    }
    const Eigen::Vector3d move = matrix.ldlt().solve(right);
    walk.cost = cost + square(walk.frame_period_change / rate_sigma_);
    walk.residual = std::sqrt(squares / std::max(1, walk.dots[0] + walk.dots[1]));
    walk.place[0] += move.x();
    walk.place[1] += move.y();
    walk.frame_period_change += move.z();
  }
  /// Standard errors in spite of whole-row shifts. The error of a dot is the fraction of a row that was cut
  /// off; these errors are equal whenever the walk returns to the same fraction. The walk gives each dot's
  /// fraction up to a constant per side. Averaged over all such constants, the mean square of a weighted sum
  /// of these errors follows from the harmonics of a sawtooth.
  void state_errors(int direction, Walk& walk) const {
    Eigen::Matrix3d matrix = known_before();
    std::vector<std::pair<Eigen::Vector3d, double>>
        used;  // design row, and the row predicted by the walk, with its fraction
    for (const SeenDot& dot : dots_) {
      const int s = side(dot, direction);
      const double at = seconds(dot, direction) + dot.frame * walk.frame_period_change;
      const double off = wrap_symmetric(at - walk.place[static_cast<std::size_t>(s)], flash_period_);
      if (std::abs(off) > kStrayRows * row_time_) continue;
      used.push_back(
          {{s == 0 ? 1.0 : 0.0, s == 1 ? 1.0 : 0.0, -dot.frame}, direction * dot.below - off / row_time_});
      matrix += used.back().first * used.back().first.transpose();
    }
    const Eigen::Matrix3d inverse = matrix.inverse();
    // In a few frames, whole-row steps pull a fitted walk towards whole rows. The true walk may be any nearby
    // one, so take the largest error over those.
    for (const double more : {-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0}) {
      const double bent = more / std::max(span_, 1.0);
      walk.frame_period_sigma =
          std::max(walk.frame_period_sigma, row_time_ * error_of(inverse.col(2), used, bent));
      walk.apart_sigma =
          std::max(walk.apart_sigma, row_time_ * error_of(inverse.col(1) - inverse.col(0), used, bent));
    }
  }
  /// RMS in rows of the sum over dots of (combination . place) times their errors, if the walk were `bent`
  /// rows per frame faster.
  [[nodiscard]] static double error_of(const Eigen::Vector3d& combination,
                                       const std::vector<std::pair<Eigen::Vector3d, double>>& used,
                                       double bent) {
    double squares = 0;
    std::array<std::array<std::complex<double>, kHarmonics>, 2> sums{};
    for (const auto& [place, row] : used) {
      const double share = combination.dot(place);
      squares += square(share);
      const std::complex<double> turn = std::polar(1.0, 2 * std::numbers::pi * (row - bent * place.z()));
      std::complex<double> harmonic = share;
      for (std::complex<double>& sum : sums[place.x() > 0 ? 0 : 1]) sum += harmonic *= turn;
    }
    double variance = square(kReadScatter) * squares;
    double covered = 0;
    for (std::size_t k = 0; k < kHarmonics; ++k) {
      const double power = 1 / (2 * square(std::numbers::pi * static_cast<double>(k + 1)));
      variance += power * (std::norm(sums[0][k]) + std::norm(sums[1][k]));
      covered += power;
    }
    return std::sqrt(variance + (1.0 / 12 - covered) * squares);
  }
  [[nodiscard]] Eigen::Matrix3d known_before() const {
    return Eigen::Vector3d(1e-9, 1e-9, square(kRowScatter * row_time_ / rate_sigma_)).asDiagonal();
  }

  const std::vector<SeenDot>& dots_;
  double row_time_, period_, flash_period_, rate_sigma_;
  double span_ = 0;
};

Status check(const ReadModeOptions& o) {
  const double values[] = {o.flash_rate.value(), o.frame_rate.value(), o.rate_sigma.value(),
                           o.row_time.value(), static_cast<double>(o.rows)};
  for (const double v : values) {
    if (std::isfinite(v) && v > 0) continue;
    return Error{ErrorKind::bad_input, "a rate, its error, the row time or the number of rows isn't positive",
                 "read mode", "give the strobe's and the camera's rates in hertz and t_row from a comb"};
  }
  return {};
}

/// Decides whether one of the two walks is the camera's, and why.
void decide_direction(const Walk& top_first, const Walk& bottom_first, std::size_t dots, int frames,
                      const ReadModeOptions& o, ReadMode& mode) {
  const bool top = top_first.cost <= bottom_first.cost;
  const Walk& best = top ? top_first : bottom_first;
  const double follow = static_cast<double>(best.dots[0] + best.dots[1]);
  // The walk of flashes in rows per frame: the part of T beyond whole flash periods.
  const double flash_period = 1 / o.flash_rate.value();
  const double walk = wrap_symmetric(-1 / o.frame_rate.value(), flash_period) / o.row_time.value();
  if (dots < kFewestDots || frames < kFewestFrames) {
    mode.direction_reason = fmt::format("only {} frames show dots: film the strobe for longer", frames);
    return;
  }
  if (follow < kLeastPart * static_cast<double>(dots)) {
    mode.direction_reason = fmt::format(
        "the dots walk neither way as {:.4f} flashes a second at {:.4f} frames a second would: "
        "check both rates, and that no frames were lost",
        o.flash_rate.value(), o.frame_rate.value());
    return;
  }
  if (std::abs(top_first.cost - bottom_first.cost) < kDecisive) {
    mode.direction_reason = fmt::format(
        "flashes at {:.4f}/s walk {:.3f} rows a frame, which tells too little in {} frames: detune the "
        "strobe by about {:.3f} flashes a second",
        o.flash_rate.value(), walk, frames, 0.01 * o.frame_rate.value());
    return;
  }
  // Close to an integer number of flashes per frame, the wrong direction may fit, with a frame rate that no
  // such camera has.
  const double off = -best.frame_period_change * o.frame_rate.value() * 1e6;
  if (std::abs(off) > kRateSigmas * o.rate_sigma.value()) {
    mode.direction_reason = fmt::format(
        "the dots' walk wants a frame rate {:.0f} ppm off {:.4f}, believed to {:.0f} ppm: check both rates",
        off, o.frame_rate.value(), o.rate_sigma.value());
    return;
  }
  mode.direction = top ? ReadDirection::top_first : ReadDirection::bottom_first;
  mode.direction_reason = fmt::format("the dots walk as with the {} row read first, to {:.2f} rows RMS",
                                      top ? "top" : "bottom", best.residual);
}

/// K from the distance between the places of both sides: c_after - c_first = T - K t_row modulo P.
void find_shifts(const Walk& walk, const ReadModeOptions& o, ReadMode& mode) {
  if (walk.dots[0] < 2 || walk.dots[1] < 2) {
    mode.shifts_reason =
        "the dots stood on one side of the lamp only: detune the strobe until they have crossed over";
    return;
  }
  const double row_time = o.row_time.value();
  const double frame_period = 1 / o.frame_rate.value() + walk.frame_period_change;
  const double modulo = 1 / o.flash_rate.value() / row_time;
  const double measured = (frame_period - (walk.place[1] - walk.place[0])) / row_time;
  const double sigma =
      std::hypot(measured * o.row_time_sigma.value() / row_time, walk.apart_sigma / row_time);
  mode.shifts_sigma = Rows(sigma);
  mode.shifts_modulo = Rows(modulo);
  const double most = std::floor(frame_period / row_time + 2 * sigma);
  mode.shifts_measured =
      Rows(o.rows + wrap_symmetric(measured - (o.rows + most) / 2, modulo) + (most - o.rows) / 2);
  std::vector<int> fitting;
  const double reach = std::max(0.5, kShiftSigmas * sigma);
  for (int k = o.rows; k <= static_cast<int>(most); ++k) {
    if (std::abs(wrap_symmetric(k - measured, modulo)) <= reach) fitting.push_back(k);
  }
  if (fitting.size() == 1) {
    mode.shifts = fitting.front();
    mode.shifts_reason = fmt::format("the two sides of the lamp say {:.2f} +- {:.2f} rows",
                                     mode.shifts_measured.value(), sigma);
  } else if (fitting.empty()) {
    mode.shifts_reason = fmt::format(
        "{:.2f} rows, which the two sides of the lamp say, lie outside of n = {} to T / t_row = {:.1f}: "
        "check t_row and the number of rows",
        mode.shifts_measured.value(), o.rows, frame_period / row_time);
  } else {
    mode.shifts_reason =
        fmt::format("{} to {} fit, modulo {:.2f} rows: film for longer, with fewer flashes a second",
                    fitting.front(), fitting.back(), modulo);
  }
}

}  // namespace

Result<ReadMode> find_read_mode(std::span<const FrameReading> frames, const ReadModeOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  ReadMode mode;
  const std::vector<SeenDot> dots = dots_of(frames);
  std::set<double> shown;
  for (const SeenDot& dot : dots) shown.insert(dot.frame);
  mode.frames = static_cast<int>(shown.size());
  const SeenFit fit(dots, options);
  const Walk down = fit.along(+1);
  const Walk up = fit.along(-1);
  decide_direction(down, up, dots.size(), mode.frames, options, mode);
  if (!mode.direction) {
    mode.shifts_reason = "the read direction isn't known";
    return mode;
  }
  const Walk& walk = mode.direction == ReadDirection::top_first ? down : up;
  mode.residual = Rows(walk.residual);
  mode.dots = walk.dots[0] + walk.dots[1];
  const double period = 1 / options.frame_rate.value();
  mode.frame_rate_error = PartsPerMillion((period / (period + walk.frame_period_change) - 1) * 1e6);
  mode.frame_rate_sigma = PartsPerMillion(walk.frame_period_sigma / period * 1e6);
  find_shifts(walk, options, mode);
  return mode;
}

}  // namespace emberlock::smear
