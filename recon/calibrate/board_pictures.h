// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "recon/calibrate/calibrate_rig.h"

namespace emberlock::recon {

/// A picture of the board: whose, and of which instant.
struct BoardPicture {
  std::string camera;
  std::string instant;
  std::filesystem::path path;
};

/// Pictures of the board by camera and instant, from folders and files:
/// - a folder with a subfolder a camera: the subfolder names the camera; the number at the end of a picture's
/// name
///   (else the whole name) is the instant;
/// - files, and pictures lying in a folder themselves ("left01.jpg", "cam3_0007.png"): the number at the
/// name's end
///   is the instant, what stands before it the camera.
/// Equal instants (as written: "01" isn't "1") were taken at the same time, or while the board lay still.
/// Sorted by camera and instant. Errors: nothing there, no picture, two pictures of one camera and instant.
Result<std::vector<BoardPicture>> list_board_pictures(const std::vector<std::filesystem::path>& inputs);

/// How a film's instants were chosen.
struct FilmCounts {
  std::size_t instants = 0;  ///< of the film
  std::size_t looked = 0;    ///< of these were searched
  std::size_t seen = 0;      ///< of these show the board to a camera
  std::size_t moving = 0;    ///< of these were left out, as the board moved
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

/// Reads the pictures and finds the board, on all processors. Errors: pictures of several sizes from one
/// camera; no picture that can be read.
Result<BoardReading> find_boards(const std::vector<BoardPicture>& pictures, const BoardSearch& search,
                                 const Progress& progress = {});

}  // namespace emberlock::recon
