// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "rig/align/bench.h"
#include "rig/align/run.h"
#include "rig/align/sight.h"
#include "smear_sync/align/align.h"

namespace emberlock::rig {

struct CameraError {
  Seconds error;
  Seconds sigma;  ///< standard error
};

/// One alignment, round by round, for a caller that has other things to do between them: start() once, then
/// round() until last() says aligned, and again whenever next_check() has passed, for as long as the lock is
/// held. Cameras that would leave tolerance are reset by such a round while all are in it: last().renews, and
/// for the rounds until they are seen again nothing is locked. What was learnt (row times, rates, delays) is
/// kept from round to round. Not thread-safe.
///
/// Between two rounds the caller may film with the cameras itself: darken() before, if flashes shan't be
/// seen, and pass_over() after it. The next round sets the strobe again.
///
/// When `stop` says so, start() and round() return within a fraction of a second, having decided nothing, and
/// can be called again.
class Alignment {
 public:
  /// Devices must outlive it. Errors: bad_input (frame rates that differ, sizes of the lists).
  static Result<std::unique_ptr<Alignment>> create(const AlignRig& rig, const AlignRunOptions& options,
                                                   AlignObserver observer = {}, Progress progress = {},
                                                   StopAsked stop = {});
  Alignment(const Alignment&) = delete;
  Alignment& operator=(const Alignment&) = delete;

  /// Starts the cameras, and measures the row time of CCDs from a comb. Errors: the devices', and device
  /// where no comb can be read.
  Status start();
  /// Films, decides, and carries the decision out. Errors: the devices' and the recorder's.
  Status round();
  /// Whether the last start() or round() was cut short.
  [[nodiscard]] bool stopped() const { return stopped_; }
  /// Asks `stop` anew.
  bool stop_asked();

  /// No flash from now on, until the next round. Its time base goes on. A strobe that somebody sets by hand
  /// is left as it is.
  Status darken();
  /// Flashes from now on, as the next round has them.
  Status light() { return bench_.set_strobe(flashes_); }
  /// Frames that came until `until` are of no use to the next round; those that still wait are dropped.
  void pass_over(TimePoint until) { bench_.pass_over(until); }
  /// Waits until `until`, or until it is asked to stop.
  void wait(TimePoint until);

  [[nodiscard]] const smear::AlignDecision& last() const { return result_.last; }
  /// The sentences of that.
  [[nodiscard]] const smear::AlignWords& words() const { return result_.words; }
  /// With period and row time as measured.
  [[nodiscard]] const smear::AlignOptions& options() const { return result_.options; }
  [[nodiscard]] const std::vector<smear::CcdTiming>& timing() const { return result_.timing; }
  [[nodiscard]] const std::vector<std::optional<smear::RowClock>>& row_clocks() const {
    return result_.row_clocks;
  }
  [[nodiscard]] const std::vector<smear::AlignCamera>& cameras() const { return cameras_; }
  [[nodiscard]] const smear::AlignState& state() const { return state_; }
  /// The strobe, as it said of itself after the last change.
  [[nodiscard]] const drivers::StrobeSettings& strobe() const { return bench_.strobe(); }
  /// What the last round saw of each camera, for a picture.
  [[nodiscard]] const std::vector<CameraSight>& sights() const { return sights_; }
  /// The instant of the last round.
  [[nodiscard]] TimePoint at() const { return at_; }
  [[nodiscard]] int resets() const { return state_.resets; }
  /// Rounds that found the cameras aligned before they began.
  [[nodiscard]] int checks() const { return result_.checks; }
  /// Everything that is known now; the delays are options for another run.
  [[nodiscard]] AlignRunResult result() const;

  // By what is known of every camera's phase and rate, at any instant after the last round.

  /// Whether all cameras are in tolerance, to three standard errors: as the last aligned round promised, as
  /// long as no round since has seen a camera out, reset or away.
  [[nodiscard]] bool locked(TimePoint now) const { return promised_until_ && now <= *promised_until_; }
  /// How long a take may be that begins now: until the first camera may leave tolerance, to three standard
  /// errors, as locked() says; 0 when one may have, or isn't aligned. Infinite where none ever does.
  [[nodiscard]] Seconds time_left(TimePoint now) const;
  /// Until the first camera leaves, most likely; infinite where none does.
  [[nodiscard]] Seconds likely_left(TimePoint now) const;
  /// For how long `camera` surely stays in tolerance; absent when it isn't locked.
  [[nodiscard]] std::optional<Seconds> time_left(TimePoint now, std::size_t camera) const;
  /// From now on locks are to hold for so long (AlignOptions::shortest_take), as far as resets can make them.
  void hold_for(Seconds shortest_take) { result_.options.shortest_take = shortest_take; }
  /// How long round() may wait to come in time: at most until ten minutes after the last one; a quarter of a
  /// second where people press shutters and say nothing. 0 when not aligned.
  [[nodiscard]] Seconds next_check(TimePoint now) const;
  /// Each camera's error, positive when it films earlier: the last round's, and how far its rate has carried
  /// it since, against the mean of all. Empty while phases are missing.
  [[nodiscard]] std::vector<CameraError> errors(TimePoint now) const;
  /// The largest difference between two cameras' errors; absent likewise.
  [[nodiscard]] std::optional<Seconds> worst_pair(TimePoint now) const;
  /// By how much a camera's frame rate, trimmed as it is, exceeds the middle of all; absent likewise.
  [[nodiscard]] std::optional<PartsPerMillion> drift(std::size_t camera) const;

 private:
  Alignment(const AlignRig& rig, AlignRunOptions options, AlignObserver observer, Progress progress,
            StopAsked stop);
  Status tell(const AlignRoundReport& seen);
  Status carry_out();
  [[nodiscard]] std::optional<Seconds> own_target(std::size_t camera) const;
  void look(const Film& film);
  void promise();

  AlignRig rig_;
  AlignRunOptions options_;
  AlignObserver observer_;
  Progress progress_;
  StopAsked stop_;
  bool stopped_ = false;
  AlignBench bench_;
  AlignRunResult result_;  ///< but for what result() adds
  std::vector<smear::AlignCamera> cameras_;
  std::vector<SensorKind> sensors_;
  std::vector<CameraSight> sights_;
  drivers::StrobeSettings flashes_;
  std::optional<smear::PeriodOffset> period_offset_;  ///< of the round before
  TimePoint at_;                                      ///< its instant
  smear::AlignState state_;
  std::optional<TimePoint> promised_until_;
  std::vector<smear::ResetDone> resets_;  ///< since the last round
  std::vector<smear::TrimDone> trims_;
  double reached_ = 0.2;  ///< of the progress; the rest is the part of the cameras within tolerance
};

}  // namespace emberlock::rig
