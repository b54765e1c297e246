// SPDX-License-Identifier: Apache-2.0
// sensor CASE: draws one frame in the function `measured`, whose instructions callgrind counts.
#include "drivers/virtual/sensor.h"

#include <cstdio>
#include <map>
#include <memory>
#include <string>

#include "base/random.h"
#include "drivers/virtual/normal_table.h"
#include "tests/integration/cost/program/measured.h"

namespace emberlock {

/// The chip of a program that knows a background, read noise and no more: written down without passes.
struct SensorByHand {
  std::vector<float> row, normal;

  explicit SensorByHand(int width)
      : row(static_cast<std::size_t>(width)), normal(static_cast<std::size_t>(width) + 2) {}

  __attribute__((noinline)) void add_noise(int y, std::uint64_t key, float variance) {
    const drivers::NormalTable& table = drivers::NormalTable::instance();
    const std::size_t samples = row.size();
    std::uint64_t counter = static_cast<std::uint64_t>(y) << 32;
    for (std::size_t i = 0; i < samples; i += 3) {
      const std::uint64_t bits = mix64(counter++ ^ key);
      normal[i] = table(bits);
      normal[i + 1] = table(bits >> drivers::NormalTable::kBitsEach);
      normal[i + 2] = table(bits >> (2 * drivers::NormalTable::kBitsEach));
    }
    const float sigma = std::sqrt(variance);
    for (std::size_t i = 0; i < samples; ++i) row[i] += normal[i] * sigma;
  }

  __attribute__((noinline)) void store(int y, Image& image) const {
    auto* to = image.row_as<std::uint8_t>(y);
    const auto white = static_cast<float>(image.layout().white());
    const float scale = white / 255;
    for (std::size_t i = 0; i < row.size(); ++i) {
      const float v = std::min(std::max(0.0F, row[i] * scale), white);
      to[i] = static_cast<std::uint8_t>(static_cast<int>(v + 0.5F));
    }
  }

  enum class Noise { none, read };
  Image expose(const ImageLayout& layout, Noise noise) {
    Image image(layout);
    for (int y = 0; y < layout.size.height; ++y) {
      std::fill(row.begin(), row.end(), 6.0F);
      if (noise == Noise::read) add_noise(y, 99, 0.49F);
      store(y, image);
    }
    return image;
  }
};

int run(const std::string& name) {
  drivers::VirtualCameraOptions camera;
  camera.layout.size = {320, 240};
  camera.timing = {.rows = 240, .shifts = 240};
  camera.lamp = {.x = 160, .y = Rows(120), .radius = 4};
  const drivers::LightPulse pulses[] = {{milliseconds(-20), microseconds(20)},
                                        {milliseconds(5), microseconds(20)}};
  drivers::VirtualSensor sensor(camera, 0, 1);
  SensorByHand by_hand(camera.layout.size.width);
  Image image;

  const std::map<std::string, std::vector<drivers::Pass>> scenes = {
      {"no_pass", {}},
      {"no_pass_of_wild_figures", {}},
      {"read_noise", {drivers::Pass::read_noise}},
      {"both_noises", {drivers::Pass::read_noise, drivers::Pass::shot_noise}},
      {"smear", {drivers::Pass::smear}},
      {"room", {drivers::Pass::room}},
      {"lamp_and_smear", {drivers::Pass::lamp, drivers::Pass::smear}},
      {"lamp_bloom_and_smear", {drivers::Pass::lamp, drivers::Pass::bloom, drivers::Pass::smear}},
      {"hot_pixels", {drivers::Pass::hot_pixels}},
      {"quantise", {drivers::Pass::quantise}},
  };
  drivers::VirtualScene scene;
  if (name == "no_pass_of_wild_figures") {
    scene.hot_pixels = 100000;
    scene.halo_level = 255;
    scene.halo_length = 100;
    scene.overflow_up = scene.overflow_down = 1000;
    scene.adc_bits = 1;
  }
  if (name == "quantise") scene.adc_bits = 6;
  if (const auto at = scenes.find(name); at != scenes.end()) {
    scene.passes = at->second;
    const auto shared = std::make_shared<drivers::VirtualScene>(scene);
    (void)sensor.expose(shared, pulses, {});  // chooses the passes
    measured([&] { image = sensor.expose(shared, pulses, {}); });
  } else if (name == "no_pass_by_hand") {
    measured([&] { image = by_hand.expose(camera.layout, SensorByHand::Noise::none); });
  } else if (name == "read_noise_by_hand") {
    (void)drivers::NormalTable::instance();  // drawn up at its first use
    measured([&] { image = by_hand.expose(camera.layout, SensorByHand::Noise::read); });
  } else {
    return 2;
  }
  std::printf("%d\n", image.view().sample(1, 1));
  return 0;
}

}  // namespace emberlock

int main(int argc, char** argv) { return argc == 2 ? emberlock::run(argv[1]) : 2; }
