// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"
#include "rig/sample/hand_film.h"
#include "smear_sync/clocks/frame_code.h"
#include "tests/support/light_patterns.h"
#include "tests/support/video_writer.h"

namespace emberlock::test {

/// How a rig films the strobe into one video file a camera.
struct StrobeFilm {
  drivers::VirtualRigOptions rig;
  drivers::StrobeSettings strobe;
  int frames = 240;                         ///< of each file
  std::vector<double> starts;               ///< seconds after which each camera's film begins; 0 where absent
  std::map<int, std::vector<int>> drops{};  ///< by camera: places at which a frame doesn't get into its file
  VideoFormat format{};
  std::string suffix = ".mp4";
};

/// One camera's file against that of camera 0, at the middle frame of that one: by the rig's own clock.
struct ClipTruth {
  std::string file;
  Seconds error;  ///< tau - tau_reference modulo T, positive when it reads earlier
  int frame_offset = 0;
  double drift_ppm = 0;
  std::vector<TimePoint> read_starts{};  ///< by place in the file
};

/// Frame i + offset of a clip without losses starts nearest to frame i, the middle one, of another.
inline int nearest_offset(const ClipTruth& reference, const ClipTruth& clip) {
  const std::size_t middle = reference.read_starts.size() / 2;
  const Seconds period =
      (clip.read_starts.back() - clip.read_starts.front()) / static_cast<double>(clip.read_starts.size() - 1);
  return static_cast<int>(std::lround((reference.read_starts[middle] - clip.read_starts.front()) / period)) -
         static_cast<int>(middle);
}

/// Film and cameras as the product's simulation takes them.
inline rig::HandFilm by_hand(const StrobeFilm& film) {
  rig::HandFilm hand{film.rig, film.strobe};
  for (const double start : film.starts) hand.starts.emplace_back(start);
  return hand;
}

/// Films all cameras of a rig, `folder`/camera-N.mp4.
inline std::vector<ClipTruth> film_strobe(const StrobeFilm& film, const std::filesystem::path& folder) {
  const drivers::VirtualRigOptions& options = film.rig;
  const int cameras = static_cast<int>(options.cameras.size());
  std::vector<std::vector<TimePoint>> starts(cameras);  // of the read phases, by place in the file
  std::vector<ClipTruth> truths(cameras);
  std::vector<std::unique_ptr<VideoWriter>> writers;
  for (int c = 0; c < cameras; ++c) {
    truths[c].file = (folder / fmt::format("camera-{}{}", c, film.suffix)).string();
    writers.push_back(
        std::make_unique<VideoWriter>(truths[c].file, options.cameras[c].layout.size, film.format));
  }
  const auto take = [&](std::size_t c, const Frame& frame, TimePoint read) -> Result<double> {
    const auto lost = film.drops.find(static_cast<int>(c));
    const int id = static_cast<int>(frame.stamp.frame_id);
    if (lost == film.drops.end() ||
        std::find(lost->second.begin(), lost->second.end(), id) == lost->second.end()) {
      starts[c].push_back(read);
      writers[c]->write(*frame.image);
    }
    return static_cast<double>(starts[c].size()) / film.frames;
  };
  if (const Status filmed = rig::film_by_hand(by_hand(film), take); !filmed.ok())
    throw std::runtime_error(filmed.error().message());
  for (const auto& writer : writers) writer->close();
  const int middle = film.frames / 2;
  const TimePoint reference = starts[0][middle];
  const Seconds period = options.cameras[0].timing.frame_period;
  for (int c = 0; c < cameras; ++c) {
    const Seconds own = options.cameras[c].timing.frame_period;
    // Beyond the file's own frames the camera went on as before.
    const double beyond = (reference - starts[c].back()) / own;
    int nearest = film.frames - 1 + static_cast<int>(std::lround(std::max(0.0, beyond)));
    Seconds error = reference - (starts[c].back() + own * static_cast<double>(nearest - film.frames + 1));
    for (int i = 0; i < film.frames; ++i) {
      if (abs(reference - starts[c][i]) < abs(error)) error = reference - starts[c][i], nearest = i;
    }
    const double before = (starts[c].front() - reference) / own;
    if (before > 0.5) {
      nearest = -static_cast<int>(std::lround(before));
      error = reference - (starts[c].front() + own * static_cast<double>(nearest));
    }
    truths[c].error = wrap_symmetric(error, period);
    truths[c].frame_offset = nearest - middle;
    truths[c].drift_ppm = (period / own - 1) * 1e6;
    truths[c].read_starts = starts[c];
  }
  return truths;
}

/// A rig of cameras of several models, that a strobe near their frame rate, with its code, makes walk;
/// started by hand within four seconds; each file in the format drawn.
inline StrobeFilm random_film(std::uint64_t seed, int cameras, const drivers::VirtualRigDraw& model,
                              const smear::FrameCode& code = {}) {
  RandomStream random(seed, 2024);
  drivers::VirtualRigDraw draw = model;
  draw.cameras = cameras;
  draw.seed = seed;
  draw.models = drivers::VirtualRigDraw::Models::mixed;
  StrobeFilm film;
  film.rig = drivers::draw_virtual_rig(draw);
  film.rig.strobe.rate_error = PartsPerMillion(random.uniform(-30, 30));
  film.rig.scene.smear_leak = random.uniform(0.004, 0.015);  // dots of 16..60 grey levels
  film.rig.scene.read_noise = random.uniform(0.5, 1.5);
  const double rates[] = {23.75, 24.2, 23.8, 24.15};
  film.strobe = {.output = drivers::StrobeOutput::flashing,
                 .rate = Hertz(rates[static_cast<int>(random.uniform(0, 4))]),
                 .phase = Seconds(random.uniform(0, 0.04)),
                 .code = smear::flash_pattern(code).value()};
  for (int c = 0; c < cameras; ++c) film.starts.push_back(random.uniform(0, 4));
  switch (static_cast<int>(random.uniform(0, 4))) {
    case 0:
      film.format.codec = AV_CODEC_ID_MJPEG;
      film.suffix = ".avi";
      break;
    case 1:
      film.format.codec = AV_CODEC_ID_FFV1;
      film.suffix = ".mkv";
      break;
    default:
      film.format.crf = 18 + static_cast<int>(random.uniform(0, 11));
  }
  return film;
}

/// The same under a pattern that nobody chose, of 4 s or more, at a rate that is often within 0.1 % of the
/// cameras'; started within a third of its length.
inline StrobeFilm pattern_film(std::uint64_t seed, int cameras, const drivers::VirtualRigDraw& model,
                               LightPattern pattern) {
  StrobeFilm film = random_film(seed, cameras, model);
  RandomStream random(seed, 77);
  film.frames = 96 + static_cast<int>(random.uniform(0, 60));
  film.strobe.code = light_pattern(pattern, 4 * film.frames, random);
  if (random.uniform() < 0.7) film.strobe.rate = Hertz(23.976 * (1 + random.uniform(-1e-3, 1e-3)));
  film.rig.strobe.rate_step = Hertz(1e-6);
  for (double& start : film.starts) start = random.uniform(0.2, 0.2 + film.frames / 24.0 / 3);
  return film;
}

/// One camera of a film under a comb of 300 flashes a second.
inline StrobeFilm comb_of(StrobeFilm film, int camera, int frames) {
  film.rig.cameras = {film.rig.cameras[camera]};
  film.strobe.rate = Hertz(300);
  film.strobe.phase = Seconds(0);
  film.strobe.code.clear();
  film.frames = frames;
  film.starts = {0.1};
  film.drops.clear();
  return film;
}

}  // namespace emberlock::test
