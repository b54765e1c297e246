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

/// Whether several videos of a camera are one film without a gap.
enum class Joins {
  proven,   ///< by the files' times of creation, or as the camera fills them up to a card's limit
  as_told,  ///< because the operator says so
};

/// A camera's film: its files, joined, and how far it can be used.
struct Film {
  session::CameraFiles files;
  std::vector<session::ClipPart> parts;
  ImageSize size;
  Hertz frame_rate{};       ///< by the time stamps; of pictures as told
  std::int64_t frames = 0;  ///< usable, from the first on
  std::optional<std::int64_t> created_ns{};
  std::vector<std::string> notes{};  ///< what is wrong with it and can be lived with
};

/// A film that can't be used as it is, and how much of it could.
struct FilmProblem {
  Error error;
  std::optional<Film> partly;  ///< what is good of it
};

struct FilmOptions {
  Joins joins = Joins::proven;
  Hertz picture_rate{25};  ///< of pictures, which have no time
};

struct ProbedFilm {
  std::optional<Film> film;
  std::optional<FilmProblem> problem;
};

/// What a camera's files hold, told from their packets. A problem: no video, files of different size or rate,
/// a variable frame rate, parts that may not follow one another. A truncated file is no problem: what is
/// there is used, and noted.
ProbedFilm probe_film(const session::CameraFiles& files, const FilmOptions& options);

/// Places at which decoding may begin, of the whole film.
std::vector<std::int64_t> keys_of(const Film& film);

}  // namespace emberlock::films
