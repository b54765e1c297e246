// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "base/image.h"
#include "base/sensor_kind.h"
#include "recon/preprocess/colour.h"
#include "recon/preprocess/samples.h"
#include "recon/preprocess/smear.h"
#include "recon/views/raw_picture.h"
#include "recon/views/view.h"

namespace emberlock::recon {

struct DevelopOptions {
  enum class SmearRemoval { automatic, off, told };
  SmearRemoval smear_removal =
      SmearRemoval::automatic;  ///< automatic: if the sensor is a CCD and shows smear
  Smear smear = {};             ///< for `told`: used as it is
  Demosaicing demosaicing = Demosaicing::bilinear;
};

/// What a camera shows without flame: found once for all of its frames.
struct DarkPicture {
  Samples level;                        ///< the frames' midmean, its hot pixels replaced
  std::vector<std::uint32_t> hot = {};  ///< pixels, ascending, the calibration's own among them
  std::size_t frames = 0;
};
/// `dark`: at least one frame, all of one layout.
DarkPicture dark_picture_of(const std::vector<ImageView>& dark, const std::optional<Colour>& colour);

/// One camera's frame of the flame, and the known properties of the camera.
struct CameraFrame {
  std::shared_ptr<const Image> frame;
  std::shared_ptr<const DarkPicture> dark = {};  ///< null: the level comes from the picture's own dark half
  std::optional<Colour> colour = {};  ///< absent: samples are assumed to be linear, and all cameras equal
  SensorKind sensor = SensorKind::ccd;
};

struct DevelopedPicture {
  RadianceImage image;
  std::vector<std::uint8_t> bounds;  ///< View::bounds
  std::vector<PreprocessStep> steps;
};

/// Converts samples to radiance: linearise, hot pixels, background, smear, demosaic, level, gain and
/// vignetting, in this order, so that additive effects of the sensor are removed before anything is
/// multiplied or interpolated. Each step reports whether it ran and why. The background must have the frame's
/// layout. The picture knows its origin.
DevelopedPicture develop(const CameraFrame& camera, const DevelopOptions& options = {});

/// A picture whose samples are linear in light already, without any of that: to_radiance(), with its origin.
RadianceImage as_filmed(std::shared_ptr<const Image> frame);

/// Merges the steps of several cameras: a step is on if any camera's is; if they differ, the reason gives
/// their numbers and the first camera of each kind.
std::vector<PreprocessStep> together(
    const std::vector<std::pair<std::string, std::vector<PreprocessStep>>>& cameras);

}  // namespace emberlock::recon
