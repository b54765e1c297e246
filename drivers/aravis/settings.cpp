// SPDX-License-Identifier: Apache-2.0
#include "drivers/aravis/settings.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "drivers/aravis/gvcp.h"
#include "drivers/aravis/pixel_format.h"

namespace emberlock::drivers::aravis {
namespace {

bool has(ArvCamera* camera, const char* feature) {
  return arv_camera_is_feature_available(camera, feature, nullptr) != 0;
}

std::vector<std::string> entries(ArvCamera* camera, const char* feature) {
  guint n = 0;
  const MemoryPtr<const char*> names(
      arv_camera_dup_available_enumerations_as_strings(camera, feature, &n, nullptr));
  return names == nullptr ? std::vector<std::string>{}
                          : std::vector<std::string>(names.get(), names.get() + n);
}

struct Sides {
  int least = 1, most = 0, step = 1;
  [[nodiscard]] bool allow(int side) const {
    return side >= least && side <= most && (side - least) % std::max(step, 1) == 0;
  }
};
Sides widths(ArvCamera* camera) {
  Sides s;
  arv_camera_get_width_bounds(camera, &s.least, &s.most, nullptr);
  s.step = arv_camera_get_width_increment(camera, nullptr);
  return s;
}
Sides heights(ArvCamera* camera) {
  Sides s;
  arv_camera_get_height_bounds(camera, &s.least, &s.most, nullptr);
  s.step = arv_camera_get_height_increment(camera, nullptr);
  return s;
}

Hertz fastest(ArvCamera* camera) {
  double least = 0, most = 0;
  ErrorSlot error;
  arv_camera_get_frame_rate_bounds(camera, &least, &most, error.out());
  if (error.failed() || !(most > 0) || !std::isfinite(most) || most > 1e6) {
    most = arv_camera_get_frame_rate(camera, error.out());  // the rate can't be set, or has no limit
  }
  return Hertz(error.failed() ? 0 : most);
}

std::optional<Offer> offer(const std::string& encoding, PackedPixels pixels, Hertz rate) {
  const auto layout = layout_of(pixels);
  if (!layout) return {};
  return Offer{{*layout, encoding, rate}, pixels};
}

std::string list(const std::vector<std::string>& names) { return fmt::format("{}", fmt::join(names, ", ")); }

/// The address of the network interface through which a GigE camera is reached.
std::string interface_address(ArvCamera* camera) {
  GSocketAddress* here = arv_gv_device_get_interface_address(ARV_GV_DEVICE(arv_camera_get_device(camera)));
  const MemoryPtr<char> address(
      g_inet_address_to_string(g_inet_socket_address_get_address(G_INET_SOCKET_ADDRESS(here))));
  return address.get();
}

std::optional<std::string> packet_note(ArvCamera* camera) {
  if (arv_camera_is_gv_device(camera) == 0) return {};
  const auto packets = static_cast<int>(arv_camera_gv_get_packet_size(camera, nullptr));
  const auto mtu = network_mtu(interface_address(camera));
  constexpr int kAnyNetwork = 1500;
  if (!mtu || packets <= 0) return {};
  if (packets > *mtu) {
    return fmt::format("packets of {} bytes, the network takes {}: lower GevSCPSPacketSize, or raise the MTU",
                       packets, *mtu);
  }
  if (*mtu > kAnyNetwork && packets <= kAnyNetwork) {
    return fmt::format("packets of {} bytes, the network takes {}: a larger GevSCPSPacketSize costs less CPU",
                       packets, *mtu);
  }
  return {};
}

std::optional<std::string> clock_note(ArvCamera* camera) {
  for (const auto& [enable, status] :
       {std::pair("PtpEnable", "PtpStatus"), {"GevIEEE1588", "GevIEEE1588Status"}}) {
    if (!has(camera, enable)) continue;
    if (arv_camera_get_boolean(camera, enable, nullptr) == 0) {
      return fmt::format("its clock is not synchronised: {} is off", enable);
    }
    const char* state = has(camera, status) ? arv_camera_get_string(camera, status, nullptr) : nullptr;
    return fmt::format("its clock is synchronised by PTP: {}", state == nullptr ? "state unknown" : state);
  }
  return {};
}

template <class Number>
std::optional<Number> number(const std::string& text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc{} && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

Error not_a(const char* what, const std::string& name, const std::string& value, const std::string& where,
            const std::string& remedy) {
  return {ErrorKind::bad_input, fmt::format("\"{}\" is not {} for {}", value, what, name), where, remedy};
}

/// Sets an enumeration, boolean, integer, float or string feature.
Status set_value(ArvCamera* camera, ArvGcNode* node, const std::string& name, const std::string& value,
                 const std::string& where) {
  const char* feature = name.c_str();
  ErrorSlot error;
  std::string range;
  if (ARV_IS_GC_COMMAND(node)) {
    arv_camera_execute_command(camera, feature, error.out());
  } else if (ARV_IS_GC_ENUMERATION(node)) {
    const auto known = entries(camera, feature);
    if (std::find(known.begin(), known.end(), value) == known.end()) {
      return not_a("a value", name, value, where, "it can be " + list(known));
    }
    arv_camera_set_string(camera, feature, value.c_str(), error.out());
  } else if (ARV_IS_GC_BOOLEAN(node)) {
    if (value != "true" && value != "false") return not_a("a value", name, value, where, "say true or false");
    arv_camera_set_boolean(camera, feature, value == "true" ? TRUE : FALSE, error.out());
  } else if (ARV_IS_GC_FLOAT(node)) {
    const auto wanted = number<double>(value);
    if (!wanted) return not_a("a number", name, value, where, "say it as 12.5");
    double least = 0, most = 0;
    arv_camera_get_float_bounds(camera, feature, &least, &most, nullptr);
    range = fmt::format("it can be {:g} .. {:g}", least, most);
    arv_camera_set_float(camera, feature, *wanted, error.out());
  } else if (ARV_IS_GC_INTEGER(node)) {
    const auto wanted = number<gint64>(value);
    if (!wanted) return not_a("a whole number", name, value, where, "say it as 12");
    gint64 least = 0, most = 0;
    arv_camera_get_integer_bounds(camera, feature, &least, &most, nullptr);
    range = fmt::format("it can be {} .. {}", least, most);
    arv_camera_set_integer(camera, feature, *wanted, error.out());
  } else {
    arv_camera_set_string(camera, feature, value.c_str(), error.out());
  }
  if (!error.failed()) return {};
  return Error{ErrorKind::bad_input, fmt::format("it refuses {} = {} ({})", name, value, error.text()), where,
               range};
}

Status set_size_and_format(ArvCamera* camera, const Offer& chosen, const std::string& where) {
  ErrorSlot error;
  arv_camera_set_pixel_format_from_string(camera, chosen.mode.encoding.c_str(), error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  arv_camera_set_region(camera, 0, 0, chosen.pixels.size.width, chosen.pixels.size.height, error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  arv_camera_set_acquisition_mode(camera, ARV_ACQUISITION_MODE_CONTINUOUS, error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  return {};
}

Status set_exposure(ArvCamera* camera, Seconds exposure, const std::string& where) {
  if (arv_camera_is_exposure_auto_available(camera, nullptr) != 0) {
    arv_camera_set_exposure_time_auto(camera, ARV_AUTO_OFF, nullptr);
  }
  double least = 0, most = 0;
  arv_camera_get_exposure_time_bounds(camera, &least, &most, nullptr);
  const double wanted = in_microseconds(exposure);
  ErrorSlot error;
  if (wanted >= least && (most <= least || wanted <= most)) {
    arv_camera_set_exposure_time(camera, wanted, error.out());
    if (!error.failed()) return {};
  }
  return Error{ErrorKind::bad_input, fmt::format("it can't expose for {:g} us {}", wanted, error.text()),
               where, fmt::format("it can for {:g} .. {:g} us", least, most)};
}

Status set_rate(ArvCamera* camera, Hertz rate, const std::string& where) {
  ErrorSlot error;
  const Hertz most = fastest(camera);
  if (rate > most * 1.001) {
    return Error{ErrorKind::bad_input, fmt::format("it can't film {:g} frames/s so", rate.value()), where,
                 fmt::format("at this size, format and exposure it films at most {:.4g}", most.value())};
  }
  if (!has(camera, "AcquisitionFrameRate") && !has(camera, "AcquisitionFrameRateAbs") &&
      !has(camera, "FPS")) {
    return {};  // it films at its present rate
  }
  arv_camera_set_frame_rate(camera, rate.value(), error.out());
  if (error.failed()) return error.error(ErrorKind::device, where);
  return {};
}

/// Sets selectors first, because they determine what the other controls refer to.
Status set_controls(ArvCamera* camera, const CameraRequest& request, const std::string& where) {
  for (const bool selectors : {true, false}) {
    for (const auto& [name, value] : request.controls) {
      if (name.ends_with("Selector") != selectors) continue;
      EMBERLOCK_RETURN_IF_ERROR(set_control(camera, name, value, where));
    }
  }
  return {};
}

}  // namespace

std::vector<Offer> offers(ArvCamera* camera, const std::optional<ImageSize>& size) {
  const Sides width = widths(camera), height = heights(camera);
  const Hertz rate = fastest(camera);
  std::vector<Offer> all;
  for (const std::string& encoding : entries(camera, "PixelFormat")) {
    auto pixels = packing_of(encoding);
    if (!pixels) continue;
    pixels->size = {width.most, height.most};
    const auto largest = offer(encoding, *pixels, rate);
    if (!largest) continue;
    all.push_back(*largest);
    if (!size || *size == largest->mode.layout.size) continue;
    // A mosaic that doesn't begin with red loses a row or a column in unpacking.
    pixels->size.width = size->width + (width.most - largest->mode.layout.size.width);
    pixels->size.height = size->height + (height.most - largest->mode.layout.size.height);
    const auto asked = offer(encoding, *pixels, rate);
    if (asked && asked->mode.layout.size == *size && width.allow(pixels->size.width) &&
        height.allow(pixels->size.height)) {
      all.push_back(*asked);
    }
  }
  return all;
}

ExternalTrigger trigger_of(ArvCamera* camera) {
  if (!has(camera, "TriggerMode")) return ExternalTrigger::absent;
  const auto sources = entries(camera, "TriggerSource");
  const bool outside = std::any_of(sources.begin(), sources.end(),
                                   [](const std::string& source) { return !source.starts_with("Software"); });
  return outside ? ExternalTrigger::present : ExternalTrigger::absent;
}

std::optional<double> link_megabits_of(ArvCamera* camera) {
  if (arv_camera_is_gv_device(camera) == 0) return {};
  return network_megabits(interface_address(camera));
}

std::vector<std::string> notes_of(ArvCamera* camera) {
  std::vector<std::string> notes;
  const Sides width = widths(camera), height = heights(camera);
  if (width.least < width.most || height.least < height.most) {
    notes.push_back(fmt::format("any size from {} x {} to {} x {} in steps of {} x {}", width.least,
                                height.least, width.most, height.most, width.step, height.step));
  }
  if (auto note = packet_note(camera)) notes.push_back(std::move(*note));
  if (arv_camera_is_gv_device(camera) != 0) {
    const gint64 delay = arv_camera_gv_get_packet_delay(camera, nullptr);
    if (delay > 0) notes.push_back(fmt::format("{} ns between two packets ({})", delay, kPacketDelayNs));
  }
  if (auto note = clock_note(camera)) notes.push_back(std::move(*note));
  return notes;
}

Status set_control(ArvCamera* camera, const std::string& name, const std::string& value,
                   const std::string& where) {
  if (name == kPacketResend) {  // a control of the stream, which may not exist yet
    if (value == "always" || value == "never") return {};
    return not_a("a value", name, value, where, "say always or never");
  }
  if (name == kPacketDelayNs) {
    const auto delay = number<gint64>(value);
    if (!delay || *delay < 0) return not_a("a delay", name, value, where, "say nanoseconds, >= 0");
    if (arv_camera_is_gv_device(camera) == 0) {
      return not_a("of use", name, value, where, "only a GigE Vision camera delays packets");
    }
    ErrorSlot error;
    arv_camera_gv_set_packet_delay(camera, *delay, error.out());
    if (error.failed()) return error.error(ErrorKind::device, where);
    return {};
  }
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(camera), name.c_str());
  if (!ARV_IS_GC_FEATURE_NODE(node)) {
    return Error{ErrorKind::bad_input, "it has no control " + name, where,
                 "`arv-tool-0.8 features` lists its controls"};
  }
  return set_value(camera, node, name, value, where);
}

Result<Applied> apply(ArvCamera* camera, const CameraRequest& request, const std::string& where) {
  arv_camera_set_range_check_policy(camera, ARV_RANGE_CHECK_POLICY_ENABLE);
  EMBERLOCK_RETURN_IF_ERROR(
      set_controls(camera, request, where));  // before the modes are read: binning and others change them
  CameraRequest wanted = request;
  wanted.frame_rate.reset();  // the range of the rate depends on size, format and exposure
  const auto offered = offers(camera, request.size);
  std::vector<CameraMode> modes;
  modes.reserve(offered.size());
  for (const Offer& one : offered) modes.push_back(one.mode);
  EMBERLOCK_ASSIGN_OR_RETURN(const CameraMode mode, choose_mode(modes, wanted, where));
  Applied applied;
  applied.offer =
      offered.at(static_cast<std::size_t>(std::find(modes.begin(), modes.end(), mode) - modes.begin()));
  EMBERLOCK_RETURN_IF_ERROR(set_size_and_format(camera, applied.offer, where));
  if (request.exposure) EMBERLOCK_RETURN_IF_ERROR(set_exposure(camera, *request.exposure, where));
  EMBERLOCK_RETURN_IF_ERROR(set_rate(camera, request.frame_rate.value_or(fastest(camera)), where));
  EMBERLOCK_RETURN_IF_ERROR(
      set_controls(camera, request, where));  // again: setting the rate switches triggers off
  applied.frame_rate = Hertz(arv_camera_get_frame_rate(camera, nullptr));
  if (!(applied.frame_rate.value() > 0)) applied.frame_rate = request.frame_rate.value_or(Hertz(1));
  applied.offer.mode.frame_rate = applied.frame_rate;
  const char* trigger =
      has(camera, "TriggerMode") ? arv_camera_get_string(camera, "TriggerMode", nullptr) : nullptr;
  applied.free_running = trigger == nullptr || std::string_view(trigger) != "On";
  return applied;
}

}  // namespace emberlock::drivers::aravis
