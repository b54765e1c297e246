#include "drivers/virtual/sensor.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "drivers/virtual/normal_table.h"
#include "smear_sync/ccd_model.h"

namespace emberlock {
namespace {

constexpr double kEdgeSigma = 0.7;      // blur of the lamp's rim, pixels
constexpr double kFaintest = 0.25;      // glare below this many grey levels is cut off
constexpr double kOverflowLevel = 300;  // above white
constexpr double kWhite = 255;

enum Stream : std::uint64_t { kNoiseStream = 1, kHotPixelStream = 2 };

/// The part of [x - reach, x + reach] by [y - up, y + down] that the image has.
Stamp stamp_about(const VirtualLamp& lamp, double reach, double up, double down, ImageSize size) {
  const auto column = [&](double x) { return static_cast<int>(std::clamp(x, 0.0, double(size.width))); };
  const auto line = [&](double y) { return static_cast<int>(std::clamp(y, 0.0, double(size.height))); };
  Stamp s;
  s.x0 = column(std::ceil(lamp.x - reach));
  s.y0 = line(std::ceil(lamp.y.value() - up));
  s.width = column(std::floor(lamp.x + reach) + 1) - s.x0;
  s.height = line(std::floor(lamp.y.value() + down) + 1) - s.y0;
  s.values.resize(static_cast<std::size_t>(s.width) * s.height);
  return s;
}

Stamp lamp_shape(const VirtualLamp& lamp, ImageSize size) {
  const double reach = lamp.radius + 5 * kEdgeSigma;
  Stamp s = stamp_about(lamp, reach, reach, reach, size);
  for (int y = s.y0; y < s.y1(); ++y) {
    for (int i = 0; i < s.width; ++i) {
      const double rho = std::hypot(s.x0 + i - lamp.x, y - lamp.y.value());
      s.row(y)[i] = static_cast<float>(0.5 * std::erfc((rho - lamp.radius) / (std::sqrt(2.0) * kEdgeSigma)));
    }
  }
  return s;
}

double halo_reach(const VirtualScene& scene) {
  return scene.halo_length * std::log(std::max(1.0, scene.halo_level / kFaintest));
}

/// Glare all round, and columns of the disk that overflow up and down.
double bloom_at(const VirtualScene& scene, const VirtualLamp& lamp, double dx, double dy) {
  const double beyond_rim = std::max(0.0, std::hypot(dx, dy) - lamp.radius);
  double level = scene.halo_level * std::exp(-beyond_rim / scene.halo_length);
  if (std::abs(dx) <= lamp.radius) {
    const double rim = std::sqrt(lamp.radius * lamp.radius - dx * dx);
    const double past = std::abs(dy) - rim - (dy < 0 ? scene.overflow_up : scene.overflow_down);
    if (scene.overflow_up + scene.overflow_down > 0) level += kOverflowLevel * std::exp(-std::max(0.0, past));
  }
  return level;
}

void add_scaled(const float* from, int count, float scale, float* to) {
  for (int i = 0; i < count; ++i) to[i] += scale * from[i];
}

/// Grey levels that a pulse leaves at the lamp's centre in all.
double charge(const VirtualScene& scene, const LightPulse& pulse) {
  return pulse.kind == StrobeOutput::steady ? scene.steady_rate * pulse.width.value() : scene.flash_level;
}

float luminance(const float* rgb) { return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2]; }

}  // namespace

VirtualSensor::VirtualSensor(const VirtualCameraOptions& options, int number, std::uint64_t seed)
    : layout_(options.layout),
      timing_(options.timing),
      sweep_out_(options.sweep_out),
      lamp_(options.lamp),
      number_(number),
      seed_(stream_seed(seed, options.id)),
      lamp_shape_(lamp_shape(options.lamp, options.layout.size)) {
  const auto samples = static_cast<std::size_t>(layout_.size.width) * channels(layout_.format);
  row_.resize(samples);
  normal_.resize(samples + 2);  // noise comes three at a time
}

Image VirtualSensor::expose(const VirtualScene& scene, std::span<const LightPulse> pulses,
                            const Exposure& exposure) {
  draw_lamp_light(scene, pulses, exposure.duration);
  draw_flame(scene, exposure);
  const int hot = scene.has(Pass::hot_pixels) ? scene.hot_pixels : 0;
  if (hot_.size() != static_cast<std::size_t>(hot)) hot_ = draw_hot_pixels(hot);

  const std::uint64_t key = random_bits(seed_, kNoiseStream, exposure.frame_id);
  const bool noisy = scene.has(Pass::shot_noise) || scene.has(Pass::read_noise);
  Image image(layout_);
  for (int y = 0; y < layout_.size.height; ++y) {
    compose_row(scene, y);
    if (noisy) add_noise(scene, y, key);
    store_row(scene, y, image);
  }
  return image;
}

void VirtualSensor::draw_lamp_light(const VirtualScene& scene, std::span<const LightPulse> pulses,
                                    Seconds exposure) {
  const double image_height = layout_.size.height;
  const bool bloom = scene.has(Pass::bloom);
  const double reach = lamp_.radius + std::max(5 * kEdgeSigma, bloom ? halo_reach(scene) : 0);
  light_ = stamp_about({lamp_.x, Rows(image_height / 2), lamp_.radius}, reach, image_height, image_height,
                       layout_.size);

  double level = 0;
  for (const LightPulse& p : pulses) {
    const Seconds lit = std::min(p.begin + p.width, Seconds(0)) - std::max(p.begin, -exposure);
    if (lit > Seconds(0)) level += charge(scene, p) * (lit / p.width);
  }
  const int margin = lamp_shape_.x0 - light_.x0;
  if (scene.has(Pass::lamp) && level > 0) {
    for (int y = lamp_shape_.y0; y < lamp_shape_.y1(); ++y) {
      add_scaled(lamp_shape_.row(y), lamp_shape_.width, static_cast<float>(level), light_.row(y) + margin);
    }
  }
  if (bloom && level > kWhite) {
    const double glare = lamp_.radius + halo_reach(scene);
    const double tail = lamp_.radius + std::log(kOverflowLevel / kFaintest);
    const Stamp area = stamp_about(lamp_, glare, std::max(glare, tail + scene.overflow_up),
                                   std::max(glare, tail + scene.overflow_down), layout_.size);
    for (int y = area.y0; y < area.y1(); ++y) {
      float* to = light_.row(y) + (area.x0 - light_.x0);
      for (int i = 0; i < area.width; ++i) {
        to[i] += static_cast<float>(bloom_at(scene, lamp_, area.x0 + i - lamp_.x, y - lamp_.y.value()));
      }
    }
  }
  if (scene.has(Pass::smear)) add_smear(scene, pulses);
}

void VirtualSensor::add_smear(const VirtualScene& scene, std::span<const LightPulse> pulses) {
  const int margin = lamp_shape_.x0 - light_.x0;
  for (const LightPulse& p : pulses) {
    const double leak = charge(scene, p) * scene.smear_leak;
    for (const FlashPart& part : split(timing_, {p.begin + p.width / 2, p.width})) {
      // Every lit row of the lamp leaks into the packet that stands under it.
      for (int y = lamp_shape_.y0; y < lamp_shape_.y1(); ++y) {
        const auto at = landing(timing_, y, part, sweep_out_);
        if (!at || at->image != 0) continue;
        add_scaled(lamp_shape_.row(y), lamp_shape_.width, static_cast<float>(leak * part.fraction),
                   light_.row(at->row) + margin);
      }
    }
  }
}

void VirtualSensor::draw_flame(const VirtualScene& scene, const Exposure& exposure) {
  flame_.clear();
  if (!scene.has(Pass::flame)) return;
  flame_.resize(3 * static_cast<std::size_t>(layout_.size.width) * layout_.size.height);
  scene.flame->add_radiance(number_, exposure.begin, exposure.duration, flame_);
}

void VirtualSensor::compose_row(const VirtualScene& scene, int y) {
  const int width = layout_.size.width;
  const int n = channels(layout_.format);
  std::fill(row_.begin(), row_.end(), static_cast<float>(scene.background));
  if (!flame_.empty()) {
    const float* rgb = flame_.data() + 3 * static_cast<std::size_t>(width) * y;
    if (n == 3) {
      add_scaled(rgb, 3 * width, 1, row_.data());
    } else if (is_bayer(layout_.format)) {
      for (int x = 0; x < width; ++x) row_[x] += rgb[3 * x + (x & 1) + (y & 1)];  // R G / G B
    } else {
      for (int x = 0; x < width; ++x) row_[x] += luminance(rgb + 3 * x);
    }
  }
  const float* white = light_.row(y);  // the strobe is white: the same for every colour
  for (int i = 0; i < light_.width; ++i) {
    for (int c = 0; c < n; ++c) row_[(light_.x0 + i) * n + c] += white[i];
  }
  const auto first =
      std::lower_bound(hot_.begin(), hot_.end(), y, [](const Point& p, int v) { return p.y < v; });
  for (auto p = first; p != hot_.end() && p->y == y; ++p) row_[p->sample] += p->level;
}

void VirtualSensor::add_noise(const VirtualScene& scene, int y, std::uint64_t key) {
  // The sum of two independent normal numbers is one of the summed variance: both passes share a draw.
  const double read = scene.has(Pass::read_noise) ? scene.read_noise * scene.read_noise : 0;
  const double shot = scene.has(Pass::shot_noise) ? 1 / scene.electrons_per_level : 0;
  const NormalTable& normal = NormalTable::instance();
  const std::size_t samples = row_.size();
  std::uint64_t counter = static_cast<std::uint64_t>(y) << 32;
  for (std::size_t i = 0; i < samples; i += 3) {
    const std::uint64_t bits = mix64(counter++ ^ key);
    normal_[i] = normal(bits);
    normal_[i + 1] = normal(bits >> NormalTable::kBitsEach);
    normal_[i + 2] = normal(bits >> (2 * NormalTable::kBitsEach));
  }
  const auto r = static_cast<float>(read);
  const auto s = static_cast<float>(shot);
  for (std::size_t i = 0; i < samples; ++i)
    row_[i] += normal_[i] * std::sqrt(r + s * std::max(0.0F, row_[i]));
}

void VirtualSensor::store_row(const VirtualScene& scene, int y, Image& image) const {
  const int bits =
      scene.has(Pass::quantise) ? std::min(scene.adc_bits, layout_.bit_depth) : layout_.bit_depth;
  const auto adc_white = static_cast<float>((1 << bits) - 1);
  const float scale = adc_white / static_cast<float>(kWhite);
  const auto widen = static_cast<float>(layout_.white()) / adc_white;
  const auto to_nearest = [half = 0.5F](float v) {
    return static_cast<int>(v + half);
  };  // v >= 0; lround is slow
  const auto convert = [&](auto* to) {
    using Sample = std::remove_pointer_t<decltype(to)>;
    for (std::size_t i = 0; i < row_.size(); ++i) {
      const int code = to_nearest(std::min(std::max(0.0F, row_[i] * scale), adc_white));
      to[i] = static_cast<Sample>(to_nearest(static_cast<float>(code) * widen));
    }
  };
  bytes_per_sample(layout_.format) == 1 ? convert(image.row_as<std::uint8_t>(y))
                                        : convert(image.row_as<std::uint16_t>(y));
}

std::vector<VirtualSensor::Point> VirtualSensor::draw_hot_pixels(int count) const {
  RandomStream random(seed_, kHotPixelStream);
  std::vector<Point> points(static_cast<std::size_t>(count));
  for (Point& p : points) {
    p.sample = static_cast<int>(random.uniform(0, static_cast<double>(row_.size())));
    p.y = static_cast<int>(random.uniform(0, layout_.size.height));
    p.level = static_cast<float>(random.uniform(15, 200));
  }
  std::stable_sort(points.begin(), points.end(), [](const Point& a, const Point& b) { return a.y < b.y; });
  return points;
}

}  // namespace emberlock
