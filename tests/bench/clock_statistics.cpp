// SPDX-License-Identifier: Apache-2.0
// How well cameras' clocks are told from a strobe, and whether the stated errors hold, over films with fresh
// seeds.
//   bench_clock_statistics [TRIALS] [SEED]
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <string>

#include "smear_sync/clocks/drift.h"
#include "smear_sync/clocks/row_clock.h"
#include "tests/support/clock_film.h"

namespace emberlock {
namespace {

struct Trial {
  double error = 0;
  double sigma = 0;
};

/// One line of the table: RMS error, mean sigma, part within two sigma, and the figure to hold.
void line(const std::string& what, const char* unit, double limit, int trials,
          const std::function<std::optional<Trial>(int)>& trial) {
  double squares = 0;
  double sigmas = 0;
  int inside = 0;
  int counted = 0;
  for (int i = 0; i < trials; ++i) {
    const auto t = trial(i);
    if (!t) continue;
    ++counted;
    squares += t->error * t->error;
    sigmas += t->sigma * t->sigma;
    inside += std::abs(t->error) <= 2 * t->sigma ? 1 : 0;
  }
  const double n = std::max(counted, 1);
  char bound[32] = "";
  if (limit > 0) std::snprintf(bound, sizeof bound, "%.3g", limit);
  std::printf("%-74s %8.4f %-4s %7s %8.4f %7.1f %% %6d\n", what.c_str(), std::sqrt(squares / n), unit, bound,
              std::sqrt(sigmas / n), 100.0 * inside / n, counted);
  std::fflush(stdout);
}

test::ClockFilm draw(std::uint64_t seed) {
  RandomStream random(seed, 31);
  test::ClockFilm f;
  f.seed = seed;
  f.lamp = random.uniform(200, 520);
  f.timing.row_time = microseconds_per_row(random.uniform(53.5, 54.5));
  f.timing.shifts = random.uniform() < 0.5 ? 720 : 740;
  f.timing.direction =
      random.uniform() < 0.5 ? smear::ReadDirection::top_first : smear::ReadDirection::bottom_first;
  f.timing.frame_period = Seconds(1 / 24.0 * (1 + random.uniform(-20e-6, 20e-6)));
  return f;
}

std::optional<Trial> row_time(test::ClockFilm f) {
  RandomStream random(f.seed, 32);
  f.flash_rate = random.uniform(299.5, 300.5);
  f.first_flash = random.uniform(0, 1 / f.flash_rate);
  std::vector<smear::SmearReading> readings;
  for (smear::FrameReading& r : film(f)) readings.push_back(std::move(r.reading));
  const auto clock = smear::fit_row_clock(readings, Hertz(f.flash_rate));
  if (!clock.ok() || clock->near_integer_pitch) return std::nullopt;
  return Trial{(clock->row_time - f.timing.row_time).value() * 1e9, clock->sigma.value() * 1e9};
}

struct Line {
  Trial phase;  ///< rows, at the middle
  Trial rate;   ///< ppm
};

/// A strobe detuned by `ppm`, filmed for so many frames.
std::optional<Line> walk(test::ClockFilm f, double ppm) {
  RandomStream random(f.seed, 33);
  f.flash_rate = 1 / (f.timing.frame_period.value() * (1 + ppm * 1e-6));
  f.first_flash = random.uniform(0, f.timing.frame_period.value());
  const auto fit = smear::fit_drift(phases(f), {.period = f.timing.frame_period,
                                                .row_time = f.timing.row_time,
                                                .flash_width = Seconds(f.flash_width),
                                                .expected = PartsPerMillion(ppm)});
  if (!fit.ok()) return std::nullopt;
  if (fit->samples < f.frames / 2) return std::nullopt;  // the flash rested: seen in too few frames
  const double at = (fit->at - TimePoint{}).value();
  const double off = wrap_symmetric(fit->tau.value() - true_tau(f, at), f.timing.frame_period.value());
  return Line{{off / f.timing.row_time.value(), fit->tau_sigma.value() / f.timing.row_time.value()},
              {fit->rate.value() - (1 - f.timing.frame_period.value() * f.flash_rate) * 1e6,
               fit->rate_sigma.value()}};
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  using namespace emberlock;
  const int trials = argc > 1 ? std::max(1, std::atoi(argv[1])) : 1000;
  const std::uint64_t first = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const auto seed = [&](int i) { return mix64(first * 1'000'003 + static_cast<std::uint64_t>(i)); };
  std::printf("%d films a line, seed %llu; t_row about 54 us, 24 frames/s, flashes of 20 us\n", trials,
              static_cast<unsigned long long>(first));
  std::printf("%-74s %13s %7s %8s %9s %6s\n", "", "RMS error", "to hold", "sigma", "within 2", "films");
  for (const double noise : {0.02, 0.05, 0.16}) {
    char about[64];
    std::snprintf(about, sizeof about, ", dots read to %.2f row", noise);
    const auto with = [&](int i, int frames, double lamp_noise = 0) {
      test::ClockFilm f = draw(seed(i));
      f.frames = frames;
      f.dot_noise = noise;
      f.lamp_noise = lamp_noise;
      return f;
    };
    line(std::string("t_row, 1 s of a 300/s comb") + about, "ns", 5, trials,
         [&](int i) { return row_time(with(i, 24)); });
    line(std::string("t_row, 10 s of a 300/s comb") + about, "ns", 1.5, trials,
         [&](int i) { return row_time(with(i, 240)); });
    line(std::string("phase, one frame") + about, "rows", 0.17, trials, [&](int i) -> std::optional<Trial> {
      test::ClockFilm f = with(i, 2);
      f.flash_rate = 1 / f.timing.frame_period.value();
      f.first_flash = RandomStream(f.seed, 33).uniform(0, f.timing.frame_period.value());
      const smear::Phase phase = phases(f)[1].phase;
      if (phase.state != smear::PhaseState::known) return std::nullopt;
      return Trial{wrap_symmetric(phase.tau.value() - true_tau(f, f.timing.frame_period.value()),
                                  f.timing.frame_period.value()) /
                       f.timing.row_time.value(),
                   phase.sigma.value() / f.timing.row_time.value()};
    });
    for (const double ppm : {167.0, 500.0, 2000.0}) {
      char beat[64];
      std::snprintf(beat, sizeof beat, ", 10 s, strobe detuned by %.0f ppm", ppm);
      line(std::string("phase") + beat + about, "rows", 0.02, trials, [&](int i) -> std::optional<Trial> {
        const auto l = walk(with(i, 240), ppm);
        return l ? std::optional(l->phase) : std::nullopt;
      });
      line(std::string("drift") + beat + about, "ppm", 0.2, trials, [&](int i) -> std::optional<Trial> {
        const auto l = walk(with(i, 240), ppm);
        return l ? std::optional(l->rate) : std::nullopt;
      });
    }
  }
}
