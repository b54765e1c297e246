// SPDX-License-Identifier: Apache-2.0
#include "films/import_films.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <numeric>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace emberlock::films {
namespace fs = std::filesystem;
namespace {

constexpr std::int64_t kBeforeACut = 16;  // frames: after a cut, H.264 may lack reference frames
constexpr double kSameRate = 1e-3;
constexpr double kSecondsRounded = 1.5;              // creation times are whole seconds
constexpr std::uintmax_t kFilledUp = 1'900'000'000;  // bytes: cameras split files at 2 or 4 GB

Error film_error(const std::string& what, const fs::path& file, const std::string& remedy) {
  return {ErrorKind::bad_input, what, file.string(), remedy};
}

/// Whether the files' own names or times show that `next` doesn't follow `before`.
std::optional<std::string> contradiction(const session::ClipPart& before, const session::ClipPart& next) {
  const std::string name = before.path.filename().string();
  const auto a = session::gopro_chapter(before.path);
  const auto b = session::gopro_chapter(next.path);
  if (a && b && a->recording != b->recording)
    return fmt::format("is of recording {}, {} is of recording {}", b->recording, name, a->recording);
  const auto number = [](const std::string& chapter) { return std::atoi(chapter.c_str()); };
  if (a && b && number(b->chapter) > number(a->chapter) + 1)
    return fmt::format("is chapter {} of its recording, and follows {}: a chapter between them is missing",
                       b->chapter, name);
  if (before.scan.created_ns && next.scan.created_ns && *next.scan.created_ns < *before.scan.created_ns)
    return fmt::format("was begun before {}, by their creation times", name);
  return {};
}

/// Whether `next` begins where `before` ends.
bool follows(const session::ClipPart& before, const session::ClipPart& next) {
  std::error_code ec;
  if (before.scan.created_ns && next.scan.created_ns) {
    const double lasted =
        static_cast<double>(before.scan.frames()) / before.scan.frame_rate.value_or(Hertz(24)).value();
    const double apart = 1e-9 * static_cast<double>(*next.scan.created_ns - *before.scan.created_ns);
    // Some cameras give all files of a film the creation time of the first.
    if (apart != 0) return std::abs(apart - lasted) <= kSecondsRounded;
  }
  return fs::file_size(before.path, ec) >= kFilledUp;
}

std::optional<Error> joined_wrongly(const session::ClipPart& before, const session::ClipPart& next,
                                    const FilmOptions& options) {
  if (before.scan.size != next.scan.size) {
    return film_error(fmt::format("is {} x {} pixels, {} of the same camera is {} x {}", next.scan.size.width,
                                  next.scan.size.height, before.path.filename().string(),
                                  before.scan.size.width, before.scan.size.height),
                      next.path, "Leave one of them out, or give each a folder of its own");
  }
  if (!before.scan.frame_rate || !next.scan.frame_rate) return {};
  if (std::abs(*before.scan.frame_rate / *next.scan.frame_rate - 1) > kSameRate) {
    return film_error(fmt::format("has {:.3f} frames a second, {} of the same camera has {:.3f}",
                                  next.scan.frame_rate->value(), before.path.filename().string(),
                                  before.scan.frame_rate->value()),
                      next.path, "Leave one of them out");
  }
  if (const auto reason = contradiction(before, next)) {
    return film_error(*reason, next.path,
                      "Leave out what belongs to another recording, or give each a folder of its own");
  }
  if (options.continuity == Continuity::as_told || follows(before, next)) return {};
  return film_error(fmt::format("may not go on where {} ends: nothing in the files says so",
                                before.path.filename().string()),
                    next.path, "Where the camera split one film, add --joined; else leave one of them out");
}

/// Appends a file to the film; false if the film ends there.
bool append(Film& film, session::ClipPart part, std::optional<Error>& problem) {
  part.first = film.parts.empty() ? 0 : film.parts.back().first + film.parts.back().scan.frames();
  const std::int64_t before = part.first;
  const session::VideoScan& scan = part.scan;
  film.frames = before + scan.frames();
  bool goes_on = true;
  const std::int64_t before_cut = std::max<std::int64_t>(0, scan.frames() - kBeforeACut);
  if (scan.irregular && !(scan.truncated() && *scan.irregular >= before_cut)) {
    problem = film_error("its frame rate varies: " + scan.irregularity, part.path,
                         "Set the camera to a constant frame rate. --partial uses what comes before");
    film.frames = before + *scan.irregular;
    goes_on = false;
  } else if (scan.truncated()) {
    film.frames = before + before_cut;
    film.notes.push_back(fmt::format("{} is truncated: {} of {} frames are there, {} are used",
                                     part.path.filename().string(), scan.frames(), scan.promised,
                                     film.frames - before));
    goes_on = false;
  }
  film.parts.push_back(std::move(part));
  return goes_on;
}

/// Notes what the file states on its display, once for a film of many files.
void note_unapplied(Film& film, const session::ClipPart& part) {
  for (const std::string& field : part.scan.unapplied) {
    const std::string note = field + ": frames stay as they are stored";
    if (std::find(film.notes.begin(), film.notes.end(), note) == film.notes.end()) film.notes.push_back(note);
  }
}

/// Notes the rate at which frames without time stamps are taken.
void note_untimed(Film& film, const FilmOptions& options) {
  film.notes.push_back(fmt::format("{} holds {} pictures without time stamps: taken at {:g} a second",
                                   film.parts.front().path.filename().string(),
                                   film.parts.front().scan.frames(), options.picture_rate.value()));
}

ProbedFilm of_pictures(const session::CameraFiles& files, const FilmOptions& options) {
  Film film{files, {}, {}, options.picture_rate, 0, {}, {}};
  const auto first = session::scan_video(files.files.front());
  if (!first.ok()) return {{}, FilmProblem{first.error(), {}}};
  film.size = first->size;
  const bool stacks = first->frames() > 1;
  for (const fs::path& file : files.files) {
    // Single pictures are decoded when they are written.
    const bool scan_it = stacks && file != files.files.front();
    Result<session::VideoScan> scan = scan_it ? session::scan_video(file) : first;
    if (!scan.ok()) return {{}, FilmProblem{scan.error(), {}}};
    if (scan->unapplied != first->unapplied) return {{}, FilmProblem{session::orientation_changed(file), {}}};
    film.parts.push_back({file, std::move(scan).value(), film.frames});
    film.frames += film.parts.back().scan.frames();
  }
  if (stacks) {
    film.files.numbers.resize(static_cast<std::size_t>(film.frames));
    std::iota(film.files.numbers.begin(), film.files.numbers.end(), 0);
    note_untimed(film, options);
  }
  note_unapplied(film, film.parts.front());
  return {film, {}};
}

}  // namespace

ProbedFilm probe_film(const session::CameraFiles& files, const FilmOptions& options) {
  if (files.kind == session::CameraFiles::Kind::pictures) return of_pictures(files, options);
  Film film{files, {}, {}, {}, 0, {}, {}};
  std::optional<Error> problem;
  for (const fs::path& file : files.files) {
    Result<session::VideoScan> scan = session::scan_video(file);
    if (!scan.ok()) {
      problem = scan.error();
      break;
    }
    session::ClipPart part{file, std::move(scan).value(), 0};
    if (!film.parts.empty()) problem = joined_wrongly(film.parts.back(), part, options);
    if (problem || !append(film, std::move(part), problem)) break;
  }
  if (film.parts.size() < files.files.size() && !film.parts.empty() && !problem)
    film.notes.push_back(
        fmt::format("its files after {} are not used", film.parts.back().path.filename().string()));
  if (!film.parts.empty()) {
    const session::VideoScan& first = film.parts.front().scan;
    film.size = first.size;
    film.frame_rate = first.frame_rate.value_or(options.picture_rate);
    film.created_ns = first.created_ns;
    if (first.tick.value() == 0) note_untimed(film, options);
    for (const session::ClipPart& part : film.parts) note_unapplied(film, part);
  }
  if (!problem) return {std::move(film), {}};
  const bool some = film.frames > 1;
  return {{}, FilmProblem{*problem, some ? std::optional(std::move(film)) : std::nullopt}};
}

std::vector<std::int64_t> keys_of(const Film& film) {
  std::vector<std::int64_t> keys;
  for (const session::ClipPart& part : film.parts) {
    for (const std::int64_t key : part.scan.keys) {
      if (part.first + key < film.frames) keys.push_back(part.first + key);
    }
  }
  return keys;
}

}  // namespace emberlock::films
