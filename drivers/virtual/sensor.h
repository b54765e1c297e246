// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "base/image.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/scene.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock::drivers {

/// A rectangle of the image with a value for each pixel.
struct Stamp {
  int x0 = 0;
  int y0 = 0;
  int width = 0;
  int height = 0;
  std::vector<float> values;

  [[nodiscard]] const float* row(int y) const {
    return values.data() + static_cast<std::size_t>(y - y0) * width;
  }
  [[nodiscard]] float* row(int y) { return values.data() + static_cast<std::size_t>(y - y0) * width; }
  [[nodiscard]] int y1() const { return y0 + height; }
};

/// The exposure of a frame, on the rig's clock.
struct Exposure {
  std::uint64_t frame_id = 0;
  TimePoint begin;
  Seconds duration;  ///< ends when the read phase starts
};

/// The sensor of one camera, of any kind: light in, picture out. In a rolling shutter, row r (in read order)
/// is exposed r t_row after the first; a flame is drawn as the first row sees it. Results depend only on the
/// arguments and (seed, camera id). Not thread-safe, because it keeps its work space.
class VirtualSensor {
 public:
  /// `number` is the camera's index in the rig, as passed to the scene's LightField. `options` must be valid.
  VirtualSensor(const VirtualCameraOptions& options, int number, std::uint64_t seed);

  /// `pulses`: the strobe's light during [-T, K t_row) relative to the start of this frame's read phase. The
  /// passes are selected once, when `scene` differs from that of the call before; an unlisted pass costs
  /// nothing per frame, row or pixel.
  Image expose(const std::shared_ptr<const VirtualScene>& scene, std::span<const LightPulse> pulses,
               const Exposure& exposure);

 private:
  struct Shot {
    std::span<const LightPulse> pulses;
    Exposure exposure;
    std::uint64_t noise_key = 0;
  };
  struct Point {
    int sample;  // within the row
    int y;
    float level;
  };

  void choose_passes();
  void choose_strobe_light();
  void choose_room();
  void choose_noise();
  void choose_converter();

  void draw_flame(const Shot& shot);
  void clear_light(const Shot& shot);
  void draw_lamp(const Shot& shot);
  void draw_bloom(const Shot& shot);
  void draw_smear(const Shot& shot);
  void light_rows(const Shot& shot);
  void draw_rolled_lamp(const Shot& shot);
  void draw_rolled_bloom(const Shot& shot);
  void add_flame(const Shot& shot, int y);
  void add_strobe_light(const Shot& shot, int y);
  void add_room(const Shot& shot, int y);
  void add_hot_pixels(const Shot& shot, int y);
  template <class Variance>
  void add_noise(const Shot& shot, int y, Variance variance);
  template <class Sample, class Convert>
  void store(int y, Image& image, Convert convert) const;
  [[nodiscard]] double lamp_level(const Shot& shot, Seconds later = Seconds(0)) const;
  [[nodiscard]] std::vector<Point> draw_hot_pixels(int count) const;

  ImageLayout layout_;
  SensorKind kind_;
  smear::CcdTiming timing_;
  smear::SweepOut sweep_out_;
  VirtualLamp lamp_;
  int number_;
  std::uint64_t seed_;  // of this camera

  // The selected work, in order.
  std::shared_ptr<const VirtualScene> scene_;
  std::vector<std::function<void(VirtualSensor&, const Shot&)>> frame_passes_;
  std::vector<std::function<void(VirtualSensor&, const Shot&, int y)>> row_passes_;
  std::function<void(const VirtualSensor&, int y, Image&)> convert_;

  Stamp lamp_shape_;           // 1 at the lamp's centre
  Stamp bloom_shape_;          // grey levels around a saturated lamp
  Stamp light_;                // of lamp, bloom and smear: the full height of the columns around the lamp
  std::vector<float> lit_;     // by row: light at the lamp's centre during the row's exposure
  std::vector<float> room_x_;  // by column and by row: the room's share of that light is their product
  std::vector<float> room_y_;
  std::vector<Point> hot_;     // by row
  std::vector<float> flame_;   // 3 w h
  std::vector<float> row_;     // samples of the current row, grey levels 0..255
  std::vector<float> normal_;  // its noise, standard normal
};

}  // namespace emberlock::drivers
