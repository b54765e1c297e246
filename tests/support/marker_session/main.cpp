// SPDX-License-Identifier: Apache-2.0
// Writes what the console's tests of augmented reality replay: a recording of a marker before a camera "hand"
// of 640 x 480, and results of a session "candle".
//   marker_session FOLDER SECONDS: FOLDER/film, the recording; FOLDER/results; FOLDER/truth.json, of each
//   frame the pixel of the marker's middle, and of a place 4 cm above it
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "tests/support/marker_session.h"

int main(int argc, char** argv) try {
  using namespace emberlock;
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() < 2) return std::fprintf(stderr, "usage: marker_session FOLDER SECONDS\n"), 2;
  const std::filesystem::path folder = words[0];
  test::MarkerSession film;
  film.lens = {{640, 480}, 600, 600, 318.3, 243.1, {-0.2, 0.05, 0, 0.001, 0}};
  film.rate = 15;
  film.frames = static_cast<int>(film.rate * std::atof(words[1].c_str()));
  film.drawn = 150;
  film.look.samples = 3;
  test::record_marker(folder / "film", film);
  test::put_flame(folder / "results/candle/middle-frame", 128);
  for (int frame = 0; frame < 3; ++frame)
    test::put_flame(folder / "results/candle" / ("frame-" + std::to_string(frame)), 48,
                    Seconds(0.05 * frame));
  nlohmann::json truth = nlohmann::json::array();
  for (int f = 0; f < film.frames; ++f) {
    const Eigen::Vector2d foot = film.camera(f).project(Eigen::Vector3d::Zero());
    const Eigen::Vector2d middle = film.camera(f).project({0, 0, 0.04});
    truth.push_back({foot.x(), foot.y(), middle.x(), middle.y()});
  }
  std::ofstream(folder / "truth.json") << truth;
  return 0;
} catch (const std::exception& problem) {
  return std::fprintf(stderr, "marker_session: %s\n", problem.what()), 1;
}
