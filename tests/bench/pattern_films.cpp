// SPDX-License-Identifier: Apache-2.0
// pattern_films [FILMS] [SEED] [CAMERAS] [small]: whether `emberlock verify` finds which frames belong
// together in films of patterns that nobody chose (a hand, a torch, bursts, a code, a few skipped flashes): a
// line for each film that isn't wholly right, a table of all, and what the errors of the right ones come to.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <string>

#include "base/square.h"
#include "films/verify_run.h"
#include "tests/support/strobe_clips.h"

namespace emberlock {
namespace {

struct Tally {
  int films = 0, right = 0, wrong = 0, open = 0, unread = 0;
  double worst_ms = 0, worst_sigmas = 0;
  double squares = 0;  // of errors in sigmas
  int errors = 0;
};

/// Lit frames as #, unlit ones as -, and those that tell nothing.
std::string seen_in(const smear::CameraVerdict& camera) {
  std::string text;
  for (const smear::FlashSeen seen : camera.clock.seen)
    text += seen == smear::FlashSeen::yes ? '#' : seen == smear::FlashSeen::no ? '-' : ' ';
  return text;
}

void judge_film(std::uint64_t seed, int cameras, const drivers::VirtualRigDraw& model,
                test::LightPattern kind, const std::filesystem::path& folder, Tally& tally) {
  const test::StrobeFilm film = test::pattern_film(seed, cameras, model, kind);
  std::filesystem::create_directories(folder);
  films::VerifyRunOptions options;
  const auto truths = test::film_strobe(film, folder);
  for (const auto& truth : truths) options.clips.push_back(truth.file);
  options.row_time = film.rig.cameras[0].timing.row_time;
  options.verify.clip.flash_rate = film.strobe.rate;
  const auto run = films::run_verify(options, {});
  ++tally.films;
  if (!run.ok()) {
    std::printf("%llu: %s\n", static_cast<unsigned long long>(seed), run.error().message().c_str());
    tally.unread += cameras - 1;
    return;
  }
  const std::size_t reference = run->result.reference;
  for (std::size_t c = 0; c < truths.size(); ++c) {
    if (c == reference) continue;
    const smear::CameraVerdict& camera = run->result.cameras[c];
    const int offset = test::nearest_offset(truths[reference], truths[c]);
    const bool known = camera.frame_offset.has_value();
    const bool right = known && *camera.frame_offset == offset;
    (right ? tally.right : known ? tally.wrong : tally.open) += 1;
    if (!right) {
      for (const std::size_t one : {reference, c}) {
        const smear::ClipClock& clock = run->result.cameras[one].clock;
        const smear::CcdTiming& is = film.rig.cameras[one].timing;
        std::printf("  tau %.4f P, told direction %d, K %d + %.3f P; truly %d, %d\n",
                    clock.line ? clock.phase_of_frame(run->result.middle).tau / clock.flash_period : NAN,
                    clock.mode.direction ? static_cast<int>(*clock.mode.direction) : 0, clock.timing.shifts,
                    clock.tau_slack / clock.flash_period, static_cast<int>(is.direction), is.shifts);
      }
      std::printf("  truly %.3f ms off\n", in_milliseconds(truths[c].error - truths[reference].error));
    }
    if (!right)
      std::printf("%llu %s, %.4f flashes/s, %d frames, camera %zu: %s %lld, true %d: %s (%s)\n",
                  static_cast<unsigned long long>(seed), std::string(test::name(kind)).c_str(),
                  film.strobe.rate.value(), film.frames, c, known ? "WRONG" : "open",
                  static_cast<long long>(camera.frame_offset.value_or(0)), offset,
                  camera.offset_reason.c_str(), camera.reason.c_str());
    if (!right)
      std::printf("%s\n%s\n", seen_in(run->result.cameras[reference]).c_str(), seen_in(camera).c_str());
    if (!right || reference != 0 || !camera.error || camera.clock.tau_slack > Seconds(0) ||
        run->result.cameras[reference].clock.tau_slack > Seconds(0))
      continue;
    const double off = std::abs(in_milliseconds(
        wrap_symmetric(*camera.error - truths[c].error, film.rig.cameras[0].timing.frame_period)));
    tally.worst_ms = std::max(tally.worst_ms, off);
    const double sigmas = off / in_milliseconds(camera.sigma);
    tally.worst_sigmas = std::max(tally.worst_sigmas, sigmas);
    tally.squares += square(sigmas);
    ++tally.errors;
    if (sigmas > 5)
      std::printf("%llu %s, camera %zu: %.4f ms off, stated to %.4f\n", static_cast<unsigned long long>(seed),
                  std::string(test::name(kind)).c_str(), c, off, in_milliseconds(camera.sigma));
  }
  std::fflush(stdout);
}

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  using namespace emberlock;
  const int films = argc > 1 ? std::atoi(argv[1]) : 200;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int cameras = argc > 3 ? std::atoi(argv[3]) : 3;
  drivers::VirtualRigDraw model;
  if (argc > 4 && std::string(argv[4]) == "small") {
    model.layout.size = {320, 240};
    model.row_time = microseconds_per_row(160);
  }
  const auto folder = std::filesystem::temp_directory_path() / ("pattern_films_" + std::to_string(seed));
  std::map<test::LightPattern, Tally> tallies;
  for (int i = 0; i < films; ++i) {
    const auto kind = test::kTellingPatterns.at(
        (static_cast<std::size_t>(seed) + static_cast<std::size_t>(i)) % test::kTellingPatterns.size());
    judge_film(seed + static_cast<std::uint64_t>(i), cameras, model, kind, folder, tallies[kind]);
    std::filesystem::remove_all(folder);
  }
  std::printf("pattern    films  right  wrong  open  unread  worst error (ms)  /sigma  chi2/n\n");
  Tally all;
  for (const auto& [kind, t] : tallies) {
    std::printf("%-10s %5d  %5d  %5d  %4d  %6d  %16.4f  %6.1f  %6.2f\n",
                std::string(test::name(kind)).c_str(), t.films, t.right, t.wrong, t.open, t.unread,
                t.worst_ms, t.worst_sigmas, t.squares / std::max(1, t.errors));
    all.films += t.films;
    all.right += t.right;
    all.wrong += t.wrong;
    all.open += t.open;
    all.unread += t.unread;
  }
  std::printf("%-10s %5d  %5d  %5d  %4d  %6d\n", "all", all.films, all.right, all.wrong, all.open,
              all.unread);
  return all.wrong == 0 ? 0 : 1;
}
