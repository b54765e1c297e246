// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "base/frame.h"
#include "base/progress.h"
#include "base/result.h"
#include "rig/align/run.h"
#include "session/async_writer.h"
#include "smear_sync/sensors/phase_sensor.h"

namespace emberlock::rig {

/// What was read of every camera between two changes; nothing of those that weren't asked.
struct Film {
  std::vector<std::vector<Frame>> frames;
  std::vector<std::vector<smear::SmearReading>> readings;
  std::vector<bool> away;  ///< by camera: a frame didn't come in time
};

/// The options of a run whose cameras film at this period: align.period says it, and each timing repeats it.
AlignRunOptions at_period(AlignRunOptions options, Seconds period);

/// The devices of an alignment and what reads their frames, with everything that happens to them written
/// down. `rig` and `options`, at the cameras' period, must outlive it. Errors of what acts on devices are
/// theirs and the recorder's.
class AlignBench {
 public:
  /// Periods that pass before frames show a change of the strobe: a flash may show in the frame of the read
  /// phase before, or in that of the next, so frames are trusted from the second one on.
  static constexpr double kSettlingPeriods = 2;

  AlignBench(const AlignRig& rig, const AlignRunOptions& options, StopAsked stop = {});

  /// As it said of itself after the last change.
  [[nodiscard]] const drivers::StrobeSettings& strobe() const { return strobe_; }
  [[nodiscard]] smear::PhaseSensor& sensor(std::size_t camera) { return *sensors_[camera]; }
  [[nodiscard]] const smear::PhaseSensor& sensor(std::size_t camera) const { return *sensors_[camera]; }
  [[nodiscard]] std::vector<std::size_t> cameras_with(SensorKind kind) const;

  /// Sets the strobe, if that changes anything; frames that show what was before are passed over from then
  /// on. Errors: the strobe's; settings that couldn't be read back are asked for again the next time.
  Status set_strobe(const drivers::StrobeSettings& wanted);
  /// Tells the camera to reset its shutter at `moment` or a whole number of periods later; at a moment drawn
  /// at random when there is none; `draw` is the number of that reset. Returns when it was told for. Error
  /// device: a camera that can't be reset.
  Result<TimePoint> reset(std::size_t camera, std::optional<TimePoint> moment, int draw);
  /// Trims the camera's frame rate. Returns when it was told. Error device: it can't be, or not so far.
  Result<TimePoint> trim(std::size_t camera, PartsPerMillion trim);
  /// `count` frames of every camera, one of each in turn, and what those of `read` show. A frame that doesn't
  /// come in time is left out, with a warning; errors: a camera that is lost, a recording that has ended.
  /// Where anybody may reset or switch off cameras a lost one is late like others, the rest of the film goes
  /// on without it, and error device is that no camera films.
  /// What was filmed until then when it is stopped.
  Result<Film> film(const std::vector<std::size_t>& read, int count);
  Result<Film> film_all(int count);
  /// Films the looks that the sensors ask for before they tell phases to a standard error of `wanted`, at
  /// `flashes` but for the delay, and sets the strobe to `flashes`. `done`, 0..1, is what `progress` is told
  /// of the run meanwhile. Errors: set_strobe's and film's; sensors that are never content are none.
  Status sweep(const drivers::StrobeSettings& flashes, Seconds wanted, const Progress& progress, double done);

  /// Waits until `until`, or until it is asked to stop, and passes over the frames that come meanwhile.
  void wait(TimePoint until, const StopAsked& stop);
  /// Frames that came until `until` aren't wanted: those that wait are dropped, and counted as such.
  void pass_over(TimePoint until);

  /// Whether it is asked to stop.
  [[nodiscard]] bool stopped() const { return stop_ && stop_(); }

  Status record(const v1::Event& event) { return rig_.recorder ? rig_.recorder->append(event) : Status{}; }

 private:
  /// How long the camera's next frame is waited for.
  [[nodiscard]] Seconds deadline(std::size_t camera) const;
  /// The next frame, within that time.
  Result<Frame> next_frame(std::size_t camera);
  [[nodiscard]] Seconds period() const { return options_.align.period; }
  [[nodiscard]] bool anybody_resets() const { return options_.align.reset_by == smear::ResetBy::anybody; }
  Result<std::optional<Frame>> fresh_frame(std::size_t camera);

  const AlignRig& rig_;
  const AlignRunOptions& options_;
  StopAsked stop_;
  std::vector<std::unique_ptr<smear::PhaseSensor>> sensors_;  ///< by camera
  std::vector<std::size_t> all_;
  drivers::StrobeSettings strobe_;
  std::optional<drivers::StrobeSettings> asked_;  ///< as asked for
  TimePoint fresh_;                               ///< frames that may have been read before are passed over
  TimePoint filmed_;                              ///< when the last frame came
  std::vector<std::uint64_t> passed_over_;        ///< frames of each camera since its last one
  std::vector<std::uint64_t> taken_;              ///< frames of each camera
  std::vector<bool> reset_ordered_;               ///< no frame has come since
  std::vector<bool> away_;                        ///< in the last film
};

}  // namespace emberlock::rig
