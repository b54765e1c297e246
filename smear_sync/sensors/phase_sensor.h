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

/// What the strobe does while a frame is filmed: one flash a frame, by `delay` late (in [0, T)), or none.
struct Look {
  std::optional<Seconds> delay;
  friend bool operator==(const Look&, const Look&) = default;
};

struct SensorOptions {
  CcdTiming timing{};  ///< n, K (n of rolling shutters) and d must be right; row_time where it isn't measured
  Seconds flash_width = microseconds(20);
};

/// One camera as a measure of phase, whatever its sensor: frames in, phases out, so that nothing downstream
/// asks what kind it was. It says which looks it wants, is shown their frames, and then tells the phases of
/// the round. All tell the same tau: how long after the end of the exposure of what is read first the flash
/// came. No clock, no device; not thread-safe.
class PhaseSensor {
 public:
  virtual ~PhaseSensor() = default;

  /// Forgets the frames of the round before. `own` is how this camera's tau moves against the strobe.
  virtual void begin_round(const Beat& own) = 0;
  /// Learns from the frames taken, and says which looks are to be filmed next, a frame each, before phases
  /// can be told to a standard error of `wanted`; asked again once their frames were taken. None: go on with
  /// the round, whether phases can be told or not.
  [[nodiscard]] virtual std::vector<Look> next_looks(Seconds wanted) = 0;
  /// A frame that came at `at`, and what it shows.
  virtual SmearReading take(const ImageView& frame, TimePoint at, const Look& look) = 0;
  /// What the round's frames tell of tau at a delay of `delay`; what isn't known says why, and what to do.
  [[nodiscard]] virtual std::vector<PhaseSample> phases(Seconds delay) = 0;
  /// The shutter's phase was drawn anew.
  virtual void forget_phase() = 0;

  /// t_row was measured by a comb, which only CCDs need.
  virtual void set_row_time(SecondsPerRow row_time) = 0;
  [[nodiscard]] virtual const CcdTiming& timing() const = 0;
  /// t_row, where the sensor measures it by its own looks.
  [[nodiscard]] virtual std::optional<RowClock> row_clock() const { return std::nullopt; }
  /// How long a frame is exposed, where flashes tell.
  [[nodiscard]] virtual std::optional<Seconds> exposure() const { return std::nullopt; }
};

/// Dots of the smear: every frame of one flash tells a phase.
std::unique_ptr<PhaseSensor> make_smear_sensor(const SensorOptions& options);
/// Bands (rolling_band.h), after a sweep of looks that shows every row dark and lit, and tells t_row. After a
/// round that shows nothing that could be read it sweeps anew: light or exposure may have changed.
std::unique_ptr<PhaseSensor> make_rolling_sensor(const SensorOptions& options);
/// Sweeps (exposure_sweep.h): a whole one when its phase isn't known, a few looks about the edge from round
/// to round. Each round has a look without flashes, over which the others are counted, so that rounds compare
/// whatever the ambient light does. After a round that tells no phase it starts anew.
std::unique_ptr<PhaseSensor> make_global_sensor(const SensorOptions& options);

std::unique_ptr<PhaseSensor> make_phase_sensor(SensorKind kind, const SensorOptions& options);

}  // namespace emberlock::smear
