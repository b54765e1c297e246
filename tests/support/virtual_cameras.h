// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"

namespace emberlock::testing_support {

/// A camera of 64 x 120 pixels, 12 bits, that reads 250 us a row and 24 frames a second; its lamp is at (30,
/// 50).
inline drivers::VirtualCameraOptions small_camera(
    smear::ReadDirection direction = smear::ReadDirection::top_first, int shifts = 120) {
  drivers::VirtualCameraOptions c;
  c.layout = {.size = {64, 120}, .format = PixelFormat::gray16, .bit_depth = 12};
  c.timing = {.rows = 120,
              .shifts = shifts,
              .frame_period = Seconds(1.0 / 24),
              .row_time = microseconds_per_row(250),
              .direction = direction};
  c.nominal_rate = Hertz(24);
  c.lamp = {.x = 30, .y = Rows(50), .radius = 3};
  c.first_phase = Seconds(0);
  return c;
}

/// A rig of such cameras that draws the passes named and nothing else.
inline std::unique_ptr<drivers::VirtualRig> small_rig(
    std::vector<drivers::VirtualCameraOptions> cameras, std::vector<drivers::Pass> passes,
    std::shared_ptr<Clock> clock = std::make_shared<drivers::VirtualClock>()) {
  drivers::VirtualRigOptions options;
  options.cameras = std::move(cameras);
  options.scene.passes = std::move(passes);
  return drivers::VirtualRig::create(std::move(options), std::move(clock)).value();
}

/// Grey levels (0..255) above the background, summed over the lamp's columns, by row.
inline std::vector<double> column_light(const Frame& frame, double x, int half_width = 7) {
  const ImageView v = frame.image->view();
  const double scale = 255.0 / v.layout.white();
  const double background = std::round(drivers::VirtualScene{}.background / scale);
  std::vector<double> rows(v.height());
  for (int y = 0; y < v.height(); ++y) {
    for (int i = static_cast<int>(x) - half_width; i <= static_cast<int>(x) + half_width; ++i) {
      if (i >= 0 && i < v.width()) rows[y] += (v.sample(i, y) - background) * scale;
    }
  }
  return rows;
}

/// The light's centre within `reach` rows of `about`, and how much there is.
struct Blob {
  double centre = 0;
  double sum = 0;
};
inline Blob blob(const std::vector<double>& rows, double about, int reach = 6) {
  Blob b;
  for (int y = static_cast<int>(about + 0.5) - reach; y <= static_cast<int>(about + 0.5) + reach; ++y) {
    if (y < 0 || y >= static_cast<int>(rows.size())) continue;
    b.sum += rows[y];
    b.centre += y * rows[y];
  }
  b.centre /= b.sum;
  return b;
}

}  // namespace emberlock::testing_support
