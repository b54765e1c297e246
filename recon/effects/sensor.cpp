// SPDX-License-Identifier: Apache-2.0
#include "recon/effects/sensor.h"

#include <algorithm>
#include <cmath>

namespace emberlock::recon {
namespace {

void bend(RadianceImage& image, double white, double exponent) {
  for (float& v : image.rgb) {
    const double share = std::abs(static_cast<double>(v)) / white;
    v = std::copysign(static_cast<float>(white * std::pow(share, exponent)), v);
  }
}

void clip(RadianceImage& image, const Sensor& sensor) {
  if (sensor.clipping == Sensor::Clipping::none) return;
  const auto white = static_cast<float>(sensor.white);
  for (float& v : image.rgb) v = std::min(v, white);
}

}  // namespace

void linearise(RadianceImage& image, const Sensor& sensor) {
  clip(image, sensor);
  if (sensor.response == Sensor::Response::gamma) bend(image, sensor.white, sensor.gamma);
}

void respond(RadianceImage& image, const Sensor& sensor) {
  if (sensor.response == Sensor::Response::gamma) bend(image, sensor.white, 1 / sensor.gamma);
  clip(image, sensor);
}

}  // namespace emberlock::recon
