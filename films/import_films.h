// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "films/import_strobe.h"
#include "session/media/clip.h"
#include "session/media/import_scan.h"

namespace emberlock::films {

/// How we know that several videos of a camera are one film without a gap.
enum class Continuity {
  proven,   ///< by the files' creation times, or because the camera filled each up to the card's limit
  as_told,  ///< because the operator says so
};

/// A camera's film: its files, joined, and the part that can be used.
struct Film {
  session::CameraFiles files;
  std::vector<session::ClipPart> parts;
  ImageSize size;
  Hertz frame_rate{};       ///< from the time stamps; for pictures, as given
  std::int64_t frames = 0;  ///< number of usable frames, from the first on
  std::optional<std::int64_t> created_ns{};
  std::vector<std::string> notes{};  ///< faults that don't prevent its use
};

/// A film that can't be used as it is, and the usable part of it.
struct FilmProblem {
  Error error;
  std::optional<Film> partly;  ///< the good part
};

struct FilmOptions {
  Continuity continuity = Continuity::proven;
  Hertz picture_rate{25};  ///< for pictures, which have no time stamps
};

struct ProbedFilm {
  std::optional<Film> film;
  std::optional<FilmProblem> problem;
};

/// Examines a camera's files by their packets. A problem: no video, files of different size or rate, a
/// variable frame rate, parts that may not be consecutive. A truncated file isn't a problem: the existing
/// part is used, with a note.
ProbedFilm probe_film(const session::CameraFiles& files, const FilmOptions& options);

/// Indices of the key frames in the whole film.
std::vector<std::int64_t> keys_of(const Film& film);

}  // namespace emberlock::films
