// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include "base/random.h"
#include "recon/adjust/picture_error.h"
#include "recon/preprocess/dark_part.h"
#include "recon/preprocess/develop.h"
#include "recon/preprocess/hot_pixels.h"
#include "recon/preprocess/radiance.h"
#include "recon/preprocess/samples.h"
#include "recon/preprocess/smear.h"
#include "recon/synthetic/flame.h"
#include "tests/support/pictures.h"

// A synthetic flame as sensors film it: what preparing the pictures is judged by.
namespace emberlock::test {

/// The flame from the side, of 255 its brightest about 230.
inline recon::RadianceImage flame_picture(std::uint64_t seed, ImageSize size = {640, 480}) {
  recon::PaperSceneOptions options;
  options.flame.seed = seed;
  options.image = size;
  options.truth_voxels = size.width < 400 ? 64 : 192;
  return *recon::paper_scene(options).views.back().image;
}

struct FilmOptions {
  PixelFormat format = PixelFormat::gray8;
  double gain = 1;                      ///< of the flame's grey levels
  double level = 4;                     ///< black level
  double noise = 1;                     ///< grey levels
  std::vector<double> smear = {};       ///< added to each column, grey levels
  std::vector<double> background = {};  ///< by pixel, grey levels
  std::vector<std::uint32_t> hot = {};
  double hot_level = 0;
};

/// 8-bit samples of a picture; the same seed makes the same noise.
inline Image film(const recon::RadianceImage& picture, const FilmOptions& options, std::uint64_t seed) {
  const int width = picture.size.width;
  const int n = channels(options.format);
  return image_of({picture.size, options.format, 8}, [&](int x, int y, int c) {
    const auto pixel =
        static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
    const int seen = is_bayer(options.format) ? recon::mosaic_channel(x, y) : n == 3 ? c : 1;
    double v = options.level +
               options.gain * static_cast<double>(picture.rgb[3 * pixel + static_cast<std::size_t>(seen)]);
    if (std::ranges::binary_search(options.hot, static_cast<std::uint32_t>(pixel))) v += options.hot_level;
    if (!options.background.empty()) v += options.background[pixel];
    if (!options.smear.empty()) v += options.smear[static_cast<std::size_t>(x)];
    v += options.noise *
         random_normal(seed, 7, static_cast<std::uint64_t>(n) * pixel + static_cast<std::uint64_t>(c));
    return std::clamp(std::lround(v), 0L, 255L);
  });
}

/// What a sensor's columns hold of a picture's light, the mean of the channels it has at each pixel.
inline std::vector<double> column_light(const recon::RadianceImage& picture, PixelFormat format,
                                        double gain) {
  std::vector<double> light(static_cast<std::size_t>(picture.size.width));
  for (int y = 0; y < picture.size.height; ++y)
    for (int x = 0; x < picture.size.width; ++x) {
      const float* rgb = &picture.rgb[3 * static_cast<std::size_t>(y * picture.size.width + x)];
      const double all = channels(format) == 3
                             ? static_cast<double>(rgb[0] + rgb[1] + rgb[2]) / 3
                             : static_cast<double>(rgb[is_bayer(format) ? recon::mosaic_channel(x, y) : 1]);
      light[static_cast<std::size_t>(x)] += gain * all;
    }
  return light;
}

struct SmearedFlame {
  recon::Samples seen;   ///< with smear
  recon::Samples clean;  ///< without, the same noise
};

inline SmearedFlame smeared_flame(const recon::RadianceImage& picture, PixelFormat format, double fraction,
                                  double peak, std::uint64_t seed) {
  FilmOptions options;
  options.format = format;
  options.gain = peak / 230;
  SmearedFlame out;
  out.clean = recon::samples_of(film(picture, options, seed).view());
  options.smear = column_light(picture, format, options.gain);
  for (double& s : options.smear) s *= fraction;
  out.seen = recon::samples_of(film(picture, options, seed).view());
  return out;
}
inline SmearedFlame smeared_flame(PixelFormat format, double fraction, double peak, std::uint64_t seed) {
  static const recon::RadianceImage picture = flame_picture(11);
  return smeared_flame(picture, format, fraction, peak, seed);
}

/// Of the means over blocks of 16 x 16 pixels, which leave noise and quantisation behind; blocks with
/// saturated samples aside.
inline double rms_of(const recon::Samples& a, const recon::Samples& b) {
  constexpr int kEdge = 16;
  double squares = 0;
  int blocks = 0;
  for (int y = 0; y + kEdge <= a.size.height; y += kEdge)
    for (int x = 0; x + kEdge <= a.size.width; x += kEdge) {
      double sum = 0;
      bool saturated = false;
      for (int v = 0; v < kEdge; ++v)
        for (int u = 0; u < kEdge; ++u)
          for (int c = 0; c < a.channels(); ++c) {
            const std::size_t i = a.index(x + u, y + v, c);
            sum += static_cast<double>(a.value[i]) - static_cast<double>(b.value[i]);
            saturated = saturated || (!a.saturated.empty() && a.saturated[i] != 0) ||
                        (!b.saturated.empty() && b.saturated[i] != 0);
          }
      if (saturated) continue;
      const double mean = sum / (kEdge * kEdge * a.channels());
      squares += mean * mean;
      ++blocks;
    }
  return std::sqrt(squares / std::max(1, blocks));
}

/// RMS over the flame's box: bilinear, gradient.
inline std::pair<double, double> demosaicing_errors(const recon::RadianceImage& picture, double noise) {
  const recon::PixelBox box = recon::flame_mask(picture, 2).box;
  FilmOptions options;
  options.format = PixelFormat::bayer_rggb8;
  options.level = 0;
  options.noise = noise;
  const recon::Samples mosaic = recon::samples_of(film(picture, options, 3).view());
  const auto error = [&](recon::Demosaicing how) {
    return recon::all_channels(recon::rmse(recon::to_picture(mosaic, nullptr, how), picture, box));
  };
  return {error(recon::Demosaicing::bilinear), error(recon::Demosaicing::gradient)};
}
inline std::pair<double, double> demosaicing_errors(std::uint64_t seed, double noise) {
  return demosaicing_errors(flame_picture(seed), noise);
}

struct HotPixelRates {
  int dark_found = 0, dark_false = 0, picture_found = 0, picture_false = 0;
};

inline HotPixelRates hot_pixel_rates(const recon::RadianceImage& picture, PixelFormat format, double level,
                                     std::uint64_t seed) {
  FilmOptions options;
  options.format = format;
  options.noise = 1.5;
  options.hot_level = level;
  RandomStream random(seed, 5);
  const auto pixels =
      static_cast<std::uint64_t>(picture.size.width) * static_cast<std::uint64_t>(picture.size.height);
  while (options.hot.size() < 100) {
    options.hot.push_back(static_cast<std::uint32_t>(random.bits() % pixels));
    std::sort(options.hot.begin(), options.hot.end());
    options.hot.erase(std::unique(options.hot.begin(), options.hot.end()), options.hot.end());
  }
  std::vector<recon::Samples> dark;
  for (std::uint64_t f = 0; f < recon::kDarkFrames; ++f)
    dark.push_back(recon::samples_of(film(recon::RadianceImage(picture.size), options, 20 + f).view()));
  const auto count = [&](const std::vector<std::uint32_t>& found, int& right, int& wrong) {
    for (const std::uint32_t p : found)
      ++(std::binary_search(options.hot.begin(), options.hot.end(), p) ? right : wrong);
  };
  HotPixelRates rates;
  count(recon::hot_pixels_of_dark(recon::midmean_of(dark)), rates.dark_found, rates.dark_false);
  count(recon::hot_pixels_of_picture(recon::samples_of(film(picture, options, 40).view())),
        rates.picture_found, rates.picture_false);
  return rates;
}
inline HotPixelRates hot_pixel_rates(PixelFormat format, double level, std::uint64_t seed) {
  static const recon::RadianceImage picture = flame_picture(11);
  return hot_pixel_rates(picture, format, level, seed);
}

/// A lamp's glow and a wall lit from one side, up to 60 grey levels.
inline std::vector<double> lit_wall(ImageSize size) {
  std::vector<double> out;
  for (int y = 0; y < size.height; ++y)
    for (int x = 0; x < size.width; ++x) {
      const double u = static_cast<double>(x) / size.width;
      const double v = static_cast<double>(y) / size.height;
      const double off = (u - 0.8) * (u - 0.8) + (v - 0.3) * (v - 0.3);
      out.push_back(8 * u + 50 * std::exp(-off / 0.002));
    }
  return out;
}

struct BackgroundResidual {
  double filmed = 0, level = 0, dark_part = 0;
};

inline BackgroundResidual background_residual(const recon::RadianceImage& picture, std::uint64_t seed) {
  FilmOptions options;
  options.format = PixelFormat::rgb8;
  options.gain = 0.6;
  options.background = lit_wall(picture.size);
  const auto frame = std::make_shared<const Image>(film(picture, options, seed));
  std::vector<Image> dark;
  for (std::uint64_t f = 0; f < recon::kDarkFrames; ++f)
    dark.push_back(film(recon::RadianceImage(picture.size), options, 100 + f));
  recon::RadianceImage truth = picture;
  for (float& v : truth.rgb) v *= 0.6F;
  recon::CameraFrame camera;
  camera.frame = frame;
  camera.sensor = SensorKind::global_shutter;
  const auto off = [&] { return recon::all_channels(recon::rmse(recon::develop(camera).image, truth, {})); };
  BackgroundResidual out;
  out.filmed = recon::all_channels(recon::rmse(recon::to_radiance(frame->view()), truth, {}));
  out.level = off();
  std::vector<ImageView> views;
  for (const Image& d : dark) views.push_back(d.view());
  camera.dark = recon::share(recon::dark_picture_of(views, {}));
  out.dark_part = off();
  return out;
}
inline BackgroundResidual background_residual(std::uint64_t seed) {
  return background_residual(flame_picture(11), seed);
}

}  // namespace emberlock::test
