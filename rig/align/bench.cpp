// SPDX-License-Identifier: Apache-2.0
#include "rig/align/bench.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "base/log.h"
#include "base/random.h"
#include "drivers/replay/record.h"

namespace emberlock::rig {
namespace {

/// Sensors that aren't content after so many answers never will be.
constexpr int kMostSweeps = 40;

/// Delays stay below the strobe's own period, which may be a little shorter than T.
constexpr double kLongestDelay = 0.9995;

/// Where anybody may reset a camera, it is away when no frame comes for so many periods; one that was away
/// is there again when one comes at once.
constexpr double kPatience = 12;
constexpr double kPatienceWhileAway = 2.5;

/// How soon a wait notices that it is asked to stop.
constexpr Seconds kWaitStep = milliseconds(200);

/// Looks, each with the cameras that want it.
using Looks = std::vector<std::pair<smear::Look, std::vector<std::size_t>>>;

/// Whether no flash comes. Looks without flashes skip every one: a strobe that is switched off may begin
/// anew with its time base, and with it every camera's phase.
bool dark(const drivers::StrobeSettings& s) {
  const bool skips_all = !s.code.empty() && std::count(s.code.begin(), s.code.end(), true) == 0;
  return s.output == drivers::StrobeOutput::off || skips_all;
}

void add(Looks& looks, const smear::Look& look, std::size_t camera) {
  const auto same = std::find_if(looks.begin(), looks.end(), [&](const auto& l) { return l.first == look; });
  if (same == looks.end()) {
    looks.push_back({look, {camera}});
  } else {
    same->second.push_back(camera);
  }
}

}  // namespace

AlignRunOptions at_period(AlignRunOptions options, Seconds period) {
  options.align.period = period;
  for (smear::CcdTiming& timing : options.timing) timing.frame_period = period;
  return options;
}

AlignBench::AlignBench(const AlignRig& rig, const AlignRunOptions& options, StopAsked stop)
    : rig_(rig),
      options_(options),
      stop_(std::move(stop)),
      all_(rig.cameras.size()),
      passed_over_(rig.cameras.size()),
      taken_(rig.cameras.size()),
      reset_ordered_(rig.cameras.size()),
      away_(rig.cameras.size()) {
  std::iota(all_.begin(), all_.end(), std::size_t{0});
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    sensors_.push_back(
        smear::make_phase_sensor(rig.cameras[i]->info().sensor, {options.timing[i], options.flash_width}));
  }
}

std::vector<std::size_t> AlignBench::cameras_with(SensorKind kind) const {
  std::vector<std::size_t> cameras;
  for (std::size_t i = 0; i < rig_.cameras.size(); ++i) {
    if (rig_.cameras[i]->info().sensor == kind) cameras.push_back(i);
  }
  return cameras;
}

Status AlignBench::set_strobe(const drivers::StrobeSettings& wanted) {
  if (asked_ == wanted) return {};
  EMBERLOCK_RETURN_IF_ERROR(rig_.strobe->apply(wanted));
  const TimePoint now = rig_.clock->now();
  EMBERLOCK_ASSIGN_OR_RETURN(strobe_, rig_.strobe->read_back());
  asked_ = wanted;
  fresh_ = now + kSettlingPeriods * period();
  return record(drivers::strobe_event(now, strobe_));
}

Result<TimePoint> AlignBench::reset(std::size_t camera, std::optional<TimePoint> moment, int draw) {
  const TimePoint now = rig_.clock->now();
  const TimePoint earliest = now + options_.reset_lead;
  TimePoint at =
      earliest + period() * random_uniform(options_.seed, camera, static_cast<std::uint64_t>(draw));
  if (moment) at = *moment + period() * std::ceil((earliest - *moment) / period());
  EMBERLOCK_RETURN_IF_ERROR(rig_.cameras[camera]->reset_shutter(at));
  sensors_[camera]->forget_phase();
  reset_ordered_[camera] = true;
  // Frames from before are older than the decision that led here: the other cameras' are passed over too.
  fresh_ = std::max(fresh_, now);
  EMBERLOCK_RETURN_IF_ERROR(record(drivers::reset_event(now, rig_.cameras[camera]->info().id, at)));
  return at;
}

Result<TimePoint> AlignBench::trim(std::size_t camera, PartsPerMillion trim) {
  const TimePoint now = rig_.clock->now();
  EMBERLOCK_RETURN_IF_ERROR(rig_.cameras[camera]->trim_rate(trim));
  EMBERLOCK_RETURN_IF_ERROR(record(drivers::trim_event(now, rig_.cameras[camera]->info().id, trim)));
  return now;
}

Result<Film> AlignBench::film(const std::vector<std::size_t>& read, int count) {
  Film film;
  film.frames.resize(rig_.cameras.size());
  film.readings.resize(rig_.cameras.size());
  film.away.resize(rig_.cameras.size());
  const smear::Look look{dark(strobe_) ? std::nullopt : std::optional(strobe_.phase)};
  if (anybody_resets()) {
    for (const std::size_t camera : all_) {
      // One that is looked for by nobody else; it may still be gone.
      if (away_[camera]) static_cast<void>(rig_.cameras[camera]->start());
    }
  }
  for (int i = 0; i < count; ++i) {
    for (const std::size_t camera : all_) {
      if (film.away[camera] && anybody_resets()) continue;
      EMBERLOCK_ASSIGN_OR_RETURN(std::optional<Frame> frame, fresh_frame(camera));
      if (stopped()) return film;
      if (!frame) film.away[camera] = true;
      const bool asked = std::find(read.begin(), read.end(), camera) != read.end();
      if (!frame || !asked) continue;  // none came: fewer samples of this camera
      film.readings[camera].push_back(
          sensors_[camera]->take(frame->image->view(), frame->stamp.monotonic_time, look));
      film.frames[camera].push_back(std::move(*frame));
    }
  }
  away_ = film.away;
  if (anybody_resets() && std::find(away_.begin(), away_.end(), false) == away_.end()) {
    return Error{ErrorKind::device, "no camera sends frames", "align", "switch them on, or plug them in"};
  }
  return film;
}

Result<Film> AlignBench::film_all(int count) { return film(all_, count); }

Status AlignBench::sweep(const drivers::StrobeSettings& flashes, Seconds wanted, const Progress& progress,
                         double done) {
  int filmed = 0;
  std::vector<std::vector<smear::Look>> asked_for(sensors_.size());
  for (int i = 0; i < kMostSweeps; ++i) {
    std::size_t most = 0;
    for (std::size_t camera = 0; camera < sensors_.size(); ++camera) {
      if (asked_for[camera].empty()) asked_for[camera] = sensors_[camera]->next_looks(wanted);
      most = std::max(most, asked_for[camera].size());
    }
    if (most == 0) break;
    // Long sweeps come first: the edges that are refined after them don't move away meanwhile.
    Looks looks;
    for (std::size_t camera = 0; camera < sensors_.size(); ++camera) {
      if (2 * asked_for[camera].size() <= most) continue;
      for (const smear::Look& look : std::exchange(asked_for[camera], {})) add(looks, look, camera);
    }
    for (const auto& [look, cameras] : looks) {
      tell(progress, done, fmt::format("sweeping the strobe's phase, look {}", ++filmed));
      drivers::StrobeSettings settings = flashes;
      if (look.delay) {
        settings.phase = std::min(*look.delay, kLongestDelay * emberlock::period(flashes.rate));
      } else {
        settings.code = {false};
      }
      EMBERLOCK_RETURN_IF_ERROR(set_strobe(settings));
      EMBERLOCK_RETURN_IF_ERROR(film(cameras, 1));
      if (stopped()) return {};
    }
  }
  return set_strobe(flashes);
}

void AlignBench::wait(TimePoint until, const StopAsked& stop) {
  // The clock isn't asked: a recording knows only the instants that were recorded.
  for (TimePoint t = filmed_; t < until && !(stop && stop());) {
    t = std::min(t + kWaitStep, until);
    rig_.clock->sleep_until(t);
  }
  pass_over(until);
}

void AlignBench::pass_over(TimePoint until) {
  fresh_ = std::max(fresh_, until);
  for (const std::size_t camera : all_) passed_over_[camera] += rig_.cameras[camera]->pass_over(until);
}

Seconds AlignBench::deadline(std::size_t camera) const {
  if (!anybody_resets() || reset_ordered_[camera]) return options_.frame_deadline;
  return std::min(options_.frame_deadline, (away_[camera] ? kPatienceWhileAway : kPatience) * period());
}

Result<Frame> AlignBench::next_frame(std::size_t camera) {
  const Seconds whole = deadline(camera);
  for (Seconds left = whole;; left -= kWaitStep) {
    Result<Frame> frame = rig_.cameras[camera]->next_frame(stop_ ? std::min(left, kWaitStep) : left);
    if (frame.ok() || frame.error().kind != ErrorKind::timed_out) return frame;
    if (stop_ && left > kWaitStep + nanoseconds(1) && !stopped()) continue;
    Error late = frame.error();
    late.what = fmt::format("no frame within {:.3g} s", whole.value());
    return late;
  }
}

Result<std::optional<Frame>> AlignBench::fresh_frame(std::size_t camera) {
  while (!stopped()) {
    Result<Frame> frame = next_frame(camera);
    if (!frame.ok()) {
      const ErrorKind kind = frame.error().kind;
      const bool lost = kind == ErrorKind::device && anybody_resets();
      if (kind != ErrorKind::timed_out && !lost) return frame.error();
      if (stopped()) break;
      if (!away_[camera]) log(LogCategory::rig).warn("{}", frame.error().message());
      EMBERLOCK_RETURN_IF_ERROR(record(
          drivers::late_event(filmed_, {rig_.cameras[camera]->info().id, taken_[camera], deadline(camera)})));
      reset_ordered_[camera] = false;
      return std::optional<Frame>();
    }
    ++taken_[camera];
    reset_ordered_[camera] = false;
    if (rig_.recorder) {
      static_cast<void>(rig_.recorder->push(camera, *frame));  // it waits for room rather than lose one
      if (const auto failure = rig_.recorder->failure()) return *failure;
      rig_.recorder->count_lost(camera, session::LossCause::passed_over,
                                std::exchange(passed_over_[camera], 0));
    }
    filmed_ = std::max(filmed_, frame->stamp.monotonic_time);
    const TimePoint read = frame->stamp.monotonic_time - rig_.cameras[camera]->info().transport;
    const bool usable = read >= fresh_ && frame->stamp.status == FrameStatus::complete;
    if (usable) return std::optional<Frame>(std::move(*frame));
  }
  return std::optional<Frame>();
}

}  // namespace emberlock::rig
