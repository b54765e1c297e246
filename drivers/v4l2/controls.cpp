// SPDX-License-Identifier: Apache-2.0
#include "drivers/v4l2/controls.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>
#include <vector>

#include <fmt/format.h>

namespace emberlock::drivers {
namespace {

constexpr std::size_t kMostControls = 1024;

std::string text_of(const char* text, std::size_t size) { return {text, ::strnlen(text, size)}; }

std::vector<v4l2_query_ext_ctrl> list_controls(const Ioctl& device) {
  std::vector<v4l2_query_ext_ctrl> all;
  v4l2_query_ext_ctrl control{};
  while (all.size() < kMostControls) {
    control.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    const auto before = control.id;
    if (device(VIDIOC_QUERY_EXT_CTRL, &control) != 0 || control.id == before) break;
    const bool settable = control.type == V4L2_CTRL_TYPE_INTEGER || control.type == V4L2_CTRL_TYPE_BOOLEAN ||
                          control.type == V4L2_CTRL_TYPE_MENU ||
                          control.type == V4L2_CTRL_TYPE_INTEGER_MENU ||
                          control.type == V4L2_CTRL_TYPE_BUTTON || control.type == V4L2_CTRL_TYPE_INTEGER64 ||
                          control.type == V4L2_CTRL_TYPE_BITMASK;
    constexpr std::uint32_t kUnusable = V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_READ_ONLY;
    if (settable && (control.flags & kUnusable) == 0) all.push_back(control);
  }
  return all;
}

std::optional<std::int64_t> number(std::string_view text) {
  std::int64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return {};
  return value;
}

struct MenuItem {
  std::int64_t index;
  std::string name;
};

std::vector<MenuItem> list_items(const Ioctl& device, const v4l2_query_ext_ctrl& control) {
  std::vector<MenuItem> items;
  constexpr std::int64_t kMostItems = 256;
  const auto last = std::min<std::int64_t>(control.maximum, control.minimum + kMostItems);
  for (std::int64_t i = std::max<std::int64_t>(control.minimum, 0); i <= last; ++i) {
    v4l2_querymenu item{};
    item.id = control.id;
    item.index = static_cast<std::uint32_t>(i);
    if (device(VIDIOC_QUERYMENU, &item) != 0) continue;
    items.push_back({i, control.type == V4L2_CTRL_TYPE_MENU
                            ? text_of(reinterpret_cast<const char*>(item.name), sizeof item.name)
                            : std::to_string(item.value)});
  }
  return items;
}

/// The value given by the text; or an error that lists the valid texts.
Result<std::int64_t> value_of(const Ioctl& device, const v4l2_query_ext_ctrl& control,
                              const std::string& text, const std::string& where) {
  const std::string name = text_of(control.name, sizeof control.name);
  const std::string refusal = fmt::format("\"{}\" can't be set to \"{}\"", name, text);
  switch (control.type) {
    case V4L2_CTRL_TYPE_BUTTON:
      return std::int64_t{0};
    case V4L2_CTRL_TYPE_BOOLEAN:
      if (text == "on" || text == "1") return std::int64_t{1};
      if (text == "off" || text == "0") return std::int64_t{0};
      return Error{ErrorKind::bad_input, refusal, where, "say on or off"};
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU: {
      std::string names;
      const auto wanted = number(text);
      for (const MenuItem& item : list_items(device, control)) {
        if (item.name == text || wanted == item.index) return item.index;
        names += (names.empty() ? "" : ", ") + item.name;
      }
      return Error{ErrorKind::bad_input, refusal, where, "it offers " + names};
    }
    default: {
      const auto wanted = number(text);
      if (wanted && *wanted >= control.minimum && *wanted <= control.maximum) return *wanted;
      return Error{ErrorKind::bad_input, refusal, where,
                   fmt::format("it takes whole numbers from {} to {}", control.minimum, control.maximum)};
    }
  }
}

Status set_value(const Ioctl& device, std::uint32_t id, std::int64_t value, bool wide,
                 const std::string& name, const std::string& where) {
  v4l2_ext_control control{};
  control.id = id;
  if (wide) {
    control.value64 = value;
  } else {
    control.value = static_cast<std::int32_t>(value);
  }
  v4l2_ext_controls controls{};
  controls.which = V4L2_CTRL_WHICH_CUR_VAL;
  controls.count = 1;
  controls.controls = &control;
  if (const int error = device(VIDIOC_S_EXT_CTRLS, &controls); error != 0) {
    return Error{ErrorKind::device, fmt::format("it refuses to set \"{}\" ({})", name, std::strerror(error)),
                 where, "another control may have to be set first"};
  }
  return {};
}

}  // namespace

Status set_control(const Ioctl& device, const std::string& name, const std::string& value,
                   const std::string& where) {
  std::string names;
  for (const v4l2_query_ext_ctrl& control : list_controls(device)) {
    const std::string known = text_of(control.name, sizeof control.name);
    if (known == name) {
      EMBERLOCK_ASSIGN_OR_RETURN(const std::int64_t number, value_of(device, control, value, where));
      return set_value(device, control.id, number, control.type == V4L2_CTRL_TYPE_INTEGER64, name, where);
    }
    names += (names.empty() ? "" : ", ") + known;
  }
  return Error{ErrorKind::bad_input, fmt::format("it has no control \"{}\"", name), where, "it has " + names};
}

Status set_exposure(const Ioctl& device, Seconds exposure, const std::string& where) {
  const auto ticks = std::llround(std::clamp(exposure.value(), 1e-4, 1e5) * 1e4);
  EMBERLOCK_RETURN_IF_ERROR(
      set_value(device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, false, "Auto Exposure", where));
  return set_value(device, V4L2_CID_EXPOSURE_ABSOLUTE, ticks, false, "Exposure Time, Absolute", where);
}

}  // namespace emberlock::drivers
