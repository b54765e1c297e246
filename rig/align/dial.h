// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "rig/align/bench.h"
#include "rig/align/run.h"
#include "smear_sync/clocks/flash_rate.h"
#include "smear_sync/clocks/phase.h"

// What an alignment does otherwise where somebody sets the strobe by a dial.
namespace emberlock::rig {

/// It is told nothing, so no comb measures the row time; and each round reads its rate, from half a second of
/// film. Options without a dial come back as they are.
AlignRunOptions for_dial(AlignRunOptions options);

/// The rate of a strobe that nobody can ask; `timing` by camera.
smear::FlashRate flashes_of(const Film& film, const std::vector<smear::CcdTiming>& timing,
                            Seconds flash_width);

/// The period offset of flashes whose rate was told from the frames that refine it.
std::optional<smear::PeriodOffset> period_offset_of(const smear::FlashRate& flashes, Seconds period);

/// One camera's phases at the instants of the flashes, against which their walk is straight.
std::vector<smear::PhaseSample> flash_samples(const std::vector<Frame>& frames,
                                              const std::vector<smear::SmearReading>& readings,
                                              const smear::CcdTiming& timing, Seconds flash_width);

}  // namespace emberlock::rig
