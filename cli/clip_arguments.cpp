// SPDX-License-Identifier: Apache-2.0
#include "cli/clip_arguments.h"

namespace emberlock::cli {

Option add_clip_options(const Verb& verb, ClipArguments& a) {
  constexpr double kLeast = 1e-6;
  constexpr double kMost = 1e6;
  const Option flash_rate =
      verb.add_option("--flash-rate", a.flash_rate,
                      "flashes per second of the strobe that all cameras filmed: about one per frame")
          .check_unshown_range(kLeast, kMost);
  const Option row_time =
      verb.add_option("--row-time-us", a.row_time_us, "t_row, the time to shift one row, if there is no comb")
          .check_unshown_range(kLeast, kMost);
  const Option comb =
      verb.add_option("--comb", a.comb,
                      "a clip of one of the cameras under a fast strobe, from which t_row is measured")
          .exclude(row_time);
  verb.add_option("--comb-rate", a.comb_rate, "flashes per second of the strobe in that clip: about 300")
      .check_unshown_range(kLeast, kMost)
      .need(comb);
  verb.add_option("--frame-rate", a.frame_rate,
                  "frame rate of the cameras, if the files state a wrong one or are pictures")
      .check_unshown_range(kLeast, kMost);
  verb.add_option("--direction", a.direction,
                  "the row that is read first, if the movement of the dots doesn't show it")
      .check_choices({"top-first", "bottom-first"});
  verb.add_option("--shifts", a.shifts,
                  "K, row shifts per readout, if the movement of the dots doesn't show it [the rows]")
      .check_range(1, 100000);
  verb.add_option("--code-words", a.code.words, "words of the code in which the strobe skips flashes")
      .check_range(1, 31)
      .show_default();
  verb.add_option("--code-spacing", a.code.spacing, "flashes from one word of the code to the next")
      .check_range(32, 100000)
      .show_default();
  verb.add_option("--flash-width-us", a.flash_width_us, "duration of a flash")
      .check_unshown_range(kLeast, kMost)
      .show_default();
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
