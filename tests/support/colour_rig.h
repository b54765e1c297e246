// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "base/random.h"
#include "base/square.h"
#include "recon/preprocess/colour_calibration.h"
#include "recon/preprocess/develop.h"
#include "tests/support/pictures.h"

namespace emberlock::test {

/// A camera with known truth: sample = round(white * ((L t V / gain + dark + noise)^(1 / gamma))), clipped.
struct ColourTruth {
  double gamma = 2.2;
  std::array<double, 3> gain = {1, 1, 1};
  std::array<double, 3> vignetting = {-0.3, 0, 0};
  double dark = 0.002;
  double toe = 0;  ///< bends the power law: exponent gamma + toe * (1 - v)
  ImageSize size{640, 480};
  struct Dust {
    double x = 0, y = 0, radius = 1,
           depth = 0;  ///< pixels; the share of the light that it takes in its middle
  };
  std::vector<Dust> dust = {};

  [[nodiscard]] double exposure(double radiance, std::size_t channel, double x, double y) const {
    double light = recon::falloff(vignetting, recon::radius_squared(size, x, y));
    for (const Dust& d : dust)
      light *= 1 - d.depth * std::exp(-0.5 * (square(x - d.x) + square(y - d.y)) / square(d.radius));
    return radiance * light / gain[channel] + dark;
  }
  /// 0..1, the inverse of exposure = v^(gamma + toe (1 - v)).
  [[nodiscard]] double sample(double exposure) const {
    if (exposure <= 0) return 0;
    double v = std::pow(exposure, 1 / gamma);
    for (int i = 0; toe != 0 && i < 12; ++i) v = std::pow(exposure, 1 / (gamma + toe * (1 - v)));
    return v;
  }
};

/// Read noise and shot noise of a sensor that holds 10 000 electrons.
inline int noisy_sample(const ColourTruth& camera, double exposure, RandomStream& random) {
  const double noise = std::sqrt(0.002 * 0.002 + std::max(0.0, exposure) / 1e4);
  const double v = camera.sample(exposure + random.normal(0, noise));
  return static_cast<int>(std::clamp(std::lround(255 * v), 0L, 255L));
}

/// Gains 0.7..1.4, gamma 1.8..2.4, vignetting 10..30 %.
inline std::vector<ColourTruth> colour_rig(std::size_t cameras, std::uint64_t seed) {
  RandomStream random(seed, 1);
  std::vector<ColourTruth> rig;
  for (std::size_t i = 0; i < cameras; ++i) {
    ColourTruth c;
    const double at = cameras > 1 ? static_cast<double>(i) / static_cast<double>(cameras - 1) : 0.5;
    c.gamma = 1.8 + 0.6 * std::fmod(at * 3.7 + random.uniform(0, 0.2), 1.0);
    for (double& g : c.gain) g = std::clamp(0.7 + 0.7 * at + random.uniform(-0.05, 0.05), 0.7, 1.4);
    const double corner = i == 0 ? 0.3 : random.uniform(0.1, 0.3);
    const double bend = random.uniform(-0.3, 0.3);
    c.vignetting = {-corner * (1 + bend), corner * bend, 0};
    c.dark = random.uniform(0.0005, 0.004);
    rig.push_back(c);
  }
  return rig;
}

inline recon::PatchReading film_patch(const ColourTruth& camera, const std::array<double, 3>& radiance,
                                      double exposure, double x, double y, RandomStream& random) {
  constexpr int kEdge = 24;
  const Image tile = image_of({{kEdge, kEdge}, PixelFormat::rgb8, 8}, [&](int u, int v, int c) {
    const auto channel = static_cast<std::size_t>(c);
    return noisy_sample(camera,
                        camera.exposure(radiance[channel] * exposure, channel, x + u - 0.5 * kEdge + 0.5,
                                        y + v - 0.5 * kEdge + 0.5),
                        random);
  });
  recon::PatchReading reading = recon::read_patch(tile.view(), {0, 0, kEdge, kEdge});
  reading.exposure = exposure;
  reading.x = x;
  reading.y = y;
  return reading;
}

inline recon::DarkReading film_dark(const ColourTruth& camera, RandomStream& random) {
  recon::DarkReading dark;
  constexpr int kSamples = 20000;
  for (auto& histogram : dark.histogram) {
    histogram.assign(256, 0);
    for (int i = 0; i < kSamples; ++i)
      histogram[static_cast<std::size_t>(noisy_sample(camera, camera.dark, random))] += 1.0 / kSamples;
  }
  return dark;
}

/// Specks, some 40 pixels wide, that take up to 8 % of the light.
inline void put_dust(ColourTruth& camera, std::uint64_t seed) {
  RandomStream random(seed, 5);
  for (int i = 0; i < 30; ++i)
    camera.dust.push_back({random.uniform(0, camera.size.width), random.uniform(0, camera.size.height),
                           random.uniform(15, 25), random.uniform(0.04, 0.08)});
}

/// A grey surface, out of focus, that fills the picture.
inline Image film_flat(const ColourTruth& camera, RandomStream& random) {
  constexpr double kRadiance = 0.5;
  return image_of({camera.size, PixelFormat::rgb8, 8}, [&](int x, int y, int c) {
    return noisy_sample(camera, camera.exposure(kRadiance, static_cast<std::size_t>(c), x + 0.5, y + 0.5),
                        random);
  });
}

struct TargetOptions {
  std::vector<double> exposures = {0.25, 0.5, 1};
  int patches = 8;
  bool dark = true;
  std::size_t places = 5;  ///< 1: in the middle alone
};

/// Greys and colours from 8 to 96 % of white.
inline std::vector<std::array<double, 3>> colour_chart(int patches, std::uint64_t seed) {
  RandomStream random(seed, 4);
  std::vector<std::array<double, 3>> chart;
  for (int p = 0; p < patches; ++p) {
    const double level = 0.08 * std::pow(12.0, static_cast<double>(p) / std::max(1, patches - 1));
    chart.push_back({level, level * random.uniform(0.6, 1), level * random.uniform(0.5, 1)});
  }
  return chart;
}

/// A chart, seen by every camera in the middle and in up to four places further out.
inline recon::ColourReadings film_target(const std::vector<ColourTruth>& rig, std::uint64_t seed,
                                         const TargetOptions& options = {}) {
  recon::ColourReadings readings;
  RandomStream random(seed, 2);
  const auto chart = colour_chart(options.patches, seed);
  constexpr std::array<std::array<double, 2>, 5> kPlaces = {
      {{0.5, 0.5}, {0.2, 0.2}, {0.85, 0.15}, {0.1, 0.88}, {0.75, 0.8}}};
  for (std::size_t i = 0; i < rig.size(); ++i) {
    readings.cameras.push_back({"cam" + std::to_string(i), rig[i].size, 1.0 / 255, {}});
    if (options.dark) readings.cameras.back().dark = film_dark(rig[i], random);
    for (std::size_t place = 0; place < std::min(options.places, kPlaces.size()); ++place) {
      for (const double exposure : options.exposures) {
        for (std::size_t p = 0; p < chart.size(); ++p) {
          const double dx = 0.04 * (static_cast<double>(p % 4) - 1.5);
          const double dy = 0.06 * (static_cast<double>(p / 4) - 0.5);
          recon::PatchReading reading =
              film_patch(rig[i], chart[p], exposure, (kPlaces[place][0] + dx) * rig[i].size.width,
                         (kPlaces[place][1] + dy) * rig[i].size.height, random);
          reading.camera = i;
          reading.patch = "p" + std::to_string(p);
          readings.patches.push_back(std::move(reading));
        }
      }
    }
  }
  return readings;
}

/// Two flat pictures of each camera.
inline void add_flats(const std::vector<ColourTruth>& rig, recon::ColourReadings& readings) {
  RandomStream random(5, 6);
  for (std::size_t i = 0; i < rig.size(); ++i)
    for (const char* name : {"flat1", "flat2"}) {
      const Image picture = film_flat(rig[i], random);
      readings.flats.push_back(recon::read_flat(picture.view()));
      readings.flats.back().camera = i;
      for (recon::PatchReading& patch : recon::flat_patches(picture.view(), std::to_string(i) + name)) {
        patch.camera = i;
        readings.patches.push_back(std::move(patch));
      }
    }
}

/// How far cameras are apart that see the same patch.
struct PatchSpread {
  double worst_pair = 0;  ///< the largest over the smallest, less 1, where there is 2 % of white or more
  double worst = 0;       ///< the most that one camera differs from their mean, there too
  double worst_dim = 0;   ///< the same of dimmer patches, of which 8 bits with a gamma tell little
  double rms = 0;         ///< from the cameras' mean, of all
  int compared = 0;       ///< patches and channels that at least two cameras show unsaturated
  int saturated = 0;      ///< readings marked as bounds
  int unmarked = 0;       ///< saturated readings that aren't
};

/// Patches that no calibration saw, 1..110 % of white, each camera showing them in other places; frames are
/// developed as a session's are.
inline PatchSpread held_out_spread(const std::vector<ColourTruth>& rig,
                                   const recon::ColourCalibration* calibration, std::uint64_t seed) {
  constexpr int kAcross = 6, kDown = 4;
  RandomStream random(seed, 3);
  std::vector<std::array<double, 3>> patches;
  for (int p = 0; p < kAcross * kDown; ++p) {
    const double level = 0.03 * std::pow(37.0, p / (kAcross * kDown - 1.0));
    patches.push_back({level, level * random.uniform(0.4, 1), level * random.uniform(0.3, 1)});
  }
  std::vector<std::array<std::vector<double>, 3>> seen(patches.size());
  PatchSpread out;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const ColourTruth& camera = rig[i];
    const int width = camera.size.width;
    const int height = camera.size.height;
    const int edge = std::min(30, width / 20);  // half of the picture stays black
    const auto patch_at = [&](int x, int y) -> int {
      const int column = x * kAcross / width;
      const int row = y * kDown / height;
      const int dx = x - (2 * column + 1) * width / (2 * kAcross);
      const int dy = y - (2 * row + 1) * height / (2 * kDown);
      if (std::abs(dx) > edge || std::abs(dy) > edge) return -1;
      return (row * kAcross + column + 5 * static_cast<int>(i)) % (kAcross * kDown);
    };
    recon::CameraFrame from;
    from.frame =
        std::make_shared<const Image>(image_of({camera.size, PixelFormat::rgb8, 8}, [&](int x, int y, int c) {
          const int p = patch_at(x, y);
          const auto channel = static_cast<std::size_t>(c);
          const double radiance = p < 0 ? 0 : patches[static_cast<std::size_t>(p)][channel];
          return noisy_sample(camera, camera.exposure(radiance, channel, x + 0.5, y + 0.5), random);
        }));
    from.sensor = SensorKind::global_shutter;
    if (calibration != nullptr) from.colour = calibration->cameras[i].colour;
    const recon::DevelopedPicture picture = recon::develop(from);
    std::vector<std::array<double, 3>> sum(patches.size());
    std::vector<std::array<int, 3>> bound(patches.size());
    std::vector<std::array<int, 3>> clipped(patches.size());
    std::vector<int> pixels(patches.size());
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const int found = patch_at(x, y);
        if (found < 0) continue;
        const auto p = static_cast<std::size_t>(found);
        const auto at = static_cast<std::size_t>(y * width + x);
        ++pixels[p];
        for (std::size_t c = 0; c < 3; ++c) {
          sum[p][c] += static_cast<double>(picture.image.rgb[3 * at + c]);
          bound[p][c] += picture.bounds.empty() ? 0 : picture.bounds[at] >> c & 1;
          clipped[p][c] += from.frame->view().sample(x, y, static_cast<int>(c)) == 255 ? 1 : 0;
        }
      }
    for (std::size_t p = 0; p < patches.size(); ++p)
      for (std::size_t c = 0; c < 3; ++c) {
        out.unmarked += clipped[p][c] != bound[p][c] ? 1 : 0;
        if (bound[p][c] > 0)
          ++out.saturated;
        else
          seen[p][c].push_back(sum[p][c] / pixels[p]);
      }
  }
  double squares = 0;
  int count = 0;
  for (const auto& patch : seen)
    for (const std::vector<double>& values : patch) {
      if (values.size() < 2) continue;
      ++out.compared;
      double mean = 0;
      for (const double v : values) mean += v / static_cast<double>(values.size());
      const auto [low, high] = std::minmax_element(values.begin(), values.end());
      const bool dim = mean < 0.02 * 255;
      if (!dim) out.worst_pair = std::max(out.worst_pair, *high / *low - 1);
      for (const double v : values) {
        double& worst = dim ? out.worst_dim : out.worst;
        worst = std::max(worst, std::abs(v / mean - 1));
        squares += (v / mean - 1) * (v / mean - 1);
        ++count;
      }
    }
  out.rms = std::sqrt(squares / std::max(1, count));
  return out;
}

}  // namespace emberlock::test
