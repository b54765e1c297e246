// SPDX-License-Identifier: Apache-2.0
#include "rig/align/dial.h"

#include <algorithm>
#include <cstdint>
#include <utility>

namespace emberlock::rig {
namespace {

/// Frames of each camera in a round where the strobe's rate is read from them: half a second, which tells it
/// to some 30 ppm, and three flashes where it flashes at a quarter of the frames' rate.
constexpr int kFramesForDial = 12;
/// What is told beforehand of the period offset, in standard errors of the rate that was read from the same
/// frames.
constexpr double kLooseOffset = 3;

}  // namespace

AlignRunOptions for_dial(AlignRunOptions options) {
  if (!options.align.dial) return options;
  options.measure_row_time = false;
  options.frames_per_round = std::max(options.frames_per_round, kFramesForDial);
  double mean = 0;
  for (const smear::CcdTiming& timing : options.timing)
    mean += timing.row_time.value() / static_cast<double>(options.timing.size());
  options.align.row_time = SecondsPerRow(mean);
  return options;
}

smear::FlashRate flashes_of(const Film& film, const std::vector<smear::CcdTiming>& timing,
                            Seconds flash_width) {
  std::vector<smear::FlashFilm> cameras;
  for (std::size_t i = 0; i < film.frames.size(); ++i) {
    smear::FlashFilm camera{timing[i], {}};
    for (std::size_t k = 0; k < film.frames[i].size(); ++k) {
      camera.frames.push_back(
          {static_cast<std::int64_t>(film.frames[i][k].stamp.frame_id), film.readings[i][k]});
    }
    cameras.push_back(std::move(camera));
  }
  return smear::see_flashes(cameras, flash_width);
}

std::optional<smear::PeriodOffset> period_offset_of(const smear::FlashRate& flashes, Seconds period) {
  if (flashes.seen != smear::FlashesSeen::rate) return std::nullopt;
  return smear::expected_period_offset(flashes.rate, period, kLooseOffset * flashes.sigma);
}

std::vector<smear::PhaseSample> flash_samples(const std::vector<Frame>& frames,
                                              const std::vector<smear::SmearReading>& readings,
                                              const smear::CcdTiming& timing, Seconds flash_width) {
  std::vector<smear::PhaseSample> samples;
  for (std::size_t k = 0; k < frames.size(); ++k)
    samples.push_back(smear::sample_of(readings[k], timing, flash_width, frames[k].stamp.monotonic_time));
  return samples;
}

}  // namespace emberlock::rig
