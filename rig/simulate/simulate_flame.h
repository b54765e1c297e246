// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>

#include "base/image.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/compute/device.h"
#include "recon/synthetic/flame_simulation.h"

namespace emberlock::rig {

struct SimulateOptions {
  recon::FlamePreset preset = recon::FlamePreset::candle;
  int frames = 24;            ///< of each camera, 1..10000
  int cameras = 11;           ///< on an arc of 300 degrees around the flame, 2..64
  ImageSize image{640, 480};  ///< even sides, 64 x 64 to 4096 x 4096
  int cells = 64;             ///< of the simulation across, a multiple of 8 from 8 to 512
  Hertz rate{24};             ///< frames a second, 1..10000
  double read_noise = 0.7;    ///< grey levels RMS; 0: neither it nor shot noise
  std::uint64_t seed = 1;     ///< of burners and noise
  recon::ComputeOptions compute;
};

struct SimulatedFilm {
  int frames = 0, cameras = 0;
  Seconds settled;                 ///< simulated before the first frame, until the flame stands
  Kelvin hottest;                  ///< of all frames
  double levels_per_radiance = 0;  ///< the exposure: grey levels of what glows with unit relative level
  double relative_divergence = 0;  ///< the worst of all steps
};

/// Simulates a flame and films it: `folder`/session is a recording of perfectly synchronous, calibrated
/// cameras whose pictures are linear sRGB (recon::standard_response()), exposed so that the brightest pixel
/// of the first frame has 230 of 255 levels. `folder`/truth/frame-0000.vdb and so on are each frame's truth:
/// emission and density (as write_volume() says), temperature (K) and velocity (m/s). The soot glows by
/// Planck's law at its gas' temperature. Errors: bad_input for options, refused for smoke, which doesn't
/// glow, and where the observer asks to stop, those of the simulation, io.
Result<SimulatedFilm> simulate_flame(const SimulateOptions& options, const std::filesystem::path& folder,
                                     const Observer& observer = {});

}  // namespace emberlock::rig
