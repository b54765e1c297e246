// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include "paper/baselines/two_colour_pyrometry/two_colour_pyrometry.h"
#include "paper/methods.h"
#include "paper/protocol.h"

namespace emberlock::paper {

Protocol cameras_protocol(Extent extent) {
  Protocol p;
  p.name = "cameras";
  p.title = "Temperature and the number of cameras";
  p.paper =
      "\"Temperature Reconstruction\": the figures of different numbers of cameras and of the cross section";
  p.differs =
      "The paper reads the temperature of a flame whose truth follows its own model (green alone, one "
      "opacity). Here soot glows by Planck's law "
      "and absorbs as soot does; all others are told that it is soot that glows. The paper's method reads it "
      "by its own rule.";
  const std::vector<int> counts =
      extent == Extent::full ? std::vector{4, 8, 12, 16, 20, 24, 28} : std::vector{4, 16};
  for (const int count : counts) {
    // The test view stands between two cameras of every ring.
    Case of{fmt::format("{}-cameras", count), ring(count, 180.0 / count), image_size(extent)};
    of.cameras.push_back({0, 0, recon::ViewRole::held_out});
    p.cases.push_back(std::move(of));
  }
  p.methods = {kTwoColourPyrometryFacts.name, kPapersMethod, kDefaultMethod};
  p.temperatures = true;
  return p;
}

}  // namespace emberlock::paper
