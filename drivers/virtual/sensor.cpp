// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/sensor.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"
#include "drivers/virtual/normal_table.h"
#include "smear_sync/ccd_model.h"

namespace emberlock::drivers {
namespace {

constexpr double kEdgeSigma = 0.7;      // blur of the lamp's rim, pixels
constexpr double kFaintest = 0.25;      // grey levels; fainter glare is cut off
constexpr double kOverflowLevel = 300;  // above white
constexpr double kWhite = 255;
constexpr double kRoomReach = 0.6;  // part of the image's width over which the room's light falls to 1 / e

enum SensorStream : std::uint64_t { kNoiseStream = 1, kHotPixelStream = 2 };

/// The part of [x - reach, x + reach] by [y - up, y + down] that lies in the image.
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

/// Glare on all sides, and overflow of the disk's columns up and down.
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

/// The glare and overflow of a saturated lamp.
Stamp bloom_shape(const VirtualScene& scene, const VirtualLamp& lamp, ImageSize size) {
  const double glare = lamp.radius + halo_reach(scene);
  const double tail = lamp.radius + std::log(kOverflowLevel / kFaintest);
  Stamp s = stamp_about(lamp, glare, std::max(glare, tail + scene.overflow_up),
                        std::max(glare, tail + scene.overflow_down), size);
  for (int y = s.y0; y < s.y1(); ++y) {
    for (int i = 0; i < s.width; ++i) {
      s.row(y)[i] = static_cast<float>(bloom_at(scene, lamp, s.x0 + i - lamp.x, y - lamp.y.value()));
    }
  }
  return s;
}

void add_scaled(const float* from, int count, float scale, float* to) {
  for (int i = 0; i < count; ++i) to[i] += scale * from[i];
}

/// `to` covers the columns of `stamp` and every row of the image; scale(y) is the factor of row y.
void add_rows(const Stamp& stamp, const auto& scale, Stamp& to) {
  for (int y = stamp.y0; y < stamp.y1(); ++y) {
    add_scaled(stamp.row(y), stamp.width, scale(y), to.row(y) + (stamp.x0 - to.x0));
  }
}

void add_stamp(const Stamp& stamp, float scale, Stamp& to) {
  add_rows(
      stamp, [scale](int) { return scale; }, to);
}

/// The decrease of the room's light along one axis of `size` pixels.
std::vector<float> falloff(int size, double centre, double reach) {
  std::vector<float> part(static_cast<std::size_t>(size));
  for (int i = 0; i < size; ++i)
    part[static_cast<std::size_t>(i)] = static_cast<float>(std::exp(-std::pow((i - centre) / reach, 2)));
  return part;
}

/// Total grey levels that a pulse adds at the lamp's centre.
double charge(const VirtualScene& scene, const LightPulse& pulse) {
  return pulse.kind == StrobeOutput::steady ? scene.steady_rate * pulse.width.value() : scene.flash_level;
}

float luminance(const float* rgb) { return 0.2126F * rgb[0] + 0.7152F * rgb[1] + 0.0722F * rgb[2]; }

}  // namespace

VirtualSensor::VirtualSensor(const VirtualCameraOptions& options, int number, std::uint64_t seed)
    : layout_(options.layout),
      kind_(options.sensor),
      timing_(options.timing),
      sweep_out_(options.sweep_out),
      lamp_(options.lamp),
      number_(number),
      seed_(stream_seed(seed, options.id)),
      lamp_shape_(lamp_shape(options.lamp, options.layout.size)) {
  const auto samples = static_cast<std::size_t>(layout_.size.width) * channels(layout_.format);
  row_.resize(samples);
  normal_.resize(samples + 2);  // noise is generated three samples at a time
}

template <class Variance>
void VirtualSensor::add_noise(const Shot& shot, int y, Variance variance) {
  const NormalTable& normal = NormalTable::instance();
  const std::size_t samples = row_.size();
  std::uint64_t counter = static_cast<std::uint64_t>(y) << 32;
  for (std::size_t i = 0; i < samples; i += 3) {
    const std::uint64_t bits = mix64(counter++ ^ shot.noise_key);
    normal_[i] = normal(bits);
    normal_[i + 1] = normal(bits >> NormalTable::kBitsEach);
    normal_[i + 2] = normal(bits >> (2 * NormalTable::kBitsEach));
  }
  for (std::size_t i = 0; i < samples; ++i) row_[i] += normal_[i] * std::sqrt(variance(row_[i]));
}

template <class Sample, class Convert>
void VirtualSensor::store(int y, Image& image, Convert convert) const {
  Sample* to = image.row_as<Sample>(y);
  for (std::size_t i = 0; i < row_.size(); ++i) to[i] = static_cast<Sample>(convert(row_[i]));
}

Image VirtualSensor::expose(const std::shared_ptr<const VirtualScene>& scene,
                            std::span<const LightPulse> pulses, const Exposure& exposure) {
  if (scene != scene_) {
    scene_ = scene;
    choose_passes();
  }
  const Shot shot{pulses, exposure, random_bits(seed_, kNoiseStream, exposure.frame_id)};
  for (const auto& pass : frame_passes_) pass(*this, shot);
  const std::vector<float> dark(row_.size(), static_cast<float>(scene->background));
  Image image(layout_);
  for (int y = 0; y < layout_.size.height; ++y) {
    std::copy(dark.begin(), dark.end(), row_.begin());
    for (const auto& pass : row_passes_) pass(*this, shot, y);
    convert_(*this, y, image);
  }
  return image;
}

void VirtualSensor::choose_passes() {
  frame_passes_.clear();
  row_passes_.clear();
  const auto listed = [this](Pass pass) { return scene_->has(pass); };
  if (listed(Pass::flame)) {
    frame_passes_.emplace_back(&VirtualSensor::draw_flame);
    row_passes_.emplace_back(&VirtualSensor::add_flame);
  }
  const bool rolls = kind_ == SensorKind::rolling_shutter;
  if (listed(Pass::room) || (rolls && (listed(Pass::lamp) || listed(Pass::bloom)))) {
    lit_.resize(static_cast<std::size_t>(layout_.size.height));
    frame_passes_.emplace_back(&VirtualSensor::light_rows);
  }
  const bool smears = listed(Pass::smear) && kind_ == SensorKind::ccd;
  if (listed(Pass::lamp) || listed(Pass::bloom) || smears) choose_strobe_light();
  if (listed(Pass::room)) choose_room();
  if (listed(Pass::hot_pixels)) {
    hot_ = draw_hot_pixels(scene_->hot_pixels);
    row_passes_.emplace_back(&VirtualSensor::add_hot_pixels);
  }
  if (listed(Pass::shot_noise) || listed(Pass::read_noise)) choose_noise();
  choose_converter();
}

void VirtualSensor::choose_strobe_light() {
  const double image_height = layout_.size.height;
  const bool bloom = scene_->has(Pass::bloom);
  const double reach = lamp_.radius + std::max(5 * kEdgeSigma, bloom ? halo_reach(*scene_) : 0);
  light_ = stamp_about({lamp_.x, Rows(image_height / 2), lamp_.radius}, reach, image_height, image_height,
                       layout_.size);
  frame_passes_.emplace_back(&VirtualSensor::clear_light);
  const bool rolls = kind_ == SensorKind::rolling_shutter;
  if (scene_->has(Pass::lamp))
    frame_passes_.emplace_back(rolls ? &VirtualSensor::draw_rolled_lamp : &VirtualSensor::draw_lamp);
  if (bloom) {
    VirtualScene glare = *scene_;
    if (kind_ != SensorKind::ccd) glare.overflow_up = glare.overflow_down = 0;  // only CCD columns overflow
    bloom_shape_ = bloom_shape(glare, lamp_, layout_.size);
    frame_passes_.emplace_back(rolls ? &VirtualSensor::draw_rolled_bloom : &VirtualSensor::draw_bloom);
  }
  if (scene_->has(Pass::smear) && kind_ == SensorKind::ccd)
    frame_passes_.emplace_back(&VirtualSensor::draw_smear);
  row_passes_.emplace_back(&VirtualSensor::add_strobe_light);
}

void VirtualSensor::choose_room() {
  const double reach = kRoomReach * layout_.size.width;
  room_x_ = falloff(layout_.size.width, lamp_.x, reach);
  room_y_ = falloff(layout_.size.height, lamp_.y.value(), reach);
  for (float& part : room_y_) part *= static_cast<float>(scene_->room_share);
  row_passes_.emplace_back(&VirtualSensor::add_room);
}

void VirtualSensor::choose_noise() {
  // The sum of two independent normal numbers has the summed variance, so both passes share one number.
  const auto read = static_cast<float>(scene_->read_noise * scene_->read_noise);
  const auto gain = static_cast<float>(1 / scene_->electrons_per_level);
  const auto add = [this](auto variance) {
    row_passes_.emplace_back(
        [variance](VirtualSensor& sensor, const Shot& shot, int y) { sensor.add_noise(shot, y, variance); });
  };
  if (!scene_->has(Pass::shot_noise)) return add([read](float) { return read; });
  if (!scene_->has(Pass::read_noise)) return add([gain](float v) { return gain * std::max(0.0F, v); });
  add([read, gain](float v) { return read + gain * std::max(0.0F, v); });
}

void VirtualSensor::choose_converter() {
  const auto to_nearest = [half = 0.5F](float v) {
    return static_cast<int>(v + half);
  };  // v >= 0; lround is slow
  const bool coarse = scene_->has(Pass::quantise) && scene_->adc_bits < layout_.bit_depth;
  const auto white = static_cast<float>(layout_.white());
  const auto adc_white = coarse ? static_cast<float>((1 << scene_->adc_bits) - 1) : white;
  const auto code = [=, scale = adc_white / static_cast<float>(kWhite)](float v) {
    return to_nearest(std::min(std::max(0.0F, v * scale), adc_white));
  };
  const auto choose = [this](auto convert) {
    if (bytes_per_sample(layout_.format) == 1) {
      convert_ = [convert](const VirtualSensor& s, int y, Image& to) {
        s.store<std::uint8_t>(y, to, convert);
      };
    } else {
      convert_ = [convert](const VirtualSensor& s, int y, Image& to) {
        s.store<std::uint16_t>(y, to, convert);
      };
    }
  };
  if (!coarse) return choose(code);
  choose([=, widen = white / adc_white](float v) { return to_nearest(static_cast<float>(code(v)) * widen); });
}

void VirtualSensor::draw_flame(const Shot& shot) {
  flame_.assign(3 * static_cast<std::size_t>(layout_.size.width) * layout_.size.height, 0.0F);
  scene_->flame->add_radiance(number_, shot.exposure.begin, shot.exposure.duration, flame_);
}

void VirtualSensor::clear_light(const Shot& /*shot*/) {
  std::fill(light_.values.begin(), light_.values.end(), 0.0F);
}

double VirtualSensor::lamp_level(const Shot& shot, Seconds later) const {
  double level = 0;
  for (const LightPulse& p : shot.pulses) {
    const Seconds lit =
        std::min(p.begin + p.width, later) - std::max(p.begin, later - shot.exposure.duration);
    if (lit > Seconds(0)) level += charge(*scene_, p) * (lit / p.width);
  }
  return level;
}

void VirtualSensor::draw_lamp(const Shot& shot) {
  const double level = lamp_level(shot);
  if (level > 0) add_stamp(lamp_shape_, static_cast<float>(level), light_);
}

void VirtualSensor::draw_bloom(const Shot& shot) {
  if (lamp_level(shot) > kWhite) add_stamp(bloom_shape_, 1, light_);
}

void VirtualSensor::light_rows(const Shot& shot) {
  const int rows = layout_.size.height;
  const bool down = timing_.direction == smear::ReadDirection::top_first;
  for (int y = 0; y < rows; ++y) {
    const Rows order(kind_ != SensorKind::rolling_shutter ? 0 : down ? y : rows - 1 - y);
    lit_[static_cast<std::size_t>(y)] = static_cast<float>(lamp_level(shot, order * timing_.row_time));
  }
}

void VirtualSensor::draw_rolled_lamp(const Shot& /*shot*/) {
  const auto lit = [this](int y) { return lit_[static_cast<std::size_t>(y)]; };
  add_rows(lamp_shape_, lit, light_);
}

void VirtualSensor::draw_rolled_bloom(const Shot& /*shot*/) {
  const auto saturates = [this](int y) {
    return lit_[static_cast<std::size_t>(y)] > static_cast<float>(kWhite) ? 1.0F : 0.0F;
  };
  add_rows(bloom_shape_, saturates, light_);
}

void VirtualSensor::draw_smear(const Shot& shot) {
  const int margin = lamp_shape_.x0 - light_.x0;
  for (const LightPulse& p : shot.pulses) {
    const double leak = charge(*scene_, p) * scene_->smear_leak;
    for (const smear::FlashPart& part : split(timing_, {p.begin + p.width / 2, p.width})) {
      // Every lit row of the lamp leaks into the charge packet below it.
      for (int y = lamp_shape_.y0; y < lamp_shape_.y1(); ++y) {
        const auto at = smear::landing(timing_, y, part, sweep_out_);
        if (!at || at->image != 0) continue;
        add_scaled(lamp_shape_.row(y), lamp_shape_.width, static_cast<float>(leak * part.fraction),
                   light_.row(at->row) + margin);
      }
    }
  }
}

void VirtualSensor::add_flame(const Shot& /*shot*/, int y) {
  const int width = layout_.size.width;
  const float* rgb = flame_.data() + 3 * static_cast<std::size_t>(width) * y;
  if (channels(layout_.format) == 3) {
    add_scaled(rgb, 3 * width, 1, row_.data());
  } else if (is_bayer(layout_.format)) {
    for (int x = 0; x < width; ++x) row_[x] += rgb[3 * x + (x & 1) + (y & 1)];  // R G / G B
  } else {
    for (int x = 0; x < width; ++x) row_[x] += luminance(rgb + 3 * x);
  }
}

void VirtualSensor::add_strobe_light(const Shot& /*shot*/, int y) {
  const int n = channels(layout_.format);
  const float* white = light_.row(y);  // the strobe is white: equal in all colours
  for (int i = 0; i < light_.width; ++i) {
    for (int c = 0; c < n; ++c) row_[(light_.x0 + i) * n + c] += white[i];
  }
}

void VirtualSensor::add_room(const Shot& /*shot*/, int y) {
  const float level = lit_[static_cast<std::size_t>(y)] * room_y_[static_cast<std::size_t>(y)];
  const auto n = static_cast<std::size_t>(channels(layout_.format));
  for (std::size_t i = 0; i < row_.size(); ++i) row_[i] += level * room_x_[i / n];
}

void VirtualSensor::add_hot_pixels(const Shot& /*shot*/, int y) {
  const auto first =
      std::lower_bound(hot_.begin(), hot_.end(), y, [](const Point& p, int v) { return p.y < v; });
  for (auto p = first; p != hot_.end() && p->y == y; ++p) row_[p->sample] += p->level;
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

}  // namespace emberlock::drivers
