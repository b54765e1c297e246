// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/develop.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "recon/preprocess/dark_part.h"
#include "recon/preprocess/hot_pixels.h"
#include "recon/preprocess/radiance.h"
#include "recon/preprocess/samples.h"

namespace emberlock::recon {
namespace {

PreprocessStep linearised(const std::optional<Colour>& colour) {
  if (!colour) return {"linearise", false, "no colour calibration: samples are taken to be linear in light"};
  if (colour->response.empty()) return {"linearise", false, "calibrated as linear in light"};
  return {"linearise", true, "by the calibrated response"};
}

/// Without what is found out in the picture.
RawPicture undeveloped(std::shared_ptr<const Image> frame, const Colour* colour) {
  const ImageLayout layout = frame->layout();
  RawPicture raw{std::move(frame), exposures_of(layout, colour), {}};
  raw.light = light_of_number(layout, colour, nullptr);
  raw.equalise = equalising(layout.size, colour != nullptr ? *colour : Colour{});
  if (colour != nullptr) raw.flat = colour->flat.light;
  return raw;
}

/// Those that stand out, and the calibrated ones.
std::vector<std::uint32_t> with_calibrated(std::vector<std::uint32_t> hot,
                                           const std::optional<Colour>& colour) {
  if (!colour || colour->hot_pixels.empty()) return hot;
  std::vector<std::uint32_t> all;
  std::set_union(hot.begin(), hot.end(), colour->hot_pixels.begin(), colour->hot_pixels.end(),
                 std::back_inserter(all));
  return all;
}

PreprocessStep take_hot_pixels_out(Samples& samples, const CameraFrame& camera, RawPicture& raw) {
  const DarkPicture* dark = camera.dark.get();
  raw.hot = dark != nullptr ? dark->hot : with_calibrated(hot_pixels_of_picture(samples), camera.colour);
  if (raw.hot.empty()) return {"hot pixels", false, "none stand out"};
  replace_hot_pixels(samples, raw.hot);
  const char* by = camera.colour && !camera.colour->hot_pixels.empty() ? "are calibrated as hot, or stand out"
                   : dark != nullptr ? "stand out in the frames without flame"
                                     : "stand out in the picture";
  return {"hot pixels", true, fmt::format("{} {}", raw.hot.size(), by)};
}

void remove_smear(Samples& samples, const Smear& smear, RawPicture& raw) {
  raw.smear_of_row = remove_smear(samples, smear);
  if (smear.path != SmearPath::whole_column) raw.smear_of_other_rows = taking_smear(smear);
}

PreprocessStep take_smear_out(Samples& samples, SensorKind sensor, const DevelopOptions& options,
                              RawPicture& raw) {
  PreprocessStep step{"smear", false, {}};
  if (options.smear_removal == DevelopOptions::SmearRemoval::off) {
    step.reason = "switched off";
  } else if (options.smear_removal == DevelopOptions::SmearRemoval::told) {
    remove_smear(samples, options.smear, raw);
    step.on = true;
    step.reason = "as told";
  } else if (sensor != SensorKind::ccd) {
    step.reason = "the sensor is no CCD";
  } else if (const auto smear = find_smear(samples, &step.reason)) {
    remove_smear(samples, *smear, raw);
    step.on = true;
  }
  return step;
}

PreprocessStep demosaiced(SampleLayout layout, Demosaicing how) {
  if (layout != SampleLayout::mosaic) return {"demosaic", false, "no mosaic"};
  return {"demosaic", true,
          how == Demosaicing::bilinear ? "bilinear, measured samples kept"
                                       : "gradient-corrected, measured samples kept"};
}

PreprocessStep saturated(const std::vector<std::uint8_t>& bounds) {
  const auto count = std::count_if(bounds.begin(), bounds.end(), [](std::uint8_t b) { return b != 0; });
  if (count == 0) return {"saturated pixels", false, "none"};
  return {"saturated pixels", true, fmt::format("{} are bounds: more light explains them", count)};
}

PreprocessStep equalised(const std::optional<Colour>& colour) {
  if (!colour) return {"gain and vignetting", false, "no colour calibration: cameras are taken to be alike"};
  return {"gain and vignetting", true, "as calibrated"};
}

/// "3 of 11 cameras, first cam2: REASON".
std::string counted(std::size_t count, std::size_t all, const std::string& first, const std::string& reason) {
  return fmt::format("{} of {} cameras, {}{}: {}", count, all, count == 1 ? "" : "first ", first, reason);
}

}  // namespace

DarkPicture dark_picture_of(const std::vector<ImageView>& dark, const std::optional<Colour>& colour) {
  std::vector<Samples> frames;
  frames.reserve(dark.size());
  for (const ImageView& frame : dark) frames.push_back(samples_of(frame, colour ? &*colour : nullptr));
  DarkPicture picture{midmean_of(frames), {}, dark.size()};
  picture.hot = with_calibrated(hot_pixels_of_dark(picture.level), colour);
  replace_hot_pixels(picture.level, picture.hot);
  return picture;
}

DevelopedPicture develop(const CameraFrame& camera, const DevelopOptions& options) {
  const Colour* colour = camera.colour ? &*camera.colour : nullptr;
  const DarkPicture* dark = camera.dark.get();
  auto raw = std::make_shared<RawPicture>(undeveloped(camera.frame, colour));
  raw->demosaicing = options.demosaicing;
  DevelopedPicture out;
  LightOfNumber light = raw->light;
  light.of_number = raw->exposures.data();
  Samples samples = samples_of(camera.frame->view(), light);
  out.steps.push_back(linearised(camera.colour));
  out.steps.push_back(take_hot_pixels_out(samples, camera, *raw));
  if (dark != nullptr) {
    raw->dark = std::shared_ptr<const std::vector<float>>(camera.dark, &dark->level.value);
    subtract(samples, dark->level);
    out.steps.push_back(
        {"background", true, fmt::format("the midmean of {} frames without flame", dark->frames)});
  } else {
    out.steps.push_back(
        {"background", false, "no frames without flame: the level of the picture's darker half instead"});
  }
  out.steps.push_back(take_smear_out(samples, camera.sensor, options, *raw));
  out.steps.push_back(demosaiced(samples.layout, options.demosaicing));
  out.image = to_picture(samples, &out.bounds, options.demosaicing);
  out.steps.push_back(saturated(out.bounds));
  if (dark == nullptr) {
    const std::array<float, 3> level = subtract_background(out.image);
    std::copy(level.begin(), level.end(), raw->equalise.level);
  }
  if (colour != nullptr) equalise(out.image, *colour);
  out.steps.push_back(equalised(camera.colour));
  out.image.origin = Origin(std::move(raw));
  return out;
}

RadianceImage as_filmed(std::shared_ptr<const Image> frame) {
  RadianceImage image = to_radiance(frame->view());
  image.origin = Origin(share(undeveloped(std::move(frame), nullptr)));
  return image;
}

std::vector<PreprocessStep> together(
    const std::vector<std::pair<std::string, std::vector<PreprocessStep>>>& cameras) {
  std::vector<PreprocessStep> out;
  if (cameras.empty()) return out;
  for (std::size_t step = 0; step < cameras.front().second.size(); ++step) {
    PreprocessStep all = cameras.front().second[step];
    const auto differs = [&](const auto& camera) {
      return camera.second[step].on != all.on || camera.second[step].reason != all.reason;
    };
    if (std::none_of(cameras.begin(), cameras.end(), differs)) {
      out.push_back(std::move(all));
      continue;
    }
    std::string reason;
    for (const bool on : {true, false}) {
      const auto is = [&](const auto& camera) { return camera.second[step].on == on; };
      const auto first = std::find_if(cameras.begin(), cameras.end(), is);
      if (first == cameras.end()) continue;
      const auto count = static_cast<std::size_t>(std::count_if(cameras.begin(), cameras.end(), is));
      reason += (reason.empty() ? "" : "; ") +
                counted(count, cameras.size(), first->first, first->second[step].reason);
      all.on = all.on || on;
    }
    all.reason = std::move(reason);
    out.push_back(std::move(all));
  }
  return out;
}

}  // namespace emberlock::recon
