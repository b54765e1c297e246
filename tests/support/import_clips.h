// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "base/in_parallel.h"
#include "base/random.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "tests/support/strobe_clips.h"
#include "tests/support/video_writer.h"

namespace emberlock::test {

/// A plume that sways and flickers, added to a dark picture.
inline void add_flame(Image& image, Seconds at) {
  const int width = image.layout().size.width;
  const int height = image.layout().size.height;
  const double t = at.value();
  for (int y = height / 6; y < height * 9 / 10; ++y) {
    const double up = 1 - static_cast<double>(y) / height;  // 0 at the foot
    const double centre =
        width * (0.5 + 0.06 * up * std::sin(9 * up - 11 * t) + 0.02 * std::sin(31 * up - 23 * t));
    const double half = width * (0.02 + 0.05 * (1 - up) * (0.8 + 0.2 * std::sin(17 * up - 19 * t)));
    const double light =
        200 * std::sin(3.1416 * std::min(1.0, 1.1 * (1 - up))) * (0.75 + 0.25 * std::sin(23 * up - 41 * t));
    auto* row = image.row_as<std::uint8_t>(y);
    const int from = std::max(0, static_cast<int>(centre - 2.5 * half));
    const int to = std::min(width, static_cast<int>(centre + 2.5 * half));
    for (int x = from; x < to; ++x) {
      const double off = (x - centre) / half;
      const double curl = 1 + 0.15 * std::sin(0.05 * x + 40 * up - 29 * t);
      row[x] =
          static_cast<std::uint8_t>(std::min(255.0, row[x] + light * curl / (1 + std::pow(off * off, 3))));
    }
  }
}

/// What cameras filmed that were started by hand: the strobe until it was switched off, then a flame.
struct FlameFilm {
  StrobeFilm strobe;       ///< its frames are the whole film's
  Seconds strobe_off{12};  ///< on the rig's clock
  /// What is added to a camera's dark picture, read at an instant of the rig's clock; called by many threads.
  std::function<void(Image& image, std::size_t camera, Seconds at)> flame =
      [](Image& image, std::size_t, Seconds at) { add_flame(image, at); };
};

/// When each frame of a file was read, by the rig's clock.
struct FlameClip {
  std::string file;
  std::vector<TimePoint> read_starts;
};

/// Films all cameras, `folder`/camera-N.mp4.
inline std::vector<FlameClip> film_flame(const FlameFilm& film, const std::filesystem::path& folder) {
  drivers::VirtualRigOptions options = film.strobe.rig;
  options.queue_frames = 4096;
  const auto clock = std::make_shared<drivers::VirtualClock>();
  const auto rig = drivers::VirtualRig::create(options, clock).value();
  if (!rig->strobe().apply(film.strobe.strobe).ok()) throw std::runtime_error("the strobe refuses");
  std::multimap<double, int> order;
  for (int c = 0; c < rig->size(); ++c)
    order.emplace(c < static_cast<int>(film.strobe.starts.size()) ? film.strobe.starts[c] : 0, c);
  for (const auto& [start, camera] : order) {
    clock->sleep_until(TimePoint{} + Seconds(start));
    if (!rig->camera(camera).start().ok()) throw std::runtime_error("a camera doesn't start");
  }
  clock->sleep_until(TimePoint{} + film.strobe_off);
  if (!rig->strobe().apply({.output = drivers::StrobeOutput::off}).ok())
    throw std::runtime_error("the strobe refuses");

  std::filesystem::create_directories(folder);
  std::vector<FlameClip> clips(rig->size());
  const auto film_one = [&](std::size_t c, const Observer&) {
    clips[c].file = (folder / fmt::format("camera-{}{}", c, film.strobe.suffix)).string();
    VideoWriter writer(clips[c].file, options.cameras[c].layout.size, film.strobe.format);
    while (static_cast<int>(clips[c].read_starts.size()) < film.strobe.frames) {
      const int camera = static_cast<int>(c);
      const Frame frame = rig->camera(camera).next_frame(Seconds(10)).value();
      const TimePoint read = rig->read_start(camera, frame.stamp.frame_id);
      Image image = *frame.image;
      // The flame is lit a second later.
      if (read > TimePoint{} + film.strobe_off + Seconds(1)) film.flame(image, c, read - TimePoint{});
      clips[c].read_starts.push_back(read);
      writer.write(image);
    }
    writer.close();
    return Status{};
  };
  if (!in_parallel(clips.size(), {}, film_one).ok()) throw std::runtime_error("a camera fails");
  return clips;
}

}  // namespace emberlock::test
