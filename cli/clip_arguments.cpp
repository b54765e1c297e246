// SPDX-License-Identifier: Apache-2.0
#include "cli/clip_arguments.h"

namespace emberlock::cli {

CLI::Option* add_clip_options(CLI::App& verb, ClipArguments& a) {
  const auto positive = CLI::Range(1e-6, 1e6).description("");
  CLI::Option* flash_rate =
      verb.add_option("--flash-rate", a.flash_rate,
                      "flashes per second of the strobe that all cameras filmed: about one per frame")
          ->check(positive);
  CLI::Option* row_time =
      verb.add_option("--row-time-us", a.row_time_us, "t_row, the time to shift one row, if there is no comb")
          ->check(positive);
  CLI::Option* comb =
      verb.add_option("--comb", a.comb,
                      "a clip of one of the cameras under a fast strobe, from which t_row is measured")
          ->excludes(row_time);
  verb.add_option("--comb-rate", a.comb_rate, "flashes per second of the strobe in that clip: about 300")
      ->check(positive)
      ->needs(comb);
  verb.add_option("--frame-rate", a.frame_rate,
                  "frame rate of the cameras, if the files state a wrong one or are pictures")
      ->check(positive);
  verb.add_option("--direction", a.direction,
                  "the row that is read first, if the movement of the dots doesn't show it")
      ->check(CLI::IsMember({"top-first", "bottom-first"}));
  verb.add_option("--shifts", a.shifts,
                  "K, row shifts per readout, if the movement of the dots doesn't show it [the rows]")
      ->check(CLI::Range(1, 100000));
  verb.add_option("--code-words", a.code.words, "words of the code in which the strobe skips flashes")
      ->check(CLI::Range(1, 31))
      ->capture_default_str();
  verb.add_option("--code-spacing", a.code.spacing, "flashes from one word of the code to the next")
      ->check(CLI::Range(32, 100000))
      ->capture_default_str();
  verb.add_option("--flash-width-us", a.flash_width_us, "duration of a flash")
      ->check(positive)
      ->capture_default_str();
  return flash_rate;
}

smear::ClipOptions clip_options_of(const ClipArguments& a) {
  smear::ClipOptions clip;
  if (a.flash_rate > 0) clip.flash_rate = Hertz(a.flash_rate);
  clip.flash_width = microseconds(a.flash_width_us);
  if (a.frame_rate > 0) clip.frame_rate = Hertz(a.frame_rate);
  if (!a.direction.empty())
    clip.direction =
        a.direction == "top-first" ? smear::ReadDirection::top_first : smear::ReadDirection::bottom_first;
  if (a.shifts > 0) clip.shifts = a.shifts;
  clip.code = a.code;
  return clip;
}

std::optional<SecondsPerRow> row_time_of(const ClipArguments& a) {
  return a.row_time_us > 0 ? std::optional(microseconds_per_row(a.row_time_us)) : std::nullopt;
}

}  // namespace emberlock::cli
