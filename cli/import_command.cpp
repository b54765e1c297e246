// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>

#include "cli/clip_arguments.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "films/import_run.h"
#include "report/import_report.h"

namespace emberlock::cli {
namespace {

struct ImportArguments {
  std::string folder;
  std::string out;
  std::vector<std::string> cameras;
  ClipArguments clip;
  bool unsynchronised = false;
  std::vector<std::string> offsets;
  std::string strobe;
  std::string flame;
  std::string rig;
  bool joined = false;
  bool partial = false;
  bool grey = false;
  std::string encoding = "quick";
  bool json = false;
};

Error not_understood(const std::string& option, const std::string& text, const std::string& remedy) {
  return {ErrorKind::bad_input, "'" + text + "' isn't understood", option, remedy};
}

/// "A=B".
Result<std::pair<std::string, std::string>> halves(const std::string& option, const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    return not_understood(option, text, "Write ID=VALUE");
  return std::pair(text.substr(0, equals), text.substr(equals + 1));
}

/// "FROM-TO" in seconds.
Result<std::optional<films::Part>> part_from(const std::string& option, const std::string& text) {
  if (text.empty()) return std::optional<films::Part>();
  double from = 0;
  double to = 0;
  char rest = 0;
  const bool read = std::sscanf(text.c_str(), "%lf-%lf%c", &from, &to, &rest) == 2;
  if (!read || !std::isfinite(from) || !std::isfinite(to) || from < 0 || to <= from)
    return not_understood(option, text, "Write FROM-TO in seconds, e.g. 2.5-14");
  return std::optional(films::Part{Seconds(from), Seconds(to)});
}

Result<films::ImportOptions> options_from(const ImportArguments& a) {
  films::ImportOptions options;
  options.folder = a.folder;
  options.out = a.out;
  for (const std::string& text : a.cameras) {
    EMBERLOCK_ASSIGN_OR_RETURN(const auto pair, halves("--camera", text));
    options.ids[pair.second] = pair.first;
  }
  for (const std::string& text : a.offsets) {
    EMBERLOCK_ASSIGN_OR_RETURN(const auto pair, halves("--offset", text));
    char* end = nullptr;
    options.offsets[pair.first] = std::strtoll(pair.second.c_str(), &end, 10);
    if (*end != '\0') return not_understood("--offset", text, "Write ID=FRAMES");
  }
  if (a.unsynchronised || !a.offsets.empty()) options.alignment = films::Alignment::offsets;
  if (a.clip.flash_rate > 0) options.alignment = films::Alignment::strobe;
  options.clip = clip_options_of(a.clip);
  if (a.clip.frame_rate > 0) options.films.picture_rate = Hertz(a.clip.frame_rate);
  options.comb = a.clip.comb;
  options.comb_rate = Hertz(a.clip.comb_rate);
  options.row_time = row_time_of(a.clip);
  EMBERLOCK_ASSIGN_OR_RETURN(options.strobe, part_from("--strobe", a.strobe));
  EMBERLOCK_ASSIGN_OR_RETURN(options.flame, part_from("--flame", a.flame));
  options.rig = a.rig;
  options.films.continuity = a.joined ? films::Continuity::as_told : films::Continuity::proven;
  options.faults = a.partial ? films::Faults::partial : films::Faults::refuse;
  options.colours = a.grey ? session::Colours::brightness : session::Colours::keep;
  options.encoding = a.encoding == "ffv1" ? session::Encoding::ffv1 : session::Encoding::huffman_nut;
  return options;
}

void print_table(const ImportArguments& arguments, const films::ImportResult& result) {
  std::printf("%s: %lld instants of %zu cameras\n", arguments.out.c_str(),
              static_cast<long long>(result.instants), result.cameras.size());
  for (const films::ImportedCamera& c : result.cameras) {
    std::printf("  %-20s", c.id.c_str());
    if (c.clock) {
      std::printf(" frame %+6lld  %+9.4f ms +- %.4f at first, %+9.4f +- %.4f at last  %+7.2f ppm",
                  static_cast<long long>(c.frame_offset), 1e3 * c.late_s.front(), 1e3 * c.sigma_s.front(),
                  1e3 * c.late_s.back(), 1e3 * c.sigma_s.back(), c.drift->value());
    } else if (result.instants > 1) {
      std::printf(" frame %+6lld", static_cast<long long>(c.frame_offset));
    }
    std::printf("\n");
  }
}

void import(const ImportArguments& arguments) {
  const films::ImportOptions options = or_fail(options_from(arguments));
  const Progress bar = progress_bar("import");
  const Interrupt interrupt;
  const auto observer = [&](double fraction, std::string_view what) {
    tell(bar, fraction, what);
    return !Interrupt::asked();
  };
  const films::ImportResult result = or_fail(films::run_import(options, observer, report::reports_of));
  for (const std::string& note : result.notes) std::fprintf(stderr, "emberlock: %s\n", note.c_str());
  std::fprintf(stderr, "emberlock: the report is %s\n", (options.out / "import.html").c_str());
  if (arguments.json) {
    std::printf("%s", report::import_json(options, result).c_str());
  } else {
    print_table(arguments, result);
  }
}

}  // namespace

void add_import(const Verb& app) {
  auto a = std::make_shared<ImportArguments>();
  const Verb verb = app.add_verb(
      "import",
      "Makes a session of the cameras' video files, folders of numbered pictures, or a transforms.json. "
      "Frames are matched by the strobe that all films show; times.json has each frame's true time.");
  verb.add_option("folder", a->folder,
                  "a video file or a subfolder for each camera, whose id is the file's or subfolder's name")
      .require();
  verb.add_option("--out", a->out, "the session's folder, which must not exist or be empty").require();
  verb.add_option("--camera", a->cameras,
                  "ID=NAME: another id for the file or subfolder NAME; may be repeated");
  const Option flash_rate = add_clip_options(verb, a->clip);
  const Option unsynchronised = verb.add_flag("--unsynchronised", a->unsynchronised,
                                              "without a strobe: the films' first frames belong together");
  verb.add_option(
      "--offset", a->offsets,
      "ID=N, without a strobe: frame i + N of this camera belongs to frame i of the others; may be "
      "repeated");
  flash_rate.exclude(unsynchronised).exclude(verb.find_option("--offset"));
  verb.add_option("--strobe", a->strobe, "FROM-TO, seconds of each film that show the strobe [found]");
  verb.add_option("--flame", a->flame,
                  "FROM-TO, seconds of the first camera's film to import [the longest part in which no film "
                  "shows the strobe]");
  verb.add_option("--rig", a->rig, "rig.json: calibration of the cameras, by their ids");
  verb.add_flag("--joined", a->joined, "the files of a camera are one film, even if nothing in them says so");
  verb.add_flag(
      "--partial", a->partial,
      "import what is good: leave out films that can't be used, end where one is damaged, and report each");
  verb.add_flag("--grey", a->grey, "store brightness only");
  verb.add_option("--encoding", a->encoding,
                  "ffv1: as in recordings; quick: six times as fast, files a sixth larger")
      .check_choices({"quick", "ffv1"})
      .show_default();
  verb.add_flag("--json", a->json, "the session's import.json on stdout");
  verb.set_action([a] { import(*a); });
}

}  // namespace emberlock::cli
