// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "base/random.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/phase.h"
#include "smear_sync/clocks/read_mode.h"

namespace emberlock::test {

/// One camera and one strobe, by their clocks alone: what is filmed are readings, without pixels.
struct ClockFilm {
  smear::CcdTiming timing{.rows = 720, .shifts = 740};
  double flash_rate = 300;
  double first_flash = 0;  ///< s after the start of frame 0's read phase
  int frames = 24;
  double lamp = 360;        ///< row, as displayed
  double lamp_error = 0;    ///< of the lamp as read: constant, rows
  double dot_noise = 0.05;  ///< RMS, rows
  double lamp_noise = 0;    ///< the same of the lamp
  double flash_width = 20e-6;
  double jitter = 0;      ///< of each flash, RMS, s
  double hidden = 15;     ///< rows about the lamp in which its bloom hides dots
  double miss = 0;        ///< probability that a dot isn't seen
  double false_dots = 0;  ///< a frame, on average
  bool sweep_out = false;
  std::vector<bool> code{};  ///< repeated; false skips
  std::uint64_t seed = 1;
};

/// Readings straight from the flashes' times: a dot stands the whole rows that were shifted out from its
/// lamp, wrapped at K, hidden near the lamp; one whose flash touches two row periods stands between, by their
/// shares. Written from the definition, apart from the product's forward model. Frame i shows what read phase
/// i moved and what wrapped in the one before; its lamp is lit by the flashes of the frame period before its
/// read phase.
inline std::vector<smear::FrameReading> film(const ClockFilm& f) {
  RandomStream random(f.seed, 9);
  const double period = f.timing.frame_period.value();
  const double row_time = f.timing.row_time.value();
  const int n = f.timing.rows;
  const int shifts = f.timing.shifts;
  const bool down = f.timing.direction == smear::ReadDirection::top_first;
  const double lamp = down ? f.lamp : n - 1 - f.lamp;  // in the order of reading
  const auto given = [&](std::int64_t j) {
    const auto cycle = static_cast<std::int64_t>(f.code.size());
    return cycle == 0 || f.code[static_cast<std::size_t>(((j % cycle) + cycle) % cycle)];
  };
  const auto flash_at = [&](std::int64_t j) {
    const double late = f.jitter * random_normal(f.seed, 21, static_cast<std::uint64_t>(j + (1LL << 40)));
    return f.first_flash + static_cast<double>(j) / f.flash_rate + late;
  };
  const auto first_after = [&](double t) {
    return static_cast<std::int64_t>(std::ceil((t - f.first_flash) * f.flash_rate));
  };
  std::vector<smear::FrameReading> readings;
  for (int i = 0; i < f.frames; ++i) {
    smear::SmearReading r;
    const double start = i * period;
    bool lit = false;
    for (std::int64_t j = first_after(start - period) - 1; j <= first_after(start); ++j) {
      lit |= given(j) && flash_at(j) >= start - period && flash_at(j) < start;
    }
    if (!lit) {
      r.reason = "no lamp";
      readings.push_back({i, r});
      continue;
    }
    r.lamp = smear::LampReading{.x = 80,
                                .y = Rows(f.lamp + f.lamp_error + random.normal(0, f.lamp_noise)),
                                .sigma = Rows(std::max(f.lamp_noise, 0.001))};
    for (const int read : {i - 1, i}) {
      const double begin = read * period;
      for (std::int64_t j = first_after(begin) - 1; j <= first_after(begin + shifts * row_time); ++j) {
        const double tau = (flash_at(j) - begin) / row_time;
        const double w = f.flash_width / row_time;
        if (!given(j) || tau - w / 2 < 0 || tau + w / 2 >= shifts) continue;
        const double early = std::floor(tau - w / 2);
        const double k = early + std::clamp((tau + w / 2 - early - 1) / std::max(w, 1e-9), 0.0, 1.0);
        double row = lamp + k;
        const bool wrapped = row >= shifts;
        if (wrapped != (read == i - 1) || (wrapped && f.sweep_out)) continue;
        if (wrapped) row -= shifts;
        if (row >= n || std::abs(row - lamp) < f.hidden || random.uniform() < f.miss) continue;
        row += random.normal(0, f.dot_noise);
        r.dots.push_back({.x = 80, .y = Rows(down ? row : n - 1 - row)});
      }
    }
    if (random.uniform() < f.false_dots) r.dots.push_back({.x = 80, .y = Rows(random.uniform(0, n))});
    std::sort(r.dots.begin(), r.dots.end(),
              [](const smear::DotReading& a, const smear::DotReading& b) { return a.y < b.y; });
    for (smear::DotReading& dot : r.dots) {
      dot.sigma = Rows(std::max(f.dot_noise, 0.001));
      dot.side = dot.y < r.lamp->y ? smear::Side::above : smear::Side::below;
    }
    r.state = r.dots.empty()       ? smear::SmearState::no_dot
              : r.dots.size() == 1 ? smear::SmearState::dot
                                   : smear::SmearState::comb;
    readings.push_back({i, std::move(r)});
  }
  return readings;
}

/// The readings of a film without its frames' numbers.
inline std::vector<smear::SmearReading> readings_of(const ClockFilm& f) {
  std::vector<smear::SmearReading> readings;
  for (smear::FrameReading& frame : film(f)) readings.push_back(std::move(frame.reading));
  return readings;
}

/// tau of the strobe's flashes, about one a frame, on their line at time t.
inline double true_tau(const ClockFilm& f, double t) {
  const double period = f.timing.frame_period.value();
  return wrap_positive(f.first_flash + (t - f.first_flash) * (1 - period * f.flash_rate), period);
}

/// The phases of a film's frames.
inline std::vector<smear::PhaseSample> phases(const ClockFilm& f) {
  std::vector<smear::PhaseSample> samples;
  for (const smear::FrameReading& r : film(f)) {
    samples.push_back(smear::sample_of(r.reading, f.timing, Seconds(f.flash_width),
                                       TimePoint{} + f.timing.frame_period * static_cast<double>(r.frame)));
  }
  return samples;
}

}  // namespace emberlock::test
