// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/clip_line.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/square.h"
#include "smear_sync/clocks/staircase.h"
#include "smear_sync/verify/median.h"

namespace emberlock::smear {
namespace {

constexpr PartsPerMillion kNextToTheWalk{
    60};  // the largest difference between the rates of a line and of the walk
constexpr PartsPerMillion kNextToTheClaim{500};
constexpr std::size_t kFewestDots = 5;   // also per side: fewer may be stray dots
constexpr double kOneLine = 1.5;         // rows: at least half of the dots must lie this close to their line
constexpr double kSigmasOfShifts = 4;    // beyond these another K is ruled out, as in find_read_mode()
constexpr double kMostMiss = 3;          // limit of a dot's residual in standard errors; stray dots have more
constexpr double kLeastMiss = 0.05;      // rows: lower limit of a dot's error
constexpr double kLeastProbable = 1e-3;  // of a K, relative to the most probable one

/// Whether the frame's dot belongs to the previous read phase: it is behind the lamp in read order.
bool wrapped(const SmearReading& reading, ReadDirection direction) {
  if (reading.dots.size() != 1 || !reading.lamp) return false;
  return static_cast<double>(direction) * (reading.dots.front().y - reading.lamp->y) < Rows(0);
}

/// The dots used for a line.
enum class DotsUsed { all, ahead, behind };

/// A value of K with its probability.
struct ShiftsGuess {
  int shifts;
  double probability;
};

/// The knowledge of K, and which dots can be used with it.
struct ShiftsKnown {
  std::vector<ShiftsGuess> guesses;  ///< sorted by probability, the largest first; the sum is 1
  DotsUsed use = DotsUsed::all;
};

/// The values of K compatible with both sides of the lamp; empty if none is.
std::vector<ShiftsGuess> measured_shifts(const ReadMode& mode, const ShiftsRange& range) {
  std::vector<ShiftsGuess> guesses;
  const double sigma = std::max(mode.shifts_sigma.value(), 1e-3);
  const double reach = std::max(0.5, kSigmasOfShifts * sigma);
  double sum = 0;
  double most = 0;
  for (int k = range.least; k <= range.most; ++k) {
    const double off = wrap_symmetric(k - mode.shifts_measured.value(), mode.shifts_modulo.value());
    if (std::abs(off) > reach) continue;
    guesses.push_back({k, std::exp(-square(off / sigma) / 2)});
    most = std::max(most, guesses.back().probability);
  }
  std::erase_if(guesses, [&](const ShiftsGuess& g) { return g.probability < kLeastProbable * most; });
  for (const ShiftsGuess& g : guesses) sum += g.probability;
  for (ShiftsGuess& g : guesses) g.probability /= sum;
  std::sort(guesses.begin(), guesses.end(),
            [](const ShiftsGuess& a, const ShiftsGuess& b) { return a.probability > b.probability; });
  return guesses;
}

ShiftsKnown what_is_known(std::span<const FrameReading> frames, const ClipOptions& options,
                          const ClipClock& clock) {
  if (const auto told = clock.mode.shifts ? clock.mode.shifts : options.shifts) return {{{*told, 1}}};
  std::array<std::size_t, 2> dots{};
  for (const FrameReading& f : frames) {
    if (f.reading.state == SmearState::dot && f.reading.lamp)
      ++dots[wrapped(f.reading, clock.timing.direction) ? 1 : 0];
  }
  const ShiftsRange range = possible_shifts(clock.timing);
  if (std::min(dots[0], dots[1]) >= kFewestDots && clock.mode.shifts_measured > Rows(0)) {
    std::vector<ShiftsGuess> guesses = measured_shifts(clock.mode, range);
    if (!guesses.empty()) return {std::move(guesses)};
  }
  return {{{range.least, 1}}, dots[1] > dots[0] ? DotsUsed::behind : DotsUsed::ahead};
}

/// Phases against the camera's own count. Frames whose count is uncertain because of losses are left out.
std::vector<PhaseSample> samples_of(std::span<const FrameReading> frames, const ClipClock& clock,
                                    Seconds flash_width, DotsUsed use) {
  std::vector<PhaseSample> samples;
  for (const FrameReading& f : frames) {
    const bool between_runs =
        std::any_of(clock.numbers.drops.begin(), clock.numbers.drops.end(),
                    [&](const DroppedFrames& d) { return f.frame > d.after && f.frame < d.before; });
    const bool behind = wrapped(f.reading, clock.timing.direction);
    const bool left_out =
        f.reading.state == SmearState::dot && use != DotsUsed::all && behind != (use == DotsUsed::behind);
    const auto read_phase = static_cast<double>(clock.count_of(f.frame) - (behind ? 1 : 0));
    const TimePoint start = TimePoint{} + clock.believed_period * read_phase;
    const char* why_not = between_runs ? "a frame was lost near it"
                          : left_out ? "it stands on the other side of the lamp than most, and K isn't known"
                                     : nullptr;
    samples.push_back(why_not != nullptr ? PhaseSample{start, {PhaseState::unusable, {}, {}, why_not}}
                                         : sample_of(f.reading, clock.timing, flash_width, start));
    samples.back().at = start;  // modulo P, phases are linear in the starts of the read phases
  }
  return samples;
}

/// The deviation of dots from the staircase of a line: the mean square in their own standard errors, each
/// limited to kMostMiss, at least 1 in total; and the number of distinct rows.
struct Misfit {
  double squares = 1;
  std::size_t rows = 0;
};
Misfit misfit_of(std::span<const PhaseSample> samples, const Drift& line, const ClipOptions& options,
                 Seconds period) {
  const double turn = (period / options.row_time).value();
  const double width = (options.flash_width / options.row_time).value();
  std::vector<double> offs;
  std::vector<double> sigmas;
  std::set<long> rows;
  for (const PhaseSample& s : samples) {
    if (s.phase.state != PhaseState::known || !s.shifted) continue;
    const double x = (phase_at(line, s.at, period).tau / options.row_time).value();
    offs.push_back(wrap_symmetric(s.shifted->rows.value() - stair(x, width), turn));
    sigmas.push_back(std::max(s.shifted->sigma.value(), kLeastMiss));
    rows.insert(std::lround(s.shifted->rows.value()));
  }
  if (offs.empty()) return {};
  const double lamp = median(offs);  // error of the lamp's row
  double sum = 0;
  for (std::size_t i = 0; i < offs.size(); ++i)
    sum += std::min(square((offs[i] - lamp) / sigmas[i]), square(kMostMiss));
  return {std::max(1.0, sum / static_cast<double>(offs.size())), rows.size()};
}

/// Fits the line through the samples and stores each dot's residual; false, with the reason, if there is
/// none.
bool fit_line(std::span<const FrameReading> frames, const ClipOptions& options, DotsUsed use,
              ClipClock& clock, Misfit& misfit) {
  const std::vector<PhaseSample> samples = samples_of(frames, clock, options.flash_width, use);
  const auto known = std::count_if(samples.begin(), samples.end(),
                                   [](const PhaseSample& s) { return s.phase.state == PhaseState::known; });
  if (known < static_cast<std::ptrdiff_t>(kFewestDots)) {
    const Phase none = combine(samples, {}, {.period = clock.flash_period});
    clock.state = none.state == PhaseState::blind ? PhaseState::blind : PhaseState::unusable;
    clock.reason =
        frames.size() < 2 * kFewestDots
            ? fmt::format("it has {} frames only; film the strobe for ten seconds", frames.size())
            : fmt::format("{} of its {} frames show a dot; most say: {}", known, frames.size(), none.reason);
    return false;
  }
  const bool told = clock.mode.frame_rate_error.has_value();
  const Seconds walk_a_frame = clock.flash_period - clock.timing.frame_period;
  const DriftOptions with{.period = clock.flash_period,
                          .row_time = options.row_time,
                          .row_time_sigma = options.row_time_sigma,
                          .lamp_sigma = clock.lamp_sigma,
                          .flash_width = options.flash_width,
                          .expected = PartsPerMillion(1e6 * (walk_a_frame / clock.believed_period)),
                          .fastest = told ? kNextToTheWalk : kNextToTheClaim};
  const Result<Drift> line = fit_drift(samples, with);
  if (!line.ok()) {
    clock.reason = line.error().what;
    return false;
  }
  clock.line = *line;
  misfit = misfit_of(samples, *line, options, clock.flash_period);
  clock.points.clear();
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].phase.state != PhaseState::known) continue;
    const Phase fitted = phase_at(*line, samples[i].at, clock.flash_period);
    const Seconds residual = wrap_symmetric(samples[i].phase.tau - fitted.tau, clock.flash_period);
    clock.points.push_back(
        {static_cast<int>(i), frames[i].reading.dots.front().y, samples[i].phase.tau, residual});
  }
  return true;
}

/// The line for one K, with its probability.
struct LineGuess {
  Drift line;
  double probability;
};

/// The number of rows by which wrapped dots deviate from the line of the others: the excess of K. A walk in
/// which a lost frame wasn't counted gives a wrong K.
int excess_shifts(std::span<const FrameReading> frames, const ClipClock& clock) {
  std::array<std::vector<double>, 2> residuals;
  for (const ClipPoint& p : clock.points) {
    const SmearReading& reading = frames[static_cast<std::size_t>(p.frame)].reading;
    residuals[wrapped(reading, clock.timing.direction) ? 1 : 0].push_back(
        (p.residual / clock.timing.row_time).value());
  }
  if (std::min(residuals[0].size(), residuals[1].size()) < kFewestDots) return 0;
  return static_cast<int>(std::lround(median(residuals[1]) - median(residuals[0])));
}

/// Reduces the probability of lines whose staircase the dots don't fit: the likelihood for normal errors of
/// unknown size. Dots in the same row have the same error and count once.
void weigh_by_misfit(std::span<const Misfit> misfits, std::vector<LineGuess>& lines) {
  double least = misfits[0].squares;
  for (const Misfit& m : misfits) least = std::min(least, m.squares);
  for (std::size_t i = 0; i < lines.size(); ++i)
    lines[i].probability *= std::pow(misfits[i].squares / least, -0.5 * static_cast<double>(misfits[0].rows));
}

/// Mean and deviation of alternative lines, of which one is right, each with its own errors. If they differ
/// in both phase and rate, the errors of the mean line are independent at another instant than the lines'
/// middle; the result refers to that instant.
Drift mean_line(std::span<const LineGuess> guesses, Seconds period) {
  Drift mean = guesses.front().line;
  double sum = 0;
  double tau = 0;
  double rate = 0;
  std::vector<std::pair<double, double>> offs;  // deviation of each line at mean.at: tau in s, rate
  for (const LineGuess& g : guesses) {
    const Phase there = phase_at(g.line, mean.at, period);
    offs.emplace_back(wrap_symmetric(there.tau - guesses.front().line.tau, period).value(),
                      1e-6 * (g.line.rate - mean.rate).value());
    sum += g.probability;
    tau += g.probability * offs.back().first;
    rate += g.probability * offs.back().second;
  }
  tau /= sum;
  rate /= sum;
  double of_tau = 0;
  double of_rate = 0;
  double of_both = 0;
  for (std::size_t i = 0; i < guesses.size(); ++i) {
    const Drift& line = guesses[i].line;
    const double share = guesses[i].probability / sum;
    const double elapsed = (mean.at - line.at).value();
    const double own_rate = 1e-6 * line.rate_sigma.value();
    of_tau +=
        share * (square(offs[i].first - tau) + square(line.tau_sigma.value()) + square(own_rate * elapsed));
    of_rate += share * (square(offs[i].second - rate) + square(own_rate));
    of_both += share * ((offs[i].first - tau) * (offs[i].second - rate) + square(own_rate) * elapsed);
  }
  const double later = of_rate > 0 ? -of_both / of_rate : 0;
  rate += 1e-6 * mean.rate.value();
  mean.at = mean.at + Seconds(later);
  mean.tau = wrap_positive(mean.tau + Seconds(tau + rate * later), period);
  mean.tau_sigma = Seconds(std::sqrt(std::max(0.0, of_tau + of_both * later)));
  mean.rate = PartsPerMillion(1e6 * rate);
  mean.rate_sigma = PartsPerMillion(1e6 * std::sqrt(of_rate));
  mean.tau_by_row_time += Seconds(1e-6 * mean.rate_by_row_time.value() * later);
  return mean;
}

}  // namespace

ShiftsRange possible_shifts(const CcdTiming& timing) {
  const int room = static_cast<int>(std::floor((timing.frame_period / timing.row_time).value()));
  return {timing.rows, std::max(timing.rows, room)};
}

void find_line(std::span<const FrameReading> frames, const ClipOptions& options, ClipClock& clock) {
  clock.line.reset();
  clock.points.clear();
  clock.state = PhaseState::unusable;
  clock.reason.clear();
  clock.tau_slack = Seconds(0);
  const ShiftsKnown known = what_is_known(frames, options, clock);
  std::vector<LineGuess> lines;
  std::vector<Misfit> misfits;
  std::vector<int> shifts;
  std::vector<std::vector<ClipPoint>> points;
  for (const ShiftsGuess& guess : known.guesses) {
    clock.timing.shifts = guess.shifts;
    Misfit& misfit = misfits.emplace_back();
    if (!fit_line(frames, options, known.use, clock, misfit)) return clock.line.reset();
    const int excess = known.guesses.size() > 1 ? 0 : excess_shifts(frames, clock);
    if (excess != 0) {
      clock.timing.shifts = std::max(clock.timing.rows, guess.shifts - excess);
      if (!fit_line(frames, options, known.use, clock, misfit)) return clock.line.reset();
    }
    shifts.push_back(clock.timing.shifts);
    lines.push_back({*clock.line, guess.probability});
    points.push_back(std::move(clock.points));
  }
  weigh_by_misfit(misfits, lines);
  const auto best = static_cast<std::size_t>(
      std::max_element(lines.begin(), lines.end(),
                       [](const LineGuess& a, const LineGuess& b) { return a.probability < b.probability; }) -
      lines.begin());
  clock.timing.shifts = shifts[best];
  clock.points = std::move(points[best]);
  std::swap(lines[0], lines[best]);
  clock.line = lines.size() > 1 ? mean_line(lines, clock.flash_period) : lines[0].line;
  if (known.use == DotsUsed::behind) {
    const ShiftsRange range = possible_shifts(clock.timing);
    clock.tau_slack = Rows(range.most - range.least) * options.row_time;
  }
  clock.timing.frame_period = clock.flash_period - clock.believed_period * (clock.line->rate.value() * 1e-6);
  clock.period_sigma = clock.believed_period * (clock.line->rate_sigma.value() * 1e-6);
  std::vector<double> distances;
  for (const ClipPoint& p : clock.points)
    distances.push_back(std::abs((p.residual / options.row_time).value()));
  if (const double typical = median(distances); typical > kOneLine) {
    clock.reason = fmt::format(
        "its dots stand {:.1f} rows off any steady walk: another strobe, a rate that isn't {:.4f} flashes a "
        "second, or frames lost without a code",
        typical, options.flash_rate.value());
    return;
  }
  clock.state = PhaseState::known;
}

}  // namespace emberlock::smear
