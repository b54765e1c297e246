// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "base/one_to_one.h"

namespace emberlock {

/// How a camera's sensor is exposed and read, which decides what a flash leaves in its pictures. In each,
/// t_start ends the exposure of what is read first.
enum class SensorKind {
  ccd,  ///< interline CCD: charge is shifted past the lamp, and a flash in the read phase leaves a dot
  rolling_shutter,  ///< each row is exposed a row time after the one before: a flash lights a band of rows
  global_shutter,   ///< the whole frame is exposed at once: a flash falls into it or doesn't
};

inline constexpr OneToOne<SensorKind, std::string_view, 3> kSensorNames{
    {{{SensorKind::ccd, "ccd"},
      {SensorKind::rolling_shutter, "rolling"},
      {SensorKind::global_shutter, "global"}}}};

constexpr std::string_view name(SensorKind kind) { return kSensorNames.second_of(kind).value_or("unknown"); }

}  // namespace emberlock
