// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

inline constexpr const char* kMirroredBoard = "shows the board only in its mirror image";
inline constexpr const char* kSwitchMirroringOff =
    "Switch the mirroring off that the camera's driver or program does";

/// A picture of the board, with its camera and instant.
struct BoardPicture {
  std::string camera;
  std::string instant;
  std::filesystem::path path;
};

/// Lists pictures of the board by camera and instant, from folders and files:
/// - a folder with a subfolder for each camera, which has the camera's name; the instant is the number at the
///   end of a picture's name (or else the whole name);
/// - files, and pictures directly in a folder ("left01.jpg", "cam3_0007.png"): the instant is the number at
///   the end of the name, the camera is the text before it.
/// Pictures with equal instants (compared as text: "01" isn't "1") must have been taken at the same time, or
/// while the board didn't move. Sorted by camera and instant. Errors: nothing found, not a picture, two
/// pictures of one camera and instant.
Result<std::vector<BoardPicture>> list_board_pictures(const std::vector<std::filesystem::path>& inputs);

/// How the instants of a film were selected.
struct FilmCounts {
  std::size_t instants = 0;  ///< in the film
  std::size_t looked = 0;    ///< searched
  std::size_t seen = 0;      ///< with the board visible to a camera
  std::size_t moving = 0;    ///< skipped because the board moved
  std::size_t taken = 0;
};

struct BoardReading {
  BoardSightings sightings;
  struct Unused {
    std::filesystem::path path;
    std::string why;
  };
  std::vector<Unused> unused;  ///< pictures that can't be read, or don't show the board
  std::optional<FilmCounts> film = {};
};

/// Reads the pictures and finds the board, on all processors. Errors: pictures of different sizes from one
/// camera; no readable picture.
Result<BoardReading> find_boards(const std::vector<BoardPicture>& pictures, const BoardSearch& search,
                                 const Progress& progress = {});

}  // namespace emberlock::recon
