// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/virtual/light_field.h"

namespace emberlock::drivers {

/// One effect in the picture. A pass that a scene doesn't list isn't computed and changes no pixel. The order
/// of the list has no meaning: light is summed first, then noise is added, then the converter is applied.
enum class Pass {
  flame,       ///< the scene's LightField, exposed; without its smear (for a flame below one grey level)
  lamp,        ///< the strobe's image, if it was lit during the exposure; saturates
  bloom,       ///< glare of a lit, saturated lamp and the overflow of its columns
  room,        ///< the room around the lamp, lit by a flash, over the whole picture
  smear,       ///< CCDs only: dots, combs and lines, by smear_sync/ccd_model
  hot_pixels,  ///< at fixed places of each camera
  shot_noise,  ///< variance proportional to the light
  read_noise,  ///< constant variance
  quantise,    ///< a converter with fewer bits than the image's format (`adc_bits`)
};

/// What the cameras see. Brightness is in linear grey levels on the scale 0..255 for every bit depth; 255 and
/// above is white.
struct VirtualScene {
  std::vector<Pass> passes{};

  /// Frame i collects light during [t_start_i - exposure, t_start_i): the exposure ends when the read phase
  /// begins, so cameras of equal t_start and exposure film the same interval. Zero means the whole frame
  /// period, so that every flash lights the lamp in one image, whatever its phase. Otherwise > 0 and at most
  /// the shortest frame period.
  Seconds exposure{};
  double background = 6;  ///< black level and stray light, 0..255

  double flash_level = 4000;  ///< one flash at the lamp's centre, before saturation; for any flash width
  double steady_rate =
      1e7;  ///< steady light at the lamp's centre, grey levels per second: a line of about 45 levels
  double room_share = 0.0015;  ///< share of the lamp's light that the room shows: 6 grey levels per flash
  double smear_leak = 0.01;    ///< share of the light that leaks into the register: dots of 40 grey levels

  double halo_level = 60;    ///< glare at the rim of the lamp's disk
  double halo_length = 4;    ///< pixels over which glare falls to 1 / e
  double overflow_up = 4;    ///< rows above the disk in which its columns saturate
  double overflow_down = 4;  ///< the same below the disk

  int hot_pixels = 12;              ///< of each camera
  double electrons_per_level = 60;  ///< shot noise: variance = level / electrons_per_level
  double read_noise = 0.7;          ///< grey levels RMS
  int adc_bits = 8;                 ///< for pass `quantise`; formats with fewer bits are unaffected

  std::shared_ptr<const LightField> flame{};  ///< drawn by pass `flame`

  [[nodiscard]] bool has(Pass pass) const;
};

/// Checks the range of every field, and that pass `flame` has a LightField. Error bad_input names the field.
Status check(const VirtualScene& scene);

/// A dark room with the strobe: lamp, bloom, smear, hot pixels and both noises; exposed over the whole frame
/// period.
VirtualScene smear_scene();

/// The same in a room that is lit by the flashes, for shutters without smear.
VirtualScene lit_room_scene();

/// A flame in a dark room, with both noises; exposed for 1 ms.
VirtualScene flame_scene(std::shared_ptr<const LightField> flame);

}  // namespace emberlock::drivers
