// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/image.h"
#include "base/quantity.h"
#include "base/sensor_kind.h"
#include "base/time_point.h"
#include "smear_sync/ccd_timing.h"
#include "smear_sync/clocks/phase.h"
#include "smear_sync/clocks/row_clock.h"
#include "smear_sync/reading.h"

namespace emberlock::smear {

/// The strobe's setting while a frame is filmed: one flash per frame, delayed by `delay` (in [0, T)), or no
/// flash.
struct Look {
  std::optional<Seconds> delay;
  friend bool operator==(const Look&, const Look&) = default;
};

struct SensorOptions {
  CcdTiming
      timing{};  ///< n, K (n for rolling shutters) and d must be right; row_time too, unless it is measured
  Seconds flash_width = microseconds(20);
};

/// Measures one camera's phase, with any kind of sensor: frames in, phases out, so that all further code is
/// independent of the kind. It says which looks (strobe settings) it needs, receives their frames, and then
/// gives the phases of the round. All kinds measure the same tau: the time from the end of the exposure of
/// the part that is read first to the flash. No clock, no device; not thread-safe.
class PhaseSensor {
 public:
  virtual ~PhaseSensor() = default;

  /// Forgets the frames of the previous round. `own` is the drift of this camera's tau against the strobe.
  virtual void begin_round(const PeriodOffset& own) = 0;
  /// Processes the frames taken so far and returns the looks to film next, one frame each, so that phases
  /// reach a standard error of `wanted`. Call it again after their frames were taken. Empty: continue with
  /// the round, whether phases are known or not.
  [[nodiscard]] virtual std::vector<Look> next_looks(Seconds wanted) = 0;
  /// Takes a frame that arrived at `at`, and returns its reading.
  virtual SmearReading take(const ImageView& frame, TimePoint at, const Look& look) = 0;
  /// The round's phases for a delay of `delay`. If they are unknown, the reason says why and what to do.
  [[nodiscard]] virtual std::vector<PhaseSample> phases(Seconds delay) = 0;
  /// The shutter was reset; its phase is unknown.
  virtual void forget_phase() = 0;

  /// Sets t_row as measured with a comb. Only CCDs need it.
  virtual void set_row_time(SecondsPerRow row_time) = 0;
  [[nodiscard]] virtual const CcdTiming& timing() const = 0;
  /// t_row, if the sensor measures it with its own looks.
  [[nodiscard]] virtual std::optional<RowClock> row_clock() const { return std::nullopt; }
  /// The exposure time, if flashes have shown it.
  [[nodiscard]] virtual std::optional<Seconds> exposure() const { return std::nullopt; }
};

/// Uses the dots of the smear: every frame with one flash gives a phase.
std::unique_ptr<PhaseSensor> make_smear_sensor(const SensorOptions& options);
/// Uses bands (rolling_band.h), after a sweep that shows every row dark and lit and measures t_row. After a
/// round without a readable frame it sweeps again, because light or exposure may have changed.
std::unique_ptr<PhaseSensor> make_rolling_sensor(const SensorOptions& options);
/// Uses sweeps (exposure_sweep.h): a complete one while the phase is unknown, then a few looks around the
/// edge in each round. Each round includes a look without flashes, which is subtracted from the others, so
/// that rounds are comparable when the ambient light changes. After a round without a phase it starts again.
std::unique_ptr<PhaseSensor> make_global_sensor(const SensorOptions& options);

std::unique_ptr<PhaseSensor> make_phase_sensor(SensorKind kind, const SensorOptions& options);

}  // namespace emberlock::smear
