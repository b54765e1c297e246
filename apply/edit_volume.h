// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "apply/edit_file.h"
#include "recon/calibrate/camera_response.h"
#include "recon/export/temperature_look_up.h"
#include "recon/hull/hull.h"
#include "recon/render/volume.h"
#include "recon/temperature/emitter.h"

namespace emberlock::apply {

/// How much of a region a place belongs to: 1 inside, falling smoothly to 0 over `edge` outside of it.
double share_of(const Region& region, const Eigen::Vector3d& place);

/// The key points that keep and cut regions leave without light (1) and those that may have some (0).
std::vector<std::uint8_t> dark_points(const recon::Grid& grid,
                                      const std::vector<const Operation*>& operations);

/// The paper's look-up: green tells a temperature, and the temperature what the camera shows of a black body.
/// It is done at key points, between which colours are linear as all light is. Immutable, thread-safe.
class FlameColours {
 public:
  /// `hottest`: the green, levels a metre, that is taken for the paper's hottest; brighter ones too.
  FlameColours(const recon::CameraResponse& response, float hottest);

  /// K of each key point; 0: darker than the coldest.
  [[nodiscard]] std::vector<float> kelvin(const recon::Volume& volume) const;
  /// Red and blue become those of a glow of each key point's temperature that has its green.
  void colour(recon::Volume& volume, const std::vector<float>& kelvin) const;

 private:
  recon::TemperatureLookUp look_up_;
  recon::EmitterTable table_;
  float hottest_;
};

/// A volume as it is shown: what is seen of it is render_view()'s with this hull.
struct EditedVolume {
  recon::Volume volume;
  recon::Hull hull;
  std::vector<float> kelvin;  ///< of each key point, before its brightness was edited; 0: not told
};

/// What colours, brightness and regions make of a volume. Where it was kept dark it neither shines nor
/// absorbs. A colour by temperature keeps the mean of the channels, but for its gain; a brightness multiplies
/// all three.
EditedVolume edited_volume(recon::Volume volume, const recon::Hull& hull, const FlameColours& flame,
                           Colours colours, const std::vector<const Operation*>& operations);

}  // namespace emberlock::apply
