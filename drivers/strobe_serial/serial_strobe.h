// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "base/clock.h"
#include "drivers/strobe.h"
#include "drivers/strobe_serial/dialect.h"
#include "drivers/strobe_serial/line.h"

namespace emberlock::drivers {

/// A strobe that speaks a dialect over a wire. A dead wire is closed, and the next call opens a new one.
/// Settings that the device lost with its power show in read_back(); they aren't restored automatically. A
/// call that fails because of silence or noise is repeated once; every command may be sent twice. A silent
/// device is reported within 2 s, and every call ends within 4 s.
class SerialStrobe final : public Strobe {
 public:
  /// Finds the device again, wherever it is plugged in. Error device: it is absent, or another process holds
  /// it.
  using Opener = std::function<Result<std::unique_ptr<Wire>>()>;

  SerialStrobe(std::string id, std::unique_ptr<const Dialect> dialect, Opener open,
               std::shared_ptr<Clock> clock);

  [[nodiscard]] const std::string& id() const override { return id_; }
  Status apply(const StrobeSettings& settings) override;
  Result<StrobeSettings> read_back() override;

  /// Opens the wire if necessary and sends hello for up to `patience`: a microcontroller that was reset by
  /// the opening of the port needs some time. Returns the device's model.
  Result<std::string> greet(Seconds patience);

 private:
  template <class Call>
  auto with_device(const Call& call) -> decltype(call(TimePoint()));
  Status ready(TimePoint until);
  Result<StrobeSettings> settings(TimePoint until);
  Error named(Error error) const;

  std::string id_;
  std::unique_ptr<const Dialect> dialect_;
  Opener open_;
  std::shared_ptr<Clock> clock_;
  std::optional<Line> line_;
};

}  // namespace emberlock::drivers
