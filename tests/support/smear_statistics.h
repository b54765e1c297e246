// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <thread>
#include <vector>

#include <Eigen/Dense>

#include "smear_sync/detect/detect.h"
#include "tests/support/compressed_frames.h"
#include "tests/support/smear_frames.h"

// Many random frames of a strobe, what the detector makes of them, and the bound on what anybody can.
namespace emberlock::test {

/// One lamp and, where `amplitude` > 0, one dot: what a frame was drawn from.
struct SmearTruth {
  double x = 0, lamp_y = 0, dot_y = 0, radius = 0;
  double bright = 0;     ///< of the lamp: over 255 it saturates
  double amplitude = 0;  ///< of the dot
  double noise = 0, shot = 0;
  double blur = 0.8;

  [[nodiscard]] SmearScene scene() const {
    SmearScene s(kWidth, kHeight, kBackground);
    s.disk(x, lamp_y, radius, bright, blur);
    if (amplitude > 0) s.disk(x, dot_y, radius, amplitude, blur);
    return s;
  }
  static constexpr int kWidth = 160, kHeight = 360;
  static constexpr double kBackground = 12;
};

struct SmearRange {
  double min_radius = 3, max_radius = 10;
  double min_amplitude = 4, max_amplitude = 40;
  double min_noise = 1, max_noise = 1.5;
  double max_shot = 0.2;
};

inline SmearTruth draw_truth(const SmearRange& range, std::uint64_t seed, std::uint64_t frame) {
  RandomStream random(seed, frame);
  SmearTruth t;
  t.radius = random.uniform(range.min_radius, range.max_radius);
  t.x = random.uniform(70, 90);
  t.lamp_y = random.uniform(60, 300);
  // Whole rows of charge, clear of the lamp.
  const double shift = std::floor(random.uniform(2.5 * t.radius + 15, 155));
  t.dot_y = t.lamp_y > 180 ? t.lamp_y - shift : t.lamp_y + shift;
  t.amplitude = random.uniform(range.min_amplitude, range.max_amplitude);
  t.noise = random.uniform(range.min_noise, range.max_noise);
  t.shot = range.max_shot * random.uniform();
  t.bright = random.uniform() < 0.5 ? 200 : 3000;
  return t;
}

/// The Cramer-Rao bound on the standard error of the dot's row, from the Fisher information of all samples
/// near it, in every colour, under Gaussian noise of variance noise^2 + shot * signal + rounding. Unknown
/// beside the row: the amplitude, the column and the baseline of each column and colour, which its samples in
/// `kHeight` rows tell. Nothing of the detector's model enters: slopes are differences of the drawn disk.
inline double cramer_rao(const SmearTruth& t, PixelFormat format = PixelFormat::gray8, int bit_depth = 8) {
  constexpr double kStep = 0.02;
  const int reach = static_cast<int>(t.radius + 6 * t.blur) + 1;
  const int left = static_cast<int>(t.x) - reach;
  const int top = static_cast<int>(t.dot_y) - reach;
  const int rows = 2 * reach + 2;
  const double rounding = std::pow(255.0 / ((1 << bit_depth) - 1), 2) / 12;
  const int kinds = is_bayer(format) ? 2 : channels(format);  // colours in a column
  const int apart = is_bayer(format) ? 2 : 1;                 // rows between samples of one colour
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();      // amplitude, x, y
  for (int x = left; x < left + rows; ++x) {
    std::vector<std::array<double, 3>> disk;  // its value and its slopes by column and row, of amplitude 1
    for (int y = top; y < top + rows; ++y) {
      const auto at = [&](double dx, double dy) {
        return SmearScene::coverage(x - t.x - dx, y - t.dot_y - dy, t.radius, t.blur);
      };
      disk.push_back({at(0, 0), (at(kStep, 0) - at(-kStep, 0)) / (2 * kStep),
                      (at(0, kStep) - at(0, -kStep)) / (2 * kStep)});
    }
    for (int kind = 0; kind < kinds; ++kind) {
      const int first = is_bayer(format) ? kind : 0;
      const double gain = SmearScene::gain(format, x, top + first, kind);
      const double dark = t.noise * t.noise + t.shot * SmearTruth::kBackground * gain + rounding;
      const auto weight =
          [&](double variance) {  // the mean tells, and a little the variance, which grows with it
            return 1 / variance + 0.5 * std::pow(t.shot / variance, 2);
          };
      Eigen::Vector3d with_baseline = Eigen::Vector3d::Zero();
      double baseline = static_cast<double>((SmearTruth::kHeight - rows) / apart) * weight(dark);
      for (int i = first; i < rows; i += apart) {
        const auto& [g, by_x, by_y] = disk[static_cast<std::size_t>(i)];
        const Eigen::Vector3d slope = gain * Eigen::Vector3d(g, t.amplitude * by_x, t.amplitude * by_y);
        const double w = weight(dark + t.shot * t.amplitude * g * gain);
        information += w * slope * slope.transpose();
        with_baseline += w * slope;
        baseline += w;
      }
      information -= with_baseline * with_baseline.transpose() / baseline;
    }
  }
  return std::sqrt(information.inverse()(2, 2));
}

/// What became of many frames.
struct SmearTally {
  int frames = 0;
  int dots = 0;       ///< frames that read a dot or a comb
  int found = 0;      ///< exactly one, within 3 rows of the truth
  int abstained = 0;  ///< read `ambiguous`, `blind` or `saturated`
  double bias = 0, squares = 0, bounds = 0,
         normed = 0;  ///< sums over the found: of errors, (error / bound)^2
  int within = 0;     ///< found, the error at most two stated sigma

  void add(const SmearTruth& t, const smear::SmearReading& r, PixelFormat format = PixelFormat::gray8,
           int bit_depth = 8) {
    ++frames;
    if (r.state == smear::SmearState::ambiguous || r.state == smear::SmearState::blind ||
        r.state == smear::SmearState::saturated)
      ++abstained;
    if (r.dots.empty()) return;
    ++dots;
    if (t.amplitude <= 0 || r.dots.size() != 1) return;
    const double error = r.dots[0].y.value() - t.dot_y;
    if (std::abs(error) > 3) return;
    const double bound = cramer_rao(t, format, bit_depth);
    ++found;
    bias += error;
    squares += error * error;
    bounds += bound * bound;
    normed += error * error / (bound * bound);
    if (std::abs(error) <= 2 * r.dots[0].sigma.value()) ++within;
  }
  SmearTally& operator+=(const SmearTally& o) {
    frames += o.frames;
    dots += o.dots;
    found += o.found;
    abstained += o.abstained;
    bias += o.bias;
    squares += o.squares;
    bounds += o.bounds;
    normed += o.normed;
    within += o.within;
    return *this;
  }
  [[nodiscard]] double mean_error() const { return bias / found; }
  [[nodiscard]] double rms() const { return std::sqrt(squares / found); }
  [[nodiscard]] double bound() const { return std::sqrt(bounds / found); }
  /// RMS of the error in units of each frame's own bound: no easy frame hides a hard one.
  [[nodiscard]] double over_bound() const { return std::sqrt(normed / found); }
  [[nodiscard]] double within_two_sigma() const { return static_cast<double>(within) / found; }
};

/// Clips of `clip` frames, first frame's number in, tally out; over all cores, the same whatever their
/// number.
inline SmearTally tally(int frames, int clip, const std::function<SmearTally(int first, int count)>& read) {
  const int clips = (frames + clip - 1) / clip;
  const int workers = std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  std::vector<SmearTally> parts(static_cast<std::size_t>(clips));
  std::vector<std::thread> threads;
  for (int w = 0; w < workers; ++w) {
    threads.emplace_back([&, w] {
      for (int i = w; i < clips; i += workers)
        parts[static_cast<std::size_t>(i)] = read(i * clip, std::min(clip, frames - i * clip));
    });
  }
  for (std::thread& t : threads) t.join();
  SmearTally sum;
  for (const SmearTally& part : parts) sum += part;
  return sum;
}

/// Frames of one dot each.
inline SmearTally read_dots(const SmearRange& range, const SmearScene::Sensor& sensor, int frames,
                            std::uint64_t seed) {
  return tally(frames, 16, [&](int first, int count) {
    SmearTally sum;
    for (int i = first; i < first + count; ++i) {
      const SmearTruth t = draw_truth(range, seed, static_cast<std::uint64_t>(i));
      SmearScene::Sensor s = sensor;
      s.noise = t.noise;
      s.shot = t.shot;
      s.seed = seed * 1'000'003 + static_cast<std::uint64_t>(i);
      sum.add(t, smear::detect(t.scene().image(s).view()), s.format, s.bit_depth);
    }
    return sum;
  });
}

/// A lamp without a dot, among hot pixels, half of them with a halo, a third with a bloom.
inline SmearScene dotless_scene(std::uint64_t seed, int frame) {
  RandomStream random(seed, static_cast<std::uint64_t>(frame));
  SmearTruth t = draw_truth({.min_radius = 2.2}, seed, static_cast<std::uint64_t>(frame));
  t.amplitude = 0;
  SmearScene scene = t.scene();
  if (frame % 2 == 0) scene.halo(t.x, t.lamp_y, random.uniform(10, 100), random.uniform(4, 12));
  if (frame % 3 == 0)
    scene.bloom(t.x, t.lamp_y, t.radius / 2, random.uniform(5, 60), random.uniform(5, 60), 500);
  for (int hot = 0; hot < 60; ++hot) {
    const int x = static_cast<int>(random.uniform(1, SmearTruth::kWidth - 2));
    const int y = static_cast<int>(random.uniform(1, SmearTruth::kHeight - 2));
    const double value = random.uniform(5, 200);
    scene.at(x, y) += value;
    if (hot % 4 == 0) scene.at(x + 1, y) += value * random.uniform();
    if (hot % 8 == 0) scene.at(x, y + 1) += value * random.uniform();
  }
  return scene;
}

inline SmearTally read_dotless(PixelFormat format, int frames, std::uint64_t seed) {
  return tally(frames, 16, [&](int first, int count) {
    SmearTally sum;
    for (int i = first; i < first + count; ++i) {
      const double noise = 0.3 + 2.7 * random_uniform(seed, 5, static_cast<std::uint64_t>(i));
      const Image image = dotless_scene(seed, i).image(
          {.noise = noise, .seed = seed * 1'000'003 + static_cast<std::uint64_t>(i), .format = format});
      sum.add({}, smear::detect(image.view()));
    }
    return sum;
  });
}

/// What only looks like a dot: frames without one.
enum class Lookalike {
  disk,     ///< a blinking reflection in the lamp's column, 1.2..4 lamps wide
  ellipse,  ///< the same, as tall as the lamp
  soft,     ///< the same, a Gaussian
  line,     ///< a steady line that may saturate, uneven by up to a tenth along its rows
};
constexpr Lookalike kReflections[] = {Lookalike::disk, Lookalike::ellipse, Lookalike::soft};

/// The lamp of draw_truth, every third with a halo, and the lookalike.
inline SmearTruth lookalike_truth(std::uint64_t seed, int frame) {
  SmearTruth t = draw_truth({}, seed, static_cast<std::uint64_t>(frame));
  t.amplitude = 0;
  return t;
}
inline SmearScene lookalike_scene(Lookalike kind, std::uint64_t seed, int frame) {
  const SmearTruth t = lookalike_truth(seed, frame);
  RandomStream random(seed + 1, static_cast<std::uint64_t>(frame));
  const auto log_uniform = [&](double low, double high) {
    return low * std::pow(high / low, random.uniform());
  };
  SmearScene scene = t.scene();
  if (kind == Lookalike::line) {
    const double ripple = random.uniform(0, 0.1);
    return scene.line(t.x, t.radius, random.uniform(100, 400), ripple, log_uniform(60, 2000));
  }
  const double width = log_uniform(1.2, 4) * t.radius;
  const double amplitude = log_uniform(8, 400);
  const double x = t.x + random.uniform(-0.5, 0.5);
  const double blur = random.uniform(0.8, 2.5);
  if (frame % 3 == 0) scene.halo(t.x, t.lamp_y, random.uniform(10, 100), random.uniform(4, 12));
  if (kind == Lookalike::disk) return scene.disk(x, t.dot_y, width, amplitude, blur);
  if (kind == Lookalike::ellipse) return scene.ellipse(x, t.dot_y, width, t.radius, amplitude, blur);
  return scene.soft_spot(x, t.dot_y, width, amplitude);
}

inline SmearTally read_lookalikes(Lookalike kind, int frames, std::uint64_t seed) {
  return tally(frames, 16, [&](int first, int count) {
    SmearTally sum;
    for (int i = first; i < first + count; ++i) {
      const SmearTruth t = lookalike_truth(seed, i);
      const Image image = lookalike_scene(kind, seed, i)
                              .image({.noise = t.noise,
                                      .shot = t.shot,
                                      .seed = seed * 1'000'003 + static_cast<std::uint64_t>(i)});
      sum.add({}, smear::detect(image.view()));
    }
    return sum;
  });
}

enum class Dots { none, one };

/// Films of one lamp, as a compressor brings them back; the dot walks a row a frame.
inline SmearTally read_compressed(
    const std::function<std::vector<Image>(const std::vector<Image>&)>& compress, Dots dots,
    const SmearRange& range, int frames, std::uint64_t seed) {
  return tally(frames, 48, [&](int first, int count) {
    SmearTruth t = draw_truth(range, seed, static_cast<std::uint64_t>(first));
    if (dots == Dots::none) t.amplitude = 0;
    t.noise *= 0.5 + random_uniform(seed, 6, static_cast<std::uint64_t>(first));
    std::vector<SmearTruth> truths;
    std::vector<Image> film;
    for (int i = 0; i < count; ++i) {
      if (i > 0) t.dot_y += t.dot_y < t.lamp_y ? -1 : 1;
      if (t.dot_y < 5 || t.dot_y > SmearTruth::kHeight - 6) t.dot_y = t.lamp_y + (t.lamp_y > 180 ? -50 : 50);
      truths.push_back(t);
      film.push_back(t.scene().image({.noise = t.noise,
                                      .shot = t.shot,
                                      .seed = seed * 1'000'003 + static_cast<std::uint64_t>(first + i)}));
    }
    const std::vector<Image> seen = compress(film);
    SmearTally sum;
    for (std::size_t i = 0; i < seen.size(); ++i) sum.add(truths[i], smear::detect(seen[i].view()));
    return sum;
  });
}

inline std::vector<Image> jpeg_film(const std::vector<Image>& film, int quality) {
  std::vector<Image> out;
  out.reserve(film.size());
  for (const Image& image : film) out.push_back(through_jpeg(image, quality));
  return out;
}

}  // namespace emberlock::test
