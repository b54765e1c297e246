// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <set>
#include <string>
#include <vector>

#include "base/random.h"
#include "smear_sync/clocks/staircase.h"
#include "smear_sync/verify/clip_clock.h"

namespace emberlock::test {

/// A camera and its clip, on the strobe's own clock, without a picture: what the detector would read.
struct ReadCamera {
  double start = 0;            ///< of the first read phase, seconds after flash 0
  double period = 1 / 23.976;  ///< T, seconds
  int rows = 720;              ///< n
  int shifts = 720;            ///< K
  int direction = +1;          ///< d
  double lamp = 300.3;         ///< row
  double lamp_error = 0.1;     ///< RMS, rows: of each frame's
  double dot_error = 0.05;     ///< the same of each dot
  double hidden = 12;          ///< rows about the lamp that its bloom covers
  int frames = 240;            ///< in the file
  std::set<int> lost{};        ///< which didn't get into it
  [[nodiscard]] double read_start(int frame) const { return start + frame * period; }
};

/// Flashes that may be skipped: flash j is given where given[j], an empty pattern gives all.
struct ReadStrobe {
  double rate = 24.2;    ///< 1/s
  double width = 20e-6;  ///< of a flash, seconds, centred on its instant
  std::vector<bool> given{};
  bool repeats = false;  ///< the pattern, before and after; else no flash is given there
  [[nodiscard]] bool gives(std::int64_t j) const {
    const auto n = static_cast<std::int64_t>(given.size());
    if (repeats && n > 0) j = (j % n + n) % n;
    return n == 0 || (j >= 0 && j < n && given[static_cast<std::size_t>(j)]);
  }
};

/// What the detector would say of each frame of a clip. A flash of `width` leaves its dot where the charge of
/// its light lies on average (stair()).
inline smear::ClipReading read_strobe(const ReadCamera& camera, const ReadStrobe& strobe,
                                      SecondsPerRow row_time, std::uint64_t seed) {
  const double row = row_time.value();
  const double flashes = 1 / strobe.rate;
  const double order = camera.direction > 0 ? camera.lamp : camera.rows - 1 - camera.lamp;
  RandomStream random(seed, 5);
  smear::ClipReading clip;
  clip.file = clip.name = "camera " + std::to_string(seed);
  clip.rows = camera.rows;
  clip.claimed_rate = Hertz(23.976);
  for (int i = 0; static_cast<int>(clip.frames.size()) < camera.frames; ++i) {
    const double begin = camera.read_start(i);
    bool lit = false;
    std::vector<double> dots;
    const auto first = static_cast<std::int64_t>(std::floor((begin - 2 * camera.period) / flashes));
    for (std::int64_t j = first; static_cast<double>(j) * flashes < begin + camera.period; ++j) {
      if (!strobe.gives(j)) continue;
      const double after = static_cast<double>(j) * flashes - begin;
      lit = lit || (after < 0 && after >= -camera.period);
      for (const int earlier : {0, 1}) {
        const double x = (after + earlier * camera.period) / row;
        if (x < 0 || x >= camera.shifts) continue;
        const double packet = order + smear::stair(x, strobe.width / row) - earlier * camera.shifts;
        const bool here = earlier == 0 ? packet <= camera.rows - 1 : packet >= 0;
        const double y = camera.direction > 0 ? packet : camera.rows - 1 - packet;
        if (here && std::abs(y - camera.lamp) > camera.hidden) dots.push_back(y);
      }
    }
    smear::SmearReading reading;
    if (lit) {
      reading.lamp = smear::LampReading{.x = 600,
                                        .y = Rows(camera.lamp + random.normal() * camera.lamp_error),
                                        .sigma = Rows(camera.lamp_error),
                                        .radius = 4};
      for (const double y : dots) {
        smear::DotReading dot;
        dot.y = Rows(y + camera.dot_error * random.normal());
        dot.sigma = Rows(camera.dot_error);
        reading.dots.push_back(dot);
      }
      reading.state = dots.empty()       ? smear::SmearState::no_dot
                      : dots.size() == 1 ? smear::SmearState::dot
                                         : smear::SmearState::comb;
      if (dots.empty()) reading.reason = "its column is clean";
    }
    if (!camera.lost.contains(i)) clip.frames.push_back(reading);
  }
  return clip;
}

}  // namespace emberlock::test
