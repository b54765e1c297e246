// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/exposure_sweep.h"

#include <algorithm>
#include <cmath>
#include <string>

namespace emberlock::smear {
namespace {

constexpr std::size_t kFewestDelays = 4;
constexpr int kFirstDelays = 24;  // over the period: an exposure of a tenth of it is hit twice
constexpr int kSteps = 4;         // the last step hits an exposure of 1/192 of the period
constexpr int kStride = 7;        // between consecutive delays; coprime to their number
constexpr double kPartial = 6;    // sigmas from both levels: a flash cut by an edge

Error refuse(std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), "exposure sweep", std::move(remedy)};
}

struct Levels {
  double dark = 0;
  double lit = 0;
  double sigma = 0;       ///< the largest of the samples'
  std::size_t whole = 0;  ///< fully lit samples
  [[nodiscard]] double part(double level) const { return (level - dark) / (lit - dark); }
};

double median(std::vector<double> v) {
  const auto middle = v.begin() + static_cast<std::ptrdiff_t>(v.size() / 2);
  std::nth_element(v.begin(), middle, v.end());
  return *middle;
}

Result<Levels> levels_of(const std::vector<SweepSample>& samples, const SweepOptions& options) {
  Levels levels;
  double low = samples.front().level;
  double high = low;
  for (const SweepSample& s : samples) {
    low = std::min(low, s.level);
    high = std::max(high, s.level);
    levels.sigma = std::max(levels.sigma, s.sigma);
  }
  const auto alike = [] {
    return refuse("the pictures are alike at every delay of the flash",
                  "shorten an exposure that lasts the whole period, or bring the strobe into view");
  };
  if (!(high > low)) return alike();
  // Samples with a partial flash are neither dark nor lit.
  std::vector<double> dark;
  std::vector<double> lit;
  for (const SweepSample& s : samples) {
    if (s.level <= low + kPartial * levels.sigma) dark.push_back(s.level);
    if (s.level >= high - kPartial * levels.sigma) lit.push_back(s.level);
  }
  levels.dark = median(dark);
  levels.lit = median(lit);
  levels.whole = lit.size();
  // The extremes of many equal pictures may differ that much; the medians near them don't.
  if (!(levels.lit - levels.dark > options.min_snr * levels.sigma)) return alike();
  return levels;
}

/// An edge of the window, between a sample on either side.
struct WindowEdge {
  double place = 0;
  double sigma = 0;
};

/// `out` and `in` are the last dark and the first lit delay (reversed at the end of the window); `sign` is +1
/// at the beginning of the window.
WindowEdge place_edge(const SweepSample& out, const SweepSample& in, double sign, const Levels& levels,
                      const SweepOptions& options, bool saturated) {
  const double period = options.period.value();
  const double width = options.flash_width.value();
  const double gap = wrap_symmetric(in.delay.value() - out.delay.value(), period);
  const double middle = out.delay.value() + gap / 2;
  // A clipped partial flash can't be distinguished from a whole one: half of the gap and of the flash are two
  // sigmas.
  if (saturated) return {middle, (std::abs(gap) + width) / 4};
  // Partial flashes this close to zero or to a whole flash can't be distinguished from these.
  const auto blurred = [&](const SweepSample& s) { return kPartial * s.sigma / (levels.lit - levels.dark); };
  const auto cut = [&](const SweepSample& s) {
    const double part = levels.part(s.level);
    const double noise = blurred(s);
    return part > noise && part < 1 - noise;
  };
  for (const SweepSample* s : {&out, &in}) {
    if (!cut(*s)) continue;
    // The window contains the part of the flash on its side of the edge.
    const double place = s->delay.value() - sign * (levels.part(s->level) - 0.5) * width;
    return {place, s->sigma / (levels.lit - levels.dark) * width};
  }
  const double hidden = std::min(1.0, blurred(out) + blurred(in)) * width;
  return {middle, std::max(std::abs(gap) - width + hidden, 0.1 * width) / std::sqrt(12.0)};
}

std::vector<SweepSample> in_order(std::span<const SweepSample> samples, Seconds period) {
  std::vector<SweepSample> sorted(samples.begin(), samples.end());
  for (SweepSample& s : sorted) s.delay = wrap_positive(s.delay, period);
  std::stable_sort(sorted.begin(), sorted.end(),
                   [](const SweepSample& a, const SweepSample& b) { return a.delay < b.delay; });
  return sorted;
}

}  // namespace

Result<ExposureWindow> fit_exposure(std::span<const SweepSample> samples, const SweepOptions& options) {
  if (samples.size() < kFewestDelays)
    return refuse("fewer than four delays were filmed", "sweep over the whole period");
  const std::vector<SweepSample> sorted = in_order(samples, options.period);
  EMBERLOCK_ASSIGN_OR_RETURN(const Levels levels, levels_of(sorted, options));
  ExposureWindow window;
  window.dark = levels.dark;
  window.lit = levels.lit;
  window.saturated = std::any_of(sorted.begin(), sorted.end(), [&](const SweepSample& s) {
    return s.clipped && levels.part(s.level) >= 0.5;
  });
  int begins = 0;
  for (std::size_t i = 0; i < sorted.size(); ++i) {
    const SweepSample& a = sorted[i];
    const SweepSample& b = sorted[(i + 1) % sorted.size()];
    const bool a_lit = levels.part(a.level) >= 0.5;
    const bool b_lit = levels.part(b.level) >= 0.5;
    if (a_lit == b_lit) continue;
    const WindowEdge edge = b_lit ? place_edge(a, b, +1, levels, options, window.saturated)
                                  : place_edge(b, a, -1, levels, options, window.saturated);
    (b_lit ? window.begin : window.end) = wrap_positive(Seconds(edge.place), options.period);
    (b_lit ? window.begin_sigma : window.end_sigma) = Seconds(edge.sigma);
    begins += b_lit ? 1 : 0;
  }
  if (begins != 1) {
    return refuse("light and dark alternate " + std::to_string(begins) + " times in one period",
                  "switch other lights off, and leave camera and strobe alone during the sweep");
  }
  return window;
}

std::vector<Seconds> even_delays(int step, Seconds period) {
  std::vector<Seconds> delays;
  if (step < 0 || step >= kSteps) return delays;
  const int count = step == 0 ? kFirstDelays : kFirstDelays << (step - 1);
  for (int i = 0; i < count; ++i) {
    const int place = i * kStride % count;
    delays.push_back(period * ((place + (step == 0 ? 0 : 0.5)) / count));
  }
  return delays;
}

int even_delay_count() { return kFirstDelays << (kSteps - 1); }

std::vector<Seconds> next_delays(std::span<const SweepSample> samples, const SweepOptions& options,
                                 Seconds resolution, SweepEdges edges) {
  if (samples.size() < kFewestDelays) return even_delays(0, options.period);
  std::vector<Seconds> delays;
  const std::vector<SweepSample> sorted = in_order(samples, options.period);
  const auto levels = levels_of(sorted, options);
  if (!levels.ok()) {
    int step = 1;  // the steps before it have been filmed
    while (step < kSteps && samples.size() >= static_cast<std::size_t>(kFirstDelays) << step) ++step;
    return even_delays(step, options.period);
  }
  const auto window = fit_exposure(samples, options);
  if (!window.ok()) return delays;
  // A short exposure may have been hit by only one flash, cut by an edge.
  if (levels->whole < 2) {
    const auto brightest = std::max_element(sorted.begin(), sorted.end(),
                                            [](const auto& a, const auto& b) { return a.level < b.level; });
    return {brightest->delay - options.flash_width, brightest->delay + options.flash_width};
  }
  // With clipped flashes an edge can't be located better than a quarter of their width.
  if (window->saturated) resolution = std::max(resolution, options.flash_width / 3);
  if (window->end_sigma > resolution) delays.push_back(window->end);
  if (edges == SweepEdges::both && window->begin_sigma > resolution) delays.push_back(window->begin);
  return delays;
}

Phase phase_of(const ExposureWindow& window, Seconds delay, Seconds period) {
  return {PhaseState::known, wrap_positive(delay - window.end, period), window.end_sigma, {}};
}

}  // namespace emberlock::smear
