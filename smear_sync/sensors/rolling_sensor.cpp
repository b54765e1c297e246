// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "smear_sync/detect/classify.h"
#include "smear_sync/sensors/exposure_sweep.h"
#include "smear_sync/sensors/phase_sensor.h"
#include "smear_sync/sensors/rolling_band.h"
#include "smear_sync/sensors/taken_look.h"

namespace emberlock::smear {
namespace {

/// Minimum number of edges for a row time.
constexpr std::size_t kFewestEdges = 6;

class RollingSensor final : public PhaseSensor {
 public:
  explicit RollingSensor(const SensorOptions& options) : options_(options) {
    options_.timing.shifts = options_.timing.rows;
  }

  void begin_round(const PeriodOffset& /*own*/) override {
    taken_.clear();
    if (nothing_read_) sweep_anew();
  }

  std::vector<Look> next_looks(Seconds /*wanted*/) override {
    if (!sweeping()) return {};
    const std::vector<Seconds> delays = even_delays(step_, options_.timing.frame_period);
    std::vector<Look> looks;
    if (step_ == 0) {
      looks.emplace_back();
    } else {
      learn(delays);
      if (!sweeping()) return {};
    }
    for (const Seconds delay : delays) looks.push_back({delay});
    ++step_;
    return looks;
  }

  SmearReading take(const ImageView& frame, TimePoint at, const Look& look) override {
    RowProfile profile = row_profile(frame);
    SmearReading reading;
    if (profile.level.empty()) {
      reading.reason = detail::unreadable(frame);
    } else if (sweeping()) {
      swept_.push_back({at, look, std::move(profile)});
      return reading;
    } else if (reference_ && unreadable_.empty()) {
      reading = read_bands(profile, *reference_, {.direction = options_.timing.direction}).reading;
    } else {
      reading.reason = unreadable_;
    }
    taken_.push_back({at, look, reading});
    return reading;
  }

  std::vector<PhaseSample> phases(Seconds delay) override {
    std::vector<PhaseSample> samples = detail::phases_at(delay, taken_, options_);
    if (!unreadable_.empty()) {
      for (PhaseSample& sample : samples) sample.phase = {PhaseState::unusable, {}, {}, unreadable_};
    }
    nothing_read_ = !samples.empty() && std::all_of(samples.begin(), samples.end(), [](const PhaseSample& s) {
      return s.phase.state == PhaseState::unusable;
    });
    return samples;
  }
  void forget_phase() override {}
  void set_row_time(SecondsPerRow row_time) override { options_.timing.row_time = row_time; }
  [[nodiscard]] const CcdTiming& timing() const override { return options_.timing; }
  [[nodiscard]] std::optional<RowClock> row_clock() const override { return clock_; }
  [[nodiscard]] std::optional<Seconds> exposure() const override { return exposure_; }

 private:
  struct Swept {
    TimePoint at;
    Look look;
    RowProfile profile;
  };

  [[nodiscard]] bool sweeping() const { return !reference_ && unreadable_.empty(); }

  void sweep_anew() {
    step_ = 0;
    swept_.clear();
    reference_.reset();
    clock_.reset();
    exposure_.reset();
    unreadable_.clear();
    nothing_read_ = false;
  }

  /// Evaluates the sweep so far. If it isn't sufficient and nothing is `still_to_come`, sets the reason.
  void learn(const std::vector<Seconds>& still_to_come) {
    const Status learnt = learn_reference();
    if (learnt.ok() || !still_to_come.empty()) return;
    unreadable_ = learnt.error().what +
                  ": let the strobe light what the camera sees from top to bottom, or lengthen its exposure";
  }

  /// An error if the sweep doesn't show all rows dark and lit.
  Status learn_reference() {
    std::vector<RowProfile> profiles;
    for (const Swept& s : swept_) profiles.push_back(s.profile);
    EMBERLOCK_ASSIGN_OR_RETURN(const BandReference reference, learn_band_reference(profiles));
    const bool down = options_.timing.direction == ReadDirection::top_first;
    const Rows last(options_.timing.rows - 1);
    std::vector<SweptEdge> edges;
    double lit = 0;
    double looks = 0;
    for (const Swept& s : swept_) {
      if (!s.look.delay) continue;
      lit += lit_part(s.profile, reference);
      ++looks;
      const BandReading bands = read_bands(s.profile, reference, {.direction = options_.timing.direction});
      if (bands.reading.state != SmearState::dot) continue;
      const Rows y = bands.reading.dots.front().y;
      edges.push_back({s.at, *s.look.delay, down ? y : last - y});
    }
    // A row is lit at the delays that fall into its exposure.
    exposure_ = options_.timing.frame_period * (lit / looks);
    fit_row_time(edges);
    reference_ = reference;
    swept_.clear();
    return {};
  }

  static double lit_part(const RowProfile& profile, const BandReference& reference) {
    double part = 0;
    for (std::size_t r = 0; r < profile.level.size(); ++r)
      part += (profile.level[r] - reference.dark[r]) / (reference.lit[r] - reference.dark[r]);
    return part / static_cast<double>(profile.level.size());
  }

  /// Fits t_row, or sets the reason why edges can't be measured.
  void fit_row_time(const std::vector<SweptEdge>& edges) {
    const Seconds period = options_.timing.frame_period;
    unreadable_ = detail::too_short(*exposure_, options_.flash_width);
    if (!unreadable_.empty()) return;
    if (edges.size() < kFewestEdges) {
      const bool long_one = *exposure_ > period / 2;
      unreadable_ =
          fmt::format("its exposure of {:.2f} ms of a period of {:.2f} ms is too {} to see an edge: {} it",
                      in_milliseconds(*exposure_), in_milliseconds(period), long_one ? "long" : "short",
                      long_one ? "shorten" : "lengthen");
    } else if (const auto clock = fit_swept_row_clock(edges, period); clock.ok()) {
      clock_ = *clock;
      options_.timing.row_time = clock->row_time;
    } else {
      unreadable_ = clock.error().what + ": " + clock.error().remedy;
    }
  }

  SensorOptions options_;
  int step_ = 0;                          ///< of the sweep
  std::vector<Swept> swept_;              ///< until the reference is learnt
  std::vector<detail::TakenLook> taken_;  ///< in this round
  std::optional<BandReference> reference_;
  std::optional<RowClock> clock_;
  std::optional<Seconds> exposure_;
  std::string unreadable_;     ///< why no phase can be determined, and what to do about it
  bool nothing_read_ = false;  ///< in the previous round
};

}  // namespace

std::unique_ptr<PhaseSensor> make_rolling_sensor(const SensorOptions& options) {
  return std::make_unique<RollingSensor>(options);
}

}  // namespace emberlock::smear
