// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <stdexcept>
#include <vector>

#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "recon/hull/hull.h"
#include "recon/synthetic/flame.h"
#include "session/files.h"
#include "session/writer.h"
#include "tests/support/marker_film.h"
#include "tests/support/recording.h"

// A recording of a marker, for cameras that replay it, and results such as a daemon's reconstructions leave.
namespace emberlock::test {

struct MarkerSession {
  recon::Intrinsics lens;
  int frames = 0;
  double rate = 30;
  PlateLook look = {};
  int drawn = 0;  ///< so many pictures are drawn, then they come back again and again; 0: all

  /// The picture that a frame has.
  [[nodiscard]] int picture(int frame) const {
    if (drawn < 2) return frame;
    const int at = frame % (2 * drawn - 2);
    return at < drawn ? at : 2 * drawn - 2 - at;
  }
  /// Of a frame: a hand holds the camera "hand".
  [[nodiscard]] recon::CameraModel camera(int frame) const { return in_a_hand(lens, picture(frame) / rate); }
};

/// Throws with the message where something fails.
inline void record_marker(const std::filesystem::path& folder, const MarkerSession& session) {
  const auto check = [](const auto& result) {
    if (!result.ok()) throw std::runtime_error(result.error().message());
  };
  const ImageLayout layout{session.lens.size, PixelFormat::rgb8, 8};
  v1::Manifest manifest = manifest_of({layout});
  manifest.mutable_cameras(0)->set_camera_id("hand");
  manifest.mutable_cameras(0)->set_frame_rate_hz(session.rate);
  *manifest.mutable_cameras(0)->mutable_calibration() = recon::calibration_of(session.camera(0));
  auto writer = emberlock::session::SessionWriter::create(folder, manifest, small_disk_options());
  check(writer);
  const Plate plate(usual_marker());
  std::vector<std::shared_ptr<const Image>> pictures;
  for (int f = 0; f < session.frames; ++f) {
    PlateLook look = session.look;
    look.seed = static_cast<std::uint64_t>(f);
    const auto picture = static_cast<std::size_t>(session.picture(f));
    if (picture == pictures.size())
      pictures.push_back(std::make_shared<const Image>(plate.seen_by(session.camera(f), look)));
    const auto ns = static_cast<std::int64_t>(f * 1e9 / session.rate);
    Frame frame;
    frame.stamp = {static_cast<std::uint64_t>(f),
                   {ns + 5},
                   {1'700'000'000'000'000'000 + ns},
                   {1'000'000'000 + ns},
                   FrameStatus::complete};
    frame.image = pictures[picture];
    check(writer->write(0, frame));
  }
  check(writer->finish());
}

/// A flame of so many voxels a side.
inline void put_flame(const std::filesystem::path& folder, int voxels, Seconds time = Seconds(0)) {
  recon::FlameOptions options;
  options.absorber = recon::Absorber::soot;
  const recon::Grid grid =
      recon::grid_over({Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(0.2)}, voxels);
  std::filesystem::create_directories(folder);
  const Status written =
      recon::write_volume(recon::Flame(options).at(time, grid).volume, folder / "volume.vdb");
  if (!written.ok()) throw std::runtime_error(written.error().message());
}

}  // namespace emberlock::test
