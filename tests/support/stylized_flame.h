// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>

#include "apply/stylize.h"
#include "base/clock.h"
#include "recon/export/picture.h"
#include "recon/synthetic/flame.h"
#include "tests/support/temp_folder.h"

namespace emberlock::test {

/// The paper's flame, filmed by ten views and one that is held out, and reconstructed.
struct ReconstructedFlame {
  recon::Scene scene;
  recon::Outcome outcome;
};
inline recon::SolveOptions stylize_options(int threads = 2) {
  recon::SolveOptions solve;
  solve.iterations = 8;
  solve.smoothness = 0.1;
  solve.compute.device = recon::Device::cpu;
  solve.compute.threads = threads;
  return solve;
}
inline ReconstructedFlame reconstructed_flame(ImageSize image = {96, 72}, int voxels = 28, int threads = 2,
                                              const std::string& effects = "extinction=32.8") {
  recon::PaperSceneOptions of_scene;
  of_scene.image = image;
  of_scene.truth_voxels = 48;
  ReconstructedFlame flame{recon::paper_scene(of_scene), {}};
  recon::ReconstructOptions options;
  options.voxels = voxels;
  options.effects = *recon::parse_effects(effects);
  options.correct_pointing = false;
  options.solve = stylize_options(threads);
  const SteadyClock clock;
  auto outcome = recon::reconstruct(flame.scene, options, clock);
  if (!outcome) throw std::runtime_error(outcome.error().message());
  flame.outcome = std::move(outcome).value();
  return flame;
}

/// Of all tests that only look.
inline const ReconstructedFlame& the_flame() {
  static const ReconstructedFlame flame = reconstructed_flame();
  return flame;
}

inline std::unique_ptr<apply::Stylization> begin_stylization(
    const ReconstructedFlame& flame, apply::Colours colours = apply::Colours::captured, int threads = 2) {
  auto begun = apply::Stylization::begin(flame.scene, flame.outcome, stylize_options(threads), colours,
                                         recon::standard_response());
  if (!begun) throw std::runtime_error(begun.error().message());
  return std::move(begun).value();
}

/// A square picture of a function of the place, -1..1 along each side, as 8 bits of grey.
template <class Grey>
std::filesystem::path write_object(const std::filesystem::path& file, int edge, const Grey& grey) {
  Image picture(ImageLayout{{edge, edge}, PixelFormat::gray8, 8});
  for (int y = 0; y < edge; ++y)
    for (int x = 0; x < edge; ++x)
      picture.row_as<std::uint8_t>(y)[x] =
          static_cast<std::uint8_t>(std::lround(grey(2 * (x + 0.5) / edge - 1, 2 * (y + 0.5) / edge - 1)));
  std::filesystem::create_directories(file.parent_path());
  const Status written = recon::write_png(picture.view(), file);
  if (!written) throw std::runtime_error(written.error().message());
  return file;
}

/// A folder of a test's own.
inline std::filesystem::path folder_for(const std::string& name) {
  static const TempFolder folders;
  const std::filesystem::path folder = folders / name;
  std::filesystem::remove_all(folder);
  std::filesystem::create_directories(folder);
  return folder;
}

}  // namespace emberlock::test
