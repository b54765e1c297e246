#include "cli/align_run.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "base/log.h"
#include "base/random.h"
#include "cli/align_json.h"
#include "drivers/replay/record.h"
#include "smear_sync/reset_delay.h"

namespace emberlock::cli {
namespace {

/// Cameras whose nominal rates differ by more can't be held in step by resets.
constexpr double kSameRate = 500e-6;

/// A dot may come from a flash of the read phase before: frames are trusted from the second one after a
/// change.
constexpr double kSettlingPeriods = 2;

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

/// What was filmed of every camera between two changes.
struct Film {
  std::vector<std::vector<Frame>> frames;
  std::vector<std::vector<SmearReading>> readings;
};

/// The devices, with everything that happens to them written down.
class Bench {
 public:
  Bench(const AlignRig& rig, const AlignRunOptions& options, Seconds period)
      : rig_(rig), options_(options), period_(period) {}

  [[nodiscard]] const StrobeSettings& strobe() const { return strobe_; }

  /// Sets the strobe, if that changes anything; frames that show what was before are passed over from then
  /// on.
  Status set_strobe(const StrobeSettings& wanted) {
    if (asked_ == wanted) return {};
    EMBERLOCK_RETURN_IF_ERROR(rig_.strobe->apply(wanted));
    const TimePoint now = rig_.clock->now();
    EMBERLOCK_ASSIGN_OR_RETURN(strobe_, rig_.strobe->read_back());
    asked_ = wanted;
    fresh_ = now + kSettlingPeriods * period_;
    return record(strobe_event(now, strobe_));
  }

  /// Tells the camera to reset its shutter at `moment` or a whole number of periods later; at a moment drawn
  /// at random when there is none. Returns when it was told for.
  Result<TimePoint> reset(std::size_t camera, std::optional<TimePoint> moment, int draw) {
    const TimePoint now = rig_.clock->now();
    const TimePoint earliest = now + options_.reset_lead;
    TimePoint at =
        earliest + period_ * random_uniform(options_.seed, camera, static_cast<std::uint64_t>(draw));
    if (moment) at = *moment + period_ * std::ceil((earliest - *moment) / period_);
    EMBERLOCK_RETURN_IF_ERROR(rig_.cameras[camera]->reset_shutter(at));
    // Frames from before are older than the decision that led here: the other cameras' are passed over too.
    fresh_ = std::max(fresh_, now);
    EMBERLOCK_RETURN_IF_ERROR(record(reset_event(now, rig_.cameras[camera]->info().id, at)));
    return at;
  }

  /// Trims the camera's frame rate. Returns when it was told.
  Result<TimePoint> trim(std::size_t camera, PartsPerMillion trim) {
    const TimePoint now = rig_.clock->now();
    EMBERLOCK_RETURN_IF_ERROR(rig_.cameras[camera]->trim_rate(trim));
    EMBERLOCK_RETURN_IF_ERROR(record(trim_event(now, rig_.cameras[camera]->info().id, trim)));
    return now;
  }

  /// `count` frames of every camera, one of each in turn, and what they show.
  Result<Film> film(int count, const Progress& progress, double from, double to, const char* what) {
    Film film;
    film.frames.resize(rig_.cameras.size());
    film.readings.resize(rig_.cameras.size());
    for (int i = 0; i < count; ++i) {
      report(progress, from + (to - from) * i / count, what);
      for (std::size_t camera = 0; camera < rig_.cameras.size(); ++camera) {
        EMBERLOCK_ASSIGN_OR_RETURN(std::optional<Frame> frame, fresh_frame(camera));
        if (!frame) continue;  // none came: fewer samples of this camera
        film.readings[camera].push_back(detect(frame->image->view()));
        film.frames[camera].push_back(std::move(*frame));
      }
    }
    return film;
  }

  Status record(const v1::Event& event) { return rig_.recorder ? rig_.recorder->append(event) : Status{}; }

 private:
  Result<std::optional<Frame>> fresh_frame(std::size_t camera) {
    for (;;) {
      Result<Frame> frame = rig_.cameras[camera]->next_frame(options_.frame_deadline);
      if (!frame.ok()) {
        if (frame.error().kind != ErrorKind::timed_out) return frame.error();
        log(LogCategory::cli).warn("{}", frame.error().message());
        return std::optional<Frame>();
      }
      if (rig_.recorder) EMBERLOCK_RETURN_IF_ERROR(rig_.recorder->write(camera, *frame));
      const bool usable =
          frame->stamp.monotonic_time >= fresh_ && frame->stamp.status == FrameStatus::complete;
      if (usable) return std::optional<Frame>(std::move(*frame));
    }
  }

  const AlignRig& rig_;
  const AlignRunOptions& options_;
  Seconds period_;
  StrobeSettings strobe_;                ///< as read back
  std::optional<StrobeSettings> asked_;  ///< as asked for
  TimePoint fresh_;                      ///< frames that came before are passed over
};

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
  return period(rate);
}

/// t_row of every camera from a comb. Cameras whose comb can't be read keep the mean of the others.
Status measure_row_times(Bench& bench, const AlignRunOptions& options, AlignRunResult& result,
                         const Progress& progress) {
  StrobeSettings comb{
      .output = StrobeOutput::flashing, .rate = options.comb_rate, .width = options.flash_width};
  for (int attempt = 0; attempt < kCombAttempts; ++attempt) {
    EMBERLOCK_RETURN_IF_ERROR(bench.set_strobe(comb));
    EMBERLOCK_ASSIGN_OR_RETURN(const Film film,
                               bench.film(options.comb_frames, progress, 0, 0.2, "measuring the row time"));
    bool near_integer = false;
    double weights = 0;
    double moment = 0;
    for (std::size_t i = 0; i < film.readings.size(); ++i) {
      const auto fit = fit_row_clock(film.readings[i], bench.strobe().rate, options.timing[i].frame_period);
      result.row_clocks[i].reset();
      if (!fit.ok()) {
        log(LogCategory::cli).warn("camera {}: {}", i, fit.error().message());
        continue;
      }
      near_integer |= fit->near_integer_pitch;
      result.row_clocks[i] = *fit;
      const double w = 1 / std::max(fit->sigma.value() * fit->sigma.value(), 1e-24);
      weights += w;
      moment += w * fit->row_time.value();
    }
    if (weights == 0) {
      return Error{ErrorKind::device, "no camera shows a comb of dots that a row time can be fitted to",
                   "measuring the row time",
                   "check that the strobe flashes at " + std::to_string(options.comb_rate.value()) +
                       "/s and is in view of the cameras"};
    }
    result.options.row_time = SecondsPerRow(moment / weights);
    if (!near_integer) break;
    comb.rate = options.comb_rate * 0.983;  // another pitch, off the whole number
  }
  for (std::size_t i = 0; i < result.timing.size(); ++i) {
    result.timing[i].row_time =
        result.row_clocks[i] ? result.row_clocks[i]->row_time : result.options.row_time;
  }
  return {};
}

AlignRound to_round(const Film& film, const AlignRunResult& rig, const AlignRunOptions& options,
                    const StrobeSettings& strobe) {
  std::vector<std::vector<PhaseSample>> samples(film.frames.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (std::size_t j = 0; j < film.frames[i].size(); ++j) {
      samples[i].push_back({film.frames[i][j].stamp.monotonic_time,
                            phase_of(film.readings[i][j], rig.timing[i], strobe.width)});
    }
  }
  const Seconds period = rig.options.period;
  CommonPhases common = refer(samples, {.period = period,
                                        .resolution = row_resolution(rig.options.row_time, strobe.width),
                                        .beat = expected_beat(strobe.rate, period, options.rate_error)});
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

}  // namespace

Result<AlignRunResult> run_align(const AlignRig& rig, const AlignRunOptions& options,
                                 const AlignObserver& observer, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Seconds period, common_period(rig, options));
  AlignRunResult result;
  result.options = options.align;
  result.options.period = period;
  result.options.round_time = period * (options.frames_per_round + kSettlingPeriods);
  result.timing = options.timing;
  for (CcdTiming& timing : result.timing) timing.frame_period = period;
  result.row_clocks.resize(rig.cameras.size());
  for (Camera* camera : rig.cameras) EMBERLOCK_RETURN_IF_ERROR(camera->start());

  Bench bench(rig, options, period);
  if (options.measure_row_time)
    EMBERLOCK_RETURN_IF_ERROR(measure_row_times(bench, options, result, progress));

  const std::vector<AlignCamera> cameras = describe(rig, options);
  StrobeSettings flashes{
      .output = StrobeOutput::flashing, .rate = rate(period), .width = options.flash_width};
  AlignState state;
  std::vector<ResetDone> resets;
  std::vector<TrimDone> trims;
  double reached = 0.2;  // of the progress; the rest is the part of the cameras within tolerance
  do {
    EMBERLOCK_RETURN_IF_ERROR(bench.set_strobe(flashes));
    const std::string words =
        "round " + std::to_string(state.rounds + 1) + ", " + std::to_string(state.resets) + " resets";
    EMBERLOCK_ASSIGN_OR_RETURN(
        const Film film, bench.film(options.frames_per_round, progress, reached, reached, words.c_str()));
    AlignRound round = to_round(film, result, options, bench.strobe());
    round.resets = std::exchange(resets, {});
    round.trims = std::exchange(trims, {});
    AlignStep step = align_step(state, round, cameras, result.options);
    state = std::move(step.state);
    result.last = std::move(step.decision);
    if (result.last.reference) reached = 0.2 + 0.8 * part_within(result.last, result.options);

    const AlignRoundReport seen{round,          result.last, cameras,      result.options,
                                bench.strobe(), film.frames, film.readings};
    v1::Event event;
    event.set_monotonic_ns(round.at.ns);
    event.mutable_decision()->set_round(static_cast<std::uint32_t>(result.last.round));
    event.mutable_decision()->set_json(round_json(seen).dump());
    EMBERLOCK_RETURN_IF_ERROR(bench.record(event));
    if (observer) observer(seen);

    if (result.last.strobe_phase) flashes.phase = *result.last.strobe_phase;
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      const CameraDecision& camera = result.last.cameras[i];
      if (camera.trim) {
        EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at, bench.trim(i, *camera.trim));
        trims.push_back({i, at, *camera.trim});
      }
      if (!camera.reset) continue;
      EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at, bench.reset(i, camera.moment, state.cameras[i].resets));
      const bool told = cameras[i].method == ResetMethod::on_command;
      resets.push_back({i, told ? std::optional(at) : std::nullopt});
    }
  } while (result.last.verdict == AlignVerdict::go_on);
  report(progress, 1, result.last.verdict == AlignVerdict::aligned ? "aligned" : "not aligned");

  result.resets = state.resets;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    result.delays.push_back(state.cameras[i].taught > 0 ? state.cameras[i].delay : cameras[i].expected_delay);
  }
  return result;
}

}  // namespace emberlock::cli
