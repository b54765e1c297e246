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
  strobe,   ///< by the smear of the strobe that all cameras filmed
  offsets,  ///< by given frame offsets, default 0: accurate to a frame at best
};

/// What to do about faulty films.
enum class Faults {
  refuse,   ///< import nothing
  partial,  ///< import the good parts and name the others
};

struct Part {
  Seconds from, to;
};

struct ImportOptions {
  std::filesystem::path folder;  ///< folder of the films; or a transforms.json, or a folder with one
  std::filesystem::path out;     ///< the session; must be missing or empty
  std::map<std::string, std::string> ids{};  ///< by name within the folder: the camera's id
  std::optional<Alignment> alignment{};      ///< default: by the numbers of pictures; required for videos
  smear::ClipOptions clip{};                 ///< the row time comes from the comb, else from `row_time`
  std::optional<SecondsPerRow> row_time{};
  std::filesystem::path comb{};  ///< a clip under comb_rate flashes per second
  Hertz comb_rate{};
  std::map<std::string, std::int64_t>
      offsets{};                 ///< by id: frame i + offset corresponds to frame i of the others
  std::optional<Part> strobe{};  ///< part of each film with the strobe; default: searched
  std::optional<Part> flame{};   ///< part of the first camera's film; default: the longest without the strobe
  FilmOptions films{};
  session::Colours colours = session::Colours::keep;
  session::Encoding encoding = session::Encoding::huffman_nut;
  Faults faults = Faults::refuse;
  std::filesystem::path rig{};  ///< rig.json with the cameras' calibration; optional
  std::uint64_t min_free_bytes = std::uint64_t{1} << 30;  ///< see WriterOptions
};

/// An imported camera.
struct ImportedCamera {
  std::string id;
  std::string name;  ///< its file or subfolder, relative to the folder
  std::vector<std::string> files;
  Hertz frame_rate{};
  std::int64_t frames = 0;             ///< length of the film
  std::vector<PlaceRange> strobe{};    ///< parts that show the strobe
  std::int64_t first = 0;              ///< index of the first imported frame
  std::int64_t frame_offset = 0;       ///< index of the first instant's frame, minus the reference's
  std::vector<std::int64_t> places{};  ///< frame index in the film, by instant
  bool calibrated = false;
  smear::ClipTimes times{};        ///< of the film, in seconds of the strobe's clock, or in frames
  std::optional<Image> preview{};  ///< the frame of the middle instant, reduced
  std::optional<smear::WholeFrames>
      whole{};  ///< which frames correspond to the reference's, and the evidence
  std::optional<smear::ClipClock>
      clock{};                    ///< the result of the strobe's readings. The next two are by instant:
  std::vector<double> late_s{};   ///< delay relative to the reference
  std::vector<double> sigma_s{};  ///< standard error of the delay
  std::optional<PartsPerMillion> drift{};  ///< frame rate divided by the reference's, minus one
};

struct ImportResult {
  v1::Manifest manifest;
  std::vector<ImportedCamera> cameras;
  std::size_t reference = 0;
  std::int64_t instants = 0;
  std::int64_t left_out = 0;                 ///< instants in the range that lack a frame of some camera
  std::optional<smear::ClipOptions> clip{};  ///< options with which the strobe was read
  std::vector<std::string> notes;            ///< hints for the operator, one sentence each
};

/// The reports on an import that are stored in the session.
struct ImportReports {
  std::string json;  ///< import.json
  std::string page;  ///< import.html
};
using ReportsOf = std::function<ImportReports(const ImportOptions&, const ImportResult&)>;

/// Creates a session from films. The originals are only read. An interrupted import continues when called
/// again with the same options. Errors: bad_input (the film, its fault and the remedy), io, refused
/// (cancelled by the observer).
Result<ImportResult> run_import(const ImportOptions& options, const Observer& observer,
                                const ReportsOf& reports);

}  // namespace emberlock::films
