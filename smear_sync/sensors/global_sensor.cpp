// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "smear_sync/detect/judge.h"
#include "smear_sync/sensors/exposure_sweep.h"
#include "smear_sync/sensors/phase_sensor.h"
#include "smear_sync/sensors/rolling_band.h"
#include "smear_sync/sensors/taken_look.h"

namespace emberlock::smear {
namespace {

/// A look tells nothing of an edge that may have moved past it since: so many standard errors of the way.
constexpr double kMoved = 3;
/// Looks that are kept.
constexpr std::size_t kMost = 400;
/// Where clipped samples hold more of a flash's light, its parts aren't told: what they are off by is less
/// than this, and the edge by this part of the flash's width, which is as fine as edges are told at all.
constexpr double kClipped = 0.1;

/// Even delays tell an edge to this part of the period, twenty-fourths apart.
constexpr double kCoarse = 1.0 / 24;

class GlobalSensor final : public PhaseSensor {
 public:
  explicit GlobalSensor(const SensorOptions& options)
      : timing_(options.timing),
        sweep_{.period = options.timing.frame_period, .flash_width = options.flash_width} {}

  void begin_round(const Beat& own) override {
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
      // What was seen in earlier rounds is as old as the first look of this one tells.
      looks.push_back(look_at(window_->end));
      looks.push_back(look_at(window_->end - window_->exposure / 2));  // what a whole flash looks like now
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
    // Where it begins isn't looked after from round to round.
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
    // The looks at both sides of the edge were taken earlier, and what the edge did since isn't quite known.
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
  /// Of a whole picture, in grey levels.
  struct Light {
    double level = 0;
    double sigma = 0;
    double clipped = 0;  ///< what saturated samples hold of it
  };
  struct Seen {
    TimePoint at;
    Seconds delay;
    Light light;  ///< beyond the round's dark look
  };
  /// Where the exposure ended, as a delay.
  struct Window {
    TimePoint at;
    Seconds end;
    Seconds sigma;
    Seconds exposure;
  };

  /// What lets the end of this round's be expected.
  struct Expected {
    Window before;
    Seconds open;  ///< by which it may be off though nothing moved
  };

  [[nodiscard]] Look look_at(Seconds delay) const { return {wrap_positive(delay, sweep_.period)}; }

  /// The delay that would have met the window now where this look met it then.
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

  /// The looks that tell where an edge is, by their index: the one that it cut, or those to either side.
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

  /// Seconds since the oldest of the looks that tell an edge.
  [[nodiscard]] double age_of(Seconds edge) const {
    Seconds age;
    for (const std::size_t i : beside(edge)) age = std::max(age, seen_.back().at - seen_[i].at);
    return age.value();
  }

  /// Where the window's end should be now.
  [[nodiscard]] Seconds end_now(const Window& window) const {
    return window.end - (seen_.back().at - window.at) * (own_.rate.value() * 1e-6);
  }
  /// How far it may be from there, given its sigma then.
  [[nodiscard]] Seconds way(TimePoint since, Seconds sigma) const {
    const Seconds unsure = (seen_.back().at - since) * (own_.sigma.value() * 1e-6);
    return Seconds(kMoved * std::hypot(unsure.value(), sigma.value()));
  }

  /// What was seen in rounds before about the edges is forgotten, so far as they may have moved since, and
  /// beyond what `wanted` leaves open: an edge that this round finds further off was moved by something else.
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

  /// An edge at this delay isn't where the rounds before let it be expected.
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
  Beat own_{};
  std::vector<Seen> seen_;        ///< by time
  std::size_t round_begins_ = 0;  ///< the first look of this round among them
  std::optional<Light> dark_;     ///< of this round, without the strobe
  bool untold_ = false;           ///< the round's looks told no phase
  std::optional<Window> window_;  ///< of the round before, until this one's first look
  std::optional<Expected> expected_;
  std::optional<Seconds> exposure_;
};

}  // namespace

std::unique_ptr<PhaseSensor> make_global_sensor(const SensorOptions& options) {
  return std::make_unique<GlobalSensor>(options);
}

}  // namespace emberlock::smear
