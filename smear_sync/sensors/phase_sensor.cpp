// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/phase_sensor.h"

#include <fmt/format.h>

#include "smear_sync/detect/follow.h"
#include "smear_sync/sensors/taken_look.h"

namespace emberlock::smear {
namespace detail {
namespace {

/// An exposure shorter than this many flash widths has no plateau with a detectable end.
constexpr double kLeastExposure = 2;

}  // namespace

std::vector<PhaseSample> phases_at(Seconds delay, std::span<const TakenLook> taken,
                                   const SensorOptions& options) {
  std::vector<PhaseSample> samples;
  for (const TakenLook& t : taken) {
    if (t.look.delay != delay) continue;
    samples.push_back({t.at, phase_of(t.reading, options.timing, options.flash_width)});
  }
  return samples;
}

std::string too_short(Seconds exposure, Seconds flash_width) {
  if (exposure >= kLeastExposure * flash_width) return {};
  return fmt::format(
      "its exposure of {:.0f} us is no longer than the flash: lengthen it, or shorten the flash",
      exposure.value() * 1e6);
}

}  // namespace detail

namespace {

class SmearSensor final : public PhaseSensor {
 public:
  explicit SmearSensor(const SensorOptions& options) : options_(options) {}

  void begin_round(const PeriodOffset& /*own*/) override { taken_.clear(); }
  std::vector<Look> next_looks(Seconds /*wanted*/) override { return {}; }
  SmearReading take(const ImageView& frame, TimePoint at, const Look& look) override {
    taken_.push_back({at, look, detector_.read(frame)});
    return taken_.back().reading;
  }
  [[nodiscard]] std::vector<PhaseSample> phases(Seconds delay) override {
    return detail::phases_at(delay, taken_, options_);
  }
  void forget_phase() override {}
  void set_row_time(SecondsPerRow row_time) override { options_.timing.row_time = row_time; }
  [[nodiscard]] const CcdTiming& timing() const override { return options_.timing; }

 private:
  SensorOptions options_;
  FollowingDetector detector_;
  std::vector<detail::TakenLook> taken_;
};

}  // namespace

std::unique_ptr<PhaseSensor> make_smear_sensor(const SensorOptions& options) {
  return std::make_unique<SmearSensor>(options);
}

std::unique_ptr<PhaseSensor> make_phase_sensor(SensorKind kind, const SensorOptions& options) {
  switch (kind) {
    case SensorKind::ccd:
      break;
    case SensorKind::rolling_shutter:
      return make_rolling_sensor(options);
    case SensorKind::global_shutter:
      return make_global_sensor(options);
  }
  return make_smear_sensor(options);
}

}  // namespace emberlock::smear
