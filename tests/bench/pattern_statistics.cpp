// SPDX-License-Identifier: Apache-2.0
// pattern_statistics [FILMS] [SEED] [CLIPS]: how honest match_patterns() is on patterns that nobody chose,
// from lit and unlit frames alone (verify_statistics films them): a line for each kind of pattern, and, of
// all shifts that were claimed at any probability, how many were right at each.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <string>

#include "smear_sync/clocks/shared_pattern.h"
#include "tests/support/light_patterns.h"

namespace emberlock {
namespace {

using test::LightPattern;

struct Film {
  std::vector<smear::PatternClip> clips;
  std::vector<std::int64_t> shifts;  ///< true: of each clip's flashes to the first clip's
  double flashes_per_frame = 1;
};

/// Clips of one strobe near the frame rate, started within a third of their length, each flash misread now
/// and then.
Film film(LightPattern kind, int count, RandomStream& random) {
  Film out;
  out.flashes_per_frame =
      random.uniform() < 0.5 ? 1 + random.uniform(-1e-3, 1e-3) : random.uniform(0.99, 1.01);
  const int frames = static_cast<int>(random.uniform(96, 240));
  const double misread = random.uniform() < 0.5 ? 0 : random.uniform(0, 0.01);
  const std::vector<bool> given = test::light_pattern(kind, 2 * frames + 20, random);
  std::vector<std::int64_t> origins;
  for (int c = 0; c < count; ++c) {
    const double begin = random.uniform(2, 2 + frames / 3.0);
    const auto origin = static_cast<std::int64_t>(begin);
    origins.push_back(origin);
    smear::PatternClip clip;
    for (int i = 0; i < frames; ++i) {
      const double start = begin + i * out.flashes_per_frame;
      bool lit = false;
      for (auto j = static_cast<std::int64_t>(std::ceil(start - out.flashes_per_frame));
           static_cast<double>(j) < start; ++j)
        lit = lit || given[static_cast<std::size_t>(j)];
      if (random.uniform() < misread) lit = !lit;
      clip.frames.push_back(
          {start - static_cast<double>(origin), lit ? smear::FlashSeen::yes : smear::FlashSeen::no});
    }
    out.clips.push_back(std::move(clip));
  }
  for (const std::int64_t origin : origins) out.shifts.push_back(origin - origins.front());
  return out;
}

struct Tally {
  int right = 0, wrong = 0, open = 0;
};

}  // namespace
}  // namespace emberlock

int main(int argc, char** argv) {
  using namespace emberlock;
  const int films = argc > 1 ? std::atoi(argv[1]) : 200;
  const std::uint64_t seed = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1;
  const int clips = argc > 3 ? std::atoi(argv[3]) : 3;
  constexpr std::array kBounds{0.5, 0.7, 0.9, 0.97, 0.99, 0.999, 0.9999, 1.0};
  std::array<Tally, kBounds.size()> bins{};
  std::array<double, kBounds.size()> claimed{};
  std::printf("pattern     right  wrong  left open   (claimed at 0.999)\n");
  for (int kind = 0; kind < 8; ++kind) {
    Tally tally;
    for (int f = 0; f < films; ++f) {
      RandomStream random(seed + static_cast<std::uint64_t>(f), 100 + static_cast<std::uint64_t>(kind));
      const Film of = film(static_cast<LightPattern>(kind), clips, random);
      smear::SharedPatternOptions options;
      options.flashes_per_frame = of.flashes_per_frame;
      const auto at_default = smear::match_patterns(of.clips, 0, options).value();
      options.confidence = 0.5;
      const auto at_all = smear::match_patterns(of.clips, 0, options).value();
      for (std::size_t c = 1; c < of.clips.size(); ++c) {
        if (at_default[c].shift)
          (at_default[c].shift->flashes == of.shifts[c] ? tally.right : tally.wrong) += 1;
        else
          ++tally.open;
        if (!at_all[c].shift) continue;
        const double p = at_all[c].shift->probability;
        const auto bin = static_cast<std::size_t>(std::max<std::ptrdiff_t>(
            0, std::upper_bound(kBounds.begin(), kBounds.end(), p) - kBounds.begin() - 1));
        (at_all[c].shift->flashes == of.shifts[c] ? bins[bin].right : bins[bin].wrong) += 1;
        claimed[bin] += p;
      }
    }
    std::printf("%-10s  %5d  %5d  %9d\n", std::string(name(static_cast<LightPattern>(kind))).c_str(),
                tally.right, tally.wrong, tally.open);
  }
  std::printf("\nclaimed from     mean  shifts  right\n");
  for (std::size_t b = 0; b < bins.size(); ++b) {
    const int all = bins[b].right + bins[b].wrong;
    if (all > 0)
      std::printf("%12.4f  %7.5f  %6d  %7.5f\n", kBounds[b], claimed[b] / all, all,
                  static_cast<double>(bins[b].right) / all);
  }
  return 0;
}
