// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <string>

#include "base/clock.h"
#include "drivers/strobe.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/shared_light.h"
#include "drivers/virtual/strobe_timeline.h"

namespace emberlock::drivers {

/// Checks that a virtual strobe has these settings. Error bad_input names the setting and its range.
Status check_settings(const StrobeSettings& settings, const std::string& where);

/// A strobe with the range (30..20000 flashes per minute) and steps of the paper's. Writes its settings to a
/// timeline, and to other processes if it has `light`.
class VirtualStrobe final : public Strobe {
 public:
  VirtualStrobe(VirtualStrobeOptions options, std::shared_ptr<Clock> clock,
                std::shared_ptr<StrobeTimeline> timeline, std::unique_ptr<LightWriter> light = nullptr);

  [[nodiscard]] const std::string& id() const override { return options_.id; }
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override { return settings_; }

 private:
  VirtualStrobeOptions options_;
  std::shared_ptr<Clock> clock_;
  std::shared_ptr<StrobeTimeline> timeline_;
  std::unique_ptr<LightWriter> light_;
  StrobeSettings settings_;
};

}  // namespace emberlock::drivers
