// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "rig/config/keys.h"

// All keys of [[rig.camera]].
namespace emberlock::rig::config {
namespace {

std::optional<ImageSize> parse_size(const std::string& text) {
  ImageSize size;
  int used = 0;
  if (std::sscanf(text.c_str(), "%5dx%5d%n", &size.width, &size.height, &used) != 2 ||
      used != static_cast<int>(text.size()) || size.width < 1 || size.height < 1 || size.width > 16384 ||
      size.height > 16384) {
    return std::nullopt;
  }
  return size;
}
std::string print_size(ImageSize size) { return fmt::format("{}x{}", size.width, size.height); }

const std::vector<std::pair<std::string_view, CameraSource>> kSources{
    {"virtual", CameraSource::virtual_}, {"v4l2", CameraSource::v4l2},     {"aravis", CameraSource::aravis},
    {"ptp", CameraSource::ptp},          {"replay", CameraSource::replay}, {"remote", CameraSource::remote}};

/// Restricts a key to cameras of these drivers.
Key<CameraConfig> of(std::vector<CameraSource> sources, Key<CameraConfig> key) {
  for (const auto& [word, source] : kSources) {
    if (std::find(sources.begin(), sources.end(), source) == sources.end()) continue;
    key.applies_words += (key.applies_words.empty() ? "of driver " : " or ") + in_quotes(word);
  }
  key.applies = [sources = std::move(sources)](const CameraConfig& camera) {
    return std::find(sources.begin(), sources.end(), camera.source) != sources.end();
  };
  return key;
}

/// controls = { Gain = "3" }: by the device's own names.
Key<CameraConfig> controls(std::string sentence) {
  Key<CameraConfig> key{
      "controls", "a table of texts, numbers, true and false", std::move(sentence), "{ Gain = 3 }", {}, {}};
  key.read = [](const toml::node& node, CameraConfig& camera) {
    const toml::table* table = node.as_table();
    if (table == nullptr) return false;
    for (const auto& [name, value] : *table) {
      std::string text;
      if (const auto spelled_out = value.value<std::string>()) {
        text = *spelled_out;
      } else if (value.is_boolean()) {
        text = *value.value<bool>() ? "1" : "0";
      } else if (value.is_integer()) {
        text = fmt::format("{}", *value.value<std::int64_t>());
      } else if (value.is_floating_point()) {
        text = fmt::format("{}", *value.value<double>());
      } else {
        return false;
      }
      camera.request.controls[std::string(name.str())] = std::move(text);
    }
    return true;
  };
  key.write = [](const CameraConfig& camera) {
    std::string text;
    for (const auto& [name, value] : camera.request.controls)
      text += (text.empty() ? "{ " : ", ") + in_quotes(name) + " = " + in_quotes(value);
    return text.empty() ? text : text + " }";
  };
  return key;
}

using Keys = std::vector<Key<CameraConfig>>;
const std::vector<CameraSource> kFilming{CameraSource::virtual_, CameraSource::v4l2, CameraSource::aravis,
                                         CameraSource::ptp};

/// Keys that select a camera and set it up.
Keys camera_keys() {
  using C = CameraConfig;
  using enum CameraSource;
  const std::vector<CameraSource> real{v4l2, aravis, ptp};
  return {
      choice<C>("driver", EMBERLOCK_AT(source), kSources,
                "Kind of camera. \"virtual\" is simulated, \"v4l2\" is what Linux drives itself, \"aravis\" "
                "is GigE Vision and USB3 Vision, \"ptp\" is a Canon with CHDK, \"replay\" is a recorded "
                "camera, \"remote\" is another host's. Required."),
      text<C>("id", EMBERLOCK_AT(id), "letters, digits, space and . _ : -",
              "The camera's id, as `emberlock devices` prints it, for \"remote\" on its host. For "
              "\"replay\": the id in the session; all "
              "cameras of the session if absent. For \"virtual\": a name, or with count > 1 the prefix of "
              "the names; \"virtual\" if absent.",
              "\"virtual\""),
      of({remote}, text<C>("host", EMBERLOCK_AT(host), "HOST:PORT",
                           "Where the emberlockd that has the camera lends it (listen in its [hosts]). "
                           "Needs certificate, key and authority in [hosts].",
                           "\"lab-2:7143\"")),
      of({virtual_},
         number<C>("count", EMBERLOCK_AT(count), {1, 64}, "Number of cameras with these settings.")),
      of(kFilming,
         spelled<C>("size", EMBERLOCK_AT(request.size), "WIDTHxHEIGHT, sides from 1 to 16384", parse_size,
                    print_size, "Size of the pictures; if absent, the largest, for \"virtual\" 1280x720.",
                    "\"1280x720\"")),
      of(kFilming, number<C>("rate_hz", EMBERLOCK_AT(request.frame_rate), {0.01, 10000},
                             "Frames per second; if absent, the fastest, for \"virtual\" 23.976. All cameras "
                             "of a rig film at one rate.",
                             "23.976")),
      of(kFilming,
         choice<C>("format", EMBERLOCK_AT(request.format),
                   named<PixelFormat>({PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                       PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16},
                                      [](PixelFormat f) { return name(f); }),
                   "Pixel format; if absent, the one that keeps most, for \"virtual\" gray8.", "\"gray8\"")),
      of(kFilming,
         number<C>("exposure_ms", EMBERLOCK_AT(request.exposure), {0.001, 60000, kMilli},
                   "Exposure time; if absent, the camera's own setting, for \"virtual\" the scene's.", "4")),
      of(real, controls("Controls to set before the camera films, by the camera's own names (`emberlock "
                        "devices probe` tries them).")),
  };
}

/// Keys for the kind of shutter and sensor.
Keys sensor_keys() {
  using C = CameraConfig;
  return {
      of(kFilming, choice<C>("sensor", EMBERLOCK_AT(sensor),
                             {{"ccd", SensorKind::ccd},
                              {"rolling", SensorKind::rolling_shutter},
                              {"global", SensorKind::global_shutter}},
                             "Kind of sensor. A flash leaves a dot in the pictures of an interline CCD, a "
                             "band in those of a rolling shutter; with a global shutter it shows only in "
                             "which frame it fell. If absent, as the driver reports, for \"virtual\" ccd.",
                             "\"ccd\"")),
      of(kFilming, choice<C>("reset", EMBERLOCK_AT(reset),
                             {{"none", ShutterReset::none},
                              {"by-hand", ShutterReset::by_hand},
                              {"on-command", ShutterReset::on_command}},
                             "How the camera gets a new random shutter phase: not at all, by an operator who "
                             "presses its button, or by the driver. If absent, as the driver reports.",
                             "\"by-hand\"")),
      number<C>("rows", EMBERLOCK_AT(rows), {1, 16384},
                "Visible rows of the sensor, from the data sheet; the picture's height if absent.", "720"),
      number<C>(
          "shifts", EMBERLOCK_AT(shifts), {1, 65536},
          "Row shifts per readout, hidden rows included, from the data sheet; the same as rows if absent.",
          "740"),
      number<C>("row_time_us", EMBERLOCK_AT(row_time), {0.1, 10000, kMicro},
                "Time to shift one row, used if it isn't measured; 54 if absent.", "54"),
      choice<C>(
          "direction", EMBERLOCK_AT(direction),
          {{"top-first", smear::ReadDirection::top_first},
           {"bottom-first", smear::ReadDirection::bottom_first}},
          "Which displayed row leaves the sensor first. The wrong direction reverses every correction."),
  };
}

}  // namespace

const Section<CameraConfig>& camera_section() {
  static const Section<CameraConfig> section = [] {
    Keys keys = camera_keys();
    for (Key<CameraConfig>& key : sensor_keys()) keys.push_back(std::move(key));
    return Section<CameraConfig>{
        "rig.camera",
        "One block per camera, of any driver. `emberlock devices` lists the cameras that are plugged in.",
        std::move(keys)};
  }();
  return section;
}

}  // namespace emberlock::rig::config
