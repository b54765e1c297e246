// SPDX-License-Identifier: Apache-2.0
// verify_statistics [RIGS] [SEED] [FRAMES]: how near `emberlock verify` comes to the truth on random rigs
// whose cameras write 1280 x 720 video: a line a rig, and the worst of all.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>

#include "films/verify_run.h"
#include "tests/support/strobe_clips.h"

namespace emberlock {
namespace {

using films::VerifyRunOptions;

struct Worst {
  double error_ms = 0, sigmas = 0, drift_ppm = 0;
  int offsets_wrong = 0, unknown = 0, cameras = 0;
};

void run_rig(std::uint64_t seed, int frames, const drivers::VirtualRigDraw& model,
             const std::filesystem::path& folder, Worst& all) {
  RandomStream random(seed, 7);
  const int cameras = 3 + static_cast<int>(random.uniform(0, 2));
  test::StrobeFilm film = test::random_film(seed, cameras, model);
  film.frames = frames;
  std::filesystem::create_directories(folder / "comb");
  films::VerifyRunOptions options;
  const auto truths = test::film_strobe(film, folder);
  for (const auto& truth : truths) options.clips.push_back(truth.file);
  options.comb = test::film_strobe(test::comb_of(film, 0, 48), folder / "comb")[0].file;
  options.comb_rate = Hertz(300);
  options.verify.clip.flash_rate = film.strobe.rate;
  const auto start = std::chrono::steady_clock::now();
  const auto run = films::run_verify(options, {});
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - start;
  if (!run.ok()) {
    std::printf("%4llu  %s\n", static_cast<unsigned long long>(seed), run.error().message().c_str());
    ++all.unknown;
    return;
  }
  Worst rig;
  for (std::size_t c = 0; c < truths.size(); ++c) {
    const smear::CameraVerdict& camera = run->result.cameras[c];
    ++rig.cameras;
    if (!camera.error || !camera.drift) {
      ++rig.unknown;
      std::printf("      %s: %s: %s\n", camera.file.c_str(), std::string(name(camera.state)).c_str(),
                  camera.reason.c_str());
      continue;
    }
    const double off = std::abs(in_milliseconds(
        wrap_symmetric(*camera.error - truths[c].error, film.rig.cameras[0].timing.frame_period)));
    rig.error_ms = std::max(rig.error_ms, off);
    if (c > 0) rig.sigmas = std::max(rig.sigmas, off / in_milliseconds(camera.sigma));
    rig.drift_ppm = std::max(rig.drift_ppm, std::abs(camera.drift->value() - truths[c].drift_ppm));
    rig.offsets_wrong += camera.frame_offset != truths[c].frame_offset ? 1 : 0;
  }
  const char* codec = film.format.codec == AV_CODEC_ID_H264    ? "h264"
                      : film.format.codec == AV_CODEC_ID_MJPEG ? "mjpeg"
                                                               : "ffv1";
  std::printf("%4llu  %7d  %-5s %3d  %6.2f  %10.2f  %9.5f  %7.1f  %10.3f  %7d  %7d  %6.1f\n",
              static_cast<unsigned long long>(seed), rig.cameras, codec,
              film.format.codec == AV_CODEC_ID_H264 ? film.format.crf : 0, film.strobe.rate.value(),
              1e9 * std::abs(run->row_clock->row_time.value() - film.rig.cameras[0].timing.row_time.value()),
              rig.error_ms, rig.sigmas, rig.drift_ppm, rig.offsets_wrong, rig.unknown, took.count());
  std::fflush(stdout);
  all.error_ms = std::max(all.error_ms, rig.error_ms);
  all.sigmas = std::max(all.sigmas, rig.sigmas);
  all.drift_ppm = std::max(all.drift_ppm, rig.drift_ppm);
  all.offsets_wrong += rig.offsets_wrong;
  all.unknown += rig.unknown;
  all.cameras += rig.cameras;
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  const int rigs = argc > 1 ? std::atoi(argv[1]) : 20;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int frames = argc > 3 ? std::atoi(argv[3]) : 240;
  emberlock::drivers::VirtualRigDraw model;
  if (argc > 4 && std::string(argv[4]) == "small") {
    model.layout.size = {320, 240};
    model.row_time = emberlock::microseconds_per_row(160);
  }
  const auto folder = std::filesystem::temp_directory_path() / ("verify_statistics_" + std::to_string(seed));
  std::printf(
      "seed  cameras  codec crf  strobe  t_row (ns)  error (ms)  /sigma  drift (ppm)  offsets  unknown  "
      "seconds\n"
      "                          (/s)    off by      off by              off by     wrong\n");
  emberlock::Worst all;
  for (int rig = 0; rig < rigs; ++rig) {
    run_rig(seed + static_cast<std::uint64_t>(rig), frames, model, folder, all);
    std::filesystem::remove_all(folder);
  }
  std::printf(
      "worst of %d cameras: error off by %.5f ms (%.1f sigma), drift by %.3f ppm; %d offsets wrong, %d "
      "unknown\n",
      all.cameras, all.error_ms, all.sigmas, all.drift_ppm, all.offsets_wrong, all.unknown);
  return 0;
}
