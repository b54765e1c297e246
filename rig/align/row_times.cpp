// SPDX-License-Identifier: Apache-2.0
#include "rig/align/row_times.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "base/log.h"

namespace emberlock::rig {
namespace {

constexpr int kCombAttempts = 2;

/// Ten flashes or a few more in a frame stand far enough apart to be told from each other, and leave three on
/// one side of any lamp. Faster than the rate for the paper's cameras not every strobe flashes.
Hertz usual_comb_rate(const std::vector<smear::CcdTiming>& timing) {
  constexpr double kFlashesPerFrame = 12.5;
  constexpr double kMost = 300;
  Seconds longest(0);
  for (const smear::CcdTiming& camera : timing) longest = std::max(longest, camera.frame_period);
  return Hertz(std::min(std::round(kFlashesPerFrame / longest.value()), kMost));
}

}  // namespace

void MeanRowTime::add(const smear::RowClock& clock) {
  const double w = 1 / std::max(clock.sigma.value() * clock.sigma.value(), 1e-24);
  weights_ += w;
  moment_ += w * clock.row_time.value();
}

std::optional<SecondsPerRow> MeanRowTime::value() const {
  if (weights_ == 0) return std::nullopt;
  return SecondsPerRow(moment_ / weights_);
}

Status measure_row_times(const AlignRig& rig, AlignBench& bench, const AlignRunOptions& options,
                         AlignRunResult& result, const Progress& progress) {
  const std::vector<std::size_t> cameras = bench.cameras_with(SensorKind::ccd);
  if (cameras.empty()) return {};
  const Hertz comb_rate = options.comb_rate.value_or(usual_comb_rate(options.timing));
  drivers::StrobeSettings comb{
      .output = drivers::StrobeOutput::flashing, .rate = comb_rate, .width = options.flash_width};
  for (int attempt = 0; attempt < kCombAttempts; ++attempt) {
    tell(progress, 0.1 * attempt, "measuring the row time");
    EMBERLOCK_RETURN_IF_ERROR(bench.set_strobe(comb));
    EMBERLOCK_ASSIGN_OR_RETURN(const Film film, bench.film(cameras, options.comb_frames));
    if (bench.stopped()) return {};
    bool near_integer = false;
    MeanRowTime mean;
    for (const std::size_t i : cameras) {
      const auto fit =
          smear::fit_row_clock(film.readings[i], bench.strobe().rate, options.timing[i].frame_period);
      result.row_clocks[i].reset();
      if (!fit.ok()) {
        log(LogCategory::rig).warn("camera {}: {}", rig.cameras[i]->info().id, fit.error().message());
        continue;
      }
      near_integer |= fit->near_integer_pitch;
      result.row_clocks[i] = *fit;
      mean.add(*fit);
    }
    if (!mean.value()) {
      return Error{ErrorKind::device, "no camera shows a comb of dots that a row time can be fitted to",
                   "measuring the row time",
                   fmt::format("check that the strobe flashes at {}/s and is in view of the cameras",
                               comb_rate.value())};
    }
    result.options.row_time = *mean.value();
    if (!near_integer) break;
    comb.rate = comb_rate * 0.983;  // another pitch, off the whole number
  }
  for (const std::size_t i : cameras) {
    bench.sensor(i).set_row_time(result.row_clocks[i] ? result.row_clocks[i]->row_time
                                                      : result.options.row_time);
  }
  return {};
}

}  // namespace emberlock::rig
