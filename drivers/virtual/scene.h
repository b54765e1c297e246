// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"
#include "drivers/virtual/light_field.h"

namespace emberlock::drivers {

/// One effect of the picture. A scene lists those it calls for; one that is not listed does not run and
/// leaves no trace in the pixels. The order in the list means nothing: light adds up first, then noise, then
/// the converter.
enum class Pass {
  flame,  ///< the scene's LightField, as exposed; its own smear is left out (a flame's is below a grey level)
  lamp,   ///< the strobe's image, when the strobe was lit in the exposure; saturates
  bloom,  ///< a lit, saturated lamp's glare and the overflow of its columns
  room,   ///< what a flash lights of the room about the lamp, over the whole picture
  smear,  ///< of CCDs: dots, combs and lines, by smear_sync/ccd_model
  hot_pixels,  ///< fixed places of each camera
  shot_noise,  ///< variance in proportion to the light
  read_noise,  ///< the same variance everywhere
  quantise,    ///< a converter coarser than the image's format (`adc_bits`)
};

/// What the cameras see. Brightness is in linear grey levels on the scale 0..255 whatever the image's depth;
/// 255 and more is white.
struct VirtualScene {
  std::vector<Pass> passes{};

  /// The picture of frame i gathers light during [t_start_i - exposure, t_start_i): it ends as the read phase
  /// begins, so cameras of equal t_start and exposure film the same instants. Zero: the whole frame period,
  /// so that every flash lights the lamp in one image, whatever its phase. Otherwise > 0 and at most the
  /// shortest frame period.
  Seconds exposure{};
  double background = 6;  ///< black level and stray light, 0..255

  double flash_level = 4000;  ///< one flash at the lamp's centre, before saturation; independent of its width
  double steady_rate = 1e7;   ///< steady light at the lamp's centre, grey levels a second: a line of about 45
  double room_share = 0.0015;  ///< of the lamp's light, that the room about it shows: 6 grey levels a flash
  double smear_leak = 0.01;    ///< share of the light that leaks into the register: dots of 40 grey levels

  double halo_level = 60;    ///< glare at the rim of the lamp's disk
  double halo_length = 4;    ///< pixels over which glare falls to 1 / e
  double overflow_up = 4;    ///< rows above the disk that its columns saturate
  double overflow_down = 4;  ///< and below it

  int hot_pixels = 12;              ///< of each camera
  double electrons_per_level = 60;  ///< shot noise: variance = level / electrons_per_level
  double read_noise = 0.7;          ///< grey levels RMS
  int adc_bits = 8;                 ///< of pass `quantise`; formats of fewer bits than this keep their own

  std::shared_ptr<const LightField> flame{};  ///< what pass `flame` draws

  [[nodiscard]] bool has(Pass pass) const;
};

/// Ranges of every field; `flame` listed needs a LightField. bad_input that names the field otherwise.
Status check(const VirtualScene& scene);

/// A dark room with the strobe: lamp, bloom, smear, hot pixels and both noises; exposed over the whole frame
/// period.
VirtualScene smear_scene();

/// The same in a room that the flashes light, so that shutters without smear see them.
VirtualScene lit_room_scene();

/// A flame in a dark room, with both noises; exposed for 1 ms.
VirtualScene flame_scene(std::shared_ptr<const LightField> flame);

}  // namespace emberlock::drivers
