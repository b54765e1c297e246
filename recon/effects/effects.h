#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/quantity.h"
#include "base/result.h"

namespace emberlock {

/// What light does on its way, beside being emitted. A zero coefficient is an effect that doesn't run.
struct Effects {
  PerMeter extinction{0};  ///< sigma_t, constant inside the medium, 0 outside
};

/// The paper's opacity a sample (0.05) as extinction: sigma = -ln(1 - tau) / edge.
PerMeter extinction_of_opacity(double tau, Meters voxel_edge);

/// What the user asks for: `--effects auto|none|extinction=VALUE`.
struct EffectRequest {
  std::optional<Effects> fixed;  ///< set by hand; otherwise found out from the pictures
  double tolerance = 0.5;        ///< grey levels: an effect that changes the pictures by less stays off
};

/// "auto", "none", "extinction=32.8" (1/m), or a comma separated list of effects; an Error that lists the
/// table's names otherwise.
Result<EffectRequest> parse_effects(std::string_view text);

/// One line of the report: what an effect does to this scene and why it is on or off.
struct EffectReport {
  std::string name;
  bool on = false;
  double predicted_change = 0;  ///< RMS of the input pictures' change in grey levels, after the best gain
  Seconds seconds{0};           ///< what finding out cost
  std::string reason;
};

struct EffectChoice {
  Effects effects;
  std::vector<EffectReport> reports;  ///< one for each effect of the table
};

}  // namespace emberlock
