// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/board_films.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include <fmt/format.h>

#include "base/in_parallel.h"
#include "session/reader.h"

namespace emberlock::recon {
namespace {

constexpr std::size_t kMirrorLooks = 16;   // frames of a film that are searched for a mirrored board
constexpr double kLeastDifference = 0.01;  // of the picture's diagonal

/// The frames and corners of one camera at the searched instants.
struct CameraFilm {
  std::vector<std::optional<std::size_t>> frames;  ///< by searched instant; nullopt without a frame
  struct Look {
    std::size_t look = 0;
    std::vector<BoardCorner> corners;
    double motion = 0;  ///< pixels per frame; infinite if the neighbouring frame doesn't show the board
  };
  std::vector<Look> seen;
  std::optional<std::size_t> mirrored;  ///< a frame that shows the board only in its mirror image
  std::vector<BoardReading::Unused> unreadable;
  std::size_t readable = 0;
};

std::vector<std::size_t> complete_frames(const session::SessionReader& reader, std::size_t camera) {
  std::vector<std::size_t> frames;
  const std::vector<FrameStamp>& stamps = reader.stamps(camera);
  for (std::size_t i = 0; i < stamps.size(); ++i)
    if (stamps[i].status == FrameStatus::complete) frames.push_back(i);
  return frames;
}

/// The frame closest to `t`, at most half a period away. `frames` must be in order of time.
std::optional<std::size_t> nearest_frame(const session::SessionReader& reader, std::size_t camera,
                                         const std::vector<std::size_t>& frames, TimePoint t) {
  const std::vector<FrameStamp>& stamps = reader.stamps(camera);
  const auto away = [&](std::size_t frame) { return abs(stamps[frame].monotonic_time - t); };
  const auto after = std::lower_bound(frames.begin(), frames.end(), t, [&](std::size_t frame, TimePoint at) {
    return stamps[frame].monotonic_time < at;
  });
  std::optional<std::size_t> best;
  if (after != frames.end()) best = *after;
  if (after != frames.begin() && (!best || away(*std::prev(after)) < away(*best))) best = *std::prev(after);
  const double rate = reader.manifest().cameras(static_cast<int>(camera)).frame_rate_hz();
  if (best && rate > 0 && away(*best) > Seconds(0.5 / rate)) return std::nullopt;
  return best;
}

/// The median motion of corners between two frames.
double motion_between(const std::vector<BoardCorner>& a, const std::vector<BoardCorner>& b) {
  std::vector<double> steps;
  for (const BoardCorner& corner : a)
    for (const BoardCorner& other : b)
      if (other.id == corner.id) steps.push_back((corner.pixel - other.pixel).norm());
  if (steps.empty()) return INFINITY;
  const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
  std::nth_element(steps.begin(), middle, steps.end());
  return *middle;
}

/// Searches one camera's frames in order, and the neighbours of those that show the board.
Status search_film(session::SessionReader& reader, std::size_t camera, const BoardSearch& search,
                   const FilmSearchOptions& options, const Observer& observer, CameraFilm& film) {
  const std::string id = reader.manifest().cameras(static_cast<int>(camera)).camera_id();
  const std::size_t count = reader.stamps(camera).size();
  // In a short film the neighbour is the frame searched next.
  std::optional<std::pair<std::size_t, std::vector<BoardCorner>>> last;
  const auto corners_in = [&](std::size_t frame) -> Result<std::vector<BoardCorner>> {
    if (!last || last->first != frame) {
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame read, reader.read(camera, frame));
      last.emplace(frame, search.find(read.image->view()));
    }
    return last->second;
  };
  for (std::size_t look = 0; look < film.frames.size(); ++look) {
    EMBERLOCK_RETURN_IF_ERROR(
        observe(observer, static_cast<double>(look) / static_cast<double>(film.frames.size()), id));
    if (!film.frames[look]) continue;
    const std::size_t frame = *film.frames[look];
    auto corners = corners_in(frame);
    if (!corners) {
      film.unreadable.push_back(
          {reader.folder() / id / ("frame " + std::to_string(frame)), corners.error().message()});
      continue;
    }
    ++film.readable;
    if (corners->empty()) {
      const bool sample = look % std::max<std::size_t>(1, film.frames.size() / kMirrorLooks) == 0;
      if (sample && film.seen.empty() && !film.mirrored && search.find_mirrored) {
        const auto read = reader.read(camera, frame);
        if (read && search.find_mirrored(read->image->view())) film.mirrored = frame;
      }
      continue;
    }
    double motion = options.stillness > 0 ? INFINITY : 0;
    if (options.stillness > 0 && count > 1) {
      const auto beside = corners_in(frame + 1 < count ? frame + 1 : frame - 1);
      if (beside) motion = motion_between(*corners, *beside);
    }
    film.seen.push_back({look, *std::move(corners), motion});
  }
  return {};
}

/// At most `most` numbers below `count`, at even intervals.
std::vector<std::size_t> spread_evenly(std::size_t count, std::size_t most) {
  const std::size_t taken = std::min(count, most);
  std::vector<std::size_t> result;
  result.reserve(taken);
  for (std::size_t n = 0; n < taken; ++n) result.push_back((2 * n + 1) * count / (2 * taken));
  return result;
}

/// The cameras' frames of the searched instants, and the instants' names.
std::vector<CameraFilm> plan_films(const session::SessionReader& reader, const FilmSearchOptions& options,
                                   FilmCounts& counts, std::vector<std::string>& names) {
  const std::vector<std::size_t> first = complete_frames(reader, 0);
  counts.instants = first.size();
  const std::vector<std::size_t> looks = spread_evenly(first.size(), options.instants * options.looks);
  counts.looked = looks.size();
  for (const std::size_t look : looks) names.push_back(std::to_string(first[look]));
  std::vector<CameraFilm> films(reader.camera_count());
  for (std::size_t c = 0; c < films.size(); ++c) {
    const std::vector<std::size_t> frames = complete_frames(reader, c);
    for (const std::size_t look : looks)
      films[c].frames.push_back(
          nearest_frame(reader, c, frames, reader.stamps(0)[first[look]].monotonic_time));
  }
  return films;
}

Status nothing_found(const std::filesystem::path& folder, const BoardReading& reading,
                     const FilmSearchOptions& options, double slowest) {
  const FilmCounts& film = *reading.film;
  const std::string noun = noun_of(reading.sightings.board);
  const auto mirrored = std::find_if(reading.unused.begin(), reading.unused.end(),
                                     [](const auto& unused) { return unused.why == kMirroredBoard; });
  if (film.seen == 0 && mirrored != reading.unused.end())
    return Error{ErrorKind::bad_input, kMirroredBoard, mirrored->path.string(), kSwitchMirroringOff};
  if (film.seen == 0) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("the {} was found at none of {} instants, of {}", noun, film.looked, film.instants),
        folder.string(),
        reading.sightings.board.kind == BoardKind::lamp
            ? "Film one small lamp, brighter than all else, in a dark room"
            : "Check the number of inner corners (chessboard) or squares (ChArUco), and that the board "
              "is sharp and large enough; search more frames with --instants"};
  }
  if (film.moving == film.seen) {
    return Error{
        ErrorKind::bad_input,
        fmt::format("the {} moves at all {} instants that show it, by {} pixels a frame at least, and "
                    "cameras don't expose at once",
                    noun, film.seen, std::isfinite(slowest) ? fmt::format("{:.1f}", slowest) : "too many"),
        folder.string(),
        fmt::format("Hold it still for a second in each pose, or allow more than --still {} (0: "
                    "frames are single pictures of a board at rest)",
                    options.stillness)};
  }
  return {};
}

/// The board's motion at each instant, in the camera where it is largest.
std::vector<double> motions_of(const std::vector<CameraFilm>& films, std::size_t looks) {
  std::vector<double> motions(looks, -1);
  for (const CameraFilm& film : films)
    for (const CameraFilm::Look& look : film.seen)
      motions[look.look] = std::max(motions[look.look], look.motion);
  return motions;
}

double mean_distance(const std::vector<BoardCorner>& a, const std::vector<BoardCorner>& b) {
  double sum = 0;
  int count = 0;
  std::map<int, const BoardCorner*> by_id;
  for (const BoardCorner& corner : b) by_id[corner.id] = &corner;
  for (const BoardCorner& corner : a) {
    const auto other = by_id.find(corner.id);
    if (other == by_id.end()) continue;
    sum += (corner.pixel - other->second->pixel).norm();
    ++count;
  }
  return count > 0 ? sum / count : INFINITY;
}

/// The difference between the views of two instants, in diagonals of the picture; 1 if no camera sees both.
double difference(const BoardSightings& sightings, const std::vector<std::size_t>& a,
                  const std::vector<std::size_t>& b) {
  double least = 1;
  for (const std::size_t i : a) {
    for (const std::size_t j : b) {
      const auto& one = sightings.sightings[i];
      const auto& other = sightings.sightings[j];
      if (one.camera != other.camera) continue;
      const ImageSize size = sightings.cameras[one.camera].size;
      least =
          std::min(least, mean_distance(one.corners, other.corners) / std::hypot(size.width, size.height));
    }
  }
  return least;
}

/// Keeps only the instants in `kept` (ascending).
void keep_instants(BoardSightings& sightings, const std::vector<std::size_t>& kept) {
  std::map<std::size_t, std::size_t> place;
  std::vector<std::string> names;
  for (const std::size_t instant : kept) {
    place[instant] = names.size();
    names.push_back(sightings.instants[instant]);
  }
  std::erase_if(sightings.sightings, [&](const auto& s) { return !place.contains(s.instant); });
  for (auto& sighting : sightings.sightings) sighting.instant = place[sighting.instant];
  sightings.instants = std::move(names);
}

}  // namespace

std::vector<std::size_t> spread_instants(const BoardSightings& sightings, std::size_t most) {
  std::vector<std::vector<std::size_t>> views(sightings.instants.size());
  for (std::size_t s = 0; s < sightings.sightings.size(); ++s)
    views[sightings.sightings[s].instant].push_back(s);
  std::vector<double> apart(views.size(), 1);  // distance to the kept ones
  std::vector<std::size_t> kept;
  while (kept.size() < most) {
    const auto worth = [&](std::size_t i) { return apart[i] * static_cast<double>(views[i].size()); };
    std::size_t best = 0;
    for (std::size_t i = 1; i < views.size(); ++i)
      if (worth(i) > worth(best)) best = i;
    if (views.empty() || views[best].empty() || apart[best] < kLeastDifference) break;
    kept.push_back(best);
    for (std::size_t i = 0; i < views.size(); ++i)
      apart[i] = i == best ? 0 : std::min(apart[i], difference(sightings, views[i], views[best]));
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

Result<BoardReading> find_boards_in_session(const std::filesystem::path& folder, const BoardSearch& search,
                                            const FilmSearchOptions& options, const Progress& progress) {
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionReader reader, session::SessionReader::open(folder));
  if (reader.camera_count() == 0)
    return Error{ErrorKind::bad_input, "has no camera", folder.string(), "Record or import one with cameras"};
  BoardReading reading;
  reading.sightings.board = search.board;
  FilmCounts& counts = reading.film.emplace();
  std::vector<CameraFilm> films = plan_films(reader, options, counts, reading.sightings.instants);
  const Observer observer = [&](double fraction, std::string_view what) {
    tell(progress, fraction, what);
    return true;
  };
  EMBERLOCK_RETURN_IF_ERROR(in_parallel(films.size(), observer, [&](std::size_t c, const Observer& part) {
    return search_film(reader, c, search, options, part, films[c]);
  }));
  const std::vector<double> motions = motions_of(films, counts.looked);
  double slowest = INFINITY;
  std::size_t readable = 0;
  for (std::size_t c = 0; c < films.size(); ++c) {
    const v1::CameraStream& stream = reader.manifest().cameras(static_cast<int>(c));
    reading.sightings.cameras.push_back(
        {stream.camera_id(), {static_cast<int>(stream.width()), static_cast<int>(stream.height())}});
    readable += films[c].readable;
    for (BoardReading::Unused& unused : films[c].unreadable) reading.unused.push_back(std::move(unused));
    if (films[c].seen.empty() && films[c].mirrored)
      reading.unused.push_back(
          {folder / stream.camera_id() / ("frame " + std::to_string(*films[c].mirrored)), kMirroredBoard});
    for (CameraFilm::Look& look : films[c].seen) {
      if (motions[look.look] > options.stillness) continue;
      reading.sightings.sightings.push_back(
          {c, look.look,
           fmt::format("{}: frame {}", (folder / stream.camera_id()).string(), *films[c].frames[look.look]),
           std::move(look.corners)});
    }
  }
  if (readable == 0) {
    return Error{ErrorKind::bad_input,
                 reading.unused.empty() ? "has no complete frame"
                                        : "no frame can be read: " + reading.unused.front().why,
                 folder.string(), "Look at it with `emberlock sessions verify`"};
  }
  for (const double motion : motions) {
    if (motion < 0) continue;
    ++counts.seen;
    counts.moving += motion > options.stillness ? 1 : 0;
    slowest = std::min(slowest, motion);
  }
  EMBERLOCK_RETURN_IF_ERROR(nothing_found(folder, reading, options, slowest));
  const std::vector<std::size_t> kept = spread_instants(reading.sightings, options.instants);
  keep_instants(reading.sightings, kept);
  counts.taken = kept.size();
  return reading;
}

}  // namespace emberlock::recon
