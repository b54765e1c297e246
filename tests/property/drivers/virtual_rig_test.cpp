// SPDX-License-Identifier: Apache-2.0
// Laws of the virtual rig: what the pictures show, the truth accessors know; and nothing depends on the
// order.
#include <cmath>

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include "tests/support/properties.h"
#include "tests/support/virtual_cameras.h"

namespace emberlock::drivers {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)
using test::any_int;
using test::any_real;

VirtualCameraOptions any_camera() {
  VirtualCameraOptions c =
      small_camera(*rc::gen::element(smear::ReadDirection::top_first, smear::ReadDirection::bottom_first),
                   *rc::gen::element(120, 140, 166));
  c.timing.frame_period = c.timing.frame_period * (1 + any_real(-1e-4, 1e-4));
  c.lamp = {.x = any_real(10, 54), .y = Rows(any_real(10, 110)), .radius = any_real(2, 4)};
  c.first_phase = Seconds(any_real(0, 1.0 / 24));
  return c;
}

RC_GTEST_PROP(VirtualRigLaws, EveryIsolatedDotIsSeenWhereTheTruthSays, ()) {
  const VirtualCameraOptions c = any_camera();
  const auto rig = small_rig({c}, {Pass::smear});
  RC_ASSERT(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(any_real(20, 100))}).ok());
  RC_ASSERT(rig->camera(0).start().ok());
  for (int i = 0; i < 6; ++i) {
    const Frame f = rig->camera(0).next_frame(Seconds(1)).value();
    const auto rows = column_light(f, c.lamp.x);
    const auto dots = rig->dots(0, f.stamp.frame_id);
    for (const TrueDot& dot : dots) {
      const double y = dot.y.value();
      bool isolated =
          y > 8 && y < 111 && std::abs(y - c.lamp.y.value()) > 14;  // the rest's charge lies on the lamp
      // Just above or below the picture there may be dots of which a part is seen.
      for (const TrueDot& other : dots) isolated &= &other == &dot || abs(other.y - dot.y) > Rows(14);
      if (!isolated) continue;
      RC_ASSERT(std::abs(blob(rows, y).centre - y) < 0.05);
    }
  }
}

RC_GTEST_PROP(VirtualRigLaws, ADotGivesTheFlashsPhaseBackWithinARow, ()) {
  const VirtualCameraOptions c = any_camera();
  const auto rig = small_rig({c}, {});
  RC_ASSERT(rig->strobe().apply({.output = StrobeOutput::flashing, .rate = Hertz(any_real(20, 300))}).ok());
  RC_ASSERT(rig->camera(0).start().ok());
  for (int i = 0; i < 4; ++i) {
    const auto id = rig->camera(0).next_frame(Seconds(1)).value().stamp.frame_id;
    for (const TrueDot& dot : rig->dots(0, id)) {
      // The lamp's own row, less a rounding, is 0 shifts and not K.
      const Rows k =
          wrap_positive(smear::shifts_between(c.timing, c.lamp.y, dot.y) + Rows(1e-9), Rows(c.timing.shifts));
      const Seconds tau = (k + Rows(0.5)) * c.timing.row_time;
      const Seconds off = wrap_symmetric(dot.flash - rig->read_start(0, id) - tau, c.timing.frame_period);
      // Half a row for whole-row shifts, and as much for a flash that spans two rows.
      RC_ASSERT(abs(off) < Rows(1.001) * c.timing.row_time);
    }
  }
}

RC_GTEST_PROP(VirtualRigLaws, TheDotsOfAFrameAreTheFlashesThatTheFormulaShows, ()) {
  VirtualCameraOptions c = any_camera();
  c.lamp.y = Rows(any_int(0, 120));
  const int n = c.timing.rows, K = c.timing.shifts;
  const int d = static_cast<int>(c.timing.direction);
  const auto rig = small_rig({c}, {});
  // As short as the strobe can, so that hardly a flash spans two rows.
  RC_ASSERT(
      rig->strobe()
          .apply({.output = StrobeOutput::flashing, .rate = Hertz(any_real(20, 300)), .width = Seconds(1e-7)})
          .ok());
  const double rate = rig->strobe().read_back().value().rate.value();
  RC_ASSERT(rig->camera(0).start().ok());
  for (int i = 0; i < 5; ++i) {
    const auto id = rig->camera(0).next_frame(Seconds(1)).value().stamp.frame_id;
    const double start = (rig->read_start(0, id) - TimePoint{}).value();
    std::vector<double> expected;
    for (int j = 0; j < 400; ++j) {
      const double t = j / rate + 0.5e-7 - start;
      const bool before = t < 0;  // during the read phase of the frame before: shows here if it wrapped
      const int k = static_cast<int>(
          std::floor((before ? t + c.timing.frame_period.value() : t) / c.timing.row_time.value()));
      if (t < -c.timing.frame_period.value() || k >= K) continue;
      const int lamp = static_cast<int>(c.lamp.y.value());
      const int packet = (d > 0 ? lamp : n - 1 - lamp) + k;
      const int y = packet % K;
      if (before == (packet >= K) && y < n) expected.push_back(d > 0 ? y : n - 1 - y);
    }
    const auto dots = rig->dots(0, id);
    RC_ASSERT(dots.size() == expected.size());
    for (std::size_t q = 0; q < dots.size(); ++q)
      RC_ASSERT(std::abs(dots[q].y.value() - expected[q]) < 1.001);
  }
}

RC_GTEST_PROP(VirtualRigLaws, ResetsKeepFrameNumbersAndArrivalTimesInOrder, ()) {
  VirtualCameraOptions c = any_camera();
  c.layout.size.width = 4;
  const auto rig = small_rig({c}, {});
  RC_ASSERT(rig->camera(0).start().ok());
  std::uint64_t last_id = 0;
  TimePoint last_time;
  for (int i = 0; i < 20; ++i) {
    if (any_int(0, 3) == 0) {
      rig->set_reset(*rc::gen::element(ShutterReset::by_hand, ShutterReset::on_command));
      RC_ASSERT(rig->camera(0).reset_shutter(rig->clock().now() + Seconds(any_real(-0.1, 0.3))).ok());
    }
    const Frame f = rig->camera(0).next_frame(Seconds(2)).value();
    RC_ASSERT(i == 0 || f.stamp.frame_id > last_id);
    RC_ASSERT(f.stamp.monotonic_time > last_time);
    last_id = f.stamp.frame_id;
    last_time = f.stamp.monotonic_time;
  }
}

}  // namespace
}  // namespace emberlock::drivers
