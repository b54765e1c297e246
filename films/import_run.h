// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "base/image.h"
#include "base/progress.h"
#include "base/quantity.h"
#include "base/result.h"
#include "emberlock/v1/session.pb.h"
#include "films/import_films.h"
#include "films/import_plan.h"
#include "session/media/frame_file.h"
#include "session/writer.h"
#include "smear_sync/verify/clip_clock.h"
#include "smear_sync/verify/clip_times.h"
#include "smear_sync/verify/whole_frames.h"

namespace emberlock::films {

/// How films are put on one clock.
enum class Alignment {
  strobe,   ///< by the smear of the strobe that all filmed
  offsets,  ///< by frame offsets as told, 0 where none is: to the frame, if at all
};

/// What is done about films that are not as they should be.
enum class Faults {
  refuse,   ///< nothing is imported
  partial,  ///< what is good is imported, and what isn't is named
};

struct Part {
  Seconds from, to;
};

struct ImportOptions {
  std::filesystem::path folder;  ///< of the films, or a transforms.json, or a folder that holds one
  std::filesystem::path out;     ///< the session; must not exist, or be empty
  std::map<std::string, std::string> ids{};  ///< by name within the folder: the camera's id
  std::optional<Alignment> alignment{};      ///< absent: by the numbers of pictures; videos must be told how
  smear::ClipOptions clip{};                 ///< its row time is that of the comb, else `row_time`
  std::optional<SecondsPerRow> row_time{};
  std::filesystem::path comb{};  ///< a clip under comb_rate flashes a second
  Hertz comb_rate{};
  std::map<std::string, std::int64_t> offsets{};  ///< by id: frame i + offset belongs to frame i of others
  std::optional<Part> strobe{};                   ///< of each film, where the strobe is; else it is found
  std::optional<Part> flame{};  ///< of the first camera's film; else the longest without the strobe
  FilmOptions films{};
  session::Colours colours = session::Colours::keep;
  session::Encoding encoding = session::Encoding::huffman_nut;
  Faults faults = Faults::refuse;
  std::filesystem::path rig{};  ///< rig.json, whose calibration the cameras get; or none
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30;  ///< as WriterOptions
};

/// A camera as it was imported.
struct ImportedCamera {
  std::string id;
  std::string name;  ///< its file or subfolder, within the folder
  std::vector<std::string> files;
  Hertz frame_rate{};
  std::int64_t frames = 0;             ///< of the film
  std::vector<PlaceRange> strobe{};    ///< parts that show it
  std::int64_t first = 0;              ///< place of the first imported frame
  std::int64_t frame_offset = 0;       ///< its place less the reference's, of the first instant
  std::vector<std::int64_t> places{};  ///< of the film, by instant
  bool calibrated = false;
  smear::ClipTimes times{};                   ///< of the film: seconds of the strobe, or frames as told
  std::optional<Image> preview{};             ///< the middle instant's frame, small
  std::optional<smear::WholeFrames> whole{};  ///< which frames belong to the reference's, and who told it
  std::optional<smear::ClipClock> clock{};    ///< what the strobe told; then, by instant:
  std::vector<double> late_s{};               ///< later than the reference
  std::vector<double> sigma_s{};              ///< its standard error
  std::optional<PartsPerMillion> drift{};     ///< its frame rate over the reference's, less one
};

struct ImportResult {
  v1::Manifest manifest;
  std::vector<ImportedCamera> cameras;
  std::size_t reference = 0;
  std::int64_t instants = 0;
  std::int64_t left_out = 0;                 ///< instants within that lack a frame of some camera
  std::optional<smear::ClipOptions> clip{};  ///< with which the strobe was read
  std::vector<std::string> notes;            ///< what an operator should know, a sentence each
};

/// What tells people and programs of an import; it lies in the session.
struct ImportReports {
  std::string json;  ///< import.json
  std::string page;  ///< import.html
};
using ReportsOf = std::function<ImportReports(const ImportOptions&, const ImportResult&)>;

/// Makes a session of films. The originals are only read. Whoever is ended goes on when called again with the
/// same options. Errors: bad_input (what is wrong with which film, and the remedy), io, refused (ended by the
/// observer).
Result<ImportResult> run_import(const ImportOptions& options, const Observer& observer,
                                const ReportsOf& reports);

}  // namespace emberlock::films
