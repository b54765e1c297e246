#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "smear_sync/sensors/exposure_sweep.h"
#include "smear_sync/sensors/phase_sensor.h"
#include "smear_sync/sensors/rolling_band.h"

namespace emberlock {
namespace {

/// A look tells nothing of an edge that may have moved past it since: so many standard errors of the way.
constexpr double kMoved = 3;
/// Looks that are kept.
constexpr std::size_t kMost = 400;
/// An exposure of fewer flash widths has no plateau whose end could be told.
constexpr double kLeastExposure = 2;

class GlobalSensor final : public PhaseSensor {
 public:
  explicit GlobalSensor(const SensorOptions& options)
      : timing_(options.timing),
        sweep_{.period = options.timing.frame_period, .flash_width = options.flash_width} {}

  void begin_round(const Beat& own) override {
    own_ = own;
    round_begins_ = seen_.size();
  }

  std::vector<Look> wants(Seconds wanted) override {
    if (!dark_) return {Look{}};
    // What was seen in earlier rounds is as old as the first look of this one tells.
    if (window_ && round_begins_ == seen_.size()) return {look_at(window_->end)};
    forget_what_moved();
    std::vector<Look> looks;
    for (const Seconds delay : next_delays(samples(), sweep_, wanted, SweepEdges::end))
      looks.push_back(look_at(delay));
    return looks;
  }

  SmearReading take(const ImageView& frame, TimePoint at, const Look& look) override {
    const RowProfile profile = row_profile(frame);
    double level = 0;
    const auto rows = static_cast<double>(profile.level.size());
    for (const double row : profile.level) level += row / rows;
    SmearReading reading;
    reading.state = SmearState::no_dot;
    reading.reason = fmt::format("a global shutter, which gathered {:.2f} grey levels", level);
    if (!look.delay) {
      dark_ = level;
      return reading;
    }
    if (seen_.size() == kMost) {
      seen_.erase(seen_.begin());
      round_begins_ -= round_begins_ > 0 ? 1 : 0;
    }
    white_ = 0.95 * frame.layout.white();
    seen_.push_back({at, *look.delay, level, profile.noise / std::sqrt(rows)});
    return reading;
  }

  [[nodiscard]] std::vector<PhaseSample> phases(Seconds delay) override {
    if (seen_.size() == round_begins_) return {};
    PhaseSample sample{seen_.back().at, {}};
    const auto window = fit_exposure(samples(), sweep_, white_);
    if (!window.ok()) {
      sample.phase.reason = why_not(window.error());
      return {sample};
    }
    const Seconds exposure = wrap_positive(window->end - window->begin, sweep_.period);
    if (exposure < kLeastExposure * sweep_.flash_width) {
      sample.phase.reason = fmt::format(
          "its exposure of {:.0f} us is no longer than the flash: lengthen it, or shorten the flash",
          exposure.value() * 1e6);
      return {sample};
    }
    sample.phase = phase_of(*window, delay, sweep_.period);
    // The looks at both sides of the edge were taken earlier, and what the edge did since isn't quite known.
    sample.phase.sigma =
        Seconds(std::hypot(sample.phase.sigma.value(), own_.sigma.value() * 1e-6 * age_of(window->end)));
    window_ = Window{sample.at, window->end, sample.phase.sigma};
    exposure_ = exposure;
    return {sample};
  }

  void forget_phase() override {
    seen_.clear();
    round_begins_ = 0;
    window_.reset();
  }
  void set_row_time(SecondsPerRow /*row_time*/) override {}
  [[nodiscard]] const CcdTiming& timing() const override { return timing_; }
  [[nodiscard]] std::optional<Seconds> exposure() const override { return exposure_; }

 private:
  struct Seen {
    TimePoint at;
    Seconds delay;
    double level;
    double sigma;
  };
  /// Where the exposure ended, as a delay.
  struct Window {
    TimePoint at;
    Seconds end;
    Seconds sigma;
  };

  [[nodiscard]] Look look_at(Seconds delay) const { return {wrap_positive(delay, sweep_.period)}; }

  /// The delay that would have met the window now where this look met it then.
  [[nodiscard]] Seconds delay_now(const Seen& s) const {
    const Seconds age = seen_.back().at - s.at;
    return wrap_positive(s.delay - age * (own_.rate.value() * 1e-6), sweep_.period);
  }
  [[nodiscard]] std::vector<SweepSample> samples() const {
    std::vector<SweepSample> all;
    for (const Seen& s : seen_) all.push_back({delay_now(s), s.level, s.sigma});
    return all;
  }

  /// Seconds since the older one of the looks next to an edge.
  [[nodiscard]] double age_of(Seconds edge) const {
    double before = INFINITY;
    double after = INFINITY;
    double age[2] = {0, 0};
    for (const Seen& s : seen_) {
      const double off = wrap_symmetric(delay_now(s) - edge, sweep_.period).value();
      double& nearest = off < 0 ? before : after;
      if (std::abs(off) > nearest) continue;
      nearest = std::abs(off);
      age[off < 0 ? 0 : 1] = (seen_.back().at - s.at).value();
    }
    return std::max(age[0], age[1]);
  }

  void forget_what_moved() {
    if (!window_ || round_begins_ == seen_.size()) return;
    const TimePoint now = seen_.back().at;
    const Seconds end = window_->end - (now - window_->at) * (own_.rate.value() * 1e-6);
    const auto moved = [&](const Seen& s) {
      const Seconds unsure = (now - s.at) * (own_.sigma.value() * 1e-6);
      const double way = kMoved * std::hypot(unsure.value(), window_->sigma.value());
      const Seconds off = wrap_symmetric(delay_now(s) - end, sweep_.period);
      return abs(off) < Seconds(way) + sweep_.flash_width;
    };
    const auto round = seen_.begin() + static_cast<std::ptrdiff_t>(round_begins_);
    const auto kept = std::remove_if(seen_.begin(), round, moved);
    round_begins_ = static_cast<std::size_t>(kept - seen_.begin());
    seen_.erase(kept, round);
    window_.reset();
  }

  [[nodiscard]] std::string why_not(const Error& error) const {
    double low = INFINITY;
    double high = -INFINITY;
    double noise = 0;
    for (const Seen& s : seen_) {
      low = std::min(low, s.level);
      high = std::max(high, s.level);
      noise = std::max(noise, s.sigma);
    }
    if (dark_ && low > *dark_ + sweep_.min_snr * noise)
      return "every flash falls into its exposure, which lasts the whole period: shorten its exposure";
    if (high - low < 2 * sweep_.min_snr * noise) {
      return fmt::format(
          "no flash shows at any delay: bring the strobe into view, or lengthen an exposure of less "
          "than {:.2f} ms",
          in_milliseconds(sweep_.period / even_delay_count()));
    }
    return error.what + ": " + error.remedy;
  }

  CcdTiming timing_;
  SweepOptions sweep_;
  Beat own_{};
  std::vector<Seen> seen_;        ///< by time
  std::size_t round_begins_ = 0;  ///< the first look of this round among them
  std::optional<double> dark_;    ///< its level without the strobe
  std::optional<double> white_;
  std::optional<Window> window_;  ///< of the round before, until this one's first look
  std::optional<Seconds> exposure_;
};

}  // namespace

std::unique_ptr<PhaseSensor> make_global_sensor(const SensorOptions& options) {
  return std::make_unique<GlobalSensor>(options);
}

}  // namespace emberlock
