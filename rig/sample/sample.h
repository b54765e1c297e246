// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "recon/calibrate/board.h"
#include "recon/views/box.h"
#include "recon/views/camera_model.h"

namespace emberlock::rig {

struct SampleOptions {
  int cameras = 8;            ///< 3..10
  ImageSize image{480, 360};  ///< even sides, 160 x 120 to 1280 x 720
  int flame_frames = 24;      ///< that each camera films of the flame, 1..240
  std::uint64_t seed = 1;
};

/// The truth about one of the sample's cameras.
struct SampleCamera {
  std::string id;
  std::string film;       ///< its file in the folder
  int frames = 0;         ///< of its film
  int frame_offset = 0;   ///< frame i of the first camera's film belongs to its frame i + frame_offset
  Seconds late;           ///< of the first frame of the flame, relative to that of the first camera
  PartsPerMillion drift;  ///< its frame rate divided by the first camera's, minus one
  SecondsPerRow row_time;
  recon::CameraModel model;  ///< in the world of the board's first picture
};

struct Sample {
  SampleOptions options;
  Hertz flash_rate;  ///< of the strobe in the films, with the default frame code
  Hertz comb_rate;   ///< of the strobe in the comb's clip
  recon::Board board;
  std::string world;  ///< the instant whose board is the world
  recon::Box box;     ///< in that world; the flame is in its middle
  std::vector<SampleCamera> cameras;
};

/// Makes what somebody has on the cards of a few cameras before the first command, by simulation:
///   films/camera-N.mp4   the strobe with its frame code for ten seconds, then a flame; started by hand
///   comb/camera-0.mp4    the first camera under the comb of fast flashes
///   board/camera-N/*.png pictures of a chessboard; equal names are one instant
///   truth.json           what Sample holds
/// Errors: bad_input (options out of range), io, refused (ended by the observer).
Result<Sample> make_sample(const SampleOptions& options, const std::filesystem::path& folder,
                           const Observer& observer = {});

}  // namespace emberlock::rig
