// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "base/random.h"

namespace emberlock::drivers {
namespace {

constexpr int kMostCameras = 64;
constexpr int kLargestSide = 16384;
constexpr std::string_view kScheme = "virtual:";

Status in_range(const std::string& where, const char* field, double value, double low, double high) {
  if (value >= low && value <= high) return {};
  return Error{ErrorKind::bad_input, std::string(field) + " is " + std::to_string(value), where,
               "give a value from " + std::to_string(low) + " to " + std::to_string(high)};
}

Status check(const VirtualCameraOptions& c) {
  const std::string where = "virtual camera " + c.id;
  const auto [width, height] = c.layout.size;
  const bool wide = bytes_per_sample(c.layout.format) == 2;
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "layout.size.width", width, 1, kLargestSide));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "layout.size.height", height, 1, kLargestSide));
  EMBERLOCK_RETURN_IF_ERROR(
      in_range(where, "layout.bit_depth", c.layout.bit_depth, wide ? 9 : 8, wide ? 16 : 8));
  if (const Status timing = check(c.timing); !timing.ok()) {
    Error error = timing.error();
    error.where = where + ", " + error.where;
    return error;
  }
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "timing.rows", c.timing.rows, height, height));
  EMBERLOCK_RETURN_IF_ERROR(
      in_range(where, "timing.frame_period", c.timing.frame_period.value(), 1e-4, 3600));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "nominal_rate", c.nominal_rate.value(), 1e-3, 1e4));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "lamp.x", c.lamp.x, -1e5, 1e5));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "lamp.y", c.lamp.y.value(), -1e5, 1e5));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "lamp.radius", c.lamp.radius, 0.5, 50));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "reset_latency", c.reset_latency.value(), 0, 10));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "reset_jitter", c.reset_jitter.value(), 0, 1));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "transport", c.transport.value(), 0, 2));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "wander", c.wander.value(), 0, 20));
  if (c.trim) {
    EMBERLOCK_RETURN_IF_ERROR(in_range(where, "trim.range", c.trim->range.value(), 1e-3, 1000));
    EMBERLOCK_RETURN_IF_ERROR(
        in_range(where, "trim.step", c.trim->step.value(), 1e-6, c.trim->range.value()));
    EMBERLOCK_RETURN_IF_ERROR(in_range(where, "trim.latency", c.trim->latency.value(), 0, 10));
  }
  return in_range(where, "first_phase", c.first_phase.value_or(Seconds(0)).value(), 0, 3600);
}

/// The kind of a group in a rig's name; none given means CCD.
std::optional<SensorKind> sensor_kind(std::string_view text) {
  if (text.empty()) return SensorKind::ccd;
  return kSensorNames.first_of(text);
}

smear::CcdTiming draw_timing(const VirtualRigDraw& draw, RandomStream& random) {
  const double crystal = 1 + random.uniform(-1, 1) * draw.crystal_spread.value() * 1e-6;
  smear::CcdTiming t;
  t.rows = draw.layout.size.height;
  t.frame_period = period(draw.rate) * crystal;
  t.row_time = draw.row_time * crystal;
  const int most = static_cast<int>(std::floor((t.frame_period / t.row_time).value()));
  const int with_dummies = std::clamp(t.rows + 20, t.rows, std::max(t.rows, most));
  const auto model = random.bits();
  t.shifts = with_dummies;
  if (draw.models == VirtualRigDraw::Models::mixed) {
    const int choices[] = {t.rows, with_dummies, std::max(t.rows, most)};
    t.shifts = choices[model % 3];
    t.direction =
        (model >> 32) % 2 == 0 ? smear::ReadDirection::top_first : smear::ReadDirection::bottom_first;
  }
  return t;
}

}  // namespace

std::uint64_t stream_seed(std::uint64_t seed, std::string_view camera_id) {
  for (const char c : camera_id) seed = mix64(seed ^ static_cast<unsigned char>(c));
  return seed;
}

Status check_exposure(const VirtualScene& scene, const VirtualCameraOptions& camera) {
  if (camera.exposure) {
    return in_range("virtual camera " + camera.id, "exposure", camera.exposure->value(), 1e-6,
                    camera.timing.frame_period.value());
  }
  return in_range("virtual camera " + camera.id, "the scene's exposure", scene.exposure.value(), 0,
                  camera.timing.frame_period.value());
}

Status check(const VirtualRigOptions& options) {
  const std::string where = "virtual rig";
  EMBERLOCK_RETURN_IF_ERROR(
      in_range(where, "the number of cameras", static_cast<double>(options.cameras.size()), 1, kMostCameras));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "queue_frames", options.queue_frames, 1, 4096));
  EMBERLOCK_RETURN_IF_ERROR(in_range(where, "strobe.rate_step", options.strobe.rate_step.value(), 1e-6, 0.5));
  EMBERLOCK_RETURN_IF_ERROR(
      in_range(where, "strobe.time_step", options.strobe.time_step.value(), 1e-9, 1e-3));
  EMBERLOCK_RETURN_IF_ERROR(
      in_range(where, "strobe.rate_error", options.strobe.rate_error.value(), -1000, 1000));
  if (const auto& dial = options.strobe.dial) {
    EMBERLOCK_RETURN_IF_ERROR(check(dial->dial));
    EMBERLOCK_RETURN_IF_ERROR(in_range(where, "strobe.dial.error", dial->error.value(), -200e3, 200e3));
    EMBERLOCK_RETURN_IF_ERROR(in_range(where, "strobe.dial.width", dial->width.value(), 1e-6, 1e-3));
    if (options.light) {
      return Error{ErrorKind::bad_input, "a strobe that is set by hand is not shared", where,
                   "leave out light or strobe.dial"};
    }
  }
  EMBERLOCK_RETURN_IF_ERROR(check(options.scene));
  std::set<std::string_view> ids;
  for (const VirtualCameraOptions& camera : options.cameras) {
    EMBERLOCK_RETURN_IF_ERROR(check(camera));
    if (!ids.insert(camera.id).second) {
      return Error{ErrorKind::bad_input, "two cameras have the id " + camera.id, where,
                   "give each its own id"};
    }
    EMBERLOCK_RETURN_IF_ERROR(check_exposure(options.scene, camera));
  }
  return {};
}

VirtualCameraOptions draw_virtual_camera(const VirtualRigDraw& draw, std::string id, SensorKind sensor) {
  VirtualCameraOptions c;
  c.id = std::move(id);
  c.sensor = sensor;
  RandomStream random(stream_seed(draw.seed, c.id), 0);
  if (sensor != SensorKind::ccd) c.exposure = draw.shutter_exposure;
  c.layout = draw.layout;
  c.nominal_rate = draw.rate;
  c.timing = draw_timing(draw, random);
  c.lamp.x = random.uniform(0.3, 0.7) * draw.layout.size.width;
  c.lamp.y = Rows(random.uniform(0.28, 0.72) * draw.layout.size.height);
  c.lamp.radius = random.uniform(3, 5);
  c.reset = draw.reset;
  c.reset_latency = draw.reset_latency + draw.reset_latency_spread * random.uniform(-1, 1);
  c.reset_jitter = draw.reset_jitter;
  c.trim = draw.trim;
  return c;
}

VirtualRigOptions draw_virtual_rig(const VirtualRigDraw& draw) {
  VirtualRigOptions rig;
  rig.seed = draw.seed;
  for (int i = 0; i < draw.cameras; ++i) {
    const auto place = static_cast<std::size_t>(i);
    const SensorKind sensor = place < draw.sensors.size() ? draw.sensors[place] : SensorKind::ccd;
    if (sensor != SensorKind::ccd) rig.scene = lit_room_scene();
    rig.cameras.push_back(draw_virtual_camera(draw, fmt::format("virtual-{:02}", i), sensor));
  }
  return rig;
}

Result<VirtualRigOptions> parse_virtual_rig(std::string_view name, std::uint64_t seed) {
  const auto refuse = [&](std::string what) {
    return Error{ErrorKind::bad_input, std::move(what), "rig " + std::string(name),
                 "give virtual:N with 1 to " + std::to_string(kMostCameras) +
                     " cameras, for example virtual:11 or virtual:4ccd+3rolling+2global"};
  };
  if (!name.starts_with(kScheme)) return refuse("there is no such rig");
  VirtualRigDraw draw{.cameras = 0, .seed = seed};
  for (std::string_view rest = name.substr(kScheme.size());;) {
    const std::size_t plus = rest.find('+');
    const std::string_view group = rest.substr(0, plus);
    int cameras = 0;
    const auto [end, failed] = std::from_chars(group.data(), group.data() + group.size(), cameras);
    if (failed == std::errc::invalid_argument) return refuse("the number of cameras is not a whole number");
    if (failed != std::errc{} || cameras < 1 || cameras > kMostCameras - draw.cameras) {
      return refuse("the number of cameras is out of range");
    }
    const auto kind = sensor_kind(group.substr(static_cast<std::size_t>(end - group.data())));
    if (!kind) return refuse("\"" + std::string(group) + "\" names no kind of sensor");
    draw.cameras += cameras;
    draw.sensors.insert(draw.sensors.end(), static_cast<std::size_t>(cameras), *kind);
    if (plus == std::string_view::npos) return draw_virtual_rig(draw);
    rest.remove_prefix(plus + 1);
  }
}

}  // namespace emberlock::drivers
