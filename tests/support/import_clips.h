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

#include "rig/sample/hand_film.h"
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
  rig::HandFilm hand = by_hand(film.strobe);
  hand.strobe_off = film.strobe_off;
  std::filesystem::create_directories(folder);
  std::vector<FlameClip> clips(hand.rig.cameras.size());
  std::vector<std::unique_ptr<VideoWriter>> writers;
  for (std::size_t c = 0; c < clips.size(); ++c) {
    clips[c].file = (folder / fmt::format("camera-{}{}", c, film.strobe.suffix)).string();
    writers.push_back(
        std::make_unique<VideoWriter>(clips[c].file, hand.rig.cameras[c].layout.size, film.strobe.format));
  }
  const auto take = [&](std::size_t c, const Frame& frame, TimePoint read) -> Result<double> {
    Image image = *frame.image;
    // The flame is lit a second later.
    if (read > TimePoint{} + film.strobe_off + Seconds(1)) film.flame(image, c, read - TimePoint{});
    clips[c].read_starts.push_back(read);
    writers[c]->write(image);
    return static_cast<double>(clips[c].read_starts.size()) / film.strobe.frames;
  };
  if (const Status filmed = rig::film_by_hand(hand, take); !filmed.ok())
    throw std::runtime_error(filmed.error().message());
  for (const auto& writer : writers) writer->close();
  return clips;
}

}  // namespace emberlock::test
