// SPDX-License-Identifier: Apache-2.0
// How often and how well the detector reads dots, on random frames that nothing was tuned on.
//   bench_detect_statistics [FRAMES] [SEED] [dots|dotless|reflections|compressed]
#include <cstdio>
#include <cstdlib>

#include "tests/support/smear_statistics.h"

namespace emberlock::test {
namespace {

void accuracy(const char* what, const SmearTally& t) {
  std::printf("%-34s %7d  %7.3f %%  %5d  %7.3f %%  %+.4f  %.4f  %.4f  %.3f  %5.1f %%\n", what, t.frames,
              100.0 * t.found / t.frames, t.dots - t.found, 100.0 * t.abstained / t.frames, t.mean_error(),
              t.rms(), t.bound(), t.over_bound(), 100 * t.within_two_sigma());
  std::fflush(stdout);
}

void false_dots(const char* what, const SmearTally& t) {
  std::printf("%-34s %7d  %5d  %.1e  %7.3f %%\n", what, t.frames, t.dots,
              static_cast<double>(t.dots) / t.frames, 100.0 * t.abstained / t.frames);
  std::fflush(stdout);
}

struct Format {
  const char* name;
  PixelFormat format;
  int depth;
};
constexpr Format kFormats[] = {{"grey, 8 bits", PixelFormat::gray8, 8},
                               {"grey, 12 bits", PixelFormat::gray16, 12},
                               {"Bayer, 8 bits", PixelFormat::bayer_rggb8, 8},
                               {"RGB, 8 bits", PixelFormat::rgb8, 8}};

struct Compressor {
  const char* name;
  std::function<std::vector<Image>(const std::vector<Image>&)> film;
};

void dots_heading() {
  std::printf("%-34s %7s  %9s  %5s  %9s  %7s  %6s  %6s  %5s  %7s\n", "one dot", "frames", "found", "wrong",
              "abstained", "bias", "RMS", "bound", "ratio", "2 sigma");
}
void dotless_heading() {
  std::printf("\n%-34s %7s  %5s  %7s  %9s\n", "no dot", "frames", "false", "rate", "abstained");
}

void dots(int frames, std::uint64_t seed) {
  dots_heading();
  struct Band {
    const char* name;
    double low, high;
  };
  for (const Band& amplitude : {Band{"4..5 levels", 4, 5}, Band{"5..40 levels", 5, 40}}) {
    for (const Band& radius :
         {Band{"3..4", 3, 4}, Band{"4..6", 4, 6}, Band{"6..8", 6, 8}, Band{"8..10", 8, 10}}) {
      const SmearRange range{.min_radius = radius.low,
                             .max_radius = radius.high,
                             .min_amplitude = amplitude.low,
                             .max_amplitude = amplitude.high};
      accuracy((std::string(amplitude.name) + ", radius " + radius.name).c_str(),
               read_dots(range, {}, frames / 4, seed + 1));
    }
  }
  for (const Format& f : kFormats)
    accuracy(f.name, read_dots({}, {.bit_depth = f.depth, .format = f.format}, frames / 4, seed + 2));
}

void dotless(int frames, std::uint64_t seed) {
  dotless_heading();
  for (const Format& f : kFormats) false_dots(f.name, read_dotless(f.format, frames, seed + 4));
}

void reflections(int frames, std::uint64_t seed) {
  dotless_heading();
  false_dots("disks 1.2..4 lamps wide", read_lookalikes(Lookalike::disk, frames / 3, seed + 6));
  false_dots("ellipses so wide, lamp-tall", read_lookalikes(Lookalike::ellipse, frames / 3, seed + 7));
  false_dots("Gaussians so wide", read_lookalikes(Lookalike::soft, frames / 3, seed + 8));
  false_dots("lines of 100..400 levels", read_lookalikes(Lookalike::line, frames / 3, seed + 9));
}

void compressed(int frames, std::uint64_t seed) {
  const Compressor compressors[] = {
      {"JPEG 75", [](const std::vector<Image>& film) { return jpeg_film(film, 75); }},
      {"H.264, CRF 18", [](const std::vector<Image>& film) { return through_h264(film, 18); }},
      {"H.264, CRF 23", [](const std::vector<Image>& film) { return through_h264(film, 23); }},
      {"H.264, CRF 28", [](const std::vector<Image>& film) { return through_h264(film, 28); }}};
  dots_heading();
  for (const Compressor& c : compressors)
    accuracy(c.name, read_compressed(c.film, Dots::one, {}, frames / 4, seed + 3));
  dotless_heading();
  for (const Compressor& c : compressors)
    false_dots(c.name, read_compressed(c.film, Dots::none, {}, frames, seed + 5));
}

}  // namespace
}  // namespace emberlock::test

int main(int argc, char** argv) {
  using namespace emberlock::test;
  const int frames = argc > 1 ? std::max(1, std::atoi(argv[1])) : 30000;
  const auto seed = static_cast<std::uint64_t>(argc > 2 ? std::atoll(argv[2]) : 20260101);
  const std::string part = argc > 3 ? argv[3] : "";
  std::printf("seed %llu; noise 1..1.5 levels and up to 0.2 of shot variance a level, background 12\n\n",
              static_cast<unsigned long long>(seed));
  if (part.empty() || part == "dots") dots(frames, seed);
  if (part.empty() || part == "dotless") dotless(frames, seed);
  if (part.empty() || part == "reflections") reflections(frames, seed);
  if (part.empty() || part == "compressed") compressed(frames, seed);
  return 0;
}
