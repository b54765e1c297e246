// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "base/one_to_one.h"

namespace emberlock {

/// How a camera's sensor is exposed and read out. This decides which trace a flash leaves in its pictures.
/// For each kind, t_start is the end of the exposure of the part that is read first.
enum class SensorKind {
  ccd,  ///< interline CCD: charge is shifted past the lamp's image; a flash during the read phase leaves a
        ///< dot
  rolling_shutter,  ///< rows are exposed one after another, a row time apart: a flash lights a band of rows
  global_shutter,   ///< the whole frame is exposed at once: a flash falls into the exposure or not
};

inline constexpr OneToOne<SensorKind, std::string_view, 3> kSensorNames{
    {{{SensorKind::ccd, "ccd"},
      {SensorKind::rolling_shutter, "rolling"},
      {SensorKind::global_shutter, "global"}}}};

constexpr std::string_view name(SensorKind kind) { return kSensorNames.second_of(kind).value_or("unknown"); }

}  // namespace emberlock
