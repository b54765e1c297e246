#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/image.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/scene.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock {

/// A rectangle of the image and what falls on each of its pixels.
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

/// When a frame was exposed, on the rig's clock.
struct Exposure {
  std::uint64_t frame_id = 0;
  TimePoint begin;
  Seconds duration;  ///< ends at the start of the read phase
};

/// The chip of one camera: light in, picture out. Results depend on the arguments and (seed, camera id)
/// alone. Not thread-safe: it keeps its work space.
class VirtualSensor {
 public:
  /// `number` is the camera's in the rig, as the scene's LightField counts. `options` are valid.
  VirtualSensor(const VirtualCameraOptions& options, int number, std::uint64_t seed);

  /// `pulses`: the strobe's light during [-T, K t_row) about the start of this frame's read phase.
  Image expose(const VirtualScene& scene, std::span<const LightPulse> pulses, const Exposure& exposure);

 private:
  struct Point {
    int sample;  // within the row
    int y;
    float level;
  };

  void draw_lamp_light(const VirtualScene& scene, std::span<const LightPulse> pulses, Seconds exposure);
  void add_smear(const VirtualScene& scene, std::span<const LightPulse> pulses);
  void draw_flame(const VirtualScene& scene, const Exposure& exposure);
  void compose_row(const VirtualScene& scene, int y);
  void add_noise(const VirtualScene& scene, int y, std::uint64_t key);
  void store_row(const VirtualScene& scene, int y, Image& image) const;
  [[nodiscard]] std::vector<Point> draw_hot_pixels(int count) const;

  ImageLayout layout_;
  CcdTiming timing_;
  SweepOut sweep_out_;
  VirtualLamp lamp_;
  int number_;
  std::uint64_t seed_;  // of this camera

  Stamp lamp_shape_;           // 1 at the lamp's centre
  Stamp light_;                // of lamp, bloom and smear: the full height of the columns about the lamp
  std::vector<Point> hot_;     // by row
  std::vector<float> flame_;   // 3 w h, empty when the scene has none
  std::vector<float> row_;     // samples of the row in work, grey levels 0..255
  std::vector<float> normal_;  // and its noise, standard normal
};

}  // namespace emberlock
