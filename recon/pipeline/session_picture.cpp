// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/session_picture.h"

#include <cmath>
#include <cstdlib>
#include <vector>

#include "recon/preprocess/dark_part.h"

namespace emberlock::recon {
namespace {

constexpr std::size_t kMostDark = 33;

SensorKind sensor_of(const v1::CameraStream& stream) {
  switch (stream.sensor()) {
    case v1::CameraStream::ROLLING_SHUTTER:
      return SensorKind::rolling_shutter;
    case v1::CameraStream::GLOBAL_SHUTTER:
      return SensorKind::global_shutter;
    default:
      return SensorKind::ccd;
  }
}

using Frames = std::vector<Frame>;

Result<Frames> read_frames(session::SessionReader& reader, std::size_t camera, std::size_t first,
                           std::size_t count) {
  Frames frames;
  for (std::size_t i = first; i < first + count; ++i) {
    if (reader.stamps(camera)[i].status != FrameStatus::complete) continue;
    EMBERLOCK_ASSIGN_OR_RETURN(Frame frame, reader.read(camera, i));
    frames.push_back(std::move(frame));
  }
  return frames;
}

/// The frames at one end of the recording, if they all show the same and the flame's frame shows more light.
/// The first look costs one frame.
Result<Frames> dark_end(session::SessionReader& reader, std::size_t camera, std::size_t first,
                        const Samples& flame) {
  EMBERLOCK_ASSIGN_OR_RETURN(Frames frames, read_frames(reader, camera, first, 1));
  if (frames.empty()) return Frames{};
  const Samples start = samples_of(frames.front().image->view());
  if (light_change(flame, start) != LightChange::gone_out) return Frames{};
  EMBERLOCK_ASSIGN_OR_RETURN(Frames others, read_frames(reader, camera, first + 1, kDarkFrames - 1));
  for (Frame& frame : others) {
    if (light_change(start, samples_of(frame.image->view())) != LightChange::none) return Frames{};
    frames.push_back(std::move(frame));
  }
  return frames.size() > kDarkFrames / 2 ? std::move(frames) : Frames{};
}

Result<Frames> find_dark(session::SessionReader& reader, std::size_t camera, std::size_t frame,
                         const ImageView& picture) {
  const std::size_t count = reader.stamps(camera).size();
  const bool before = frame >= 2 * kDarkFrames;
  const bool after = count >= frame + 2 * kDarkFrames;
  if (!before && !after) return Frames{};
  const Samples flame = samples_of(picture);
  Frames dark;
  if (before) {
    EMBERLOCK_ASSIGN_OR_RETURN(dark, dark_end(reader, camera, 0, flame));
  }
  if (dark.empty() && after) {
    EMBERLOCK_ASSIGN_OR_RETURN(dark, dark_end(reader, camera, count - kDarkFrames, flame));
  }
  return dark;
}

Result<Frames> told_dark(session::SessionReader& reader, std::size_t camera, const FrameOptions& options) {
  const auto [first, last] = options.dark;
  const std::string where = reader.folder().string() + ": camera " +
                            reader.manifest().cameras(static_cast<int>(camera)).camera_id();
  if (last >= reader.stamps(camera).size()) {
    return Error{ErrorKind::bad_input, "has no frame " + std::to_string(last) + " of the background's", where,
                 "It has " + std::to_string(reader.stamps(camera).size()) + ": choose another --background"};
  }
  EMBERLOCK_ASSIGN_OR_RETURN(Frames frames, read_frames(reader, camera, first, last - first + 1));
  if (frames.empty())
    return Error{ErrorKind::bad_input, "none of the background's frames is complete", where,
                 "Choose another --background"};
  return frames;
}

}  // namespace

Status parse_background(const std::string& text, FrameOptions& options) {
  if (text == "auto" || text == "level") {
    options.background =
        text == "auto" ? FrameOptions::Background::automatic : FrameOptions::Background::level;
    return {};
  }
  const auto digits = [](const std::string& word) {
    return !word.empty() && word.size() < 10 && word.find_first_not_of("0123456789") == std::string::npos;
  };
  const std::size_t dash = text.find('-');
  const std::string first = text.substr(0, dash);
  const std::string last = dash == std::string::npos ? first : text.substr(dash + 1);
  if (digits(first) && digits(last)) {
    options.background = FrameOptions::Background::frames;
    options.dark = {std::stoul(first), std::stoul(last)};
    if (options.dark.first <= options.dark.second && options.dark.second - options.dark.first < kMostDark)
      return {};
  }
  return Error{ErrorKind::bad_input, "\"" + text + "\" is no background", "--background",
               "Give auto, level, or FIRST-LAST: up to 33 frames without flame"};
}

Status parse_smear(const std::string& text, FrameOptions& options) {
  using Removal = DevelopOptions::SmearRemoval;
  DevelopOptions& develop = options.develop;
  if (text == "auto" || text == "off") {
    develop.smear_removal = text == "auto" ? Removal::automatic : Removal::off;
    return {};
  }
  const std::size_t colon = text.find(':');
  const std::string number = text.substr(0, colon);
  const std::string side = colon == std::string::npos ? "" : text.substr(colon + 1);
  char* end = nullptr;
  const double fraction = std::strtod(number.c_str(), &end);
  const bool sided = side == "above" || side == "below";
  if (number.empty() || *end != '\0' || !(fraction > 0 && fraction < 0.1) ||
      (colon != std::string::npos && !sided)) {
    return Error{
        ErrorKind::bad_input, "\"" + text + "\" is no smear", "--smear",
        "Give auto, off, or the share of every row's light, above 0 and below 0.1, with :above or :below for "
        "the rows on one side"};
  }
  develop.smear_removal = Removal::told;
  develop.smear.fraction = {fraction, fraction, fraction};
  develop.smear.path = side == "above"   ? SmearPath::rows_above
                       : side == "below" ? SmearPath::rows_below
                                         : SmearPath::whole_column;
  return {};
}

Result<FrameDeveloper> FrameDeveloper::create(session::SessionReader& reader, std::size_t camera,
                                              const v1::CameraStream& stream, const Frame& flame,
                                              std::size_t number, const FrameOptions& options) {
  FrameDeveloper developer;
  developer.sensor_ = sensor_of(stream);
  developer.options_ = options.develop;
  if (stream.has_colour()) {
    EMBERLOCK_ASSIGN_OR_RETURN(developer.colour_, read_colour(stream.colour(), reader.layout(camera).size,
                                                              "camera " + stream.camera_id()));
    if (changes_nothing(*developer.colour_)) developer.colour_.reset();
  }
  Frames dark;
  if (options.background == FrameOptions::Background::automatic) {
    EMBERLOCK_ASSIGN_OR_RETURN(dark, find_dark(reader, camera, number, flame.image->view()));
  } else if (options.background == FrameOptions::Background::frames) {
    EMBERLOCK_ASSIGN_OR_RETURN(dark, told_dark(reader, camera, options));
  }
  if (dark.empty()) return developer;
  std::vector<ImageView> views;
  views.reserve(dark.size());
  for (const Frame& frame : dark) views.push_back(frame.image->view());
  developer.dark_ = share(dark_picture_of(views, developer.colour_));
  return developer;
}

DevelopedPicture FrameDeveloper::develop(const Frame& frame) const {
  CameraFrame from;
  from.frame = frame.image;
  from.sensor = sensor_;
  from.colour = colour_;
  from.dark = dark_;
  return recon::develop(from, options_);
}

}  // namespace emberlock::recon
