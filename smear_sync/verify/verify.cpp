// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/verify/verify.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/one_to_one.h"

namespace emberlock::smear {
namespace {

constexpr OneToOne<ClipsVerdict, std::string_view, 3> kVerdictNames{
    {{{ClipsVerdict::in_sync, "in sync"},
      {ClipsVerdict::out_of_tolerance, "out of tolerance"},
      {ClipsVerdict::not_proven, "not proven"}}}};

constexpr OneToOne<ClipState, std::string_view, 6> kClipNames{
    {{{ClipState::in_sync, "in sync"},
      {ClipState::out_of_tolerance, "out of tolerance"},
      {ClipState::ambiguous, "ambiguous"},
      {ClipState::direction_unknown, "direction unknown"},
      {ClipState::blind, "blind"},
      {ClipState::unusable, "unusable"}}}};

constexpr double kSigmas = 2;

double per_frame_walk(const ClipClock& clock) {
  return std::abs((clock.flash_period / clock.timing.frame_period) - 1);
}

/// Sets the error between two phases of the same strobe, and its standard error.
void compare(const CameraVerdict& reference, CameraVerdict& camera, const WholeFrames& whole,
             std::int64_t middle, const VerifyOptions& options) {
  const Seconds flashes = reference.clock.flash_period;
  const Seconds frame = reference.clock.timing.frame_period;
  const auto& offset = whole.offset;
  if (offset) camera.frame_offset = offset->frames;
  camera.offset_reason = whole.reason;
  camera.offset_by = whole.witness;
  camera.offset_probability = whole.probability;
  if (!reference.clock.line || !camera.clock.line) return;

  const std::int64_t place = middle + (offset ? offset->frames : std::llround(whole.about.value_or(0)));
  const Phase there = camera.clock.phase_of_frame(place);
  const Phase here = reference.clock.phase_of_frame(middle);
  Seconds error = there.tau - here.tau;  // modulo P
  camera.sigma = Seconds(std::hypot(there.sigma.value(), here.sigma.value()));
  if (offset) {
    error = error + flashes * std::round((flashes * offset->lag - error) / flashes);
  } else {
    // The flashes can't be matched: frames with the same index may be apart by the spread of the starts, or
    // by the uncertainty of the sound.
    const double walk = std::max(per_frame_walk(reference.clock), per_frame_walk(camera.clock));
    const Seconds spread = whole.about ? frame * std::hypot(whole.about_sigma, 0.5) : options.start_spread;
    camera.sigma = Seconds(std::hypot(camera.sigma.value(), walk * spread.value()));
    error = wrap_symmetric(error, flashes);
  }
  camera.error = wrap_symmetric(error, frame);
  const auto slack = std::max(camera.clock.tau_slack, reference.clock.tau_slack);
  camera.sigma = Seconds(std::hypot(camera.sigma.value(), slack.value()));

  const ClipClock& a = camera.clock;
  const ClipClock& b = reference.clock;
  camera.drift = PartsPerMillion(1e6 * (b.timing.frame_period / a.timing.frame_period - 1));
  camera.drift_sigma =
      PartsPerMillion(1e6 * std::hypot(a.period_sigma.value(), b.period_sigma.value()) / frame.value());
  Drift line;
  line.tau = wrap_positive(*camera.error, frame);
  line.tau_sigma = camera.sigma;
  line.rate = *camera.drift;
  line.rate_sigma = camera.drift_sigma;
  camera.time_left =
      time_left(line, {}, {.tolerance = options.tolerance.in_time(options.clip.row_time), .period = frame});
}

void set_state(const CameraVerdict& reference, CameraVerdict& camera, const VerifyOptions& options) {
  if (camera.clock.state == PhaseState::blind) {
    camera.state = ClipState::blind;
    camera.reason = camera.clock.reason;
    return;
  }
  if (camera.clock.state != PhaseState::known) {
    camera.state = ClipState::unusable;
    camera.reason = camera.clock.reason;
    return;
  }
  const auto known_direction = [&](const CameraVerdict& c) {
    return c.clock.mode.direction.has_value() || options.clip.direction.has_value();
  };
  if (!known_direction(camera) || !known_direction(reference)) {
    const CameraVerdict& which = known_direction(camera) ? reference : camera;
    camera.state = ClipState::direction_unknown;
    camera.reason = "which row is read first isn't known: " + which.clock.mode.direction_reason;
    camera.error.reset();
    camera.drift.reset();
    camera.time_left.reset();
    return;
  }
  if (!camera.error) {
    camera.reason = "the reference has no phase to compare with";
    return;
  }
  const SecondsPerRow row = options.clip.row_time;
  const Seconds tolerance = options.tolerance.in_time(row);
  const Seconds size = abs(*camera.error);
  const std::string sense = *camera.error > Seconds(0) ? "earlier" : "later";
  camera.reason =
      fmt::format("reads {:.3f} ms ({:.1f} rows) {} than the reference, +- {:.3f} ms", in_milliseconds(size),
                  (size / row).value(), sense, in_milliseconds(camera.sigma * kSigmas));
  if (size + camera.sigma * kSigmas <= tolerance) {
    camera.state = ClipState::in_sync;
  } else if (size - camera.sigma * kSigmas > tolerance) {
    camera.state = ClipState::out_of_tolerance;
  } else {
    camera.state = ClipState::ambiguous;
    const bool no_shifts = std::max(camera.clock.tau_slack, reference.clock.tau_slack) > Seconds(0);
    camera.reason += no_shifts ? ": its dots wrapped, and K isn't known; give --shifts"
                     : camera.frame_offset
                         ? ": too near the tolerance to tell"
                         : ": the beat moves the flash while it isn't known which frames belong together";
  }
}

std::size_t choose_reference(const std::vector<CameraVerdict>& cameras) {
  const auto known = std::find_if(cameras.begin(), cameras.end(),
                                  [](const CameraVerdict& c) { return c.clock.state == PhaseState::known; });
  return known == cameras.end() ? 0 : static_cast<std::size_t>(known - cameras.begin());
}

void find_worst_pair(VerifyResult& result) {
  const Seconds frame = result.cameras[result.reference].clock.timing.frame_period;
  for (const CameraVerdict& a : result.cameras) {
    for (const CameraVerdict& b : result.cameras) {
      if (&a == &b || !a.error || !b.error) continue;
      const Seconds apart = abs(wrap_symmetric(*a.error - *b.error, frame));
      result.worst_pair = std::max(result.worst_pair.value_or(apart), apart);
    }
  }
}

std::string join(const std::vector<std::string>& files) {
  std::string list;
  for (std::size_t i = 0; i < files.size(); ++i) {
    if (i > 0) list += i + 1 == files.size() ? " and " : ", ";
    list += files[i];
  }
  return list;
}

void advise(VerifyResult& result) {
  const auto files_where = [&](const auto& condition) {
    std::vector<std::string> files;
    for (const CameraVerdict& c : result.cameras) {
      if (condition(c)) files.push_back(c.name);
    }
    return files;
  };
  const auto in_state = [&](ClipState state) {
    return files_where([&](const CameraVerdict& c) { return c.state == state; });
  };
  const auto tell = [&](const std::vector<std::string>& files, const std::string& advice) {
    if (!files.empty()) result.to_do.push_back(fmt::format(fmt::runtime(advice), join(files)));
  };
  const SecondsPerRow row = result.options.clip.row_time;
  for (const CameraVerdict& c : result.cameras) {
    if (c.state != ClipState::out_of_tolerance) continue;
    result.to_do.push_back(fmt::format(
        "Reset the shutter of {} until it reads {:.2f} ms ({:.0f} rows) {} than now, film the strobe and "
        "verify again.",
        c.name, in_milliseconds(abs(*c.error)), (abs(*c.error) / row).value(),
        *c.error > Seconds(0) ? "later" : "earlier"));
  }
  tell(in_state(ClipState::blind),
       "Bring the dot of {} out: move the strobe's phase by a quarter of a frame, or detune it by 1 %, and "
       "film "
       "again.");
  tell(in_state(ClipState::direction_unknown),
       "Detune the strobe by about 1 % (24.2 flashes a second for 23.976 frames), so that the dots of {} "
       "walk and "
       "tell the read direction; or give --direction.");
  tell(in_state(ClipState::unusable), "See to {}: lamp in the picture, strobe on, ten seconds of film.");
  const auto unnumbered = files_where([](const CameraVerdict& c) { return !c.frame_offset; });
  tell(
      unnumbered,
      "Let the strobe skip flashes in its code while all cameras film it, or pass a hand before its lamp six "
      "times at odd intervals, so that it is seen which frames of {} belong to which.");
  for (const CameraVerdict& c : result.cameras) {
    if (c.frame_offset.value_or(0) == 0) continue;
    result.to_do.push_back(fmt::format("Pair frame i of {} with frame i {} {} of {}.",
                                       result.cameras[result.reference].name, *c.frame_offset < 0 ? '-' : '+',
                                       std::abs(*c.frame_offset), c.name));
  }
  for (const CameraVerdict& c : result.cameras) {
    for (const DroppedFrames& drop : c.clock.numbers.drops) {
      result.to_do.push_back(
          fmt::format("{} {} {} frame{} between frames {} and {}: shift its pairs from there on.", c.name,
                      drop.frames > 0 ? "lost" : "doubled", std::abs(drop.frames),
                      std::abs(drop.frames) == 1 ? "" : "s", drop.after, drop.before));
    }
  }
}

void conclude(VerifyResult& result) {
  int in = 0;
  int out = 0;
  for (const CameraVerdict& c : result.cameras) {
    in += c.state == ClipState::in_sync ? 1 : 0;
    out += c.state == ClipState::out_of_tolerance ? 1 : 0;
  }
  const int all = static_cast<int>(result.cameras.size());
  const SecondsPerRow row = result.options.clip.row_time;
  const Tolerance& tolerance = result.options.tolerance;
  const std::string bound = fmt::format("{:.3f} ms ({:.1f} rows)", in_milliseconds(tolerance.in_time(row)),
                                        tolerance.in_rows(row).value());
  if (out > 0) {
    result.verdict = ClipsVerdict::out_of_tolerance;
    result.summary = fmt::format("NOT in sync: {} of {} cameras {} more than {} from the reference.", out,
                                 all, out == 1 ? "lies" : "lie", bound);
  } else if (in == all) {
    result.verdict = ClipsVerdict::in_sync;
    result.summary = fmt::format("In sync: all {} cameras lie within {} of the reference.", all, bound);
  } else {
    result.verdict = ClipsVerdict::not_proven;
    result.summary =
        fmt::format("Not proven: {} of {} cameras are known to lie within {}, the others may or may not.", in,
                    all, bound);
  }
}

Result<std::vector<WholeFrames>> match_all(const VerifyResult& result, const VerifyOptions& options,
                                           std::span<const SoundTrack> sounds) {
  std::vector<ClipClock> clocks;
  for (const CameraVerdict& camera : result.cameras) clocks.push_back(camera.clock);
  std::vector<std::optional<SoundOffset>> heard;
  if (!sounds.empty()) heard = match_sounds(sounds, result.reference);
  return match_frames(clocks, result.reference, result.middle, options.clip, heard);
}

}  // namespace

std::string_view name(ClipState state) { return kClipNames.second_of(state).value_or("unknown"); }

std::string_view name(ClipsVerdict verdict) { return kVerdictNames.second_of(verdict).value_or("unknown"); }

Result<VerifyResult> verify_clips(std::span<const ClipReading> clips, const VerifyOptions& options,
                                  std::span<const SoundTrack> sounds) {
  if (clips.size() < 2) {
    return Error{ErrorKind::bad_input, "one clip alone is in sync with nothing", "verify",
                 "give the clips of two cameras or more that filmed the same strobe"};
  }
  if (!sounds.empty() && sounds.size() != clips.size())
    return Error{ErrorKind::bad_input, "there isn't a sound track for each clip", "verify",
                 "give one for each, empty where there is none"};
  VerifyResult result;
  result.options = options;
  for (const ClipReading& clip : clips) {
    CameraVerdict camera;
    camera.file = clip.file;
    camera.name = clip.name;
    EMBERLOCK_ASSIGN_OR_RETURN(camera.clock, read_clip_clock(clip, options.clip));
    result.cameras.push_back(std::move(camera));
  }
  result.reference = choose_reference(result.cameras);
  result.middle = static_cast<std::int64_t>(clips[result.reference].frames.size() / 2);
  const CameraVerdict reference = result.cameras[result.reference];
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<WholeFrames> whole, match_all(result, options, sounds));
  for (std::size_t i = 0; i < result.cameras.size(); ++i) {
    compare(reference, result.cameras[i], whole[i], result.middle, options);
    set_state(reference, result.cameras[i], options);
  }
  CameraVerdict& itself = result.cameras[result.reference];
  if (itself.clock.state == PhaseState::known) {
    itself.state = ClipState::in_sync;
    itself.reason = "the reference, to which the others are compared";
    itself.error = Seconds(0);
    itself.sigma = Seconds(0);
    itself.drift = PartsPerMillion(0);
    itself.drift_sigma = PartsPerMillion(0);
    itself.time_left.reset();
  }
  find_worst_pair(result);
  conclude(result);
  advise(result);
  return result;
}

}  // namespace emberlock::smear
