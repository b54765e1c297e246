#include "smear_sync/sensors/phase_sensor.h"

#include "smear_sync/detect/follow.h"

namespace emberlock {
namespace {

class SmearSensor final : public PhaseSensor {
 public:
  explicit SmearSensor(const SensorOptions& options) : options_(options) {}

  void begin_round(const Beat& /*own*/) override { taken_.clear(); }
  std::vector<Look> wants(Seconds /*wanted*/) override { return {}; }
  SmearReading take(const ImageView& frame, TimePoint at, const Look& look) override {
    taken_.push_back({at, look, detector_.read(frame)});
    return taken_.back().reading;
  }
  [[nodiscard]] std::vector<PhaseSample> phases(Seconds delay) override {
    std::vector<PhaseSample> samples;
    for (const Taken& t : taken_) {
      if (t.look.delay != delay) continue;
      samples.push_back({t.at, phase_of(t.reading, options_.timing, options_.flash_width)});
    }
    return samples;
  }
  void forget_phase() override {}
  void set_row_time(SecondsPerRow row_time) override { options_.timing.row_time = row_time; }
  [[nodiscard]] const CcdTiming& timing() const override { return options_.timing; }

 private:
  struct Taken {
    TimePoint at;
    Look look;
    SmearReading reading;
  };
  SensorOptions options_;
  FollowingDetector detector_;
  std::vector<Taken> taken_;
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

}  // namespace emberlock
