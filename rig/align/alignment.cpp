// SPDX-License-Identifier: Apache-2.0
#include "rig/align/alignment.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "rig/align/decision_proto.h"
#include "rig/align/dial.h"
#include "rig/align/row_times.h"
#include "rig/align/stagger.h"
#include "smear_sync/align/move_together.h"
#include "smear_sync/align/reset_delay.h"
#include "smear_sync/align/stagger.h"

namespace emberlock::rig {
namespace {

/// Looks about the edge that the phase of one global shutter takes in a round, beside one without flashes
/// that all of them share.
constexpr double kLooks = 5;
/// And those over the whole period that come first when some were reset: all of these share them too.
constexpr double kSweepLooks = 24;

/// Standard error of a swept phase that is aimed at: this part of the tolerance, as fine as tells whether
/// the edge follows the strobe's step, or the least that sweeps reach.
constexpr double kSweptPart = 0.04;
constexpr Seconds kSweptLeast = microseconds(2);

Seconds wanted_of_sweeps(const smear::AlignOptions& options) {
  Seconds wanted = kSweptPart * options.tolerance.in_time(options.row_time);
  if (options.strobe_step > Seconds(0))
    wanted = std::min(wanted, smear::kToldPartOfStep * options.strobe_step);
  return std::max(wanted, kSweptLeast);
}

/// While cameras are held they are filmed at least this often, however long they promise to stay.
constexpr Seconds kLongestWait{600};
/// A check comes so much of the promised time before its end, so that whoever is due is reset within it.
constexpr double kAhead = 0.05;
/// Where people press shutters they are filmed at least this often: what a press does is seen at once.
constexpr Seconds kLongestWaitForPeople{0.25};

/// That the options go by the rig's cameras, and its strobe shows their phases; the frame period.
Result<Seconds> check_rig(const AlignRig& rig, const AlignRunOptions& options) {
  const auto refuse = [](std::string what, std::string where, std::string remedy) {
    return Error{ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
  };
  EMBERLOCK_ASSIGN_OR_RETURN(const Seconds period, common_period(rig.cameras));
  const auto goes_by_camera = [&](const auto& list) {
    return list.empty() || list.size() == rig.cameras.size();
  };
  if (options.timing.empty() || !goes_by_camera(options.timing) || !goes_by_camera(options.delays) ||
      !goes_by_camera(options.offsets)) {
    return refuse("timings, delays or offsets don't go by camera", "align", "give one for each camera");
  }
  if (!options.offsets.empty())
    EMBERLOCK_RETURN_IF_ERROR(smear::check_stagger(rig.cameras.size(), period,
                                                   options.align.tolerance.in_time(options.align.row_time)));
  if (options.align.reference >= rig.cameras.size()) {
    return refuse("the reference is not among the cameras", "align", "choose one of the rig's");
  }
  const Seconds step = options.align.strobe_step;
  if (!(step >= Seconds(0) && step < period / 4)) {
    return refuse(
        fmt::format("the strobe can't be moved by {:.4g} ms to see dots follow", in_milliseconds(step)),
        "align",
        fmt::format("choose a step of less than a quarter of the frame period, {:.4g} ms; 0: none",
                    in_milliseconds(period / 4)));
  }
  const auto sweeps = std::find_if(rig.cameras.begin(), rig.cameras.end(), [](const drivers::Camera* camera) {
    return camera->info().sensor != SensorKind::ccd;
  });
  if (options.align.dial && sweeps != rig.cameras.end()) {
    return refuse(fmt::format("has a {} shutter, whose phase only a strobe shows whose flashes are moved",
                              name((*sweeps)->info().sensor)),
                  "camera " + (*sweeps)->info().id,
                  "use a strobe that can be told, or CCDs alone with one that is set by hand");
  }
  return period;
}

/// What the sensors measured of themselves. Rows are CCD's where there is one, else a rolling shutter's.
void adopt_sensors(const AlignRig& rig, AlignBench& bench, const AlignRunOptions& options,
                   AlignRunResult& result) {
  MeanRowTime mean;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const smear::PhaseSensor& sensor = bench.sensor(i);
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
smear::PeriodOffset own_period_offset(const smear::AlignState& state, std::size_t camera,
                                      const smear::PeriodOffset& common, const smear::AlignOptions& options) {
  const double spread = options.rate_spread.value();
  smear::PeriodOffset own{common.rate, PartsPerMillion(std::hypot(common.sigma.value(), spread))};
  if (!state.last_round || !state.cameras[camera].phase.phase_known()) return own;
  const smear::PhaseTrack& track = state.cameras[camera].phase;
  const TimePoint later = *state.last_round + Seconds(1);  // when what was ordered is in force
  const smear::Drift drift = track.at(*state.last_round, smear::track_options(options));
  own.rate += drift.rate + track.trim(later);
  own.sigma = PartsPerMillion(std::hypot(common.sigma.value(), drift.rate_sigma.value()));
  return own;
}

smear::AlignRound to_round(AlignBench& bench, const Film& film, const AlignRunResult& rig,
                           smear::PeriodOffset expected) {
  const drivers::StrobeSettings& strobe = bench.strobe();
  smear::FlashRate flashes;
  if (rig.options.dial) {
    flashes = flashes_of(film, rig.timing, strobe.width);
    expected = period_offset_of(flashes, rig.options.period).value_or(expected);
  }
  std::vector<std::vector<smear::PhaseSample>> samples;
  for (std::size_t i = 0; i < film.frames.size(); ++i) {
    samples.push_back(rig.options.dial
                          ? flash_samples(film.frames[i], film.readings[i], rig.timing[i], strobe.width)
                          : bench.sensor(i).phases(strobe.phase));
  }
  const Seconds period = rig.options.period;
  smear::CommonPhases common =
      smear::refer(samples, {.period = period,
                             .resolution = smear::row_resolution(rig.options.row_time, strobe.width),
                             .period_offset = expected});
  smear::AlignRound round{common.at, common.period_offset, strobe.phase, {}, {}, {}, std::move(flashes)};
  for (std::size_t i = 0; i < samples.size(); ++i) {
    std::vector<TimePoint> stamps;
    for (const Frame& frame : film.frames[i]) stamps.push_back(frame.stamp.monotonic_time);
    round.cameras.push_back({std::move(common.phases[i]), smear::common_stamp(stamps, common.at, period)});
    if (!film.away[i] || rig.options.reset_by == smear::ResetBy::orders) continue;
    round.cameras.back().away = true;
    round.cameras.back().phase = {smear::PhaseState::unusable, {}, {}, "it sends no frames"};
  }
  return round;
}

std::vector<smear::AlignCamera> describe(const AlignRig& rig, const AlignRunOptions& options) {
  std::vector<smear::AlignCamera> cameras;
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const drivers::CameraInfo& info = rig.cameras[i]->info();
    cameras.push_back({info.id, info.model, info.reset,
                       options.delays.empty() ? std::nullopt : options.delays[i], info.trim,
                       options.offsets.empty() ? Seconds(0) : options.offsets[i]});
  }
  return cameras;
}

/// How near the goal a decision is: the part of the cameras within tolerance.
double part_within(const smear::AlignDecision& decision, const smear::AlignOptions& options) {
  const Seconds tolerance = options.tolerance.in_time(options.row_time);
  const auto within =
      std::count_if(decision.cameras.begin(), decision.cameras.end(),
                    [&](const smear::CameraDecision& c) { return c.error && abs(*c.error) <= tolerance; });
  return static_cast<double>(within) / static_cast<double>(decision.cameras.size());
}

}  // namespace

Result<std::unique_ptr<Alignment>> Alignment::create(const AlignRig& rig, const AlignRunOptions& options,
                                                     AlignObserver observer, Progress progress,
                                                     StopAsked stop) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Seconds period, check_rig(rig, options));
  return std::unique_ptr<Alignment>(new Alignment(rig, for_dial(at_period(options, period)),
                                                  std::move(observer), std::move(progress), std::move(stop)));
}

Alignment::Alignment(const AlignRig& rig, AlignRunOptions options, AlignObserver observer, Progress progress,
                     StopAsked stop)
    : rig_(rig),
      options_(std::move(options)),
      observer_(std::move(observer)),
      progress_(std::move(progress)),
      stop_(std::move(stop)),
      bench_(rig_, options_, [this] { return stop_asked(); }),
      cameras_(describe(rig, options_)),
      sights_(rig.cameras.size()) {
  const Seconds period = options_.align.period;
  result_.options = options_.align;
  result_.options.round_time = period * (options_.frames_per_round + AlignBench::kSettlingPeriods);
  if (const auto swept = bench_.cameras_with(SensorKind::global_shutter); !swept.empty()) {
    const Seconds look = period * (1 + AlignBench::kSettlingPeriods);
    result_.options.round_time += (1 + kLooks * static_cast<double>(swept.size())) * look;
    result_.options.sweep_time = kSweepLooks * look;
  }
  result_.timing = options_.timing;
  result_.row_clocks.resize(rig.cameras.size());
  for (const drivers::Camera* camera : rig.cameras) sensors_.push_back(camera->info().sensor);
  flashes_ = {.output = drivers::StrobeOutput::flashing, .rate = rate(period), .width = options_.flash_width};
  if (options_.align.dial) flashes_.rate = options_.align.dial->nearest(flashes_.rate);
}

bool Alignment::stop_asked() {
  stopped_ = stopped_ || (stop_ && stop_());
  return stopped_;
}

Status Alignment::start() {
  stopped_ = false;
  for (drivers::Camera* camera : rig_.cameras) EMBERLOCK_RETURN_IF_ERROR(camera->start());
  if (!options_.measure_row_time) return {};
  return measure_row_times(rig_, bench_, options_, result_, progress_);
}

Status Alignment::round() {
  stopped_ = false;
  EMBERLOCK_RETURN_IF_ERROR(bench_.set_strobe(flashes_));
  // What a round before saw of the beat is no better than the settings, whose error is common to all
  // rounds.
  const smear::PeriodOffset expected =
      smear::expected_period_offset(bench_.strobe().rate, result_.options.period, options_.rate_error);
  for (std::size_t i = 0; i < cameras_.size(); ++i)
    bench_.sensor(i).begin_round(
        own_period_offset(state_, i, period_offset_.value_or(expected), result_.options));
  EMBERLOCK_RETURN_IF_ERROR(bench_.sweep(flashes_, wanted_of_sweeps(result_.options), progress_, reached_));
  adopt_sensors(rig_, bench_, options_, result_);
  emberlock::tell(progress_, std::min(reached_, kNearlyDone),
                  fmt::format("round {}, {} resets", state_.rounds + 1, state_.resets));
  EMBERLOCK_ASSIGN_OR_RETURN(const Film film, bench_.film_all(options_.frames_per_round));
  if (stopped_) return {};
  smear::AlignRound round = to_round(bench_, film, result_, expected);
  period_offset_ = round.period_offset;
  at_ = round.at;
  round.resets = std::exchange(resets_, {});
  round.trims = std::exchange(trims_, {});
  if (result_.last.verdict == smear::AlignVerdict::aligned) ++result_.checks;
  smear::AlignStep step = smear::align_step(state_, round, cameras_, result_.options);
  state_ = std::move(step.state);
  result_.last = std::move(step.decision);
  result_.words = smear::words(result_.last, round, cameras_, result_.options);
  for (const std::size_t camera : result_.last.jumped) bench_.sensor(camera).forget_phase();
  promise();
  if (result_.last.reference) reached_ = 0.2 + 0.8 * part_within(result_.last, result_.options);
  look(film);
  EMBERLOCK_RETURN_IF_ERROR(tell({round, result_.last, result_.words, cameras_, sensors_, result_.options,
                                  bench_.strobe(), film.frames, film.readings}));
  return carry_out();
}

Status Alignment::darken() {
  if (options_.align.dial) return {};  // somebody switches it off, or it goes on flashing
  drivers::StrobeSettings dark = flashes_;
  dark.code = {false};
  return bench_.set_strobe(dark);
}

void Alignment::wait(TimePoint until) {
  stopped_ = false;
  bench_.wait(until, [this] { return stop_asked(); });
}

AlignRunResult Alignment::result() const {
  AlignRunResult all = result_;
  all.offsets = options_.offsets;
  all.resets = state_.resets;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    all.cameras.push_back(rig_.cameras[i]->info());
    all.exposures.push_back(bench_.sensor(i).exposure());
    const bool taught = i < state_.cameras.size() && state_.cameras[i].taught > 0;
    all.delays.push_back(taught ? state_.cameras[i].delay : cameras_[i].expected_delay);
  }
  return all;
}

void Alignment::promise() {
  if (last().verdict == smear::AlignVerdict::aligned) {
    promised_until_ = at_ + std::min(last().next_check.value_or(kLongestWait), kUntilStopped);
    return;
  }
  const Seconds tolerance = result_.options.tolerance.in_time(result_.options.row_time);
  const auto breaks = [&](std::size_t i) {
    const smear::CameraDecision& camera = last().cameras[i];
    return camera.reset || state_.cameras[i].away || (camera.error && abs(*camera.error) > tolerance);
  };
  bool broken = last().verdict != smear::AlignVerdict::go_on || !last().jumped.empty();
  for (std::size_t i = 0; i < cameras_.size(); ++i) broken = broken || breaks(i);
  if (broken) promised_until_.reset();
}

Seconds Alignment::time_left(TimePoint now) const {
  if (!locked(now)) return Seconds(0);
  const Seconds left = *promised_until_ - now;
  return left < kUntilStopped / 2 ? left : Seconds(std::numeric_limits<double>::infinity());
}

Seconds Alignment::likely_left(TimePoint now) const {
  if (!locked(now)) return Seconds(0);
  Seconds left(std::numeric_limits<double>::infinity());
  for (const smear::CameraDecision& camera : last().cameras)
    if (camera.time_left) left = std::min(left, camera.time_left->expected - (now - at_));
  return std::max(left, time_left(now));
}

std::optional<Seconds> Alignment::time_left(TimePoint now, std::size_t camera) const {
  const auto& stay = last().cameras[camera].sure_stay;
  if (!stay || !locked(now)) return std::nullopt;
  return std::max(*stay - (now - at_), Seconds(0));
}

Seconds Alignment::next_check(TimePoint now) const {
  if (last().verdict != smear::AlignVerdict::aligned) return Seconds(0);
  const Seconds promised = std::min(last().next_check.value_or(kLongestWait), kLongestWait);
  Seconds ahead = std::max(kAhead * promised, result_.options.round_time);
  // A renewal comes before less than the shortest take is left, where it can.
  if (promised > result_.options.shortest_take) ahead = std::max(ahead, result_.options.shortest_take);
  const bool pressed = result_.options.reset_by == smear::ResetBy::anybody &&
                       std::any_of(cameras_.begin(), cameras_.end(), [](const smear::AlignCamera& camera) {
                         return camera.method == ShutterReset::by_hand;
                       });
  const Seconds wait = pressed ? std::min(promised - ahead, kLongestWaitForPeople) : promised - ahead;
  return std::max(wait - (now - at_), Seconds(0));
}

std::vector<CameraError> Alignment::errors(TimePoint now) const {
  if (!last().worst_pair) return {};
  const smear::TrackOptions track = smear::track_options(result_.options);
  std::vector<CameraError> errors;
  Seconds carried;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const smear::PhaseTrack& phase = state_.cameras[i].phase;
    const smear::Drift drift = phase.at(now, track);
    const Seconds way = wrap_symmetric(drift.tau - phase.at(at_, track).tau, track.period);
    errors.push_back({last().cameras[i].error.value_or(Seconds()) + way, drift.tau_sigma});
    carried = carried + way / static_cast<double>(cameras_.size());
  }
  for (CameraError& camera : errors) camera.error = wrap_symmetric(camera.error - carried, track.period);
  return errors;
}

std::optional<Seconds> Alignment::worst_pair(TimePoint now) const {
  if (!last().worst_pair) return std::nullopt;
  const std::vector<CameraError> all = errors(now);
  Seconds worst;
  for (std::size_t i = 0; i < all.size(); ++i) {
    for (std::size_t k = 0; k < i; ++k)
      worst = std::max(worst, abs(wrap_symmetric(all[i].error - all[k].error, result_.options.period)));
  }
  return worst;
}

std::optional<PartsPerMillion> Alignment::drift(std::size_t camera) const {
  if (!last().worst_pair) return std::nullopt;
  const smear::TrackOptions track = smear::track_options(result_.options);
  std::vector<PartsPerMillion> rates;
  for (const smear::CameraTrack& each : state_.cameras)
    rates.push_back(each.phase.at(at_, track).rate + each.phase.trim(at_));
  const auto [slowest, fastest] = std::minmax_element(rates.begin(), rates.end());
  return rates[camera] - 0.5 * (*slowest + *fastest);
}

std::optional<Seconds> Alignment::own_target(std::size_t camera) const {
  if (!last().target) return std::nullopt;
  return wrap_positive(*last().target - cameras_[camera].offset, result_.options.period);
}

void Alignment::look(const Film& film) {
  const Seconds tolerance = result_.options.tolerance.in_time(result_.options.row_time);
  for (std::size_t i = 0; i < sights_.size(); ++i) {
    if (film.readings[i].empty()) {
      sights_[i] = {};
    } else {
      sights_[i] =
          sight_of(film.readings[i].back(), sensors_[i], result_.timing[i], own_target(i), tolerance);
    }
  }
}

Status Alignment::tell(const AlignRoundReport& seen) {
  v1::Event event;
  event.set_monotonic_ns(seen.round.at.ns);
  *event.mutable_decision() = to_proto(seen);
  EMBERLOCK_RETURN_IF_ERROR(bench_.record(event));
  if (observer_) observer_(seen);
  return {};
}

Status Alignment::carry_out() {
  if (last().strobe_phase) flashes_.phase = *last().strobe_phase;
  if (last().dial) flashes_.rate = last().dial->set;
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    const smear::CameraDecision& camera = last().cameras[i];
    if (camera.trim) {
      EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at, bench_.trim(i, *camera.trim));
      trims_.push_back({i, at, *camera.trim});
    }
    if (!camera.reset) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(const TimePoint at, bench_.reset(i, camera.moment, state_.cameras[i].resets));
    const bool told = cameras_[i].method == ShutterReset::on_command;
    resets_.push_back({i, told ? std::optional(at) : std::nullopt});
  }
  return {};
}

}  // namespace emberlock::rig
