// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/clocks/flash_rate.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "base/one_to_one.h"
#include "base/square.h"
#include "smear_sync/clocks/phase.h"
#include "smear_sync/clocks/weighted_line.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<FlashesSeen, std::string_view, 6> kSeenNames{{{{FlashesSeen::rate, "rate"},
                                                                  {FlashesSeen::hidden, "hidden"},
                                                                  {FlashesSeen::too_slow, "too-slow"},
                                                                  {FlashesSeen::too_fast, "too-fast"},
                                                                  {FlashesSeen::unsteady, "unsteady"},
                                                                  {FlashesSeen::none, "none"}}}};

constexpr std::size_t kFewestFlashes = 3;
/// Two observed flashes may be up to this many periods apart, with all flashes between them hidden.
constexpr int kMostHidden = 4;
/// Tolerance for the time of a flash, as part of the frame period: the effect of a row time that is 1 % off.
constexpr double kMisplaced = 0.01;
/// The same as part of the flash period, so that not every period fits.
constexpr double kMisplacedOfOwn = 0.12;
/// Two cameras' periods agree if they differ by less than this, or by less than six standard errors.
constexpr double kAlike = 500e-6;
constexpr double kAlikeSigmas = 6;
/// No dot is expected this close to the lamp (radii, rows) or to the picture's edge (rows).
constexpr double kBloomRadii = 4;
constexpr Rows kBloomRows{12};
constexpr Rows kHiddenEdge{4};
/// A camera may miss this share of the dots that it should show.
constexpr double kMissedPart = 0.1;
/// This many places where a flash should show but doesn't rule a rate out.
constexpr int kMissed = 2;

struct FlashInstant {
  double t = 0;  ///< on the camera's clock: i T + tau
  double sigma = 0;
};

struct CameraFlashes {
  const FlashFilm* film = nullptr;
  std::vector<FlashInstant> flashes;
  LampReading lamp{};  ///< the last observed one
};

struct FlashPeriod {
  double period = 0;
  double sigma = 0;
};

std::vector<FlashInstant> instants_of(const FlashFilm& film, Seconds flash_width) {
  const CcdTiming& timing = film.timing;
  const double resolution = row_resolution(timing.row_time, flash_width).value();
  std::vector<FlashInstant> flashes;
  for (const FrameReading& frame : film.frames) {
    const SmearReading& reading = frame.reading;
    if (!reading.lamp || (reading.state != SmearState::dot && reading.state != SmearState::comb)) continue;
    for (const DotReading& dot : reading.dots) {
      const Rows below = static_cast<double>(timing.direction) * (dot.y - reading.lamp->y);
      const Rows shifted = wrap_positive(below, Rows(timing.shifts)) + Rows(0.5);
      // A wrapped dot belongs to the read phase before its own frame's.
      const double frames = static_cast<double>(frame.frame) - (below < Rows(0) ? 1 : 0);
      flashes.push_back({frames * timing.frame_period.value() + (shifted * timing.row_time).value(),
                         std::hypot((dot.sigma * timing.row_time).value(), resolution)});
    }
  }
  std::sort(flashes.begin(), flashes.end(),
            [](const FlashInstant& a, const FlashInstant& b) { return a.t < b.t; });
  return flashes;
}

/// The period near `guess` of which all intervals between flashes are multiples; nullopt if some aren't.
std::optional<FlashPeriod> fit_period(const std::vector<FlashInstant>& flashes, double guess,
                                      const CcdTiming& timing, double resolution) {
  const double allowed = std::min(kMisplaced * timing.frame_period.value(), kMisplacedOfOwn * guess);
  std::vector<LinePoint> points{{0, flashes[0].t, 1 / square(flashes[0].sigma)}};
  double period = guess;
  for (std::size_t i = 1; i < flashes.size(); ++i) {
    // Counted from the last flash: the period isn't accurate enough yet for longer intervals.
    const double apart = flashes[i].t - flashes[i - 1].t;
    const double whole = std::round(apart / period);
    if (whole < 1 || std::abs(apart - whole * period) > allowed) return std::nullopt;
    points.push_back({points.back().t + whole, flashes[i].t, 1 / square(flashes[i].sigma)});
    if (i + 1 >= kFewestFlashes) period = weighted_line(points).rate;
  }
  const WeightedLine line = weighted_line(points);
  for (const LinePoint& p : points) {
    if (std::abs(p.y - line.level - line.rate * (p.t - line.middle)) > allowed) return std::nullopt;
  }
  const double span = points.back().t;
  const double stairs = 2.1 * resolution / span;  // like staircase_rate_error(), for the period
  return FlashPeriod{line.rate, std::sqrt(line.rate_variance + square(stairs))};
}

/// Whether the lamp was lit during the exposure, and a dot of any flash would be read.
bool shows_lamp(const SmearReading& reading) {
  return reading.state == SmearState::dot || reading.state == SmearState::comb ||
         reading.state == SmearState::no_dot;
}

/// Whether a flash at `t` would show as a dot in a frame that was filmed and readable. The flash lights the
/// lamp in the next image, which is then being exposed. A wrapped dot is in that image too. A dot that isn't
/// wrapped is in the image being read out; it can be read if an earlier flash lit the lamp in that image.
bool would_show(double t, const FlashFilm& film, const LampReading& lamp) {
  const CcdTiming& timing = film.timing;
  const double period = timing.frame_period.value();
  const double frame = std::floor(t / period);
  const double k = std::floor((t - frame * period) / timing.row_time.value());
  if (k >= timing.shifts) return false;
  const double d = static_cast<double>(timing.direction);
  const auto shows = [&](Rows row) {
    const Rows near = kBloomRadii * Rows(lamp.radius) + kBloomRows;
    return row >= kHiddenEdge && row <= Rows(timing.rows - 1) - kHiddenEdge && abs(row - lamp.y) > near;
  };
  const Rows moved = lamp.y + Rows(d * k);
  const bool here = shows(moved);
  if (!here && !shows(moved - Rows(d * timing.shifts))) return false;
  return std::any_of(film.frames.begin(), film.frames.end(), [&](const FrameReading& shown) {
    const bool readable = shows_lamp(shown.reading) || (!here && shown.reading.state == SmearState::no_lamp);
    return readable && static_cast<double>(shown.frame) == (here ? frame : frame + 1);
  });
}

/// Whether flashes of this period should be visible between those that a camera saw, but aren't.
bool too_fast_for(const CameraFlashes& camera, double period) {
  const std::vector<FlashInstant>& flashes = camera.flashes;
  std::size_t missed = 0;
  for (std::size_t i = 0; i + 1 < flashes.size(); ++i) {
    const double whole = std::round((flashes[i + 1].t - flashes[i].t) / period);
    for (double between = 1; between < whole; ++between)
      missed += would_show(flashes[i].t + between * period, *camera.film, camera.lamp) ? 1 : 0;
  }
  return static_cast<double>(missed) > std::max(1.0, kMissedPart * static_cast<double>(flashes.size()));
}

/// The longest period that explains a camera's flashes.
std::optional<FlashPeriod> period_of(const CameraFlashes& camera, Seconds flash_width) {
  if (camera.flashes.size() < kFewestFlashes) return std::nullopt;
  double least = camera.flashes.back().t - camera.flashes.front().t;
  for (std::size_t i = 1; i < camera.flashes.size(); ++i)
    least = std::min(least, camera.flashes[i].t - camera.flashes[i - 1].t);
  const CcdTiming& timing = camera.film->timing;
  if (!(least > 2 * timing.row_time.value())) return std::nullopt;
  const double resolution = row_resolution(timing.row_time, flash_width).value();
  for (int hidden = 1; hidden <= kMostHidden; ++hidden) {
    const auto fit = fit_period(camera.flashes, least / hidden, timing, resolution);
    if (fit && !too_fast_for(camera, fit->period)) return fit;
  }
  return std::nullopt;
}

/// The ratio of a camera's period to `period`, if some of its flashes are hidden; 0: not an integer.
int times(const FlashPeriod& seen, const FlashPeriod& period) {
  const double ratio = seen.period / period.period;
  const double whole = std::round(ratio);
  if (whole < 1 || whole > kMostHidden) return 0;
  const double apart = std::abs(seen.period - whole * period.period);
  const double sigma = std::hypot(seen.sigma, whole * period.sigma);
  return apart <= std::max(kAlike * seen.period, kAlikeSigmas * sigma) ? static_cast<int>(whole) : 0;
}

/// times() for a camera, or 0 if it contradicts the period.
int of_period(const CameraFlashes& camera, const std::optional<FlashPeriod>& seen,
              const FlashPeriod& period) {
  const int whole = seen ? times(*seen, period) : 0;
  return whole > 1 && too_fast_for(camera, period.period) ? 0 : whole;
}

/// Whether all additional flashes of a strobe `faster` times as fast would be hidden from all cameras.
bool all_hidden(const std::vector<CameraFlashes>& cameras, double period, int faster) {
  int missed = 0;
  for (const CameraFlashes& camera : cameras) {
    for (std::size_t i = 0; i + 1 < camera.flashes.size(); ++i) {
      for (int between = 1; between < faster; ++between) {
        const double t = camera.flashes[i].t + period * between / faster;
        if (t >= camera.flashes[i + 1].t - period / (2 * faster)) break;
        if (would_show(t, *camera.film, camera.lamp) && ++missed >= kMissed) return false;
      }
    }
  }
  return true;
}

/// Whether flashes of this period explain all pictures in which the lamp is lit.
bool lights_all(const std::vector<CameraFlashes>& cameras, double period) {
  int lit = 0;
  int dark = 0;  // of those, without a flash during the exposure
  for (const CameraFlashes& camera : cameras) {
    const double frame_period = camera.film->timing.frame_period.value();
    for (const FrameReading& frame : camera.film->frames) {
      if (!shows_lamp(frame.reading)) continue;
      const double from = static_cast<double>(frame.frame - 1) * frame_period - camera.flashes[0].t;
      const double slack = kMisplaced * frame_period;
      const double flash = std::ceil((from - slack) / period) * period;
      ++lit;
      dark += flash > from + frame_period + slack ? 1 : 0;
    }
  }
  return dark <= std::max(1.0, kMissedPart * lit);
}

/// Why no rate can be determined.
FlashRate without_rate(std::span<const FlashFilm> cameras, bool unsteady) {
  int lit = 0;
  int lines = 0;
  int frames = 0;
  for (const FlashFilm& camera : cameras) {
    for (const FrameReading& frame : camera.frames) {
      ++frames;
      const SmearState state = frame.reading.state;
      lit += state != SmearState::no_lamp ? 1 : 0;
      lines += state == SmearState::steady ? 1 : 0;
    }
  }
  FlashRate none;
  if (lit == 0) return none;
  none.seen = FlashesSeen::unsteady;
  if (2 * lines > lit) {
    none.seen = FlashesSeen::too_fast;
  } else if (2 * lit < frames) {
    none.seen = FlashesSeen::too_slow;
    std::size_t longest = 1;
    for (const FlashFilm& camera : cameras) longest = std::max(longest, camera.frames.size());
    none.rate = Hertz(static_cast<double>(kFewestFlashes) /
                      (static_cast<double>(longest) * cameras.front().timing.frame_period.value()));
  } else if (!unsteady) {
    none.seen = FlashesSeen::hidden;
  }
  return none;
}

}  // namespace

std::string_view name(FlashesSeen seen) { return kSeenNames.second_of(seen).value_or("unknown"); }

FlashRate see_flashes(std::span<const FlashFilm> films, Seconds flash_width) {
  std::vector<CameraFlashes> cameras;
  std::vector<std::optional<FlashPeriod>> periods;
  bool dots = false;
  for (const FlashFilm& film : films) {
    CameraFlashes camera{&film, instants_of(film, flash_width)};
    for (const FrameReading& frame : film.frames) camera.lamp = frame.reading.lamp.value_or(camera.lamp);
    dots = dots || camera.flashes.size() >= kFewestFlashes;
    periods.push_back(period_of(camera, flash_width));
    cameras.push_back(std::move(camera));
  }
  // The period of the majority; a camera that shows only some of the flashes agrees with one that shows all.
  std::optional<FlashPeriod> best;
  int most = 0;
  for (const auto& candidate : periods) {
    if (!candidate) continue;
    int agree = 0;
    for (std::size_t i = 0; i < periods.size(); ++i)
      agree += of_period(cameras[i], periods[i], *candidate) > 0;
    const bool longer = best && candidate->period > best->period;
    if (agree > most || (agree == most && longer)) best = candidate;
    most = std::max(most, agree);
  }
  const auto told =
      std::count_if(periods.begin(), periods.end(), [](const auto& p) { return p.has_value(); });
  if (!best || 2 * most < told) return without_rate(films, dots);

  double weights = 0;
  double moment = 0;
  std::vector<CameraFlashes> agreeing;
  std::vector<std::optional<OwnFlashes>> own(periods.size());
  for (std::size_t i = 0; i < periods.size(); ++i) {
    const int whole = of_period(cameras[i], periods[i], *best);
    if (const auto& seen = periods[i])
      own[i] =
          OwnFlashes{Hertz(1 / seen->period), PartsPerMillion(1e6 * seen->sigma / seen->period), whole > 0};
    if (whole == 0) continue;
    const double w = square(whole / periods[i]->sigma);
    weights += w;
    moment += w * periods[i]->period / whole;
    agreeing.push_back(std::move(cameras[i]));
  }
  const double period = moment / weights;
  std::vector<int> possible;  // multiples of the rate given by the dots
  for (int faster = 1; faster <= kMostHidden; ++faster) {
    if (all_hidden(agreeing, period, faster)) possible.push_back(faster);
  }
  const auto lit = std::find_if(possible.begin(), possible.end(),
                                [&](int faster) { return lights_all(agreeing, period / faster); });
  if (lit != possible.end()) possible.erase(possible.begin(), lit);
  FlashRate found{FlashesSeen::rate,
                  Hertz(possible.front() / period),
                  PartsPerMillion(1e6 / std::sqrt(weights) / period),
                  {},
                  static_cast<int>(agreeing.size()),
                  std::move(own)};
  for (std::size_t i = 1; i < possible.size(); ++i) found.others.push_back(Hertz(possible[i] / period));
  return found;
}

}  // namespace emberlock::smear
