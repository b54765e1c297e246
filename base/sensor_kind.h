#pragma once

#include <string_view>

namespace emberlock {

/// How a camera's sensor is exposed and read, which decides what a flash leaves in its pictures. In each,
/// t_start ends the exposure of what is read first.
enum class SensorKind {
  ccd,  ///< interline CCD: charge is shifted past the lamp, and a flash in the read phase leaves a dot
  rolling_shutter,  ///< each row is exposed a row time after the one before: a flash lights a band of rows
  global_shutter,   ///< the whole frame is exposed at once: a flash falls into it or doesn't
};

/// "ccd", "rolling" or "global".
constexpr std::string_view name(SensorKind kind) {
  switch (kind) {
    case SensorKind::ccd:
      return "ccd";
    case SensorKind::rolling_shutter:
      return "rolling";
    case SensorKind::global_shutter:
      return "global";
  }
  return "unknown";
}

}  // namespace emberlock
