// SPDX-License-Identifier: Apache-2.0
#include "films/import_strobe.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "smear_sync/detect/detect.h"
#include "smear_sync/detect/film.h"
#include "smear_sync/detect/follow.h"

namespace emberlock::films {
namespace {

constexpr double kSampleSeconds = 0.9;  // interval between two sampled frames
constexpr double kLongestBlind = 2.5;   // seconds
constexpr double kShortestPart = 2;     // seconds
constexpr double kSameLamp = 1.5;       // pixels: the lamp doesn't move; flames do
constexpr std::int64_t kLongestDark =
    48;  // frames: the code skips up to nine flashes in a row, a hand in front of the lamp more
constexpr std::int64_t kSurelyOver = 60;
constexpr int kFewestDots = 10;

bool shows_strobe(const smear::SmearReading& reading) {
  return reading.lamp &&
         (reading.state == smear::SmearState::dot || reading.state == smear::SmearState::no_dot ||
          reading.state == smear::SmearState::comb);
}

struct LampPlace {
  double x, y;
};

bool at(const LampPlace& lamp, const smear::SmearReading& reading) {
  return reading.lamp && std::hypot(reading.lamp->x - lamp.x, reading.lamp->y.value() - lamp.y) <= kSameLamp;
}

/// The place of most lamps with a dot. A flame rarely resembles one, and never twice at the same place.
std::optional<LampPlace> most_frequent_lamp(const std::map<std::int64_t, smear::SmearReading>& readings) {
  constexpr std::size_t kMostCandidates = 400;
  std::vector<LampPlace> lamps;
  for (const auto& [place, reading] : readings) {
    const bool dots = reading.state == smear::SmearState::dot || reading.state == smear::SmearState::comb;
    if (reading.lamp && dots) lamps.push_back({reading.lamp->x, reading.lamp->y.value()});
  }
  const std::size_t stride = 1 + lamps.size() / kMostCandidates;
  std::optional<LampPlace> best;
  std::ptrdiff_t most = 0;
  for (std::size_t i = 0; i < lamps.size(); i += stride) {
    const auto near = std::count_if(lamps.begin(), lamps.end(), [&](const LampPlace& l) {
      return std::hypot(l.x - lamps[i].x, l.y - lamps[i].y) <= kSameLamp;
    });
    if (near > most) {
      most = near;
      best = lamps[i];
    }
  }
  return best;
}

/// Reads frames, each once, until a damaged one is found.
class Looker {
 public:
  Looker(const FilmToSearch& film, const ReadPlace& read)
      : read_(read), range_(film.within.value_or(PlaceRange{0, film.frames})) {
    range_.first = std::clamp<std::int64_t>(range_.first, 0, film.frames);
    range_.last = std::clamp<std::int64_t>(range_.last, range_.first, film.frames);
  }

  [[nodiscard]] const PlaceRange& range() const { return range_; }
  [[nodiscard]] int looked_at() const { return looked_at_; }
  std::map<std::int64_t, smear::SmearReading>& glances() { return glances_; }

  /// Reads a single frame; false if it is damaged.
  bool glance(std::int64_t place) {
    const auto image = take(place);
    if (image) glances_[place] = smear::detect(image->view());
    return image.has_value();
  }

  std::optional<Image> take(std::int64_t place) {
    if (place >= range_.last) return std::nullopt;
    Result<Image> image = read_(place);
    ++looked_at_;
    if (image.ok()) return std::move(image).value();
    if (image.error().kind != ErrorKind::bad_input && image.error().kind != ErrorKind::out_of_data)
      failure_ = image.error();
    return std::nullopt;
  }
  [[nodiscard]] const std::optional<Error>& failure() const { return failure_; }

 private:
  const ReadPlace& read_;
  PlaceRange range_;
  std::map<std::int64_t, smear::SmearReading> glances_;
  int looked_at_ = 0;
  std::optional<Error> failure_;
};

/// Samples about a frame per second, and every frame between key frames that are far apart.
void look_around(const FilmToSearch& film, Looker& looker) {
  const PlaceRange& range = looker.range();
  const auto step = std::max<std::int64_t>(1, std::llround(kSampleSeconds * film.frame_rate.value()));
  const std::int64_t longest = std::llround(kLongestBlind * film.frame_rate.value());
  std::vector<std::int64_t> looks;
  for (const std::int64_t key : film.keys) {
    if (key < range.first || key >= range.last) continue;
    if (looks.empty() || key - looks.back() >= step) looks.push_back(key);
  }
  if (looks.empty() || looks.front() - range.first > longest) looks.insert(looks.begin(), range.first);
  for (std::size_t i = 0; i < looks.size(); ++i) {
    const std::int64_t next = i + 1 < looks.size() ? looks[i + 1] : range.last;
    const std::int64_t until = next - looks[i] > longest ? next : looks[i] + 1;
    for (std::int64_t place = looks[i]; place < until; ++place) {
      if (!looker.glance(place)) break;
    }
  }
}

/// Reads every frame from `from` until well after the last that shows the lamp, at least up to `last_glance`,
/// the last sampled frame that showed it.
std::map<std::int64_t, smear::SmearReading> read_on(Looker& looker, const LampPlace& lamp, std::int64_t from,
                                                    std::int64_t last_glance) {
  std::map<std::int64_t, smear::SmearReading> film;
  smear::FollowingDetector detector;
  std::int64_t last_lit = last_glance;
  for (std::int64_t place = from; place <= std::max(last_glance, last_lit + kSurelyOver); ++place) {
    const auto image = looker.take(place);
    if (!image) break;
    smear::SmearReading reading = detector.read(image->view());
    if (shows_strobe(reading) && at(lamp, reading)) last_lit = std::max(last_lit, place);
    film.emplace(place, std::move(reading));
  }
  return film;
}

/// Resolves readings of single frames that are ambiguous, using the whole film.
void settle_film(std::map<std::int64_t, smear::SmearReading>& film) {
  std::vector<smear::SmearReading> readings;
  readings.reserve(film.size());
  for (const auto& [place, reading] : film) readings.push_back(reading);
  readings = smear::share_lamp(smear::settle(readings));
  std::size_t i = 0;
  for (auto& [place, reading] : film) reading = std::move(readings[i++]);
}

/// Finds runs of lit frames without a long dark interval.
void take_runs(const std::map<std::int64_t, smear::SmearReading>& film, const LampPlace& lamp, Hertz rate,
               StrobeParts& parts) {
  PlaceRange run;
  int lit = 0;
  int dots = 0;
  const auto end_run = [&] {
    const bool long_enough = static_cast<double>(run.count()) >= kShortestPart * rate.value();
    if (long_enough && 4 * lit > run.count() && dots >= kFewestDots) {
      parts.lit.push_back(run);
      for (std::int64_t place = run.first; place < run.last; ++place)
        parts.readings[static_cast<std::size_t>(place)] = film.at(place);
    }
    lit = dots = 0;
  };
  for (const auto& [place, reading] : film) {
    if (!at(lamp, reading) || reading.state == smear::SmearState::no_lamp) continue;
    if (lit > 0 && place - run.last >= kLongestDark) end_run();
    if (lit == 0) run.first = place;
    run.last = place + 1;
    ++lit;
    dots += reading.state == smear::SmearState::dot || reading.state == smear::SmearState::comb ? 1 : 0;
  }
  if (lit > 0) end_run();
}

}  // namespace

Result<StrobeParts> find_strobe(const FilmToSearch& film, const ReadPlace& read) {
  Looker looker(film, read);
  StrobeParts parts;
  parts.readings.assign(static_cast<std::size_t>(film.frames),
                        {smear::SmearState::ambiguous, {}, {}, "it isn't of a part that shows the strobe"});
  look_around(film, looker);
  const auto lamp = most_frequent_lamp(looker.glances());
  const std::int64_t slack = std::llround(kLongestBlind * film.frame_rate.value());
  std::int64_t done = looker.range().first;  // every frame before it was read or isn't needed
  for (auto glance = looker.glances().begin(); lamp && glance != looker.glances().end(); ++glance) {
    if (glance->first < done || !shows_strobe(glance->second) || !at(*lamp, glance->second)) continue;
    // The last sampled frame that shows the strobe without a long break.
    std::int64_t last = glance->first;
    for (auto later = glance; later != looker.glances().end() && later->first - last <= slack; ++later) {
      if (shows_strobe(later->second) && at(*lamp, later->second)) last = later->first;
    }
    auto film_there = read_on(looker, *lamp, std::max(done, glance->first - slack), last);
    if (film_there.empty()) break;
    done = film_there.rbegin()->first + 1;
    settle_film(film_there);
    take_runs(film_there, *lamp, film.frame_rate, parts);
  }
  if (looker.failure()) return *looker.failure();
  parts.looked_at = looker.looked_at();
  return parts;
}

}  // namespace emberlock::films
