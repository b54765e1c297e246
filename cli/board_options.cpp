// SPDX-License-Identifier: Apache-2.0
#include "cli/board_options.h"

namespace emberlock::cli {

void add_board_options(const Verb& verb, films::BoardArguments& arguments, std::size_t instants) {
  arguments.film.instants = instants;
  verb.add_option(
          "pictures", arguments.pictures,
          "A folder with a subfolder per camera, in which pictures of one instant have the same number; or a "
          "folder of pictures named by camera and instant (left01.jpg); or a recorded or imported session")
      .require();
  verb.add_option("--board", arguments.board,
                  "chessboard:9x6:25mm (inner corners, square), or charuco:11x8:30mm:22mm:5X5_100 (squares, "
                  "square, marker, dictionary)");
  verb.add_option("--instants", arguments.film.instants,
                  "Sessions only: most instants that are used. Four times as many are searched; those whose "
                  "poses differ most are used")
      .show_default()
      .check_range(1, 10000);
  verb.add_option("--still", arguments.film.stillness,
                  "Sessions only: pixels that the board may move from one frame to the next; 0: no limit")
      .show_default()
      .check_range(0.0, 1000.0);
}

}  // namespace emberlock::cli
