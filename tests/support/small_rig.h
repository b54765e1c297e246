// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <memory>
#include <vector>

#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "rig/align/run.h"

namespace emberlock::test {

/// Four cameras of 320 x 240 whose 240 rows take most of the frame period, so that few phases are blind.
inline drivers::VirtualRigOptions small_rig(std::uint64_t seed, int cameras = 4,
                                            std::vector<SensorKind> sensors = {}) {
  drivers::VirtualRigDraw draw;
  draw.cameras = cameras;
  draw.sensors = std::move(sensors);
  draw.seed = seed;
  draw.layout.size = {320, 240};
  draw.row_time = microseconds_per_row(150);
  return drivers::draw_virtual_rig(draw);
}

/// The rig, opened on a virtual clock, and what a data sheet says of it.
struct SmallBench {
  explicit SmallBench(const drivers::VirtualRigOptions& setup)
      : rig(drivers::VirtualRig::create(setup, std::make_shared<drivers::VirtualClock>()).value()) {
    align.strobe = &rig->strobe();
    align.clock = &rig->clock();
    for (int i = 0; i < rig->size(); ++i) align.cameras.push_back(&rig->camera(i));
    options.align.tolerance.amount = Rows(30);
    options.comb_frames = 12;
    for (const drivers::VirtualCameraOptions& camera : setup.cameras) {
      const smear::CcdTiming& t = camera.timing;
      options.timing.push_back({.rows = t.rows, .shifts = t.shifts, .direction = t.direction});
    }
  }

  /// The largest true difference of a read phase's start, less its camera's offset, from the middle of them
  /// all: half of what two cameras differ by.
  [[nodiscard]] Rows true_error(SecondsPerRow row_time) const {
    const Seconds period = rig->truth(0).timing.frame_period;
    std::vector<TimePoint> starts;
    for (int i = 0; i < rig->size(); ++i) {
      const Seconds offset =
          options.offsets.empty() ? Seconds(0) : options.offsets[static_cast<std::size_t>(i)];
      starts.push_back(rig->read_start_after(i, rig->clock().now()) - offset);
    }
    Seconds worst;
    for (const TimePoint a : starts) {
      for (const TimePoint b : starts) worst = std::max(worst, abs(wrap_symmetric(a - b, period)));
    }
    return worst / row_time / 2;
  }

  std::unique_ptr<drivers::VirtualRig> rig;
  rig::AlignRig align;
  rig::AlignRunOptions options;
};

}  // namespace emberlock::test
