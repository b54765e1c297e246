#include "daemon/align/run.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "daemon/align/bench.h"
#include "daemon/align/json.h"
#include "smear_sync/align/align_words.h"
#include "smear_sync/align/move_together.h"
#include "smear_sync/align/reset_delay.h"

namespace emberlock {
namespace {

/// Cameras whose nominal rates differ by more can't be held in step by resets.
constexpr double kSameRate = 500e-6;

/// Looks about the edge that the phase of one global shutter takes in a round, beside one without flashes
/// that all of them share.
constexpr double kLooks = 5;
/// And those over the whole period that come first when some were reset: all of these share them too.
constexpr double kSweepLooks = 24;

/// Standard error of a swept phase that is aimed at: this part of the tolerance, as fine as tells whether
/// the edge follows the strobe's step, or the least that sweeps reach.
constexpr double kSweptPart = 0.04;
constexpr Seconds kSweptLeast = microseconds(2);

Seconds wanted_of_sweeps(const AlignOptions& options) {
  Seconds wanted = kSweptPart * options.tolerance.in_time(options.row_time);
  if (options.strobe_step > Seconds(0)) wanted = std::min(wanted, kToldPartOfStep * options.strobe_step);
  return std::max(wanted, kSweptLeast);
}

/// Of the progress, before the end.
constexpr double kNeverDone = 0.999;

/// While cameras are held they are filmed at least this often, however long they promise to stay.
constexpr Seconds kLongestWait{600};

constexpr int kCombAttempts = 2;

ResetMethod method_of(ShutterReset reset) {
  switch (reset) {
    case ShutterReset::none:
      return ResetMethod::none;
    case ShutterReset::by_hand:
      return ResetMethod::by_hand;
    case ShutterReset::on_command:
      return ResetMethod::on_command;
  }
  return ResetMethod::none;
}

std::optional<RateTrim> trim_of(const CameraInfo& info) {
  if (!info.trim) return std::nullopt;
  return RateTrim{info.trim->range, info.trim->step, info.trim->latency};
}

Result<Seconds> common_period(const AlignRig& rig, const AlignRunOptions& options) {
  const auto refuse = [](std::string what, std::string where, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
  };
  if (rig.cameras.empty()) return refuse("there is no camera", "align", "connect at least two");
  if (options.timing.size() != rig.cameras.size() ||
      (!options.delays.empty() && options.delays.size() != rig.cameras.size())) {
    return refuse("timings or delays don't go by camera", "align", "give one for each camera");
  }
  if (options.align.reference >= rig.cameras.size()) {
    return refuse("the reference is not among the cameras", "align", "choose one of the rig's");
  }
  const Hertz rate = rig.cameras.front()->info().frame_rate;
  for (const Camera* camera : rig.cameras) {
    const Hertz own = camera->info().frame_rate;
    if (std::abs(own / rate - 1) > kSameRate) {
      return refuse("films at " + std::to_string(own.value()) + " frames/s, the first camera at " +
                        std::to_string(rate.value()),
                    "camera " + camera->info().id, "set all cameras to one frame rate");
    }
  }
  const Seconds period = emberlock::period(rate);
  const Seconds step = options.align.strobe_step;
  if (!(step >= Seconds(0) && step < period / 4)) {
    return refuse(
        fmt::format("the strobe can't be moved by {:.4g} ms to see dots follow", in_milliseconds(step)),
        "align",
        fmt::format("choose a step of less than a quarter of the frame period, {:.4g} ms; 0: none",
                    in_milliseconds(period / 4)));
  }
  return period;
}

/// A mean of row times, each weighing by its standard error.
class MeanRowTime {
 public:
  void add(const RowClock& clock) {
    const double w = 1 / std::max(clock.sigma.value() * clock.sigma.value(), 1e-24);
    weights_ += w;
    moment_ += w * clock.row_time.value();
  }
  [[nodiscard]] std::optional<SecondsPerRow> value() const {
    if (weights_ == 0) return std::nullopt;
    return SecondsPerRow(moment_ / weights_);
  }

 private:
  double weights_ = 0;
  double moment_ = 0;
};

/// t_row of every CCD from a comb. CCDs whose comb can't be read keep the mean of the others.
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

/// What the sensors measured of themselves. Rows are CCD's where there is one, else a rolling shutter's.
void adopt_sensors(const AlignRig& rig, AlignBench& bench, const AlignRunOptions& options,
                   AlignRunResult& result) {
  MeanRowTime mean;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const PhaseSensor& sensor = bench.sensor(i);
    result.timing[i] = sensor.timing();
    const auto clock = sensor.row_clock();
    if (!clock) continue;
    result.row_clocks[i] = clock;
    mean.add(*clock);
  }
  const bool rows_of_ccds = !bench.cameras_with(SensorKind::ccd).empty();
  if (options.measure_row_time && !rows_of_ccds && mean.value()) result.options.row_time = *mean.value();
}

/// How a camera's tau moves against the strobe, as far as earlier rounds tell.
Beat own_beat(const AlignState& state, std::size_t camera, const Beat& common, const AlignOptions& options) {
  const double spread = options.rate_spread.value();
  Beat own{common.rate, PartsPerMillion(std::hypot(common.sigma.value(), spread))};
  if (!state.last_round || !state.cameras[camera].phase.phase_known()) return own;
  const PhaseTrack& track = state.cameras[camera].phase;
  const TimePoint later = *state.last_round + Seconds(1);  // when what was ordered is in force
  const Drift drift = track.at(*state.last_round, track_options(options));
  own.rate += drift.rate + track.trim(later);
  own.sigma = PartsPerMillion(std::hypot(common.sigma.value(), drift.rate_sigma.value()));
  return own;
}

AlignRound to_round(AlignBench& bench, const Film& film, const AlignRunResult& rig, const Beat& expected) {
  const StrobeSettings& strobe = bench.strobe();
  std::vector<std::vector<PhaseSample>> samples;
  for (std::size_t i = 0; i < film.frames.size(); ++i)
    samples.push_back(bench.sensor(i).phases(strobe.phase));
  const Seconds period = rig.options.period;
  CommonPhases common = refer(
      samples,
      {.period = period, .resolution = row_resolution(rig.options.row_time, strobe.width), .beat = expected});
  AlignRound round{common.at, common.beat, strobe.phase, {}, {}, {}};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::vector<TimePoint> stamps;
    for (const Frame& frame : film.frames[i]) stamps.push_back(frame.stamp.monotonic_time);
    round.cameras.push_back({std::move(common.phases[i]), common_stamp(stamps, common.at, period)});
  }
  return round;
}

std::vector<AlignCamera> describe(const AlignRig& rig, const AlignRunOptions& options) {
  std::vector<AlignCamera> cameras;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraInfo& info = rig.cameras[i]->info();
    cameras.push_back({info.id, info.model, method_of(info.reset),
                       options.delays.empty() ? std::nullopt : options.delays[i], trim_of(info)});
  }
  return cameras;
}

/// How near the goal a decision is: the part of the cameras within tolerance.
double part_within(const AlignDecision& decision, const AlignOptions& options) {
  const Seconds tolerance = options.tolerance.in_time(options.row_time);
  const auto within =
      std::count_if(decision.cameras.begin(), decision.cameras.end(),
                    [&](const CameraDecision& c) { return c.error && abs(*c.error) <= tolerance; });
  return static_cast<double>(within) / static_cast<double>(decision.cameras.size());
}

/// One alignment: what is known, and the steps of a round.
class AlignRunner {
 public:
  AlignRunner(const AlignRig& rig, const AlignRunOptions& options, Seconds period,
              const AlignObserver& observer, const Progress& progress)
      : rig_(rig), options_(options), observer_(observer), progress_(progress), bench_(rig, options, period) {
    result_.options = options.align;
    result_.options.period = period;
    result_.options.round_time = period * (options.frames_per_round + AlignBench::kSettlingPeriods);
    if (const auto swept = bench_.cameras_with(SensorKind::global_shutter); !swept.empty()) {
      const Seconds look = period * (1 + AlignBench::kSettlingPeriods);
      result_.options.round_time += (1 + kLooks * static_cast<double>(swept.size())) * look;
      result_.options.sweep_time = kSweepLooks * look;
    }
    result_.timing = options.timing;
    for (CcdTiming& timing : result_.timing) timing.frame_period = period;
    result_.row_clocks.resize(rig.cameras.size());
    cameras_ = describe(rig, options);
    for (const Camera* camera : rig.cameras) sensors_.push_back(camera->info().sensor);
    flashes_ = {.output = StrobeOutput::flashing, .rate = rate(period), .width = options.flash_width};
  }

  Status start() {
    for (Camera* camera : rig_.cameras) EMBERLOCK_RETURN_IF_ERROR(camera->start());
    if (!options_.measure_row_time) return {};
    return measure_row_times(rig_, bench_, options_, result_, progress_);
  }

  /// Films, decides, and carries the decision out.
  Status round() {
    EMBERLOCK_RETURN_IF_ERROR(bench_.set_strobe(flashes_));
    // What a round before saw of the beat is no better than the settings, whose error is common to all
    // rounds.
    const Beat expected = expected_beat(bench_.strobe().rate, result_.options.period, options_.rate_error);
    for (std::size_t i = 0; i < cameras_.size(); ++i)
      bench_.sensor(i).begin_round(own_beat(state_, i, beat_.value_or(expected), result_.options));
    EMBERLOCK_RETURN_IF_ERROR(bench_.sweep(flashes_, wanted_of_sweeps(result_.options), progress_, reached_));
    adopt_sensors(rig_, bench_, options_, result_);
    report(progress_, std::min(reached_, kNeverDone),
           fmt::format("round {}, {} resets", state_.rounds + 1, state_.resets));
    EMBERLOCK_ASSIGN_OR_RETURN(const Film film, bench_.film_all(options_.frames_per_round));
    AlignRound round = to_round(bench_, film, result_, expected);
    beat_ = round.beat;
    at_ = round.at;
    round.resets = std::exchange(resets_, {});
    round.trims = std::exchange(trims_, {});
    AlignStep step = align_step(state_, round, cameras_, result_.options);
    state_ = std::move(step.state);
    result_.last = std::move(step.decision);
    if (result_.last.reference) reached_ = 0.2 + 0.8 * part_within(result_.last, result_.options);
    EMBERLOCK_RETURN_IF_ERROR(tell({round, result_.last, cameras_, sensors_, result_.options, bench_.strobe(),
                                    film.frames, film.readings}));
    return carry_out();
  }

  /// After a round that found the cameras aligned: keeps them so for the time asked for, or until it is
  /// stopped, and as long as they can be.
  Status hold(const StopAsked& stop) {
    const TimePoint began = at_;
    const auto left = [&] { return *options_.hold - (at_ - began); };
    while (left() > Seconds(0) && !(stop && stop())) {
      const bool waits = result_.last.verdict == AlignVerdict::aligned;
      if (waits) {
        const Seconds promised = result_.last.next_check.value_or(kLongestWait) - result_.options.round_time;
        const Seconds pause = std::clamp(promised, Seconds(0), std::min(kLongestWait, left()));
        report(progress_, std::min((at_ - began) / *options_.hold, kNeverDone),
               fmt::format("held for {} by {} checks and {} resets, checks again in {}", words(at_ - began),
                           result_.checks, state_.resets, words(pause)));
        bench_.wait(at_ + pause, stop);
        if (stop && stop()) break;
      }
      EMBERLOCK_RETURN_IF_ERROR(round());
      result_.checks += waits ? 1 : 0;
      if (result_.last.verdict == AlignVerdict::refused || result_.last.verdict == AlignVerdict::given_up)
        break;
    }
    return {};
  }

  [[nodiscard]] const AlignDecision& last() const { return result_.last; }

  AlignRunResult finish() {
    report(progress_, 1, result_.last.verdict == AlignVerdict::aligned ? "aligned" : "not aligned");
    result_.resets = state_.resets;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      result_.cameras.push_back(rig_.cameras[i]->info());
      result_.exposures.push_back(bench_.sensor(i).exposure());
      const CameraTrack& track = state_.cameras[i];
      result_.delays.push_back(track.taught > 0 ? track.delay : cameras_[i].expected_delay);
    }
    return std::move(result_);
  }

 private:
  Status tell(const AlignRoundReport& seen) {
    v1::Event event;
    event.set_monotonic_ns(seen.round.at.ns);
    event.mutable_decision()->set_round(static_cast<std::uint32_t>(seen.decision.round));
    event.mutable_decision()->set_json(round_json(seen).dump());
    EMBERLOCK_RETURN_IF_ERROR(bench_.record(event));
    if (observer_) observer_(seen);
    return {};
  }

  Status carry_out() {
    if (result_.last.strobe_phase) flashes_.phase = *result_.last.strobe_phase;
    for (std::size_t i = 0; i < cameras_.size(); ++i) {
      const CameraDecision& camera = result_.last.cameras[i];
      if (camera.trim) {
        EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at, bench_.trim(i, *camera.trim));
        trims_.push_back({i, at, *camera.trim});
      }
      if (!camera.reset) continue;
      EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at,
                                 bench_.reset(i, camera.moment, state_.cameras[i].resets));
      const bool told = cameras_[i].method == ResetMethod::on_command;
      resets_.push_back({i, told ? std::optional(at) : std::nullopt});
    }
    return {};
  }

  const AlignRig& rig_;
  const AlignRunOptions& options_;
  const AlignObserver& observer_;
  const Progress& progress_;
  AlignBench bench_;
  AlignRunResult result_;
  std::vector<AlignCamera> cameras_;
  std::vector<SensorKind> sensors_;
  StrobeSettings flashes_;
  std::optional<Beat> beat_;  ///< of the round before
  TimePoint at_;              ///< its instant
  AlignState state_;
  std::vector<ResetDone> resets_;  ///< since the last round
  std::vector<TrimDone> trims_;
  double reached_ = 0.2;  ///< of the progress; the rest is the part of the cameras within tolerance
};

}  // namespace

Result<AlignRunResult> run_align(const AlignRig& rig, const AlignRunOptions& options,
                                 const AlignObserver& observer, const Progress& progress,
                                 const StopAsked& stop) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Seconds period, common_period(rig, options));
  AlignRunner run(rig, options, period, observer, progress);
  EMBERLOCK_RETURN_IF_ERROR(run.start());
  do {
    EMBERLOCK_RETURN_IF_ERROR(run.round());
  } while (run.last().verdict == AlignVerdict::go_on && !(stop && stop()));
  if (options.hold && run.last().verdict == AlignVerdict::aligned) EMBERLOCK_RETURN_IF_ERROR(run.hold(stop));
  return run.finish();
}

}  // namespace emberlock
