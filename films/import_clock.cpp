// SPDX-License-Identifier: Apache-2.0
#include "films/import_clock.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "films/clip_reader.h"
#include "session/media/sound.h"
#include "smear_sync/clocks/row_clock.h"

namespace emberlock::films {
namespace {

constexpr SecondsPerRow kRowTimeAsGiven(20e-9);  // standard error of a row time given by the user

}  // namespace

PlaceRange places_of(const Part& part, const Film& film) {
  const double rate = film.frame_rate.value();
  return {std::clamp<std::int64_t>(std::llround(part.from.value() * rate), 0, film.frames),
          std::clamp<std::int64_t>(std::llround(part.to.value() * rate), 0, film.frames)};
}

Result<smear::ClipOptions> clip_options(const ImportOptions& options) {
  smear::ClipOptions clip = options.clip;
  if (options.row_time) {
    clip.row_time = *options.row_time;
    clip.row_time_sigma = kRowTimeAsGiven;
    return clip;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<FilmedClip> comb, read_clips({options.comb.string()}, {}));
  const auto clock = smear::fit_row_clock(comb.front().reading.frames, options.comb_rate);
  if (!clock.ok()) {
    Error error = clock.error();
    error.where = options.comb.string();
    return error;
  }
  clip.row_time = clock->row_time;
  clip.row_time_sigma = clock->sigma;
  return clip;
}

Result<SoundTrack> sound_of(const Film& film) {
  if (film.files.kind == session::CameraFiles::Kind::pictures) return SoundTrack{};
  return session::read_sound(film.parts.front().path);
}

Result<StrobeParts> look_for_strobe(const Film& film, const ImportOptions& options) {
  session::ClipReader reader(film.parts, session::Colours::brightness);
  const FilmToSearch search{film.frames, film.frame_rate, keys_of(film),
                            options.strobe ? std::optional(places_of(*options.strobe, film)) : std::nullopt};
  bool begun = false;
  return find_strobe(search, [&](std::int64_t place) -> Result<Image> {
    if (!begun || reader.place() != place) EMBERLOCK_RETURN_IF_ERROR(reader.seek(place));
    begun = true;
    return reader.next();
  });
}

Status read_clock(Candidate& candidate, const smear::ClipOptions& options) {
  const Film& film = candidate.film;
  const std::string where = film.parts.front().path.string();
  if (candidate.strobe->lit.empty()) {
    return Error{
        ErrorKind::bad_input, "shows no strobe", where,
        "Give the film in which this camera shows the strobe's lamp for five seconds or more, or name "
        "the part with --strobe. --partial leaves this camera out, --unsynchronised pairs frames "
        "without a strobe"};
  }
  const smear::ClipReading reading{where, film.files.id, film.size.height, film.frame_rate,
                                   candidate.strobe->readings};
  EMBERLOCK_ASSIGN_OR_RETURN(candidate.clock, smear::read_clip_clock(reading, options));
  EMBERLOCK_ASSIGN_OR_RETURN(candidate.times, smear::known_strobe_times(*candidate.clock, options, where));
  return {};
}

std::vector<Status> match_films(std::vector<Candidate>& films, const smear::ClipOptions& options) {
  std::vector<Status> answers(films.size());
  if (films.empty()) return answers;
  std::vector<smear::ClipClock> clocks;
  std::vector<SoundTrack> sounds;
  for (const Candidate& c : films) {
    clocks.push_back(*c.clock);
    sounds.push_back(c.sound);
  }
  const std::int64_t middle = std::llround(films.front().times->at);
  const Result<std::vector<smear::WholeFrames>> whole =
      smear::match_frames(clocks, 0, middle, options, smear::match_sounds(sounds, 0));
  for (std::size_t i = 0; i < films.size(); ++i) {
    const std::string where = films[i].film.parts.front().path.string();
    if (!whole.ok()) {
      answers[i] = whole.error();
    } else if (!(*whole)[i].offset) {
      answers[i] = Error{
          ErrorKind::bad_input,
          "it isn't known which of its frames belong to those of " + films.front().film.files.id + ": " +
              (*whole)[i].reason,
          where,
          "Let the strobe skip flashes in its code while all cameras film it, or pass a hand before its lamp "
          "six times at odd intervals"};
    } else {
      films[i].whole = (*whole)[i];
      films[i].times->start += films[i].clock->flash_period * static_cast<double>((*whole)[i].flashes);
      if ((*whole)[i].witness == smear::FrameWitness::code)
        smear::into_cycle_of(*films.front().times, options, *films[i].times);
    }
  }
  return answers;
}

Status pair_by_offsets(std::vector<Candidate>& films, const ImportOptions& options) {
  for (Candidate& c : films) {
    const auto told = options.offsets.find(c.film.files.id);
    std::int64_t offset = told == options.offsets.end() ? 0 : told->second;
    smear::ClipTimes times;
    times.period = period(c.film.frame_rate);
    if (c.film.files.kind == session::CameraFiles::Kind::pictures) {
      const std::vector<std::int64_t>& numbers = c.film.files.numbers;
      offset -= numbers.front();
      for (std::size_t i = 1; i < numbers.size(); ++i) {
        const std::int64_t lacks = numbers[i] - numbers[i - 1] - 1;
        const auto place = static_cast<std::int64_t>(i);
        if (lacks > 0) times.drops.push_back({place - 1, place, static_cast<int>(lacks)});
      }
    }
    times.start = times.period * static_cast<double>(-offset);
    c.times = std::move(times);
  }
  for (const auto& [id, offset] : options.offsets) {
    const bool there = std::any_of(films.begin(), films.end(), [&, &wanted = id](const Candidate& c) {
      return c.film.files.id == wanted;
    });
    if (!there)
      return Error{ErrorKind::bad_input, "no camera has this id", "--offset " + id,
                   "Name a camera of the folder"};
  }
  return {};
}

}  // namespace emberlock::films
