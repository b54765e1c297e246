#include "drivers/replay/record.h"

#include <cmath>

#include "session/layout.h"

namespace emberlock {

v1::CameraStream to_proto(const CameraInfo& info) {
  v1::CameraStream stream;
  stream.set_camera_id(info.id);
  stream.set_model(info.model);
  set_layout(stream, info.layout);
  stream.set_frame_rate_hz(info.frame_rate.value());
  switch (info.reset) {
    case ShutterReset::none:
      stream.set_shutter_reset(v1::CameraStream::NONE);
      break;
    case ShutterReset::by_hand:
      stream.set_shutter_reset(v1::CameraStream::BY_HAND);
      break;
    case ShutterReset::on_command:
      stream.set_shutter_reset(v1::CameraStream::ON_COMMAND);
      break;
  }
  switch (info.sensor) {
    case SensorKind::ccd:
      stream.set_sensor(v1::CameraStream::CCD);
      break;
    case SensorKind::rolling_shutter:
      stream.set_sensor(v1::CameraStream::ROLLING_SHUTTER);
      break;
    case SensorKind::global_shutter:
      stream.set_sensor(v1::CameraStream::GLOBAL_SHUTTER);
      break;
  }
  if (info.trim) {
    stream.set_trim_range_ppm(info.trim->range.value());
    stream.set_trim_step_ppm(info.trim->step.value());
    stream.set_trim_latency_s(info.trim->latency.value());
  }
  return stream;
}

Result<CameraInfo> camera_info(const v1::CameraStream& stream) {
  CameraInfo info;
  EMBERLOCK_ASSIGN_OR_RETURN(info.layout, layout_of(stream));
  info.id = stream.camera_id();
  info.model = stream.model();
  info.frame_rate = Hertz(stream.frame_rate_hz());
  if (stream.shutter_reset() == v1::CameraStream::BY_HAND) info.reset = ShutterReset::by_hand;
  if (stream.shutter_reset() == v1::CameraStream::ON_COMMAND) info.reset = ShutterReset::on_command;
  if (stream.sensor() == v1::CameraStream::ROLLING_SHUTTER) info.sensor = SensorKind::rolling_shutter;
  if (stream.sensor() == v1::CameraStream::GLOBAL_SHUTTER) info.sensor = SensorKind::global_shutter;
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
  switch (s.output) {
    case StrobeOutput::off:
      state.set_output(v1::StrobeState::OFF);
      break;
    case StrobeOutput::flashing:
      state.set_output(v1::StrobeState::FLASHING);
      break;
    case StrobeOutput::steady:
      state.set_output(v1::StrobeState::STEADY);
      break;
  }
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
  switch (state.output()) {
    case v1::StrobeState::OFF:
      s.output = StrobeOutput::off;
      break;
    case v1::StrobeState::FLASHING:
      s.output = StrobeOutput::flashing;
      break;
    case v1::StrobeState::STEADY:
      s.output = StrobeOutput::steady;
      break;
    default:
      return damaged("output");
  }
  if (!std::isfinite(state.rate_hz())) return damaged("rate_hz");
  if (!std::isfinite(state.phase_s())) return damaged("phase_s");
  if (!std::isfinite(state.width_s())) return damaged("width_s");
  s.rate = Hertz(state.rate_hz());
  s.phase = Seconds(state.phase_s());
  s.width = Seconds(state.width_s());
  s.code.assign(state.code().begin(), state.code().end());
  return s;
}

}  // namespace emberlock
