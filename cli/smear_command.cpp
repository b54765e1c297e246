// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "session/media/frame_file.h"
#include "smear_sync/detect/detect.h"

namespace emberlock::cli {
namespace {

struct SmearArguments {
  std::vector<std::string> files;
  bool json = false;
};

/// JSON has no NaN and infinity; rounding to a millionth keeps lines readable.
double rounded(double v) { return std::isfinite(v) ? std::round(v * 1e6) / 1e6 : 0; }

std::string reading_line(const std::string& file, int frame, const smear::SmearReading& reading) {
  nlohmann::ordered_json line;
  line["file"] = file;
  line["frame"] = frame;
  line["state"] = name(reading.state);
  line["lamp"] = nullptr;
  if (reading.lamp) line["lamp"] = {{"x", rounded(reading.lamp->x)}, {"y", rounded(reading.lamp->y.value())}};
  line["dots"] = nlohmann::ordered_json::array();
  for (const smear::DotReading& dot : reading.dots) {
    line["dots"].push_back({{"y", rounded(dot.y.value())},
                            {"sigma", rounded(dot.sigma.value())},
                            {"snr", rounded(dot.snr)},
                            {"side", name(dot.side)}});
  }
  line["reason"] = reading.reason;
  // File names may not be UTF-8.
  return line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

std::string text_line(const std::string& file, int frame, const smear::SmearReading& reading) {
  std::string line = fmt::format("{} frame {}: {}", file, frame, name(reading.state));
  if (reading.lamp)
    line += fmt::format(", lamp at row {:.2f}, column {:.2f}", reading.lamp->y.value(), reading.lamp->x);
  for (const smear::DotReading& dot : reading.dots) {
    line += fmt::format(", dot at row {:.2f} +- {:.2f} (SNR {:.0f}, {})", dot.y.value(), dot.sigma.value(),
                        dot.snr, name(dot.side));
  }
  return line + ": " + reading.reason;
}

/// Reads all frames of a file; an error if it ended before its end.
Status read_frames(const std::string& path, bool json) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::unique_ptr<session::FrameFile> file, session::FrameFile::open(path));
  for (int frame = 0;; ++frame) {
    const Result<Image> image = file->next();
    if (!image.ok()) {
      if (image.error().kind == ErrorKind::out_of_data) return {};
      return image.error();
    }
    const smear::SmearReading reading = smear::detect(image->view());
    const std::string line = json ? reading_line(path, frame, reading) : text_line(path, frame, reading);
    std::fprintf(stdout, "%s\n", line.c_str());
    std::fflush(stdout);
  }
}

/// A broken file doesn't prevent reading the others: all are read and every error is printed; then the exit
/// code reports it.
void run_smear(const SmearArguments& arguments) {
  bool failed = false;
  for (const std::string& path : arguments.files) {
    const Status status = read_frames(path, arguments.json);
    if (status.ok()) continue;
    std::fprintf(stderr, "emberlock: %s\n", status.error().message().c_str());
    failed = true;
  }
  if (failed) throw Exit(2, "smear: not all files could be read");
}

}  // namespace

void add_smear(const Verb& app) {
  const Verb verb =
      app.add_verb("smear", "Finds the lamp and its smear dots in images and videos of a strobe.");
  auto arguments = std::make_shared<SmearArguments>();
  verb.add_option("files", arguments->files, "images (PGM, PNG, TIFF, JPEG, FITS) or videos").require();
  verb.add_flag("--json", arguments->json,
                "one JSON object per frame, each on a line; rows and columns count from 0 at the centre of "
                "the top left pixel");
  verb.set_action([arguments] { run_smear(*arguments); });
}

}  // namespace emberlock::cli
