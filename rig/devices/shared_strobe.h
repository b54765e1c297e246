// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <mutex>
#include <optional>
#include <string>

#include "drivers/strobe.h"

namespace emberlock::rig {

/// A strobe whose calls may come from several threads: each waits until the others' are over.
class SharedStrobe final : public drivers::Strobe {
 public:
  /// `strobe` outlives it.
  explicit SharedStrobe(drivers::Strobe& strobe) : strobe_(strobe) {}

  [[nodiscard]] const std::string& id() const override { return strobe_.id(); }
  Status apply(const drivers::StrobeSettings& settings) override {
    const std::lock_guard lock(mutex_);
    return strobe_.apply(settings);
  }
  Result<drivers::StrobeSettings> read_back() override {
    const std::lock_guard lock(mutex_);
    return strobe_.read_back();
  }
  [[nodiscard]] std::optional<StrobeDial> dial() const override { return strobe_.dial(); }

 private:
  drivers::Strobe& strobe_;
  std::mutex mutex_;
};

}  // namespace emberlock::rig
