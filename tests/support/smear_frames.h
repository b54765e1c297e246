// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "base/image.h"
#include "base/random.h"

namespace emberlock::test {

/// Smear frames drawn from their description with known truth, independent of every model in the product. A
/// scene is real-valued grey levels of 8 bits; `image()` adds the noise and rounds.
class SmearScene {
 public:
  SmearScene(int width, int height, double background = 12)
      : width_(width),
        height_(height),
        v_(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), background) {}

  [[nodiscard]] int width() const { return width_; }
  [[nodiscard]] int height() const { return height_; }
  double& at(int x, int y) {
    return v_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }
  [[nodiscard]] double at(int x, int y) const {
    return v_[static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x)];
  }

  /// A disk as a lens and square pixels draw it: 4 x 4 samples a pixel of a disk with a Gaussian edge.
  SmearScene& disk(double x, double y, double radius, double amplitude, double blur = 0.8) {
    const int reach = static_cast<int>(std::ceil(radius + 5 * blur)) + 1;
    for (int py = std::max(0, static_cast<int>(y) - reach);
         py <= std::min(height_ - 1, static_cast<int>(y) + reach); ++py) {
      for (int px = std::max(0, static_cast<int>(x) - reach);
           px <= std::min(width_ - 1, static_cast<int>(x) + reach); ++px) {
        at(px, py) += amplitude * coverage(px - x, py - y, radius, blur);
      }
    }
    return *this;
  }
  static double coverage(double dx, double dy, double radius, double blur) {
    double sum = 0;
    for (int i = 0; i < 16; ++i) {
      const double sx = dx + (i % 4 - 1.5) / 4;
      const double sy = dy + (i / 4 - 1.5) / 4;  // NOLINT(bugprone-integer-division)
      sum += 0.5 * std::erfc((std::hypot(sx, sy) - radius) / (1.4142135623730951 * blur));
    }
    return sum / 16;
  }
  /// What covers `amplitude` times a part of each pixel within its half widths across columns and along rows,
  /// with an edge of this blur, to first order in the distance from the edge.
  SmearScene& ellipse(double x, double y, double across, double along, double amplitude, double blur) {
    for (int py = 0; py < height_; ++py) {
      for (int px = 0; px < width_; ++px) {
        const double dx = px - x;
        const double dy = py - y;
        const double r = std::hypot(dx / across, dy / along);
        const double slope = std::hypot(dx / (across * across), dy / (along * along)) / std::max(r, 1e-9);
        const double outside = (r - 1) / std::max(slope, 1e-9);
        at(px, py) += amplitude * 0.5 * std::erfc(outside / (1.4142135623730951 * blur));
      }
    }
    return *this;
  }
  /// A Gaussian of this half width at half height.
  SmearScene& soft_spot(double x, double y, double half_width, double amplitude) {
    const double fall = std::log(2.0) / (half_width * half_width);
    for (int py = 0; py < height_; ++py) {
      for (int px = 0; px < width_; ++px)
        at(px, py) += amplitude * std::exp(-fall * ((px - x) * (px - x) + (py - y) * (py - y)));
    }
    return *this;
  }
  /// Glare: falls as 1 / (1 + (r / scale)^2) to all sides.
  SmearScene& halo(double x, double y, double amplitude, double scale) {
    for (int py = 0; py < height_; ++py) {
      for (int px = 0; px < width_; ++px)
        at(px, py) += amplitude / (1 + ((px - x) * (px - x) + (py - y) * (py - y)) / (scale * scale));
    }
    return *this;
  }
  /// Charge that overflows along the column: `above` and `below` are its lengths, decaying linearly.
  SmearScene& bloom(double x, double y, double half_width, double above, double below, double amplitude) {
    for (int py = 0; py < height_; ++py) {
      const double length = py < y ? above : below;
      const double fade = std::max(0.0, 1 - std::abs(py - y) / std::max(length, 1e-9));
      for (int px = 0; px < width_; ++px) {
        at(px, py) += amplitude * fade * std::clamp(half_width + 0.5 - std::abs(px - x), 0.0, 1.0);
      }
    }
    return *this;
  }
  /// A full-height line with the lamp's profile across, brighter and darker by `ripple` of itself along a
  /// sine of this period in rows.
  SmearScene& line(double x, double radius, double amplitude, double ripple = 0, double period = 1) {
    for (int py = 0; py < height_; ++py) {
      const double bright = amplitude * (1 + ripple * std::sin(2 * 3.141592653589793 * py / period));
      for (int px = 0; px < width_; ++px) {
        const double d = std::abs(px - x);
        at(px, py) += d < radius ? bright * std::sqrt(1 - d * d / (radius * radius)) : 0;
      }
    }
    return *this;
  }

  /// What channel c of a pixel sees of the scene.
  static double gain(PixelFormat format, int x, int y, int c) {
    if (is_bayer(format)) {
      if (x % 2 == 0 && y % 2 == 0) return 0.7;
      return x % 2 == 1 && y % 2 == 1 ? 0.5 : 1;
    }
    if (channels(format) == 3) return c == 0 ? 0.7 : c == 1 ? 1.0 : 0.5;
    return 1;
  }

  struct Sensor {
    double noise = 1.2;  ///< grey levels of 8 bits
    double shot = 0;     ///< variance a grey level
    int bit_depth = 8;
    double gamma = 1;  ///< output = 255 (v / 255)^(1 / gamma), after the noise
    std::uint64_t seed = 1;
    PixelFormat format = PixelFormat::gray8;
  };
  /// The frame that a sensor makes of the scene. Bayer and RGB: gains R 0.7, G 1, B 0.5 of the scene.
  [[nodiscard]] Image image(const Sensor& s) const {
    Image out({{width_, height_}, s.format, s.bit_depth});
    const int white = out.layout().white();
    const int n = channels(s.format);
    Normals normals(s.seed);
    for (int y = 0; y < height_; ++y) {
      for (int x = 0; x < width_; ++x) {
        for (int c = 0; c < n; ++c) {
          double v = at(x, y) * gain(s.format, x, y, c);
          const double sigma =
              s.shot == 0 ? s.noise : std::sqrt(s.noise * s.noise + s.shot * std::max(0.0, v));
          v += sigma * normals.next();
          v = std::clamp(v / 255, 0.0, 1.0);
          if (s.gamma != 1) v = std::pow(v, 1 / s.gamma);
          const long sample = std::lround(v * white);
          if (bytes_per_sample(s.format) == 1) {
            out.row_as<std::uint8_t>(y)[x * n + c] = static_cast<std::uint8_t>(sample);
          } else {
            out.row_as<std::uint16_t>(y)[x * n + c] = static_cast<std::uint16_t>(sample);
          }
        }
      }
    }
    return out;
  }

 private:
  /// Standard normals, four from one draw: quantiles by table, and drawn anew in the last bin of either tail.
  class Normals {
   public:
    explicit Normals(std::uint64_t seed) : random_(seed, 77) {}
    double next() {
      if (left_ == 0) {
        bits_ = random_.bits();
        left_ = 4;
      }
      const auto bin = static_cast<std::size_t>(bits_ & 0xffff);
      bits_ >>= 16;
      --left_;
      if (bin != 0 && bin != 0xffff) return static_cast<double>(table()[bin]);
      const double tail = quantile(random_.uniform() / 0x10000);
      return bin == 0 ? tail : -tail;
    }

   private:
    /// By bisection: P(normal < x) = p for p <= 1/2.
    static double quantile(double p) {
      double low = -10;
      double high = 0;
      for (int i = 0; i < 40; ++i) {
        const double middle = (low + high) / 2;
        (0.5 * std::erfc(-middle / 1.4142135623730951) < p ? low : high) = middle;
      }
      return (low + high) / 2;
    }
    static const std::vector<float>& table() {
      static const std::vector<float> quantiles = [] {
        std::vector<float> t(0x10000);
        for (std::size_t i = 0; i < t.size() / 2; ++i) {
          t[i] = static_cast<float>(quantile((static_cast<double>(i) + 0.5) / 0x10000));
          t[t.size() - 1 - i] = -t[i];
        }
        return t;
      }();
      return quantiles;
    }

    RandomStream random_;
    std::uint64_t bits_ = 0;
    int left_ = 0;
  };

  int width_, height_;
  std::vector<double> v_;
};

}  // namespace emberlock::test
