// SPDX-License-Identifier: Apache-2.0
// What `emberlock import` costs, and how near its times come to the truth.
//   import speed FOLDER EMBERLOCK [OPTION...]: 11 clips of 60 s, 1280 x 720 H.264 in colour (made in FOLDER
//   unless
//     they are there: strobe for 12 s, then a flame), imported by the program EMBERLOCK with OPTIONs; prints
//     seconds, processor seconds and the most memory (ru_maxrss of the process).
//   import times [RIGS] [SEED]: random rigs of three small cameras whose flame lasts a minute; prints wrong
//   frame offsets,
//     and residual times against their standard errors.
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/square.h"
#include "films/import_run.h"
#include "report/import_report.h"
#include "session/reader.h"
#include "session/shutter_times.h"
#include "tests/support/import_clips.h"

namespace emberlock {
namespace {

namespace fs = std::filesystem;

int usage() {
  std::fprintf(stderr, "import speed FOLDER EMBERLOCK [OPTION...] | import times [RIGS] [SEED]\n");
  return 2;
}

/// Eleven cameras as consumers', one film each; those that are there already are kept.
test::FlameFilm fleet() {
  drivers::VirtualRigDraw model;
  test::FlameFilm film{test::random_film(7, 11, model), Seconds(13)};
  film.strobe.format = {};
  film.strobe.format.gop = 12;
  film.strobe.format.crf = 14;  // some 10 Mbit/s
  film.strobe.format.tinted = true;
  film.strobe.suffix = ".mp4";
  film.strobe.rig.scene.read_noise = 2;
  film.strobe.frames = 60 * 24;
  for (double& start : film.strobe.starts) start /= 4;
  return film;
}

int run_program(const std::vector<std::string>& words) {
  const auto start = std::chrono::steady_clock::now();
  const pid_t child = ::fork();
  if (child == 0) {
    std::vector<char*> arguments;
    for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
    arguments.push_back(nullptr);
    ::execv(arguments[0], arguments.data());
    std::_Exit(127);
  }
  int status = 0;
  struct rusage used {};
  ::wait4(child, &status, 0, &used);
  const std::chrono::duration<double> wall = std::chrono::steady_clock::now() - start;
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  std::printf("exit %d: %.1f s, %.1f s of processor (%.1f user, %.1f system), at most %.0f MB\n",
              WEXITSTATUS(status), wall.count(), seconds(used.ru_utime) + seconds(used.ru_stime),
              seconds(used.ru_utime), seconds(used.ru_stime), 1.024e-3 * static_cast<double>(used.ru_maxrss));
  return WEXITSTATUS(status);
}

int speed(const fs::path& folder, const std::string& program, const std::vector<std::string>& more) {
  const test::FlameFilm film = fleet();
  if (!fs::exists(folder / "comb")) {
    std::printf("filming\n");
    std::fflush(stdout);
    test::film_flame(film, folder / "clips");
    fs::create_directories(folder / "comb");
    test::film_strobe(test::comb_of(film.strobe, 0, 48), folder / "comb");
  }
  std::uintmax_t bytes = 0;
  for (const auto& file : fs::directory_iterator(folder / "clips")) bytes += file.file_size();
  fs::remove_all(folder / "session");
  fs::remove_all(folder / "session.importing");
  std::vector<std::string> words{program,
                                 "import",
                                 (folder / "clips").string(),
                                 "--out",
                                 (folder / "session").string(),
                                 "--flash-rate",
                                 fmt::format("{}", film.strobe.strobe.rate.value()),
                                 "--comb",
                                 (folder / "comb" / "camera-0.mp4").string(),
                                 "--comb-rate",
                                 "300"};
  words.insert(words.end(), more.begin(), more.end());
  const int code = run_program(words);
  std::uintmax_t session = 0;
  for (const auto& file : fs::recursive_directory_iterator(folder / "session"))
    if (file.is_regular_file()) session += file.file_size();
  std::printf("%.2f GB of films, %.2f GB of session\n", 1e-9 * static_cast<double>(bytes),
              1e-9 * static_cast<double>(session));
  return code;
}

struct Residuals {
  int offsets_wrong = 0, refused = 0, cameras = 0;
  double squares_first = 0, squares_last = 0, worst = 0, worst_us = 0;
};

void times_of(std::uint64_t seed, const fs::path& folder, Residuals& all) {
  drivers::VirtualRigDraw model;
  model.layout.size = {320, 240};
  model.row_time = microseconds_per_row(160);
  const smear::FrameCode code{};
  test::FlameFilm film{test::random_film(seed, 3, model, code), Seconds(14)};
  film.strobe.format.codec = AV_CODEC_ID_H264;
  film.strobe.format.crf = 18 + static_cast<int>(seed % 8);
  film.strobe.format.gop = 12;
  film.strobe.suffix = ".mp4";
  film.strobe.frames = 60 * 24;
  const auto clips = test::film_flame(film, folder / "clips");
  fs::create_directories(folder / "comb");
  films::ImportOptions options;
  options.folder = folder / "clips";
  options.out = folder / "session";
  options.alignment = films::Alignment::strobe;
  options.clip.flash_rate = film.strobe.strobe.rate;
  options.comb = test::film_strobe(test::comb_of(film.strobe, 0, 48), folder / "comb")[0].file;
  options.comb_rate = Hertz(300);
  const auto result = films::run_import(options, {}, report::reports_of);
  if (!result.ok()) {
    ++all.refused;
    std::printf("%4llu  %s\n", static_cast<unsigned long long>(seed), result.error().message().c_str());
    return;
  }
  const auto session = session::SessionReader::open(options.out);
  const auto times = session::read_shutter_times(*session).value().value();
  const auto& reference = result->cameras[0];
  for (std::size_t c = 1; c < clips.size(); ++c) {
    const films::ImportedCamera& camera = result->cameras[c];
    ++all.cameras;
    const auto off = [&](std::int64_t instant, Seconds late) {
      const Seconds truth = clips[c].read_starts[static_cast<std::size_t>(camera.first + instant)] -
                            clips[0].read_starts[static_cast<std::size_t>(reference.first + instant)];
      all.offsets_wrong += instant == 0 && abs(truth) > Seconds(0.5 / 23.976) ? 1 : 0;
      all.worst_us = std::max(all.worst_us, in_microseconds(abs(late - truth)));
      return late - truth;
    };
    const auto& late = times.cameras(static_cast<int>(c)).late_s();
    const double first = off(0, Seconds(late[0])).value() / camera.sigma_s.front();
    const double last =
        off(result->instants - 1, Seconds(late[late.size() - 1])).value() / camera.sigma_s.back();
    all.squares_first += square(first);
    all.squares_last += square(last);
    all.worst = std::max({all.worst, std::abs(first), std::abs(last)});
    std::printf("%4llu  crf %d  camera %zu  first %+6.2f sigma (%.2f us)  last %+6.2f sigma (%.2f us)\n",
                static_cast<unsigned long long>(seed), film.strobe.format.crf, c, first,
                1e6 * camera.sigma_s.front(), last, 1e6 * camera.sigma_s.back());
    std::fflush(stdout);
  }
}

int times(int rigs, std::uint64_t seed) {
  const fs::path folder = fs::temp_directory_path() / fmt::format("import_times_{}", seed);
  Residuals all;
  for (int rig = 0; rig < rigs; ++rig) {
    fs::remove_all(folder);
    times_of(seed + static_cast<std::uint64_t>(rig), folder, all);
  }
  if (std::getenv("KEEP") == nullptr) fs::remove_all(folder);
  std::printf(
      "%d cameras: %d offsets wrong, %d rigs refused; chi-square a degree %.2f at first, %.2f after the "
      "flame; worst "
      "%.1f sigma, %.1f us\n",
      all.cameras, all.offsets_wrong, all.refused, all.squares_first / all.cameras,
      all.squares_last / all.cameras, all.worst, all.worst_us);
  return 0;
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  if (words.size() >= 3 && words[0] == "speed")
    return emberlock::speed(words[1], words[2], {words.begin() + 3, words.end()});
  if (!words.empty() && words[0] == "times")
    return emberlock::times(words.size() > 1 ? std::atoi(words[1].c_str()) : 20,
                            words.size() > 2 ? std::strtoull(words[2].c_str(), nullptr, 10) : 1);
  return emberlock::usage();
}
