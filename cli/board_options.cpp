// SPDX-License-Identifier: Apache-2.0
#include "cli/board_options.h"

namespace emberlock::cli {

void add_board_options(CLI::App& verb, films::BoardArguments& arguments, std::size_t instants) {
  arguments.film.instants = instants;
  verb.add_option("pictures", arguments.pictures,
                  "A folder with a subfolder a camera, in which pictures of one instant have one number; or "
                  "pictures named by camera and instant (left01.jpg); or a recorded or imported session")
      ->required();
  verb.add_option("--board", arguments.board,
                  "chessboard:9x6:25mm (inner corners, square), or charuco:11x8:30mm:22mm:5X5_100 (squares, "
                  "square, marker, dictionary)");
  verb.add_option(
          "--instants", arguments.film.instants,
          "Of a session: so many instants are taken at most, spread over poses, of four times as many "
          "that are searched")
      ->capture_default_str()
      ->check(CLI::Range(1, 10000));
  verb.add_option("--still", arguments.film.stillness,
                  "Of a session: pixels that the board may move from one frame to the next; 0: don't ask")
      ->capture_default_str()
      ->check(CLI::Range(0.0, 1000.0));
}

}  // namespace emberlock::cli
