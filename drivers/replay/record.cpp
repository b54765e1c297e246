// SPDX-License-Identifier: Apache-2.0
#include "drivers/replay/record.h"

#include <cmath>
#include <sstream>
#include <string_view>

#include <fmt/format.h>

#include "base/one_to_one.h"
#include "session/layout.h"

namespace emberlock::drivers {
namespace {

constexpr std::string_view kLate = "late frame: ";

constexpr OneToOne<ShutterReset, v1::CameraStream::ShutterReset, 3> kResets{
    {{{ShutterReset::none, v1::CameraStream::NONE},
      {ShutterReset::by_hand, v1::CameraStream::BY_HAND},
      {ShutterReset::on_command, v1::CameraStream::ON_COMMAND}}}};
constexpr OneToOne<SensorKind, v1::CameraStream::Sensor, 3> kSensors{
    {{{SensorKind::ccd, v1::CameraStream::CCD},
      {SensorKind::rolling_shutter, v1::CameraStream::ROLLING_SHUTTER},
      {SensorKind::global_shutter, v1::CameraStream::GLOBAL_SHUTTER}}}};
constexpr OneToOne<DeviceTimeOf, v1::CameraStream::DeviceTimeOf, 3> kDeviceTimes{
    {{{DeviceTimeOf::unknown, v1::CameraStream::UNKNOWN},
      {DeviceTimeOf::exposure_start, v1::CameraStream::EXPOSURE_START},
      {DeviceTimeOf::frame_end, v1::CameraStream::FRAME_END}}}};
constexpr OneToOne<StrobeOutput, v1::StrobeState::Output, 3> kOutputs{
    {{{StrobeOutput::off, v1::StrobeState::OFF},
      {StrobeOutput::flashing, v1::StrobeState::FLASHING},
      {StrobeOutput::steady, v1::StrobeState::STEADY}}}};

}  // namespace

v1::CameraStream to_proto(const CameraInfo& info) {
  v1::CameraStream stream;
  stream.set_camera_id(info.id);
  stream.set_model(info.model);
  session::set_layout(stream, info.layout);
  stream.set_frame_rate_hz(info.frame_rate.value());
  stream.set_shutter_reset(kResets.second_of(info.reset).value_or(v1::CameraStream::NONE));
  stream.set_sensor(kSensors.second_of(info.sensor).value_or(v1::CameraStream::CCD));
  stream.set_device_time_of(kDeviceTimes.second_of(info.device_time_of).value_or(v1::CameraStream::UNKNOWN));
  stream.set_transport_s(info.transport.value());
  if (info.trim) {
    stream.set_trim_range_ppm(info.trim->range.value());
    stream.set_trim_step_ppm(info.trim->step.value());
    stream.set_trim_latency_s(info.trim->latency.value());
  }
  return stream;
}

Result<CameraInfo> camera_info(const v1::CameraStream& stream) {
  CameraInfo info;
  EMBERLOCK_ASSIGN_OR_RETURN(info.layout, session::layout_of(stream));
  info.id = stream.camera_id();
  info.model = stream.model();
  info.frame_rate = Hertz(stream.frame_rate_hz());
  info.reset = kResets.first_of(stream.shutter_reset()).value_or(ShutterReset::none);
  info.sensor = kSensors.first_of(stream.sensor()).value_or(SensorKind::ccd);
  info.device_time_of = kDeviceTimes.first_of(stream.device_time_of()).value_or(DeviceTimeOf::unknown);
  info.transport = Seconds(stream.transport_s());
  if (stream.trim_range_ppm() > 0 && stream.trim_step_ppm() > 0) {
    info.trim = FrameRateTrim{PartsPerMillion(stream.trim_range_ppm()),
                              PartsPerMillion(stream.trim_step_ppm()), Seconds(stream.trim_latency_s())};
  }
  return info;
}

v1::Event strobe_event(TimePoint now, const StrobeSettings& s) {
  v1::Event event;
  event.set_monotonic_ns(now.ns);
  v1::StrobeState& state = *event.mutable_strobe();
  state.set_output(kOutputs.second_of(s.output).value_or(v1::StrobeState::OFF));
  state.set_rate_hz(s.rate.value());
  state.set_phase_s(s.phase.value());
  state.set_width_s(s.width.value());
  state.mutable_code()->Add(s.code.begin(), s.code.end());
  return event;
}

v1::Event reset_event(TimePoint now, const std::string& camera_id, TimePoint at) {
  v1::Event event;
  event.set_monotonic_ns(now.ns);
  event.mutable_reset()->set_camera_id(camera_id);
  event.mutable_reset()->set_at_ns(at.ns);
  return event;
}

v1::Event late_event(TimePoint at, const LateFrame& late) {
  v1::Event event;
  event.set_monotonic_ns(at.ns);
  event.set_note(fmt::format("{}{} {} {}", kLate, late.after_frames, late.waited.value(), late.camera_id));
  return event;
}

std::optional<LateFrame> late_frame(const v1::Event& event) {
  if (!event.has_note() || !event.note().starts_with(kLate)) return std::nullopt;
  LateFrame late;
  double waited = 0;
  std::istringstream fields(event.note().substr(kLate.size()));
  if (!(fields >> late.after_frames >> waited >> std::ws && std::getline(fields, late.camera_id)))
    return std::nullopt;
  late.waited = Seconds(waited);
  return late;
}

v1::Event trim_event(TimePoint now, const std::string& camera_id, PartsPerMillion trim) {
  v1::Event event;
  event.set_monotonic_ns(now.ns);
  event.mutable_trim()->set_camera_id(camera_id);
  event.mutable_trim()->set_trim_ppm(trim.value());
  return event;
}

Result<StrobeSettings> strobe_settings(const v1::StrobeState& state) {
  StrobeSettings s;
  const auto damaged = [](const char* field) {
    return Error{ErrorKind::bad_input, "a recorded strobe state has an unusable value",
                 std::string("events.binpb, StrobeState.") + field, "Restore the session's events"};
  };
  const auto output = kOutputs.first_of(state.output());
  if (!output) return damaged("output");
  if (!std::isfinite(state.rate_hz())) return damaged("rate_hz");
  if (!std::isfinite(state.phase_s())) return damaged("phase_s");
  if (!std::isfinite(state.width_s())) return damaged("width_s");
  s.output = *output;
  s.rate = Hertz(state.rate_hz());
  s.phase = Seconds(state.phase_s());
  s.width = Seconds(state.width_s());
  s.code.assign(state.code().begin(), state.code().end());
  return s;
}

}  // namespace emberlock::drivers
