#include "daemon/align/row_times.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>

#include "base/log.h"

namespace emberlock {
namespace {

constexpr int kCombAttempts = 2;

}  // namespace

void MeanRowTime::add(const RowClock& clock) {
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
  StrobeSettings comb{
      .output = StrobeOutput::flashing, .rate = options.comb_rate, .width = options.flash_width};
  for (int attempt = 0; attempt < kCombAttempts; ++attempt) {
    report(progress, 0.1 * attempt, "measuring the row time");
    EMBERLOCK_RETURN_IF_ERROR(bench.set_strobe(comb));
    EMBERLOCK_ASSIGN_OR_RETURN(const Film film, bench.film(cameras, options.comb_frames));
    if (bench.stopped()) return {};
    bool near_integer = false;
    MeanRowTime mean;
    for (const std::size_t i : cameras) {
      const auto fit = fit_row_clock(film.readings[i], bench.strobe().rate, options.timing[i].frame_period);
      result.row_clocks[i].reset();
      if (!fit.ok()) {
        log(LogCategory::daemon).warn("camera {}: {}", rig.cameras[i]->info().id, fit.error().message());
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
                               options.comb_rate.value())};
    }
    result.options.row_time = *mean.value();
    if (!near_integer) break;
    comb.rate = options.comb_rate * 0.983;  // another pitch, off the whole number
  }
  for (const std::size_t i : cameras) {
    bench.sensor(i).set_row_time(result.row_clocks[i] ? result.row_clocks[i]->row_time
                                                      : result.options.row_time);
  }
  return {};
}

}  // namespace emberlock
