// SPDX-License-Identifier: Apache-2.0
// What calibrating colours and preparing pictures reach, on simulated cameras whose truth is known.
//   build/release/bin/bench_colour [seeds]
#include <chrono>
#include <cstdio>
#include <cstdlib>

#include "recon/preprocess/colour_calibration.h"
#include "recon/synthetic/flame.h"
#include "tests/support/colour_rig.h"
#include "tests/support/flame_frames.h"

namespace emberlock::test {
namespace {

void print_spread(const char* what, const PatchSpread& s) {
  std::printf(
      "  %-34s worst pair %6.2f %%, worst from the mean %6.2f %% (dim %5.2f %%), rms %5.3f %%; %d compared, "
      "%d bounds\n",
      what, 100 * s.worst_pair, 100 * s.worst, 100 * s.worst_dim, 100 * s.rms, s.compared, s.saturated);
}

PatchSpread worse(const PatchSpread& a, const PatchSpread& b) {
  return {std::max(a.worst_pair, b.worst_pair),
          std::max(a.worst, b.worst),
          std::max(a.worst_dim, b.worst_dim),
          std::max(a.rms, b.rms),
          a.compared + b.compared,
          a.saturated + b.saturated,
          a.unmarked + b.unmarked};
}

/// What a perfect calibration would say: the noise of the patches themselves is left.
recon::ColourCalibration true_calibration(const std::vector<ColourTruth>& rig) {
  constexpr std::size_t kPoints = 4096;
  recon::ColourCalibration out;
  for (const ColourTruth& camera : rig) {
    recon::CalibratedColour& c = out.cameras.emplace_back();
    for (std::size_t i = 0; i < kPoints; ++i) {
      const double v = static_cast<double>(i) / (kPoints - 1);
      c.colour.response.push_back(std::pow(v, camera.gamma + camera.toe * (1 - v)));
    }
    c.colour.gain = camera.gain;
    c.colour.vignetting = camera.vignetting;
    c.colour.dark.fill(camera.dark);
  }
  return out;
}

void patches(int seeds, double toe, const char* what) {
  PatchSpread before;
  PatchSpread after;
  PatchSpread truth;
  double chi_square = 0;
  int gains = 0;
  double seconds = 0;
  for (int seed = 1; seed <= seeds; ++seed) {
    auto rig = colour_rig(11, static_cast<std::uint64_t>(seed));
    for (ColourTruth& camera : rig) camera.toe = toe;
    const auto start = std::chrono::steady_clock::now();
    const auto calibration = recon::calibrate_colour(film_target(rig, static_cast<std::uint64_t>(seed)));
    seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (!calibration) {
      std::printf("seed %d: %s\n", seed, calibration.error().message().c_str());
      continue;
    }
    before = worse(before, held_out_spread(rig, nullptr, 100 + static_cast<std::uint64_t>(seed)));
    after = worse(after, held_out_spread(rig, &*calibration, 100 + static_cast<std::uint64_t>(seed)));
    const recon::ColourCalibration perfect = true_calibration(rig);
    truth = worse(truth, held_out_spread(rig, &perfect, 100 + static_cast<std::uint64_t>(seed)));
    for (std::size_t c = 0; c < 3; ++c) {
      double mean = 0;
      for (const ColourTruth& camera : rig) mean += std::log(camera.gain[c]) / 11;
      for (std::size_t i = 0; i < rig.size(); ++i) {
        const recon::CalibratedColour& found = calibration->cameras[i];
        const double off = std::log(found.colour.gain[c]) - (std::log(rig[i].gain[c]) - mean);
        chi_square += off * off / (found.gain_sigma[c] * found.gain_sigma[c]);
        ++gains;
      }
    }
  }
  std::printf("%s: %d rigs of eleven cameras, patches that no calibration saw\n", what, seeds);
  print_spread("as filmed", before);
  print_spread("calibrated (worst of all rigs)", after);
  print_spread("told the cameras' truth instead", truth);
  std::printf(
      "  saturated but not marked: %d; gains' chi-square over their number: %.2f; %.2f s a rig with "
      "filming\n",
      after.unmarked, chi_square / std::max(1, gains), seconds / seeds);
}

void dust(int seeds) {
  PatchSpread without;
  PatchSpread with;
  for (int seed = 1; seed <= seeds; ++seed) {
    const auto number = static_cast<std::uint64_t>(seed);
    auto rig = colour_rig(11, number);
    for (std::size_t i = 0; i < rig.size(); ++i) put_dust(rig[i], 100 * number + i);
    recon::ColourReadings readings = film_target(rig, number);
    const auto lens_alone = recon::calibrate_colour(readings);
    add_flats(rig, readings);
    const auto flat = recon::calibrate_colour(readings);
    if (!lens_alone || !flat) {
      std::printf("seed %d: not calibrated\n", seed);
      continue;
    }
    without = worse(without, held_out_spread(rig, &*lens_alone, 100 + number));
    with = worse(with, held_out_spread(rig, &*flat, 100 + number));
  }
  std::printf("dust on all sensors: %d rigs of eleven cameras\n", seeds);
  print_spread("without flat pictures", without);
  print_spread("two flat pictures each", with);
}

void smear() {
  std::printf(
      "smear: RMS that it adds to a picture, grey levels, and what is left; fraction found over the true "
      "one\n");
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    for (const double fraction : {2e-4, 5e-4, 2e-3}) {
      for (const double peak : {180.0, 400.0}) {
        const SmearedFlame flame = smeared_flame(format, fraction, peak, 1);
        std::string why;
        const auto found = recon::find_smear(flame.seen, &why);
        recon::Samples cleaned = flame.seen;
        if (found) recon::remove_smear(cleaned, *found);
        std::printf("  %-12s fraction %.0e, brightest %3.0f: %7.3f -> %6.3f  x%.3f  %s\n",
                    std::string(name(format)).c_str(), fraction, peak, rms_of(flame.seen, flame.clean),
                    rms_of(cleaned, flame.clean), found ? found->fraction[0] / fraction : 0.0, why.c_str());
      }
    }
  }
}

void demosaicing() {
  std::printf("demosaicing: RMS over the flame, grey levels, bilinear / gradient-corrected\n");
  for (const int seed : {11, 12, 13}) {
    for (const double noise : {0.0, 1.0, 3.0}) {
      const auto [bilinear, gradient] = demosaicing_errors(static_cast<std::uint64_t>(seed), noise);
      std::printf("  flame %d, noise %.0f: %.3f / %.3f\n", seed, noise, bilinear, gradient);
    }
  }
}

void hot_pixels() {
  std::printf(
      "hot pixels: found of 100, and false ones in 307 200, by dark frames / by the flame's picture\n");
  for (const PixelFormat format : {PixelFormat::gray8, PixelFormat::bayer_rggb8, PixelFormat::rgb8}) {
    for (const double level : {8.0, 20.0, 60.0}) {
      const HotPixelRates r = hot_pixel_rates(format, level, 1);
      std::printf("  %-12s %2.0f levels hot, noise 1.5: %3d, %d / %3d, %d\n",
                  std::string(name(format)).c_str(), level, r.dark_found, r.dark_false, r.picture_found,
                  r.picture_false);
    }
  }
}

void backgrounds() {
  const BackgroundResidual r = background_residual(1);
  std::printf(
      "background: a lamp's glow and a lit wall behind the flame, noise 1: RMS off the truth, grey levels\n");
  std::printf(
      "  as filmed %.2f, the picture's level taken out %.2f, the dark part's midmean taken out %.2f\n",
      r.filmed, r.level, r.dark_part);
}

}  // namespace
}  // namespace emberlock::test

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::max(1, std::atoi(argv[1])) : 20;
  emberlock::test::patches(seeds, 0, "power laws");
  emberlock::test::patches(std::max(1, seeds / 4), 0.5, "bent responses");
  emberlock::test::dust(std::max(1, seeds / 2));
  emberlock::test::smear();
  emberlock::test::demosaicing();
  emberlock::test::hot_pixels();
  emberlock::test::backgrounds();
}
