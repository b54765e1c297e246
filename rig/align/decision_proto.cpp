// SPDX-License-Identifier: Apache-2.0
#include "rig/align/decision_proto.h"

#include <cstddef>
#include <cstdint>
#include <variant>
#include <vector>

#include "rig/align/settings_proto.h"

namespace emberlock::rig {
namespace {

using v1::DecisionEvent;

// Every code has its number in the schema: a switch without a default doesn't compile once one is forgotten.

DecisionEvent::Verdict number_of(smear::AlignVerdict code) {
  switch (code) {
    case smear::AlignVerdict::go_on:
      return DecisionEvent::GO_ON;
    case smear::AlignVerdict::aligned:
      return DecisionEvent::ALIGNED;
    case smear::AlignVerdict::refused:
      return DecisionEvent::REFUSED;
    case smear::AlignVerdict::given_up:
      return DecisionEvent::GIVEN_UP;
  }
  return DecisionEvent::VERDICT_UNSPECIFIED;
}

DecisionEvent::Goal number_of(smear::AlignGoal code) {
  switch (code) {
    case smear::AlignGoal::tolerance:
      return DecisionEvent::TOLERANCE;
    case smear::AlignGoal::reach:
      return DecisionEvent::REACH;
  }
  return DecisionEvent::GOAL_UNSPECIFIED;
}

DecisionEvent::Reason::Cause number_of(smear::AlignCause code) {
  switch (code) {
    case smear::AlignCause::none:
      break;
    case smear::AlignCause::untrimmable:
      return DecisionEvent::Reason::UNTRIMMABLE;
    case smear::AlignCause::untellable:
      return DecisionEvent::Reason::UNTELLABLE;
    case smear::AlignCause::too_costly:
      return DecisionEvent::Reason::TOO_COSTLY;
    case smear::AlignCause::stuck:
      return DecisionEvent::Reason::STUCK;
    case smear::AlignCause::out:
      return DecisionEvent::Reason::OUT;
    case smear::AlignCause::leaving:
      return DecisionEvent::Reason::LEAVING;
    case smear::AlignCause::within:
      return DecisionEvent::Reason::WITHIN;
    case smear::AlignCause::locked:
      return DecisionEvent::Reason::LOCKED;
    case smear::AlignCause::trimming:
      return DecisionEvent::Reason::TRIMMING;
    case smear::AlignCause::waits_for_away:
      return DecisionEvent::Reason::WAITS_FOR_AWAY;
    case smear::AlignCause::looks_again:
      return DecisionEvent::Reason::LOOKS_AGAIN;
    case smear::AlignCause::unseen:
      return DecisionEvent::Reason::UNSEEN;
    case smear::AlignCause::unmoved:
      return DecisionEvent::Reason::UNMOVED;
    case smear::AlignCause::drift_unknown:
      return DecisionEvent::Reason::DRIFT_UNKNOWN;
    case smear::AlignCause::dial:
      return DecisionEvent::Reason::DIAL;
  }
  return DecisionEvent::Reason::CAUSE_UNSPECIFIED;
}

DecisionEvent::CameraReason::Cause number_of(smear::CameraCause code) {
  switch (code) {
    case smear::CameraCause::none:
      break;
    case smear::CameraCause::stands:
      return DecisionEvent::CameraReason::STANDS;
    case smear::CameraCause::reference:
      return DecisionEvent::CameraReason::REFERENCE;
    case smear::CameraCause::within:
      return DecisionEvent::CameraReason::WITHIN;
    case smear::CameraCause::fixed:
      return DecisionEvent::CameraReason::FIXED;
    case smear::CameraCause::waits:
      return DecisionEvent::CameraReason::WAITS;
    case smear::CameraCause::by_hand:
      return DecisionEvent::CameraReason::BY_HAND;
    case smear::CameraCause::reset:
      return DecisionEvent::CameraReason::RESET;
    case smear::CameraCause::untaught:
      return DecisionEvent::CameraReason::UNTAUGHT;
    case smear::CameraCause::in_turn:
      return DecisionEvent::CameraReason::IN_TURN;
    case smear::CameraCause::leaving:
      return DecisionEvent::CameraReason::LEAVING;
    case smear::CameraCause::leaving_by_hand:
      return DecisionEvent::CameraReason::LEAVING_BY_HAND;
    case smear::CameraCause::late:
      return DecisionEvent::CameraReason::LATE;
    case smear::CameraCause::slewing:
      return DecisionEvent::CameraReason::SLEWING;
    case smear::CameraCause::settling:
      return DecisionEvent::CameraReason::SETTLING;
    case smear::CameraCause::locked:
      return DecisionEvent::CameraReason::LOCKED;
    case smear::CameraCause::waits_for_others:
      return DecisionEvent::CameraReason::WAITS_FOR_OTHERS;
    case smear::CameraCause::away:
      return DecisionEvent::CameraReason::AWAY;
    case smear::CameraCause::doubted:
      return DecisionEvent::CameraReason::DOUBTED;
    case smear::CameraCause::blind:
      return DecisionEvent::CameraReason::BLIND;
    case smear::CameraCause::unreadable:
      return DecisionEvent::CameraReason::UNREADABLE;
    case smear::CameraCause::unheard:
      return DecisionEvent::CameraReason::UNHEARD;
    case smear::CameraCause::waits_for_dial:
      return DecisionEvent::CameraReason::WAITS_FOR_DIAL;
  }
  return DecisionEvent::CameraReason::CAUSE_UNSPECIFIED;
}

DecisionEvent::CameraReason::Timing number_of(smear::ResetTiming code) {
  switch (code) {
    case smear::ResetTiming::none:
      break;
    case smear::ResetTiming::on_target:
      return DecisionEvent::CameraReason::ON_TARGET;
    case smear::ResetTiming::far_side:
      return DecisionEvent::CameraReason::FAR_SIDE;
    case smear::ResetTiming::teaches:
      return DecisionEvent::CameraReason::TEACHES;
  }
  return DecisionEvent::CameraReason::TIMING_UNSPECIFIED;
}

DecisionEvent::Doubt::Cause number_of(smear::DoubtCause code) {
  switch (code) {
    case smear::DoubtCause::strobe_stood:
      return DecisionEvent::Doubt::STROBE_STOOD;
    case smear::DoubtCause::stood:
      return DecisionEvent::Doubt::STOOD;
    case smear::DoubtCause::against:
      return DecisionEvent::Doubt::AGAINST;
    case smear::DoubtCause::otherwise:
      return DecisionEvent::Doubt::OTHERWISE;
    case smear::DoubtCause::walked_apart:
      return DecisionEvent::Doubt::WALKED_APART;
    case smear::DoubtCause::walked_against:
      return DecisionEvent::Doubt::WALKED_AGAINST;
    case smear::DoubtCause::stood_in_walk:
      return DecisionEvent::Doubt::STOOD_IN_WALK;
  }
  return DecisionEvent::Doubt::CAUSE_UNSPECIFIED;
}

DecisionEvent::Camera::State number_of(smear::PhaseState code) {
  switch (code) {
    case smear::PhaseState::known:
      return DecisionEvent::Camera::KNOWN;
    case smear::PhaseState::blind:
      return DecisionEvent::Camera::BLIND;
    case smear::PhaseState::unusable:
      return DecisionEvent::Camera::UNUSABLE;
  }
  return DecisionEvent::Camera::STATE_UNSPECIFIED;
}

DecisionEvent::Camera::Servo number_of(smear::ServoState code) {
  switch (code) {
    case smear::ServoState::slewing:
      return DecisionEvent::Camera::SLEWING;
    case smear::ServoState::settling:
      return DecisionEvent::Camera::SETTLING;
    case smear::ServoState::locked:
      return DecisionEvent::Camera::LOCKED;
  }
  return DecisionEvent::Camera::SERVO_UNSPECIFIED;
}

DecisionEvent::Dial::Cause number_of(smear::DialCause code) {
  switch (code) {
    case smear::DialCause::leave:
      return DecisionEvent::Dial::LEAVE;
    case smear::DialCause::out_of_sight:
      return DecisionEvent::Dial::OUT_OF_SIGHT;
    case smear::DialCause::set:
      return DecisionEvent::Dial::SET;
    case smear::DialCause::turn_off_rate:
      return DecisionEvent::Dial::TURN_OFF_RATE;
  }
  return DecisionEvent::Dial::CAUSE_UNSPECIFIED;
}

DecisionEvent::Dial::Seen number_of(smear::FlashesSeen code) {
  switch (code) {
    case smear::FlashesSeen::rate:
      return DecisionEvent::Dial::RATE;
    case smear::FlashesSeen::hidden:
      return DecisionEvent::Dial::HIDDEN;
    case smear::FlashesSeen::too_slow:
      return DecisionEvent::Dial::TOO_SLOW;
    case smear::FlashesSeen::too_fast:
      return DecisionEvent::Dial::TOO_FAST;
    case smear::FlashesSeen::unsteady:
      return DecisionEvent::Dial::UNSTEADY;
    case smear::FlashesSeen::none:
      return DecisionEvent::Dial::NONE;
  }
  return DecisionEvent::Dial::SEEN_UNSPECIFIED;
}

void set_effort(const smear::AlignEffort& effort, DecisionEvent::Effort& to) {
  to.set_resets(effort.resets);
  to.set_resets_p95(static_cast<std::uint32_t>(effort.resets_p95));
  to.set_time_s(effort.time.value());
  to.set_time_p95_s(effort.time_p95.value());
  to.set_probability(effort.within);
}

void set_offer(const smear::AlignOffer& offer, DecisionEvent::Offer& to) {
  to.set_policy(to_proto(offer.policy));
  if (const auto* rows = std::get_if<Rows>(&offer.tolerance.amount)) {
    to.set_tolerance_rows(rows->value());
  } else {
    to.set_tolerance_s(std::get<Seconds>(offer.tolerance.amount).value());
  }
  set_effort(offer.effort, *to.mutable_effort());
}

template <class Places>
void set_places(const std::vector<std::size_t>& from, Places* to) {
  for (const std::size_t i : from) to->Add(static_cast<std::uint32_t>(i));
}

void set_reason(const smear::AlignReason& reason, DecisionEvent::Reason& to) {
  to.set_cause(number_of(reason.cause));
  set_places(reason.cameras, to.mutable_cameras());
  set_places(reason.unmoved, to.mutable_unmoved());
  set_places(reason.rough, to.mutable_rough());
  to.set_sigma_s(reason.sigma.value());
  to.set_looks(static_cast<std::uint32_t>(reason.looks));
  to.set_rounds(static_cast<std::uint32_t>(reason.rounds));
  if (reason.first_out) to.set_first_out(static_cast<std::uint32_t>(*reason.first_out));
}

void set_reason(const smear::CameraReason& reason, DecisionEvent::CameraReason& to) {
  to.set_cause(number_of(reason.cause));
  to.set_timing(number_of(reason.timing));
  to.set_stay_s(reason.stay.value());
  to.set_trim_ppm(reason.trim.value());
  if (reason.after) to.set_after(static_cast<std::uint32_t>(*reason.after));
  if (!reason.doubt) return;
  DecisionEvent::Doubt& doubt = *to.mutable_doubt();
  doubt.set_cause(number_of(reason.doubt->cause));
  doubt.set_strobe_s(reason.doubt->strobe.value());
  doubt.set_seen_s(reason.doubt->seen.value());
}

void set_camera(const smear::Phase& phase, const smear::CameraDecision& camera, DecisionEvent::Camera& to) {
  if (phase.state == smear::PhaseState::known) {
    to.set_tau_s(phase.tau.value());
    to.set_tau_sigma_s(phase.sigma.value());
  }
  to.set_state(number_of(camera.state));
  if (camera.error) to.set_error_s(camera.error->value());
  to.set_sigma_s(camera.sigma.value());
  to.set_reset(camera.reset);
  if (camera.moment) to.set_moment_ns(camera.moment->ns);
  if (camera.trim) to.set_trim_ppm(camera.trim->value());
  if (camera.servo) to.set_servo(number_of(*camera.servo));
  if (camera.time_left) {
    to.mutable_time_left()->set_expected_s(camera.time_left->expected.value());
    to.mutable_time_left()->set_earliest_s(camera.time_left->earliest.value());
    to.mutable_time_left()->set_latest_s(camera.time_left->latest.value());
  }
  set_reason(camera.reason, *to.mutable_reason());
}

void set_dial(const smear::DialAdvice& advice, DecisionEvent::Dial& to) {
  to.set_set_hz(advice.set.value());
  if (advice.measured) to.set_measured_hz(advice.measured->value());
  to.set_sigma_ppm(advice.sigma.value());
  for (const Hertz other : advice.others) to.add_others_hz(other.value());
  to.set_ready(advice.ready);
  to.set_act(advice.act);
  to.set_cause(number_of(advice.cause));
  to.set_seen(number_of(advice.seen));
  if (advice.slower_than) to.set_slower_than_hz(advice.slower_than->value());
  if (advice.from) to.set_from_hz(advice.from->value());
  set_places(advice.hidden, to.mutable_hidden());
}

}  // namespace

DecisionEvent to_proto(const AlignRoundReport& report) {
  const smear::AlignDecision& decision = report.decision;
  DecisionEvent event;
  event.set_round(static_cast<std::uint32_t>(decision.round));
  event.set_period_offset_ppm(report.round.period_offset.rate.value());
  event.set_period_offset_sigma_ppm(report.round.period_offset.sigma.value());
  event.set_strobe_phase_s(report.strobe.phase.value());
  event.set_verdict(number_of(decision.verdict));
  event.set_goal(number_of(decision.goal));
  set_reason(decision.reason, *event.mutable_reason());
  if (decision.target) event.set_target_s(decision.target->value());
  if (decision.reference) event.set_reference(static_cast<std::uint32_t>(*decision.reference));
  for (std::size_t i = 0; i < decision.cameras.size(); ++i)
    set_camera(report.round.cameras[i].phase, decision.cameras[i], *event.add_cameras());
  if (decision.worst_pair) event.set_worst_pair_s(decision.worst_pair->value());
  if (decision.strobe_phase) event.set_next_strobe_phase_s(decision.strobe_phase->value());
  event.set_resets_so_far(static_cast<std::uint32_t>(decision.resets_so_far));
  event.set_renews(decision.renews);
  event.set_in_time(decision.in_time);
  if (decision.reset_next) event.set_reset_next(static_cast<std::uint32_t>(*decision.reset_next));
  set_places(decision.jumped, event.mutable_jumped());
  if (decision.next_check) event.set_next_check_s(decision.next_check->value());
  if (decision.effort) set_effort(*decision.effort, *event.mutable_effort());
  for (const smear::AlignOffer& offer : decision.offers) set_offer(offer, *event.add_offers());
  if (decision.dial) set_dial(*decision.dial, *event.mutable_dial());
  return event;
}

DecisionEvent lock_evidence(const Alignment& lock, TimePoint now) {
  DecisionEvent event;
  event.set_round(static_cast<std::uint32_t>(lock.last().round));
  event.set_verdict(number_of(lock.last().verdict));
  for (const CameraError& camera : lock.errors(now)) {
    DecisionEvent::Camera& told = *event.add_cameras();
    told.set_error_s(camera.error.value());
    told.set_sigma_s(camera.sigma.value());
  }
  if (const auto worst = lock.worst_pair(now)) event.set_worst_pair_s(worst->value());
  return event;
}

}  // namespace emberlock::rig
