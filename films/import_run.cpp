// SPDX-License-Identifier: Apache-2.0
#include "films/import_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include <fmt/chrono.h>
#include <fmt/format.h>
#include <sys/stat.h>

#include "base/in_parallel.h"
#include "films/import_clock.h"
#include "films/import_parts.h"
#include "films/import_transforms.h"
#include "films/small_picture.h"
#include "recon/calibrate/rig.h"
#include "session/layout.h"
#include "session/rig_file.h"

namespace emberlock::films {
namespace fs = std::filesystem;
namespace {

constexpr double kProbed = 0.03;  // share of the import's progress
constexpr double kAnalysed = 0.15;
constexpr int kMostPlans = 65;  // each after the first was cut short by another damaged film

/// Joins several errors; the first comes first.
Error together(const std::vector<Error>& errors) {
  Error all = errors.front();
  for (std::size_t i = 1; i < errors.size(); ++i) all.remedy += "; and " + errors[i].message();
  return all;
}

class Import {
 public:
  Import(const ImportOptions& options, const Observer& observer, const ReportsOf& reports)
      : options_(options), observer_(observer), reports_(reports) {}

  Result<ImportResult> run() {
    EMBERLOCK_ASSIGN_OR_RETURN(const ImportFolder target, ImportFolder::open(options_.out, inputs()));
    EMBERLOCK_RETURN_IF_ERROR(probe());
    EMBERLOCK_RETURN_IF_ERROR(read_calibration());
    EMBERLOCK_RETURN_IF_ERROR(choose_alignment());
    EMBERLOCK_RETURN_IF_ERROR(put_on_one_clock());
    for (int round = 0; round < kMostPlans; ++round) {
      EMBERLOCK_ASSIGN_OR_RETURN(const FramePlan plan, make_plan());
      EMBERLOCK_ASSIGN_OR_RETURN(std::vector<CameraPart> parts, make_parts(plan));
      v1::Manifest manifest;
      EMBERLOCK_RETURN_IF_ERROR(calibrate(manifest, parts));
      const Status written = write(target, parts);
      if (!written.ok() && round + 1 < kMostPlans && cut_at_damage(written.error())) continue;
      if (!written.ok()) return written.error();
      return conclude(target, plan, std::move(manifest), parts);
    }
    return Error{ErrorKind::bad_input, "too many films are damaged", options_.folder.string(), ""};
  }

 private:
  Status choose_alignment() {
    const bool pictures = std::all_of(films_.begin(), films_.end(), [](const Candidate& c) {
      return c.film.files.kind == session::CameraFiles::Kind::pictures;
    });
    if (!options_.alignment && !pictures) {
      return Error{ErrorKind::bad_input, "how frames of different films belong together isn't known",
                   options_.folder.string(),
                   "Give the strobe's --flash-rate and --comb (or --row-time-us); or, where no strobe was "
                   "filmed, --offset or --unsynchronised"};
    }
    alignment_ = options_.alignment.value_or(Alignment::offsets);
    if (alignment_ == Alignment::offsets) return {};
    if (!options_.row_time && options_.comb.empty()) {
      return Error{
          ErrorKind::bad_input, "the time that the sensor takes to shift a row isn't known", "import",
          "film the strobe at about 300 flashes a second and add --comb CLIP --comb-rate HZ, or give "
          "--row-time-us"};
    }
    return {};
  }

  /// The files that are read; they must not lie in the session.
  std::vector<fs::path> inputs() const {
    std::vector<fs::path> read{options_.folder};
    for (const fs::path& file : {options_.comb, options_.rig})
      if (!file.empty()) read.push_back(file);
    return read;
  }

  Observer stage(double from, double to) const { return part_of(observer_, from, to); }

  /// With `partial` a fault becomes a note, otherwise it is kept for the error.
  bool forgive(const Error& error, std::vector<Error>& errors, const std::string& consequence) {
    if (options_.faults == Faults::partial && error.kind == ErrorKind::bad_input) {
      notes_.push_back(consequence + ": " + error.where + ": " + error.what +
                       (error.remedy.empty() ? "" : ". " + error.remedy));
      return true;
    }
    errors.push_back(error);
    return false;
  }

  Status probe() {
    session::FolderScanOptions with{options_.ids, {}};
    if (!options_.comb.empty()) with.without.push_back(options_.comb);
    EMBERLOCK_ASSIGN_OR_RETURN(const session::FolderScan scan, session::scan_folder(options_.folder, with));
    if (!scan.passed_over.empty())
      notes_.push_back(fmt::format("{} files are no films by their names and were passed over, {} among them",
                                   scan.passed_over.size(), scan.passed_over.front()));
    std::vector<ProbedFilm> probed(scan.cameras.size());
    EMBERLOCK_RETURN_IF_ERROR(
        in_parallel(probed.size(), stage(0, kProbed), [&](std::size_t i, const Observer& observer) -> Status {
          probed[i] = probe_film(scan.cameras[i], options_.films);
          return observe(observer, 1, scan.cameras[i].id);
        }));
    std::vector<Error> errors;
    for (std::size_t i = 0; i < probed.size(); ++i) {
      ProbedFilm& p = probed[i];
      const std::string& id = scan.cameras[i].id;
      if (p.film) films_.push_back({std::move(*p.film)});
      if (!p.problem) continue;
      const bool some = p.problem->partly.has_value();
      if (forgive(p.problem->error, errors, id + (some ? " is used in part" : " is left out")) && some)
        films_.push_back({std::move(*p.problem->partly)});
    }
    if (!errors.empty()) return together(errors);
    for (const Candidate& c : films_)
      for (const std::string& note : c.film.notes) notes_.push_back(c.film.files.id + ": " + note);
    if (films_.empty())
      return Error{ErrorKind::bad_input, "no film in it can be used", options_.folder.string(),
                   "See the notes on each"};
    return {};
  }

  Status put_on_one_clock() {
    if (alignment_ == Alignment::offsets) return by_offsets();
    EMBERLOCK_ASSIGN_OR_RETURN(clip_, clip_options(options_));
    const auto analyse = [&](std::size_t i, const Observer& observer) -> Status {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, 0, "strobe of " + films_[i].film.files.id));
      EMBERLOCK_ASSIGN_OR_RETURN(films_[i].strobe, look_for_strobe(films_[i].film, options_));
      EMBERLOCK_ASSIGN_OR_RETURN(films_[i].sound, sound_of(films_[i].film));
      return observe(observer, 1, "strobe of " + films_[i].film.files.id);
    };
    EMBERLOCK_RETURN_IF_ERROR(in_parallel(films_.size(), stage(kProbed, kAnalysed), analyse));
    std::vector<Error> errors;
    std::vector<Candidate> good;
    for (Candidate& c : films_) {
      const Status read = read_clock(c, clip_);
      if (!read.ok()) {
        forgive(read.error(), errors, c.film.files.id + " is left out");
        continue;
      }
      for (const smear::DroppedFrames& drop : c.times->drops)
        notes_.push_back(fmt::format("{} {} {} frames between {} and {}", c.film.files.id,
                                     drop.frames > 0 ? "lost" : "doubled", std::abs(drop.frames), drop.after,
                                     drop.before));
      good.push_back(std::move(c));
    }
    if (!errors.empty()) return together(errors);
    films_ = std::move(good);
    if (films_.empty())
      return Error{ErrorKind::bad_input, "no film shows a strobe that tells its times",
                   options_.folder.string(), "Film the strobe with all cameras; or add --unsynchronised"};
    return match_all_films();
  }

  Status match_all_films() {
    const std::vector<Status> matched = match_films(films_, clip_);
    std::vector<Error> errors;
    std::vector<Candidate> good;
    for (std::size_t i = 0; i < films_.size(); ++i) {
      if (matched[i].ok()) {
        good.push_back(std::move(films_[i]));
      } else {
        forgive(matched[i].error(), errors, films_[i].film.files.id + " is left out");
      }
    }
    if (!errors.empty()) return together(errors);
    films_ = std::move(good);
    return {};
  }

  Status by_offsets() {
    EMBERLOCK_RETURN_IF_ERROR(pair_by_offsets(films_, options_));
    const bool videos = std::any_of(films_.begin(), films_.end(), [](const Candidate& c) {
      return c.film.files.kind == session::CameraFiles::Kind::video;
    });
    if (videos && films_.size() > 1)
      notes_.emplace_back(
          "NOT SYNCHRONISED: frames are paired as told, not as the strobe proves; nothing says when each was "
          "taken, and there is no times.json");
    return {};
  }

  Result<FramePlan> make_plan() const {
    std::vector<TimedFilm> timed;
    for (const Candidate& c : films_) {
      timed.push_back({c.film.files.id, c.film.parts.front().path.string(), *c.times, c.film.frames,
                       c.strobe ? c.strobe->lit : std::vector<PlaceRange>()});
    }
    PlanOptions with;
    if (options_.flame) with.flame = places_of(*options_.flame, films_.front().film);
    return plan_frames(timed, 0, with);
  }

  Result<std::vector<CameraPart>> make_parts(const FramePlan& plan) const {
    std::vector<CameraPart> parts;
    const Film& reference = films_.front().film;
    const smear::ClipTimes& clock = *films_.front().times;
    const Seconds origin = clock.read_start(plan.cameras.front().places.front());
    for (std::size_t c = 0; c < films_.size(); ++c) {
      const Film& film = films_[c].film;
      const FramePlan::Camera& frames = plan.cameras[c];
      CameraPart part;
      part.files = film.parts;
      part.colours = options_.colours;
      part.places = frames.places;
      session::ClipReader reader(film.parts, options_.colours);
      EMBERLOCK_RETURN_IF_ERROR(reader.seek(part.places.front()));
      EMBERLOCK_ASSIGN_OR_RETURN(const Image first, reader.next());
      part.stream.set_camera_id(film.files.id);
      part.stream.set_frame_rate_hz(film.frame_rate.value());
      session::set_layout(part.stream, first.layout());
      part.writer.encoding =
          bytes_per_sample(first.layout().format) > 1 ? session::Encoding::ffv1 : options_.encoding;
      part.writer.min_free_bytes = options_.min_free_bytes;
      for (std::size_t i = 0; i < frames.places.size(); ++i) {
        const auto id = static_cast<std::uint64_t>(plan.instants[i] - plan.instants.front());
        const TimePoint instant = TimePoint{} + (clock.read_start(plan.cameras.front().places[i]) - origin);
        const Seconds into_film =
            period(reference.frame_rate) * static_cast<double>(plan.cameras.front().places[i]);
        const TimePoint wall = TimePoint{reference.created_ns.value_or(0)} + into_film;
        part.stamps.push_back(
            {id, instant + Seconds(frames.late_s[i]), wall, instant, FrameStatus::complete});
      }
      parts.push_back(std::move(part));
    }
    return parts;
  }

  /// Reads the rig file first, so that its faults are reported before the films are searched.
  Status read_calibration() {
    if (options_.rig.empty()) return {};
    EMBERLOCK_ASSIGN_OR_RETURN(rig_, session::read_rig(options_.rig));
    v1::Manifest manifest;
    for (const Candidate& c : films_) {
      v1::CameraStream& stream = *manifest.add_cameras();
      stream.set_camera_id(c.film.files.id);
      stream.set_width(static_cast<std::uint32_t>(c.film.size.width));
      stream.set_height(static_cast<std::uint32_t>(c.film.size.height));
    }
    return recon::apply_rig(manifest, *rig_, options_.rig.string());
  }

  /// Copies the rig's calibration to the cameras, and its box to the manifest.
  Status calibrate(v1::Manifest& manifest, std::vector<CameraPart>& parts) const {
    if (!rig_) return {};
    for (const CameraPart& part : parts) *manifest.add_cameras() = part.stream;
    EMBERLOCK_RETURN_IF_ERROR(recon::apply_rig(manifest, *rig_, options_.rig.string()));
    for (std::size_t c = 0; c < parts.size(); ++c) parts[c].stream = manifest.cameras(static_cast<int>(c));
    return {};
  }

  Status write(const ImportFolder& target, const std::vector<CameraPart>& parts) {
    damaged_.assign(parts.size(), std::nullopt);
    return in_parallel(parts.size(), stage(kAnalysed, kNearlyDone),
                       [&](std::size_t i, const Observer& observer) -> Status {
                         return target.write(parts[i], observer, damaged_[i]);
                       });
  }

  /// With `partial`, a film is cut where it proved to be damaged.
  bool cut_at_damage(const Error& error) {
    if (options_.faults == Faults::refuse) return false;
    for (std::size_t c = 0; c < films_.size(); ++c) {
      if (!damaged_[c]) continue;
      films_[c].film.frames = *damaged_[c];
      notes_.push_back(fmt::format("{} ends at its frame {}: {}: {}", films_[c].film.files.id, *damaged_[c],
                                   error.where, error.what));
      return true;
    }
    return false;
  }

  Result<ImportResult> conclude(const ImportFolder& target, const FramePlan& plan, v1::Manifest manifest,
                                const std::vector<CameraPart>& parts) {
    ImportResult result;
    result.reference = plan.reference;
    result.instants = static_cast<std::int64_t>(plan.instants.size());
    result.left_out = plan.left_out;
    if (plan.left_out > 0)
      notes_.push_back(
          fmt::format("{} instants are left out: not all films have a frame of theirs", plan.left_out));
    if (plan.repeated > 0)
      notes_.push_back(
          fmt::format("{} frames stand for two instants: the cameras' rates differ", plan.repeated));
    v1::ShutterTimes times;
    for (std::size_t c = 0; c < films_.size(); ++c) {
      result.cameras.push_back(describe(plan, parts, c));
      const FramePlan::Camera& camera = plan.cameras[c];
      v1::ShutterTimes::Camera& entry = *times.add_cameras();
      entry.set_camera_id(films_[c].film.files.id);
      for (const double late : camera.late_s) entry.add_late_s(late);
      entry.set_sigma_s(*std::max_element(camera.sigma_s.begin(), camera.sigma_s.end()));
    }
    result.notes = notes_;
    const bool timed = alignment_ == Alignment::strobe;
    if (timed) result.clip = clip_;
    manifest.set_session_id(fs::absolute(options_.out).lexically_normal().filename().string());
    manifest.set_purpose("flame");
    manifest.set_created_utc(created(films_.front().film));
    EMBERLOCK_ASSIGN_OR_RETURN(
        result.manifest,
        target.finish(std::move(manifest), parts, timed ? &times : nullptr, reports_(options_, result)));
    EMBERLOCK_RETURN_IF_ERROR(observe(observer_, 1, "imported"));
    return result;
  }

  static std::string created(const Film& film) {
    std::int64_t seconds = film.created_ns.value_or(0) / 1'000'000'000;
    struct stat info {};
    if (!film.created_ns && ::stat(film.parts.front().path.c_str(), &info) == 0)
      seconds = info.st_mtim.tv_sec;
    return fmt::format("{:%Y-%m-%dT%H:%M:%SZ}", fmt::gmtime(static_cast<std::time_t>(seconds)));
  }

  /// A frame to recognise the camera by; nullopt if it can't be decoded.
  static std::optional<Image> preview_of(const CameraPart& part, std::int64_t place) {
    session::ClipReader reader(part.files, part.colours);
    if (!reader.seek(place).ok()) return std::nullopt;
    const Result<Image> image = reader.next();
    return image.ok() ? std::optional(small_picture(*image)) : std::nullopt;
  }

  ImportedCamera describe(const FramePlan& plan, const std::vector<CameraPart>& parts, std::size_t c) const {
    const Candidate& from = films_[c];
    const FramePlan::Camera& frames = plan.cameras[c];
    ImportedCamera camera;
    camera.id = from.film.files.id;
    camera.name = from.film.files.name;
    for (const session::ClipPart& part : from.film.parts) camera.files.push_back(part.path.string());
    camera.frame_rate = from.film.frame_rate;
    camera.frames = from.film.frames;
    camera.first = frames.places.front();
    camera.frame_offset = frames.places.front() - plan.cameras[plan.reference].places.front();
    camera.calibrated = parts[c].stream.has_calibration();
    camera.places = frames.places;
    camera.times = *from.times;
    camera.preview = preview_of(parts[c], camera.places[camera.places.size() / 2]);
    if (!from.strobe) return camera;
    camera.strobe = from.strobe->lit;
    camera.clock = from.clock;
    camera.whole = from.whole;
    camera.late_s = frames.late_s;
    camera.sigma_s = frames.sigma_s;
    camera.drift = PartsPerMillion(1e6 * (films_[plan.reference].times->period / from.times->period - 1));
    return camera;
  }

  const ImportOptions& options_;
  const Observer& observer_;
  const ReportsOf& reports_;
  Alignment alignment_ = Alignment::strobe;
  std::optional<v1::Rig> rig_;
  smear::ClipOptions clip_;  // with the measured row time
  std::vector<Candidate> films_;
  std::vector<std::optional<std::int64_t>> damaged_;  // by film: the damaged frame found while writing
  std::vector<std::string> notes_;
};

}  // namespace

Result<ImportResult> run_import(const ImportOptions& options, const Observer& observer,
                                const ReportsOf& reports) {
  if (const auto transforms = transforms_in(options.folder))
    return import_transforms(*transforms, options, observer, reports);
  return Import(options, observer, reports).run();
}

}  // namespace emberlock::films
