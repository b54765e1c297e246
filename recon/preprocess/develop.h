// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <vector>

#include "base/image.h"
#include "base/sensor_kind.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/smear.h"
#include "recon/preprocess/view.h"

namespace emberlock::recon {

struct DevelopOptions {
  enum class SmearRemoval { automatic, off, told };
  SmearRemoval smear_removal =
      SmearRemoval::automatic;  ///< automatic: where the sensor is a CCD and shows it
  Smear smear = {};             ///< told: as it is
  Demosaicing demosaicing = Demosaicing::bilinear;
};

/// One camera's frame of the flame and what is known about the camera.
struct CameraFrame {
  ImageView frame;
  std::vector<ImageView> dark =
      {};  ///< frames without flame; none: the picture's own dark half tells the level
  std::optional<Colour> colour = {};  ///< none: samples are taken to be linear, and all cameras alike
  SensorKind sensor = SensorKind::ccd;
};

struct DevelopedPicture {
  RadianceImage image;
  std::vector<std::uint8_t> bounds;  ///< View::bounds
  std::vector<PreprocessStep> steps;
};

/// From samples to radiance: linearise, hot pixels, background, smear, demosaic, level, gain and vignetting,
/// in this order: what adds up in the sensor is taken out before anything is multiplied or interpolated. Each
/// step says whether it ran and why. Dark frames have the frame's layout.
DevelopedPicture develop(const CameraFrame& camera, const DevelopOptions& options = {});

/// The steps of several cameras as one list: on where any camera's is; where they differ, the reason counts
/// them and names the first of each.
std::vector<PreprocessStep> together(
    const std::vector<std::pair<std::string, std::vector<PreprocessStep>>>& cameras);

}  // namespace emberlock::recon
