// SPDX-License-Identifier: Apache-2.0
// What a program of one's own does with an installed Emberlock: it records a frame of a strobe, reads the dot
// in it, and reconstructs a flame. `flame_and_dot FOLDER` makes the session FOLDER.
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <utility>

#include "base/clock.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"
#include "session/layout.h"
#include "session/reader.h"
#include "session/writer.h"
#include "smear_sync/detect/detect.h"

namespace {

/// The value, or the end with what was wrong, where, and what to do about it.
template <class T>
T or_end(emberlock::Result<T> result) {
  if (result.ok()) return std::move(result).value();
  std::fprintf(stderr, "%s\n", result.error().message().c_str());
  std::exit(1);
}
void or_end(const emberlock::Status& status) {
  if (status.ok()) return;
  std::fprintf(stderr, "%s\n", status.error().message().c_str());
  std::exit(1);
}

/// A lamp at row 60, and 42 rows further down its dot: the flash came while the charge was shifted.
emberlock::Frame strobe_frame(const emberlock::ImageLayout& layout) {
  emberlock::Image image(layout);
  for (int y = 0; y < layout.size.height; ++y)
    for (int x = 0; x < layout.size.width; ++x) {
      const auto disk = [&](double row) { return std::hypot(x - 80, y - row) < 6; };
      const int noise = (7 * x + 13 * y) % 3;
      image.row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>((disk(60)    ? 240
                                                                    : disk(102) ? 60
                                                                                : 10) +
                                                                   noise);
    }
  emberlock::Frame frame;
  frame.image = std::make_shared<const emberlock::Image>(std::move(image));
  return frame;
}

void record_and_read_a_dot(const std::filesystem::path& folder) {
  using namespace emberlock;
  const ImageLayout layout{{160, 160}, PixelFormat::gray8, 8};
  v1::Manifest manifest;
  manifest.set_session_id("example");
  manifest.set_purpose("strobe");
  v1::CameraStream& camera = *manifest.add_cameras();
  camera.set_camera_id("camera-0");
  camera.set_frame_rate_hz(24);
  session::set_layout(camera, layout);
  session::WriterOptions options;
  options.min_free_bytes = 0;
  session::SessionWriter writer = or_end(session::SessionWriter::create(folder, manifest, options));
  or_end(writer.write(0, strobe_frame(layout)));
  or_end(writer.finish());

  session::SessionReader reader = or_end(session::SessionReader::open(folder));
  const Frame frame = or_end(reader.read(0, 0));
  const smear::SmearReading reading = smear::detect(frame.image->view());
  if (reading.state != smear::SmearState::dot) {
    std::fprintf(stderr, "no dot: %s\n", reading.reason.c_str());
    std::exit(1);
  }
  std::printf("the dot stands %.1f rows below the lamp\n",
              (reading.dots.front().y - reading.lamp->y).value());
}

void reconstruct_a_flame() {
  using namespace emberlock;
  recon::PaperSceneOptions film;  // eleven simulated cameras around a flame, the last one held out
  film.image = {96, 72};
  film.truth_voxels = 32;
  const recon::Scene scene = recon::paper_scene(film);
  recon::ReconstructOptions options;
  options.voxels = 24;
  options.effects = or_end(recon::parse_effects("extinction=32.8"));
  options.solve.compute.device = recon::Device::cpu;
  const SteadyClock clock;
  const recon::Outcome outcome = or_end(recon::reconstruct(scene, options, clock));
  const std::array<double, 3>& error = outcome.reconstruction.heldout_rmse.value();
  std::printf("the camera held out is shown within %.0f grey levels\n",
              std::ceil(recon::all_channels(error)));
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "flame_and_dot FOLDER\n");
    return 2;
  }
  record_and_read_a_dot(argv[1]);
  reconstruct_a_flame();
}
