// SPDX-License-Identifier: Apache-2.0
#include <cstdio>

#include "rig/config/keys.h"

// Every key of [[rig.camera]].
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

const std::vector<std::pair<std::string_view, CameraSource>> kSources{{"virtual", CameraSource::virtual_},
                                                                      {"v4l2", CameraSource::v4l2},
                                                                      {"aravis", CameraSource::aravis},
                                                                      {"ptp", CameraSource::ptp},
                                                                      {"replay", CameraSource::replay}};

/// The key, for cameras of these drivers alone.
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

/// Which camera, and how it is set up.
Keys camera_keys() {
  using C = CameraConfig;
  using enum CameraSource;
  const std::vector<CameraSource> real{v4l2, aravis, ptp};
  return {
      choice<C>("driver", EMBERLOCK_AT(source), kSources,
                "How the camera is reached. \"virtual\" is simulated, \"v4l2\" is what Linux drives itself, "
                "\"aravis\" is GigE Vision and USB3 Vision, \"ptp\" is a Canon with CHDK, \"replay\" is a "
                "recorded "
                "camera. Must be said."),
      text<C>("id", EMBERLOCK_AT(id), "letters, digits, space and . _ : -",
              "The camera, as `emberlock devices` names it. Of \"replay\" as in its session, all of the "
              "session if "
              "absent; of \"virtual\" a name, or with count > 1 what the names begin with, \"virtual\" "
              "if absent.",
              "\"virtual\""),
      of({virtual_}, number<C>("count", EMBERLOCK_AT(count), {1, 64}, "So many cameras alike.")),
      of(kFilming,
         spelled<C>("size", EMBERLOCK_AT(request.size), "WIDTHxHEIGHT, sides from 1 to 16384", parse_size,
                    print_size, "Of the pictures; the largest if absent, of \"virtual\" 1280x720.",
                    "\"1280x720\"")),
      of(kFilming,
         number<C>("rate_hz", EMBERLOCK_AT(request.frame_rate), {0.01, 10000},
                   "Frames a second; the fastest if absent, of \"virtual\" 23.976. All cameras of a rig "
                   "film at one rate.",
                   "23.976")),
      of(kFilming,
         choice<C>("format", EMBERLOCK_AT(request.format),
                   named<PixelFormat>({PixelFormat::gray8, PixelFormat::gray16, PixelFormat::bayer_rggb8,
                                       PixelFormat::bayer_rggb16, PixelFormat::rgb8, PixelFormat::rgb16},
                                      [](PixelFormat f) { return name(f); }),
                   "Of the pixels; what keeps most if absent, of \"virtual\" gray8.", "\"gray8\"")),
      of(kFilming, number<C>("exposure_ms", EMBERLOCK_AT(request.exposure), {0.001, 60000, kMilli},
                             "As the camera is set if absent, of \"virtual\" as the scene has it.", "4")),
      of(real,
         controls("Set before it films, by the camera's own names (`emberlock devices probe` tries them).")),
  };
}

/// What kind of shutter and chip it has.
Keys sensor_keys() {
  using C = CameraConfig;
  return {
      of(kFilming,
         choice<C>("sensor", EMBERLOCK_AT(sensor),
                   {{"ccd", SensorKind::ccd},
                    {"rolling", SensorKind::rolling_shutter},
                    {"global", SensorKind::global_shutter}},
                   "What a flash leaves in its pictures: an interline CCD's dot, a rolling shutter's band, "
                   "or nothing but the frame. As the driver says if absent, of \"virtual\" ccd.",
                   "\"ccd\"")),
      of(kFilming,
         choice<C>("reset", EMBERLOCK_AT(reset),
                   {{"none", ShutterReset::none},
                    {"by-hand", ShutterReset::by_hand},
                    {"on-command", ShutterReset::on_command}},
                   "How its shutter phase is drawn anew: not at all, by an operator who presses the "
                   "button, or by the driver. As the driver says if absent.",
                   "\"by-hand\"")),
      number<C>("rows", EMBERLOCK_AT(rows), {1, 16384},
                "Visible rows of its chip, from the data sheet; the picture's height if absent.", "720"),
      number<C>(
          "shifts", EMBERLOCK_AT(shifts), {1, 65536},
          "Row shifts of a read phase, hidden rows too, from the data sheet; as many as rows if absent.",
          "740"),
      number<C>("row_time_us", EMBERLOCK_AT(row_time), {0.1, 10000, kMicro},
                "Time to shift one row, used where it isn't measured; 54 if absent.", "54"),
      choice<C>("direction", EMBERLOCK_AT(direction),
                {{"top-first", smear::ReadDirection::top_first},
                 {"bottom-first", smear::ReadDirection::bottom_first}},
                "Which displayed row leaves the chip first. The wrong one reverses every correction."),
  };
}

}  // namespace

const Section<CameraConfig>& camera_section() {
  static const Section<CameraConfig> section = [] {
    Keys keys = camera_keys();
    for (Key<CameraConfig>& key : sensor_keys()) keys.push_back(std::move(key));
    return Section<CameraConfig>{"rig.camera",
                                 "One block a camera, of any driver, as often as needed. `emberlock devices` "
                                 "lists what is plugged in.",
                                 std::move(keys)};
  }();
  return section;
}

}  // namespace emberlock::rig::config
