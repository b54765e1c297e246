// SPDX-License-Identifier: Apache-2.0
#include "films/import_plan.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace emberlock::films {
namespace {

constexpr std::int64_t kGuard = 2;  // frames: a flash may also show in the picture after its own

struct Span {
  Seconds from, to;
};

/// Index of the film's frame whose read phase begins closest to an instant, if the film has it.
std::optional<std::int64_t> place_at(const TimedFilm& film, Seconds instant) {
  const auto place = film.times.place_of(film.times.nearest_count(instant));
  return place && *place >= 0 && *place < film.frames ? place : std::nullopt;
}

bool is_lit(const TimedFilm& film, std::int64_t place) {
  return std::any_of(film.lit.begin(), film.lit.end(), [&](const PlaceRange& part) {
    return place >= part.first - kGuard && place < part.last + kGuard;
  });
}

Span covered(const TimedFilm& film) {
  return {film.times.read_start(0), film.times.read_start(film.frames - 1)};
}

/// The longest run of the reference's frames that lie within all films while no film shows the strobe.
PlaceRange longest_unlit(std::span<const TimedFilm> films, std::size_t reference) {
  PlaceRange best;
  PlaceRange run;
  const TimedFilm& clock = films[reference];
  for (std::int64_t place = 0; place < clock.frames; ++place) {
    const Seconds instant = clock.times.read_start(place);
    const bool good = std::all_of(films.begin(), films.end(), [&](const TimedFilm& film) {
      const Span span = covered(film);
      const Seconds half = film.times.period / 2;
      if (instant < span.from - half || instant > span.to + half) return false;
      const auto there = place_at(film, instant);
      return !there || !is_lit(film, *there);
    });
    if (!good) continue;
    if (place != run.last) run.first = place;
    run.last = place + 1;
    if (run.count() > best.count()) best = run;
  }
  return best;
}

Error nothing_in_common(std::span<const TimedFilm> films, std::size_t reference) {
  const TimedFilm& clock = films[reference];
  const Span span = covered(clock);
  for (const TimedFilm& film : films) {
    const Span other = covered(film);
    if (other.from > span.to || other.to < span.from) {
      return {ErrorKind::bad_input,
              fmt::format("was filmed at another time than {}: from {:.1f} s to {:.1f} s after that began",
                          clock.name, (other.from - span.from).value(), (other.to - span.from).value()),
              film.name, "Leave this film out, or give the one that belongs to the others"};
    }
  }
  return {
      ErrorKind::bad_input, "no frames are common to all films and free of the strobe", clock.name,
      "Film the flame with all cameras after (or before) they filmed the strobe, without stopping them; or "
      "give --flame FROM-TO"};
}

}  // namespace

Result<FramePlan> plan_frames(std::span<const TimedFilm> films, std::size_t reference,
                              const PlanOptions& options) {
  const TimedFilm& clock = films[reference];
  const PlaceRange flame = options.flame.value_or(longest_unlit(films, reference));
  FramePlan plan;
  plan.reference = reference;
  plan.cameras.resize(films.size());
  for (std::int64_t place = flame.first; place < flame.last; ++place) {
    const Seconds instant = clock.times.read_start(place);
    std::vector<std::int64_t> places;
    for (const TimedFilm& film : films) {
      const auto there = place_at(film, instant);
      if (there) places.push_back(*there);
      const bool beyond = instant > covered(film).to + film.times.period / 2 ||
                          instant < covered(film).from - film.times.period / 2;
      if (!there && beyond && options.flame) {
        return Error{
            ErrorKind::bad_input,
            fmt::format("doesn't reach over the flame part that was asked for: it lacks frame {} of {}",
                        place, clock.name),
            film.name, "Ask for a shorter part with --flame, or leave it out"};
      }
    }
    if (places.size() < films.size()) {
      ++plan.left_out;
      continue;
    }
    plan.instants.push_back(clock.times.count_of(place));
    for (std::size_t c = 0; c < films.size(); ++c) {
      FramePlan::Camera& camera = plan.cameras[c];
      plan.repeated += !camera.places.empty() && camera.places.back() == places[c] ? 1 : 0;
      camera.places.push_back(places[c]);
      camera.late_s.push_back((films[c].times.read_start(places[c]) - instant).value());
      camera.sigma_s.push_back(
          c == reference ? 0 : smear::sigma_between(films[c].times, places[c], clock.times, place).value());
    }
  }
  if (plan.instants.empty()) return nothing_in_common(films, reference);
  return plan;
}

}  // namespace emberlock::films
