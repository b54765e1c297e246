// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>

#include "base/image.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/camera_response.h"
#include "recon/compute/device.h"
#include "recon/synthetic/flame_simulation.h"
#include "recon/temperature/visible_gas.h"

namespace emberlock::rig {

struct SimulateOptions {
  recon::FlamePreset preset = recon::FlamePreset::candle;
  int frames = 24;                         ///< of each camera, 1..10000
  int cameras = 11;                        ///< on an arc of 300 degrees around the flame, 2..64
  ImageSize image{640, 480};               ///< even sides, 64 x 64 to 4096 x 4096
  PixelFormat format = PixelFormat::rgb8;  ///< of the pictures
  int cells = 64;                          ///< of the simulation across, a multiple of 8 from 8 to 512
  Hertz rate{24};                          ///< frames a second, 1..10000
  double read_noise = 0.7;                 ///< grey levels RMS, 0..50; 0: neither it nor shot noise
  /// By how much cameras after the first are late at most, evenly drawn; at most half a frame period.
  Seconds offsets{0};
  bool stagger =
      false;  ///< cameras at instants spread evenly over the frame period (smear_sync/align/stagger.h)
  /// Of the cameras; its levels hold for an exposure of kUsualExposure. Absent: recon::standard_response(),
  /// and the session tells none.
  std::optional<recon::CameraResponse> response;
  /// How long the shutters are open, 1 us to a frame period. Absent: of an absolute response what makes the
  /// first frame's brightest pixel 230 of 255 levels, at most a frame period; otherwise kUsualExposure. Told
  /// for an absolute response alone: without a scale no exposure changes a picture.
  std::optional<Seconds> exposure;
  std::optional<recon::Sun> sun;  ///< of smoke alone, which doesn't glow; absent: recon::Sun{}
  std::uint64_t seed = 1;         ///< of burners, offsets and noise
  recon::ComputeOptions compute;

  static constexpr Seconds kUsualExposure = milliseconds(1);
  static constexpr int kLeastSide = 64, kMostSide = 4096;  ///< of the image
};

struct SimulatedFilm {
  int frames = 0, cameras = 0;
  Seconds settled;  ///< simulated before the first frame, until the flame stands
  Kelvin hottest;   ///< of all frames
  Seconds exposure;
  double gain = 0;                 ///< the pictures' grey levels over those of the response
  double relative_divergence = 0;  ///< the worst of all steps
  Meters cell;                     ///< edge, of the simulation and its truth
  Meters pixel;                    ///< what a pixel covers in the middle of the flame
};
/// As many cells, a multiple of 32, as make the truth finer than what the pictures resolve: a smaller truth
/// doesn't judge a reconstruction's finest structures. Nothing where 512 don't suffice.
std::optional<int> cells_for_pictures(int cells, const SimulatedFilm& film);

/// Simulates a flame and films it with virtual cameras (drivers/virtual: their shutters, noise, mosaic and
/// converter): `folder`/session is a recording of calibrated cameras with linear pictures. A relative
/// response is exposed so that the brightest pixel of the first frame has 230 of 255 levels; an absolute one
/// tells the levels, and the manifest has it for the exposure used. Late cameras' times are in times.json. A
/// picture shows the middle of its exposure: motion during it isn't blurred. `folder`/truth/frame-0000.vdb
/// and so on are the truth at each frame's instant, the first camera's: emission and density (as
/// write_volume() says), temperature (K) and velocity (m/s). Errors: bad_input for options, refused where the
/// observer asks to stop and where nothing is seen, those of the simulation, io.
Result<SimulatedFilm> simulate_flame(const SimulateOptions& options, const std::filesystem::path& folder,
                                     const Observer& observer = {});

}  // namespace emberlock::rig
