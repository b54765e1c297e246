// SPDX-License-Identifier: Apache-2.0
#include "films/verify_run.h"

#include <algorithm>

#include <fmt/format.h>

namespace emberlock::films {
namespace {

constexpr SecondsPerRow kRowTimeAsTold(20e-9);  // standard error of a row time given by the user

Status check(const VerifyRunOptions& options) {
  if (options.clips.size() < 2) {
    return Error{ErrorKind::bad_input, "one clip alone is in sync with nothing", options.clips.front(),
                 "give the clips of two cameras or more that filmed the same strobe"};
  }
  if (options.comb.empty() && !options.row_time) {
    return Error{ErrorKind::bad_input, "the time that the sensor takes to shift a row isn't known", "verify",
                 "film the strobe at about 300 flashes a second and add --comb CLIP --comb-rate HZ, or give "
                 "--row-time-us"};
  }
  if (!options.comb.empty() && !(options.comb_rate > Hertz(0))) {
    return Error{ErrorKind::bad_input, "the comb's flash rate isn't known", options.comb,
                 "give --comb-rate, the strobe's flashes a second while it was filmed"};
  }
  return {};
}

/// Measures the row time in the comb.
Status learn_from_comb(const VerifyRunOptions& options, VerifyRunResult& run, smear::VerifyOptions& verify) {
  const smear::ClipReading& comb = run.comb->reading;
  const auto clock = smear::fit_row_clock(comb.frames, options.comb_rate);
  if (!clock.ok()) {
    Error error = clock.error();
    error.where = options.comb;
    return error;
  }
  run.row_clock = *clock;
  verify.clip.row_time = clock->row_time;
  verify.clip.row_time_sigma = clock->sigma;
  if (clock->near_integer_pitch) {
    run.notes.push_back(
        fmt::format("The comb's dots stand nearly whole rows apart ({:.3f}): t_row may be off by more than "
                    "it says. Film the "
                    "comb again at a rate that differs by a percent.",
                    clock->pitch.value()));
  }
  return {};
}

/// Reports the read direction of the comb's camera, for an operator who knows that the others are of the same
/// model.
Status hint_from_comb(const VerifyRunOptions& options, VerifyRunResult& run) {
  const auto& cameras = run.result.cameras;
  const bool wanted = std::any_of(cameras.begin(), cameras.end(), [](const smear::CameraVerdict& c) {
    return c.state == smear::ClipState::direction_unknown;
  });
  if (!wanted || !run.comb) return {};
  smear::ClipOptions fast = run.result.options.clip;
  fast.flash_rate = options.comb_rate;
  EMBERLOCK_ASSIGN_OR_RETURN(const smear::ClipWalk walk, smear::read_walk(run.comb->reading, fast));
  if (!walk.mode.direction) return {};
  run.notes.push_back(fmt::format(
      "The camera of {0} reads the {1} row first: where all cameras are of its model, add "
      "--direction {1}-first.",
      run.comb->reading.name, walk.mode.direction == smear::ReadDirection::top_first ? "top" : "bottom"));
  return {};
}

}  // namespace

Result<VerifyRunResult> run_verify(const VerifyRunOptions& options, const Progress& progress) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  std::vector<std::string> files = options.clips;
  if (!options.comb.empty()) files.push_back(options.comb);
  VerifyRunResult run;
  EMBERLOCK_ASSIGN_OR_RETURN(run.clips, read_clips(files, progress));
  smear::VerifyOptions verify = options.verify;
  if (!options.comb.empty()) {
    run.comb = std::move(run.clips.back());
    run.clips.pop_back();
    EMBERLOCK_RETURN_IF_ERROR(learn_from_comb(options, run, verify));
  } else {
    verify.clip.row_time = *options.row_time;
    verify.clip.row_time_sigma = kRowTimeAsTold;
  }
  std::vector<smear::ClipReading> readings;
  std::vector<SoundTrack> sounds;
  for (const FilmedClip& clip : run.clips) {
    readings.push_back(clip.reading);
    sounds.push_back(clip.sound);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(run.result, smear::verify_clips(readings, verify, sounds));
  EMBERLOCK_RETURN_IF_ERROR(hint_from_comb(options, run));
  return run;
}

nlohmann::ordered_json verify_json(const smear::VerifyResult& result) {
  using nlohmann::ordered_json;
  ordered_json cameras = ordered_json::array();
  for (const smear::CameraVerdict& c : result.cameras) {
    ordered_json camera;
    camera["file"] = c.file;
    camera["error_ms"] = c.error ? ordered_json(in_milliseconds(*c.error)) : nullptr;
    camera["sigma_ms"] = c.error ? ordered_json(in_milliseconds(c.sigma)) : nullptr;
    camera["frame_offset"] = c.frame_offset ? ordered_json(*c.frame_offset) : nullptr;
    camera["drift_ppm"] = c.drift ? ordered_json(c.drift->value()) : nullptr;
    camera["state"] = name(c.state);
    camera["offset_by"] =
        c.offset_by == smear::FrameWitness::none ? ordered_json(nullptr) : ordered_json(name(c.offset_by));
    camera["offset_probability"] =
        c.frame_offset ? ordered_json(c.offset_probability) : ordered_json(nullptr);
    camera["offset_reason"] = c.offset_reason;
    cameras.push_back(std::move(camera));
  }
  ordered_json json;
  json["reference"] = result.cameras[result.reference].file;
  json["cameras"] = std::move(cameras);
  json["worst_pair_ms"] = result.worst_pair ? ordered_json(in_milliseconds(*result.worst_pair)) : nullptr;
  json["verdict"] = name(result.verdict);
  return json;
}

}  // namespace emberlock::films
