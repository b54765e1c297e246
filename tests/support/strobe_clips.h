// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
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

/// Films all cameras of a rig, `folder`/camera-N.mp4.
inline std::vector<ClipTruth> film_strobe(const StrobeFilm& film, const std::filesystem::path& folder) {
  drivers::VirtualRigOptions options = film.rig;
  options.queue_frames = 4096;
  const auto clock = std::make_shared<drivers::VirtualClock>();
  const auto rig = drivers::VirtualRig::create(options, clock).value();
  if (!rig->strobe().apply(film.strobe).ok()) throw std::runtime_error("the strobe refuses");
  std::multimap<double, int> order;
  for (int c = 0; c < rig->size(); ++c)
    order.emplace(c < static_cast<int>(film.starts.size()) ? film.starts[c] : 0, c);
  for (const auto& [start, camera] : order) {
    clock->sleep_until(TimePoint{} + Seconds(start));
    if (!rig->camera(camera).start().ok()) throw std::runtime_error("a camera doesn't start");
  }

  std::vector<std::vector<TimePoint>> starts(rig->size());  // of the read phases, by place in the file
  std::vector<ClipTruth> truths(rig->size());
  for (int c = 0; c < rig->size(); ++c) {
    truths[c].file = (folder / fmt::format("camera-{}{}", c, film.suffix)).string();
    VideoWriter writer(truths[c].file, options.cameras[c].layout.size, film.format);
    const auto lost = film.drops.find(c);
    while (static_cast<int>(starts[c].size()) < film.frames) {
      const Frame frame = rig->camera(c).next_frame(Seconds(10)).value();
      const int id = static_cast<int>(frame.stamp.frame_id);
      if (lost != film.drops.end() &&
          std::find(lost->second.begin(), lost->second.end(), id) != lost->second.end())
        continue;
      starts[c].push_back(rig->read_start(c, frame.stamp.frame_id));
      writer.write(*frame.image);
    }
    writer.close();
  }
  const int middle = film.frames / 2;
  const TimePoint reference = starts[0][middle];
  const Seconds period = options.cameras[0].timing.frame_period;
  for (int c = 0; c < rig->size(); ++c) {
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
