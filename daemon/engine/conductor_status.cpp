// SPDX-License-Identifier: Apache-2.0
// What the conductor shows of itself.
#include <algorithm>
#include <cmath>
#include <string>

#include "base/clock.h"
#include "base/version.h"
#include "daemon/engine/conductor.h"
#include "daemon/engine/words.h"
#include "daemon/hosts/lent_frame.h"
#include "drivers/replay/record.h"
#include "smear_sync/align/align_words.h"

namespace emberlock::daemon {
namespace {

void set_cost(v1::AlignmentCost& cost, const smear::AlignEffort& effort) {
  cost.set_resets(effort.resets);
  cost.set_resets_p95(static_cast<std::uint32_t>(effort.resets_p95));
  cost.set_time_s(effort.time.value());
  cost.set_time_p95_s(effort.time_p95.value());
}

v1::Point point(double x, Rows y) {
  v1::Point point;
  point.set_x(x);
  point.set_y(y.value());
  return point;
}

void show_sight(const rig::CameraSight& sight, v1::CameraStatus& camera) {
  if (sight.lamp) {
    *camera.mutable_lamp() = point(sight.lamp->x, sight.lamp->y);
    camera.set_lamp_radius(sight.lamp->radius);
  }
  for (const smear::DotReading& dot : sight.dots) *camera.add_dots() = point(dot.x, dot.y);
  if (sight.target_row) camera.set_target_row(sight.target_row->value());
  if (sight.tolerance) camera.set_tolerance_rows(sight.tolerance->value());
  for (const rig::RowSpan& span : sight.band) {
    v1::RowSpan& shown = *camera.add_band();
    shown.set_first(span.first.value());
    shown.set_last(span.last.value());
  }
}

void show_decision(const smear::CameraDecision& decision, const std::string& words, SecondsPerRow row,
                   v1::CameraStatus& camera) {
  camera.set_sight(std::string(name(decision.state)));
  camera.set_reason(words);
  if (decision.error) {
    camera.set_error_s(decision.error->value());
    camera.set_error_rows((*decision.error / row).value());
    camera.set_sigma_rows((decision.sigma / row).value());
  }
  camera.set_reset_next(decision.reset);
  if (decision.trim) camera.set_trim_ppm(decision.trim->value());
}

std::string capitalized(std::string sentence) {
  if (!sentence.empty() && sentence[0] >= 'a' && sentence[0] <= 'z') sentence[0] -= 'a' - 'A';
  return sentence;
}

/// Of a strobe that somebody sets by hand: what it is to be set to, what it does.
void show_dial(const StrobeDial& dial, const rig::Alignment* alignment, v1::StrobeStatus& shown) {
  shown.set_by_hand(true);
  if (alignment == nullptr) {
    shown.set_reason(words(dial, std::nullopt));
    return;
  }
  const auto& advice = alignment->last().dial;
  if (!advice) {
    shown.set_reason(words(dial, alignment->strobe().rate));
    return;
  }
  if (advice->measured) shown.set_measured_hz(advice->measured->value());
  if (!advice->ready || advice->act) shown.set_light(v1::AMBER);
  shown.set_reason(alignment->words().dial);
}

/// What the operator does now, by what stands most in the way.
std::string next_step(const MachineState& state, const std::string& reset_next,
                      const rig::Alignment* alignment, const LockLeft& left, bool has_strobe) {
  const Fault* worst = nullptr;
  for (const Fault& fault : state.faults)
    if (!fault.over && (worst == nullptr || fault.light > worst->light)) worst = &fault;
  if (worst != nullptr && worst->light == v1::RED) return remedy(*worst);
  const bool films = state.phase == v1::CALIBRATING || state.phase == v1::ALIGNING;
  if (films && alignment != nullptr) {
    const auto& dial = alignment->last().dial;
    if (dial && (dial->act || !dial->ready)) return capitalized(alignment->words().dial);
  }
  if (!reset_next.empty()) return words(NextStep::press_shutter, reset_next);
  switch (state.phase) {
    case v1::IDLE:
      return words(has_strobe ? NextStep::align : NextStep::record);
    case v1::LOCKED:
      return words(NextStep::record, left);
    case v1::CAPTURING:
      return words(NextStep::stop_recording, state.lock == Lock::held ? left : LockLeft{});
    default:
      return {};
  }
}

}  // namespace

v1::DaemonStatus Conductor::status() const {
  const TimePoint now = parts_.rig.clock().now();
  v1::DaemonStatus status;
  status.set_phase(state_.phase);
  status.set_light(light(state_));
  status.set_reason(words(state_.reason));
  for (const Fault& fault : state_.faults) *status.add_faults() = to_proto(fault);
  describe_cameras(status);
  const drivers::Strobe* strobe = devices_.strobe;
  if (strobe != nullptr) {
    v1::StrobeStatus& shown = *status.mutable_strobe();
    shown.set_id(strobe->id());
    shown.set_light(strobe_status_.ok() ? v1::GREEN : v1::RED);
    if (!strobe_status_.ok()) shown.set_reason(strobe_status_.error().message());
    *shown.mutable_settings() =
        drivers::strobe_event(now, alignment_ ? alignment_->strobe() : strobe_settings_).strobe();
    if (const auto dial = strobe->dial()) show_dial(*dial, alignment_.get(), shown);
  }
  if (alignment_ || !history_.empty()) describe_alignment(*status.mutable_alignment());
  if (recorder_) {
    *status.mutable_recording() = recorder_->status(now);
    if (spread_) status.mutable_recording()->set_spread_s(spread_->value());
    if (state_.phase == v1::FINISHING) status.mutable_recording()->set_state(v1::RecordingStatus::FINISHING);
  } else if (recording_) {
    *status.mutable_recording() = *recording_;
    const auto compression = parts_.jobs.find(v1::Job::COMPRESS, recording_->session());
    if (compression) status.mutable_recording()->set_transcoded(compression->fraction());
  }
  if (const auto reconstruction = parts_.reconstruction.status())
    *status.mutable_reconstruction() = *reconstruction;
  if (const auto live = parts_.live.status()) *status.mutable_live() = *live;
  describe_hosts(status);
  *status.mutable_storage() = storage_;
  for (const v1::Job& job : parts_.jobs.list())
    if (!job.session().empty()) *status.add_jobs() = job;
  status.set_next_step(
      next_step(state_, status.alignment().reset_next(), alignment_.get(), lock_left(), strobe != nullptr));
  if (status.light() == v1::GREEN && recorder_ && lost(status.recording().lost()) > 0)
    status.set_light(v1::AMBER);
  status.set_rig(parts_.config.rig.name);
  status.set_version(version());
  status.set_now_ns(now.ns);
  status.set_now_utc(utc_now());
  status.set_uptime_s((now - began_).value());
  return status;
}

void Conductor::describe_cameras(v1::DaemonStatus& status) const {
  const auto states = camera_states();
  const auto refusals = camera_refusals();
  const TimePoint now = parts_.rig.clock().now();
  for (std::size_t i = 0; i < devices_.cameras.size(); ++i) {
    const drivers::CameraInfo& info = devices_.cameras[i]->info();
    const v1::CameraStream stream = drivers::to_proto(info);
    v1::CameraStatus& camera = *status.add_cameras();
    camera.set_id(info.id);
    camera.set_model(info.model);
    camera.set_driver(std::string(parts_.rig.driver(i)));
    camera.set_host(parts_.rig.host(i));
    camera.set_state(states[i]);
    camera.set_width(stream.width());
    camera.set_height(stream.height());
    camera.set_frame_rate_hz(info.frame_rate.value());
    camera.set_measured_rate_hz(watch_.rate(i));
    camera.set_reset(stream.shutter_reset());
    camera.set_sensor(stream.sensor());
    *camera.mutable_counts() = to_proto(devices_.cameras[i]->counts());
    camera.set_light(v1::GREEN);
    camera.set_reason(words(v1::CameraStatus::FILMING));
    camera.set_lost_lately(overload_.lost_lately(i));
    if (alignment_ && alignment_->last().round > 0) {
      const smear::CameraDecision& decision = alignment_->last().cameras[i];
      show_decision(decision, alignment_->words().cameras[i], alignment_->options().row_time, camera);
      show_sight(alignment_->sights()[i], camera);
      const auto left = alignment_->time_left(now, i);
      if (left && std::isfinite(left->value())) camera.set_time_left_s(left->value());
      if (const auto drift = alignment_->drift(i)) camera.set_drift_ppm(drift->value());
      if (const auto& clock = alignment_->row_clocks()[i]) camera.set_row_time_s(clock->row_time.value());
      camera.set_resets(static_cast<std::uint32_t>(alignment_->state().cameras[i].resets));
      const Seconds tolerance = alignment_->options().tolerance.in_time(alignment_->options().row_time);
      if (!decision.error || abs(*decision.error) > tolerance) camera.set_light(v1::AMBER);
    }
    if (states[i] == v1::CameraStatus::FILMING) describe_frames(camera);
    if (states[i] == v1::CameraStatus::LOST || states[i] == v1::CameraStatus::QUARANTINED) {
      camera.set_light(v1::RED);
      camera.set_reason(refusals[i] ? refusals[i]->message() : words(states[i]));
    }
    if (states[i] == v1::CameraStatus::ENDED) {
      camera.set_light(v1::AMBER);
      camera.set_reason(words(states[i]));
    }
  }
}

/// One that loses frames, or sends others than it was asked for, isn't well, wherever the cause lies.
void Conductor::describe_frames(v1::CameraStatus& camera) const {
  constexpr double kRateOff = 0.05;
  const double comes = camera.measured_rate_hz();
  const double asked = camera.frame_rate_hz();
  const bool steady = parts_.rig.clock().now() - aligned_at_ > 3 * DeviceWatch::kRateSpan;
  if (camera.lost_lately() > 0) {
    camera.set_light(v1::AMBER);
    if (!camera.reset_next())
      camera.set_reason(words(FramesMissed{camera.lost_lately(), OverloadWatch::kSpan}));
  } else if (real_time() && steady && comes > 0 && asked > 0 && std::abs(comes / asked - 1) > kRateOff) {
    camera.set_light(v1::AMBER);
    camera.set_reason(words(RateOff{Hertz(comes), Hertz(asked)}));
  }
}

void Conductor::describe_alignment(v1::AlignmentStatus& status) const {
  const smear::AlignOptions& options = alignment_ ? alignment_->options() : align_options_.align;
  if (!tolerance_told_) {
    status.set_flame_speed_m_s(flame_.speed.value());
    status.set_detail_m(flame_.detail.value());
  }
  status.set_shortest_take_s(options.shortest_take.value());
  status.set_policy(std::string(name(options.policy)));
  status.set_staggered(!align_options_.offsets.empty());
  status.set_tolerance_rows(options.tolerance.in_rows(options.row_time).value());
  status.set_tolerance_s(options.tolerance.in_time(options.row_time).value());
  status.set_row_time_s(options.row_time.value());
  status.set_period_s(options.period.value());
  for (const v1::RoundPoint& point : history_) *status.add_history() = point;
  if (foretold_) set_cost(*status.mutable_cost(), *foretold_);
  if (!alignment_) return;
  const TimePoint now = parts_.rig.clock().now();
  const smear::AlignDecision& last = alignment_->last();
  status.set_round(static_cast<std::uint32_t>(last.round));
  status.set_resets(static_cast<std::uint32_t>(alignment_->resets()));
  status.set_checks(static_cast<std::uint32_t>(alignment_->checks()));
  status.set_reason(alignment_->words().reason);
  if (last.round == 0) return;
  status.set_verdict(verdict());
  if (const auto worst = alignment_->worst_pair(now)) status.set_worst_pair_s(worst->value());
  if (last.verdict == smear::AlignVerdict::aligned) {
    status.set_next_check_s(alignment_->next_check(now).value());
    const LockLeft left = lock_left();
    if (left.sure) status.set_time_left_s(left.sure->value());
    if (left.likely) status.set_likely_left_s(left.likely->value());
    if (last.renewed) status.set_renewed_left_s(last.renewed->value());
    status.set_leaves_first(left.leaves_first);
  }
  for (const smear::AlignOffer& offer : last.offers) {
    v1::AlignmentOffer& shown = *status.add_offers();
    shown.set_policy(std::string(name(offer.policy)));
    shown.set_tolerance_rows(offer.tolerance.in_rows(options.row_time).value());
    shown.set_tolerance_s(offer.tolerance.in_time(options.row_time).value());
    set_cost(*shown.mutable_cost(), offer.effort);
  }
  for (std::size_t i = 0; i < last.cameras.size(); ++i) {
    if (last.cameras[i].reset && alignment_->cameras()[i].method == ShutterReset::by_hand) {
      status.set_reset_next(alignment_->cameras()[i].id);
      break;
    }
  }
}

}  // namespace emberlock::daemon
