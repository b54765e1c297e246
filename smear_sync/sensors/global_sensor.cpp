// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "smear_sync/detect/classify.h"
#include "smear_sync/sensors/exposure_sweep.h"
#include "smear_sync/sensors/phase_sensor.h"
#include "smear_sync/sensors/rolling_band.h"
#include "smear_sync/sensors/taken_look.h"

namespace emberlock::smear {
namespace {

/// A look isn't used if the edge may have moved past it since; in standard errors of that motion.
constexpr double kMoved = 3;
/// Maximum number of stored looks.
constexpr std::size_t kMost = 400;
/// If clipped samples hold more of a flash's light than this, partial flashes can't be measured. Below it
/// their error shifts the edge by at most this part of the flash's width, which is the resolution of an edge
/// anyway.
constexpr double kClipped = 0.1;

/// Evenly spaced delays locate an edge to this part of the period.
constexpr double kCoarse = 1.0 / 24;

class GlobalSensor final : public PhaseSensor {
 public:
  explicit GlobalSensor(const SensorOptions& options)
      : timing_(options.timing),
        sweep_{.period = options.timing.frame_period, .flash_width = options.flash_width} {}

  void begin_round(const PeriodOffset& own) override {
    own_ = own;
    if (untold_) forget_phase();
    dark_.reset();
    expected_.reset();
    round_begins_ = seen_.size();
  }

  std::vector<Look> next_looks(Seconds wanted) override {
    std::vector<Look> looks;
    if (!dark_) looks.emplace_back();
    if (window_ && round_begins_ == seen_.size()) {
      // The age of earlier looks is known only with the first look of this round.
      looks.push_back(look_at(window_->end));
      looks.push_back(
          look_at(window_->end - window_->exposure / 2));  // shows the present brightness of a whole flash
      return looks;
    }
    forget_what_moved(wanted);
    for (const Seconds delay : next_delays(samples(), sweep_, wanted, SweepEdges::end))
      looks.push_back(look_at(delay));
    return looks;
  }

  SmearReading take(const ImageView& frame, TimePoint at, const Look& look) override {
    const RowProfile profile = row_profile(frame);
    SmearReading reading;
    reading.reason = detail::unreadable(frame);
    if (!reading.reason.empty()) return reading;
    const auto rows = static_cast<double>(profile.level.size());
    Light light{0, profile.noise / std::sqrt(rows), profile.clipped};
    for (const double row : profile.level) light.level += row / rows;
    reading.state = SmearState::no_dot;
    reading.reason = fmt::format("a global shutter, which gathered {:.2f} grey levels", light.level);
    if (!look.delay) dark_ = light;
    if (!look.delay || !dark_) return reading;
    if (seen_.size() == kMost) {
      seen_.erase(seen_.begin());
      round_begins_ -= round_begins_ > 0 ? 1 : 0;
    }
    seen_.push_back({at, *look.delay,
                     Light{light.level - dark_->level, std::hypot(light.sigma, dark_->sigma),
                           light.clipped - dark_->clipped}});
    return reading;
  }

  [[nodiscard]] std::vector<PhaseSample> phases(Seconds delay) override {
    if (seen_.size() == round_begins_) return {};
    untold_ = true;
    PhaseSample sample{seen_.back().at, {}};
    const auto window = fit_exposure(samples(), sweep_);
    if (!window.ok()) {
      sample.phase.reason = why_not(window.error());
      return {sample};
    }
    Seconds exposure = wrap_positive(window->end - window->begin, sweep_.period);
    // The beginning of the exposure isn't tracked from round to round.
    if (exposure_ && window->begin_sigma > kCoarse * sweep_.period) exposure = *exposure_;
    sample.phase.reason = detail::too_short(exposure, sweep_.flash_width);
    if (unexpected(window->end)) {
      sample.phase.reason =
          "its exposure doesn't end where it did: leave its shutter alone but for what is ordered; its phase "
          "is "
          "looked for anew";
    }
    if (!sample.phase.reason.empty()) return {sample};
    untold_ = false;
    sample.phase = phase_of(*window, delay, sweep_.period);
    // The looks on both sides of the edge are older, and the edge's motion since then is uncertain.
    sample.phase.sigma =
        Seconds(std::hypot(sample.phase.sigma.value(), own_.sigma.value() * 1e-6 * age_of(window->end)));
    window_ = Window{sample.at, window->end, sample.phase.sigma, exposure};
    exposure_ = exposure;
    return {sample};
  }

  void forget_phase() override {
    seen_.clear();
    round_begins_ = 0;
    window_.reset();
    expected_.reset();
    untold_ = false;
  }
  void set_row_time(SecondsPerRow /*row_time*/) override {}
  [[nodiscard]] const CcdTiming& timing() const override { return timing_; }
  [[nodiscard]] std::optional<Seconds> exposure() const override { return exposure_; }

 private:
  /// Mean brightness of a whole picture, in grey levels.
  struct Light {
    double level = 0;
    double sigma = 0;
    double clipped = 0;  ///< part of it in saturated samples
  };
  struct Seen {
    TimePoint at;
    Seconds delay;
    Light light;  ///< minus the dark look of the round
  };
  /// End of the exposure, as a delay.
  struct Window {
    TimePoint at;
    Seconds end;
    Seconds sigma;
    Seconds exposure;
  };

  /// What is needed to predict the end for this round.
  struct Expected {
    Window before;
    Seconds open;  ///< uncertainty of the end without motion
  };

  [[nodiscard]] Look look_at(Seconds delay) const { return {wrap_positive(delay, sweep_.period)}; }

  /// The delay that would now hit the window at the same place as this look did.
  [[nodiscard]] Seconds delay_now(const Seen& s) const {
    const Seconds age = seen_.back().at - s.at;
    return wrap_positive(s.delay - age * (own_.rate.value() * 1e-6), sweep_.period);
  }
  [[nodiscard]] std::vector<SweepSample> samples() const {
    std::vector<SweepSample> all;
    for (const Seen& s : seen_) {
      const bool clipped = s.light.clipped > kClipped * s.light.level;
      all.push_back({delay_now(s), s.light.level, s.light.sigma, clipped});
    }
    return all;
  }

  /// The indices of the looks that locate an edge: the one that it cut, or those on either side.
  [[nodiscard]] std::vector<std::size_t> beside(Seconds edge) const {
    std::optional<std::size_t> nearest[2];
    const auto off = [&](std::size_t i) { return wrap_symmetric(delay_now(seen_[i]) - edge, sweep_.period); };
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      auto& best = nearest[off(i) < Seconds(0) ? 0 : 1];
      if (!best || abs(off(i)) <= abs(off(*best))) best = i;
    }
    std::vector<std::size_t> looks;
    for (const auto& i : nearest) {
      if (i && abs(off(*i)) < sweep_.flash_width / 2) return {*i};
      if (i) looks.push_back(*i);
    }
    return looks;
  }

  /// Age in seconds of the oldest of these looks.
  [[nodiscard]] double age_of(Seconds edge) const {
    Seconds age;
    for (const std::size_t i : beside(edge)) age = std::max(age, seen_.back().at - seen_[i].at);
    return age.value();
  }

  /// The predicted end of the window.
  [[nodiscard]] Seconds end_now(const Window& window) const {
    return window.end - (seen_.back().at - window.at) * (own_.rate.value() * 1e-6);
  }
  /// How far it may be from there, given its sigma at that time.
  [[nodiscard]] Seconds way(TimePoint since, Seconds sigma) const {
    const Seconds unsure = (seen_.back().at - since) * (own_.sigma.value() * 1e-6);
    return Seconds(kMoved * std::hypot(unsure.value(), sigma.value()));
  }

  /// Forgets earlier looks near the edges that may have been passed by the motion since, beyond `wanted`. If
  /// this round finds an edge further off, something else moved it.
  void forget_what_moved(Seconds wanted) {
    if (!window_ || round_begins_ == seen_.size()) return;
    const Seconds end = end_now(*window_);
    const Seconds open = 2 * wanted + sweep_.flash_width / 2;
    const auto moved = [&](const Seen& s) {
      const auto near = [&](Seconds edge) {
        return abs(wrap_symmetric(delay_now(s) - edge, sweep_.period)) < way(s.at, window_->sigma) + 2 * open;
      };
      return near(end - window_->exposure) || near(end);
    };
    expected_ = Expected{*window_, open};
    const auto round = seen_.begin() + static_cast<std::ptrdiff_t>(round_begins_);
    const auto kept = std::remove_if(seen_.begin(), round, moved);
    round_begins_ = static_cast<std::size_t>(kept - seen_.begin());
    seen_.erase(kept, round);
    window_.reset();
  }

  /// Whether an edge at this delay contradicts the prediction from earlier rounds.
  [[nodiscard]] bool unexpected(Seconds end) const {
    if (!expected_) return false;
    const Seconds off = wrap_symmetric(end - end_now(expected_->before), sweep_.period);
    return abs(off) > way(expected_->before.at, expected_->before.sigma) + expected_->open;
  }

  [[nodiscard]] std::string why_not(const Error& error) const {
    double low = INFINITY;
    double high = -INFINITY;
    double noise = 0;
    for (const Seen& s : seen_) {
      low = std::min(low, s.light.level);
      high = std::max(high, s.light.level);
      noise = std::max(noise, s.light.sigma);
    }
    if (low > sweep_.min_snr * noise)
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
  PeriodOffset own_{};
  std::vector<Seen> seen_;        ///< sorted by time
  std::size_t round_begins_ = 0;  ///< index of the first look of this round
  std::optional<Light> dark_;     ///< of this round, without the strobe
  bool untold_ = false;           ///< the round gave no phase
  std::optional<Window> window_;  ///< of the previous round, until the first look of this one
  std::optional<Expected> expected_;
  std::optional<Seconds> exposure_;
};

}  // namespace

std::unique_ptr<PhaseSensor> make_global_sensor(const SensorOptions& options) {
  return std::make_unique<GlobalSensor>(options);
}

}  // namespace emberlock::smear
