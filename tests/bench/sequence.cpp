// SPDX-License-Identifier: Apache-2.0
// What a frame of a sequence costs and reaches that starts from where the one before ended, beside the same
// frame alone, from pictures in memory to rendered views.
//   bench_sequence write SESSION SHRINK FOLDER [FRAMES]     each frame as FOLDER/NNNN/transforms.json, for
//                                                           machines without film decoders
//   bench_sequence DEVICE VOXELS HELD_OUT FOLDER [ROUNDS]   the frames there, forth and back so many times;
//                                                           resident memory on the way
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "base/clock.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/frame_sequence.h"
#include "recon/pipeline/scene.h"
#include "recon/views/shrink.h"
#include "tests/support/scene_files.h"

using namespace emberlock;
namespace fs = std::filesystem;

namespace {

int write(const fs::path& session, int shrink, const fs::path& folder, std::size_t frames) {
  recon::SceneOptions options;
  options.recording = std::make_shared<recon::SharedRecording>();
  for (std::size_t n = 0; n < frames; ++n) {
    options.frame = n;
    auto scene = recon::load_scene(session, options);
    if (!scene.ok()) {
      std::fprintf(stderr, "%s\n", scene.error().message().c_str());
      return 1;
    }
    for (recon::View& view : scene->views) view = recon::shrunk(view, shrink);
    if (!test::write_scene(*scene, folder / fmt::format("{:04}", n)).ok()) return 1;
  }
  return 0;
}

double resident_megabytes() {
  std::ifstream status("/proc/self/statm");
  double all = 0;
  double resident = 0;
  status >> all >> resident;
  return resident * 4096 / 1e6;
}

struct Sum {
  double seconds = 0, error = 0;
  int frames = 0;
};

template <class Reconstruct>
void timed(const Reconstruct& reconstruct, Sum& sum) {
  const SteadyClock clock;
  const TimePoint begin = clock.now();
  const auto outcome = reconstruct();
  const double seconds = (clock.now() - begin).value();
  if (!outcome.ok()) {
    std::fprintf(stderr, "%s\n", outcome.error().message().c_str());
    return;
  }
  sum.seconds += seconds;
  sum.error += recon::all_channels(outcome->report.heldout_rmse.value_or(outcome->report.input_rmse));
  ++sum.frames;
}

int run(const char* device, int voxels, int held_out, const fs::path& folder, int rounds) {
  const SteadyClock clock;
  recon::ReconstructOptions options;
  options.voxels = voxels;
  options.solve.compute.device = recon::parse_device(device).value();
  std::vector<recon::Scene> scenes;
  std::vector<fs::path> folders(fs::directory_iterator(folder), {});
  std::sort(folders.begin(), folders.end());
  for (const fs::path& frame : folders) {
    scenes.push_back(recon::load_scene(frame / "transforms.json").value());
    if (!recon::hold_out(scenes.back(), {held_out}).ok()) return 1;
  }
  recon::FrameSequence sequence(options, clock);
  Sum first, in_turn, alone;
  double memory = 0, half = 0;
  for (int round = 0; round < rounds; ++round) {
    for (std::size_t n = 0; n < scenes.size(); ++n) {
      const recon::Scene& scene = scenes[round % 2 == 0 ? n : scenes.size() - 1 - n];
      const bool begins = round == 0 && n == 0;
      timed([&] { return sequence.next(scene); }, begins ? first : in_turn);
      if (round == 0 && n > 0) timed([&] { return recon::reconstruct(scene, options, clock); }, alone);
    }
    if (round == 0) memory = resident_megabytes();
    if (round == rounds / 2) half = resident_megabytes();
  }
  const auto print = [](const char* what, const Sum& sum) {
    std::printf("| %s | %d | %.3f | %.2f |\n", what, sum.frames, sum.seconds / std::max(1, sum.frames),
                sum.error / std::max(1, sum.frames));
  };
  std::printf("| %s, %d voxels | frames | s a frame | error |\n|---|---|---|---|\n", device, voxels);
  print("the first", first);
  print("from the one before", in_turn);
  print("alone", alone);
  std::printf("memory: %.1f MB after the first round, %.1f MB after half of %d, %.1f MB at the end\n", memory,
              half, rounds, resident_megabytes());
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  const auto number = [&](int i, int otherwise) { return argc > i ? std::atoi(argv[i]) : otherwise; };
  if (argc >= 5 && std::string_view(argv[1]) == "write")
    return write(argv[2], number(3, 1), argv[4], static_cast<std::size_t>(number(5, 60)));
  if (argc >= 5) return run(argv[1], number(2, 128), number(3, 0), argv[4], number(5, 1));
  std::fprintf(stderr,
               "bench_sequence write SESSION SHRINK FOLDER [FRAMES] | bench_sequence DEVICE VOXELS HELD_OUT "
               "FOLDER [ROUNDS]\n");
  return 2;
}
