// SPDX-License-Identifier: Apache-2.0
#include "rig/align/settings_proto.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <string>
#include <variant>

#include <fmt/format.h>

#include "base/one_to_one.h"

namespace emberlock::rig {
namespace {

using v1::AlignmentSettings;

constexpr OneToOne<smear::AlignPolicy, AlignmentSettings::Policy, 4> kPolicies{
    {{{smear::AlignPolicy::fixed_reference, AlignmentSettings::FIXED_REFERENCE},
      {smear::AlignPolicy::densest, AlignmentSettings::DENSEST},
      {smear::AlignPolicy::timed, AlignmentSettings::TIMED},
      {smear::AlignPolicy::trimmed, AlignmentSettings::TRIMMED}}}};
constexpr OneToOne<smear::ResetBy, AlignmentSettings::ResetBy, 2> kResetBy{
    {{{smear::ResetBy::orders, AlignmentSettings::ORDERS},
      {smear::ResetBy::anybody, AlignmentSettings::ANYBODY}}}};
constexpr OneToOne<smear::ReadDirection, AlignmentSettings::ReadDirection, 2> kDirections{
    {{{smear::ReadDirection::top_first, AlignmentSettings::TOP_FIRST},
      {smear::ReadDirection::bottom_first, AlignmentSettings::BOTTOM_FIRST}}}};

/// Takes values over and remembers the first that can't be.
class Intake {
 public:
  template <class Unit>
  void take(const char* field, double value, Quantity<Unit>& to, double least) {
    if (!(std::isfinite(value) && value >= least)) refuse(field);
    to = Quantity<Unit>(value);
  }
  void take(const char* field, std::uint32_t value, int& to, int least) {
    if (value > static_cast<std::uint32_t>(std::numeric_limits<int>::max()) ||
        static_cast<int>(value) < least)
      return refuse(field);
    to = static_cast<int>(value);
  }
  template <class To>
  void take(const char* field, std::optional<To> value, To& to) {
    if (!value) return refuse(field);
    to = *value;
  }
  void refuse(const char* field) {
    if (!refused_) refused_ = field;
  }
  [[nodiscard]] Status status() const {
    if (!refused_) return {};
    return Error{ErrorKind::bad_input,
                 fmt::format("its alignment settings can't be read: {} is missing or out of range", refused_),
                 "recording", "replay a recording that `emberlock align --record` made"};
  }

 private:
  const char* refused_ = nullptr;
};

constexpr double kAny = -std::numeric_limits<double>::infinity();
constexpr double kPositive = std::numeric_limits<double>::min();

void take_tolerance(const AlignmentSettings& from, smear::Tolerance& to, Intake& intake) {
  Rows rows;
  Seconds time;
  switch (from.tolerance_case()) {
    case AlignmentSettings::kToleranceRows:
      intake.take("tolerance_rows", from.tolerance_rows(), rows, kPositive);
      to.amount = rows;
      return;
    case AlignmentSettings::kToleranceS:
      intake.take("tolerance_s", from.tolerance_s(), time, kPositive);
      to.amount = time;
      return;
    case AlignmentSettings::TOLERANCE_NOT_SET:
      intake.refuse("tolerance");
  }
}

void take_policy(const AlignmentSettings& from, smear::AlignOptions& to, Intake& intake) {
  intake.take("policy", kPolicies.first_of(from.policy()), to.policy);
  take_tolerance(from, to.tolerance, intake);
  to.reference = from.reference();
  intake.take("row_time_s", from.row_time_s(), to.row_time, kPositive);
  intake.take("delay_jitter_s", from.delay_jitter_s(), to.delay_jitter, kPositive);
  intake.take("rate_spread_ppm", from.rate_spread_ppm(), to.rate_spread, 0);
  intake.take("rate_wander_ppm", from.rate_wander_ppm(), to.rate_wander, 0);
  intake.take("trim_time_s", from.trim_time_s(), to.trim_time, kPositive);
  intake.take("reset_time_s", from.reset_time_s(), to.reset_time, 0);
  intake.take("max_rounds", from.max_rounds(), to.max_rounds, 1);
  intake.take("max_looks", from.max_looks(), to.max_looks, 1);
  intake.take("strobe_step_s", from.strobe_step_s(), to.strobe_step, 0);
  intake.take("shortest_take_s", from.shortest_take_s(), to.shortest_take, 0);
  intake.take("reset_by", kResetBy.first_of(from.reset_by()), to.reset_by);
  if (from.has_limits()) {
    smear::AlignLimits& limits = to.limits.emplace();
    intake.take("limits.resets", from.limits().resets(), limits.resets, 0);
    intake.take("limits.time_s", from.limits().time_s(), limits.time, 0);
    limits.probability = from.limits().probability();
    if (!(limits.probability >= 0 && limits.probability <= 1)) intake.refuse("limits.probability");
  }
  if (from.has_dial()) {
    to.dial = StrobeDial{Hertz(from.dial().slowest_hz()), Hertz(from.dial().fastest_hz()),
                         Hertz(from.dial().step_hz())};
    if (!check(*to.dial).ok()) intake.refuse("dial");
  }
}

void take_camera(const AlignmentSettings::Camera& from, AlignRunOptions& to, Intake& intake) {
  smear::CcdTiming& timing = to.timing.emplace_back();
  intake.take("cameras.rows", from.rows(), timing.rows, 0);
  intake.take("cameras.shifts", from.shifts(), timing.shifts, 0);
  intake.take("cameras.frame_period_s", from.frame_period_s(), timing.frame_period, 0);
  intake.take("cameras.row_time_s", from.row_time_s(), timing.row_time, 0);
  intake.take("cameras.direction", kDirections.first_of(from.direction()), timing.direction);
  intake.take("cameras.offset_s", from.offset_s(), to.offsets.emplace_back(), 0);
  to.delays.emplace_back();
  if (!from.has_delay()) return;
  smear::ResetDelay& delay = to.delays.back().emplace();
  intake.take("cameras.delay.mean_s", from.delay().mean_s(), delay.mean, kAny);
  intake.take("cameras.delay.sigma_s", from.delay().sigma_s(), delay.sigma, 0);
}

}  // namespace

AlignmentSettings::Policy to_proto(smear::AlignPolicy policy) {
  return kPolicies.second_of(policy).value_or(AlignmentSettings::POLICY_UNSPECIFIED);
}

AlignmentSettings to_proto(const AlignRunOptions& options) {
  const smear::AlignOptions& align = options.align;
  AlignmentSettings to;
  to.set_policy(to_proto(align.policy));
  if (const auto* rows = std::get_if<Rows>(&align.tolerance.amount)) {
    to.set_tolerance_rows(rows->value());
  } else {
    to.set_tolerance_s(std::get<Seconds>(align.tolerance.amount).value());
  }
  to.set_reference(static_cast<std::uint32_t>(align.reference));
  to.set_row_time_s(align.row_time.value());
  to.set_delay_jitter_s(align.delay_jitter.value());
  to.set_rate_spread_ppm(align.rate_spread.value());
  to.set_rate_wander_ppm(align.rate_wander.value());
  to.set_trim_time_s(align.trim_time.value());
  to.set_reset_time_s(align.reset_time.value());
  if (align.limits) {
    to.mutable_limits()->set_resets(static_cast<std::uint32_t>(align.limits->resets));
    to.mutable_limits()->set_time_s(align.limits->time.value());
    to.mutable_limits()->set_probability(align.limits->probability);
  }
  to.set_max_rounds(static_cast<std::uint32_t>(align.max_rounds));
  to.set_max_looks(static_cast<std::uint32_t>(align.max_looks));
  to.set_strobe_step_s(align.strobe_step.value());
  to.set_shortest_take_s(align.shortest_take.value());
  to.set_reset_by(kResetBy.second_of(align.reset_by).value_or(AlignmentSettings::RESET_BY_UNSPECIFIED));
  if (align.dial) {
    to.mutable_dial()->set_slowest_hz(align.dial->slowest.value());
    to.mutable_dial()->set_fastest_hz(align.dial->fastest.value());
    to.mutable_dial()->set_step_hz(align.dial->step.value());
  }
  to.set_measure_row_time(options.measure_row_time);
  if (options.comb_rate) to.set_comb_rate_hz(options.comb_rate->value());
  to.set_comb_frames(static_cast<std::uint32_t>(options.comb_frames));
  to.set_frames_per_round(static_cast<std::uint32_t>(options.frames_per_round));
  to.set_flash_width_s(options.flash_width.value());
  to.set_frame_deadline_s(options.frame_deadline.value());
  to.set_reset_lead_s(options.reset_lead.value());
  to.set_rate_error_ppm(options.rate_error.value());
  to.set_seed(options.seed);
  if (options.hold) to.set_hold_s(options.hold->value());
  for (std::size_t i = 0; i < options.timing.size(); ++i) {
    const smear::CcdTiming& timing = options.timing[i];
    AlignmentSettings::Camera& camera = *to.add_cameras();
    camera.set_rows(static_cast<std::uint32_t>(timing.rows));
    camera.set_shifts(static_cast<std::uint32_t>(timing.shifts));
    camera.set_frame_period_s(timing.frame_period.value());
    camera.set_row_time_s(timing.row_time.value());
    camera.set_direction(
        kDirections.second_of(timing.direction).value_or(AlignmentSettings::READ_DIRECTION_UNSPECIFIED));
    if (i < options.offsets.size()) camera.set_offset_s(options.offsets[i].value());
    if (i >= options.delays.size() || !options.delays[i]) continue;
    camera.mutable_delay()->set_mean_s(options.delays[i]->mean.value());
    camera.mutable_delay()->set_sigma_s(options.delays[i]->sigma.value());
  }
  return to;
}

Result<AlignRunOptions> align_options(const AlignmentSettings& settings) {
  AlignRunOptions options;
  Intake intake;
  take_policy(settings, options.align, intake);
  options.measure_row_time = settings.measure_row_time();
  if (settings.has_comb_rate_hz())
    intake.take("comb_rate_hz", settings.comb_rate_hz(), options.comb_rate.emplace(), kPositive);
  intake.take("comb_frames", settings.comb_frames(), options.comb_frames, 0);
  intake.take("frames_per_round", settings.frames_per_round(), options.frames_per_round, 1);
  intake.take("flash_width_s", settings.flash_width_s(), options.flash_width, 0);
  intake.take("frame_deadline_s", settings.frame_deadline_s(), options.frame_deadline, 0);
  intake.take("reset_lead_s", settings.reset_lead_s(), options.reset_lead, 0);
  intake.take("rate_error_ppm", settings.rate_error_ppm(), options.rate_error, 0);
  options.seed = settings.seed();
  if (settings.has_hold_s()) intake.take("hold_s", settings.hold_s(), options.hold.emplace(), 0);
  for (const AlignmentSettings::Camera& camera : settings.cameras()) take_camera(camera, options, intake);
  // Recordings of one common instant have none.
  if (std::all_of(options.offsets.begin(), options.offsets.end(),
                  [](Seconds offset) { return offset == Seconds(0); }))
    options.offsets.clear();
  EMBERLOCK_RETURN_IF_ERROR(intake.status());
  return options;
}

}  // namespace emberlock::rig
