// SPDX-License-Identifier: Apache-2.0
// What the conductor shows of itself.
#include <algorithm>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "base/clock.h"
#include "daemon/engine/conductor.h"
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

void show_decision(const smear::CameraDecision& decision, SecondsPerRow row, v1::CameraStatus& camera) {
  camera.set_sight(std::string(name(decision.state)));
  camera.set_reason(decision.reason);
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
    shown.set_reason("is set by hand; the alignment says what to set");
    return;
  }
  const Hertz set = alignment->strobe().rate;
  const auto& advice = alignment->last().dial;
  if (!advice) {
    shown.set_reason(fmt::format("is set by hand: set it to {} flashes a minute ({:.3f} Hz)",
                                 dial.per_minute(set), set.value()));
    return;
  }
  if (advice->measured) shown.set_measured_hz(advice->measured->value());
  if (!advice->ready || advice->act) shown.set_light(v1::AMBER);
  shown.set_reason(advice->words);
}

/// What the operator does now, by what stands most in the way.
std::string next_step(const MachineState& state, const std::string& reset_next,
                      const std::optional<smear::DialAdvice>& dial, bool has_strobe) {
  const v1::Fault* worst = nullptr;
  for (const v1::Fault& fault : state.faults)
    if (!fault.over() && (worst == nullptr || fault.light() > worst->light())) worst = &fault;
  if (worst != nullptr && worst->light() == v1::RED)
    return worst->subject().empty() ? worst->remedy() : worst->subject() + ": " + worst->remedy();
  const bool films = state.phase == v1::CALIBRATING || state.phase == v1::ALIGNING;
  if (films && dial && (dial->act || !dial->ready)) return capitalized(dial->words);
  if (!reset_next.empty()) return fmt::format("Press the shutter of {}", reset_next);
  switch (state.phase) {
    case v1::IDLE:
      return has_strobe ? "Align the cameras" : "Record";
    case v1::LOCKED:
      return "Record";
    case v1::CAPTURING:
      return "Stop the recording when the flame is over";
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
  status.set_reason(state_.reason);
  for (const v1::Fault& fault : state_.faults) *status.add_faults() = fault;
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
    const auto compression = parts_.work.find(v1::BackgroundJob::COMPRESS, recording_->session());
    if (compression) status.mutable_recording()->set_transcoded(compression->fraction());
  }
  if (const auto reconstruction = parts_.reconstruction.status())
    *status.mutable_reconstruction() = *reconstruction;
  *status.mutable_storage() = storage_;
  for (const v1::BackgroundJob& job : parts_.work.progress())
    if (!job.session().empty()) *status.add_jobs() = job;
  status.set_next_step(next_step(state_, status.alignment().reset_next(),
                                 alignment_ ? alignment_->last().dial : std::nullopt, strobe != nullptr));
  status.set_rig(parts_.config.rig.name);
  status.set_version(EMBERLOCK_VERSION);
  status.set_now_ns(now.ns);
  status.set_now_utc(utc_now());
  status.set_uptime_s((now - began_).value());
  return status;
}

void Conductor::describe_cameras(v1::DaemonStatus& status) const {
  const auto states = camera_states();
  const TimePoint now = parts_.rig.clock().now();
  for (std::size_t i = 0; i < devices_.cameras.size(); ++i) {
    const drivers::CameraInfo& info = devices_.cameras[i]->info();
    const v1::CameraStream stream = drivers::to_proto(info);
    v1::CameraStatus& camera = *status.add_cameras();
    camera.set_id(info.id);
    camera.set_model(info.model);
    camera.set_driver(std::string(parts_.rig.driver(i)));
    camera.set_state(states[i]);
    camera.set_width(stream.width());
    camera.set_height(stream.height());
    camera.set_frame_rate_hz(info.frame_rate.value());
    camera.set_measured_rate_hz(watch_.rate(i));
    camera.set_reset(stream.shutter_reset());
    camera.set_sensor(stream.sensor());
    const drivers::FrameCounts counts = devices_.cameras[i]->counts();
    v1::CameraCounts& shown = *camera.mutable_counts();
    shown.set_delivered(counts.delivered);
    shown.set_damaged(counts.damaged);
    shown.set_camera_gap(counts.camera_gap);
    shown.set_transport(counts.transport);
    shown.set_resend(counts.resend);
    shown.set_underrun(counts.underrun);
    shown.set_queue(counts.queue);
    shown.set_passed_over(counts.passed_over);
    camera.set_light(v1::GREEN);
    camera.set_reason("films");
    if (alignment_ && alignment_->last().round > 0) {
      const smear::CameraDecision& decision = alignment_->last().cameras[i];
      show_decision(decision, alignment_->options().row_time, camera);
      show_sight(alignment_->sights()[i], camera);
      if (decision.time_left && alignment_->locked(now))
        camera.set_time_left_s(
            std::max(0.0, (decision.time_left->earliest - (now - alignment_->at())).value()));
      if (const auto drift = alignment_->drift(i)) camera.set_drift_ppm(drift->value());
      if (const auto& clock = alignment_->row_clocks()[i]) camera.set_row_time_s(clock->row_time.value());
      camera.set_resets(static_cast<std::uint32_t>(alignment_->state().cameras[i].resets));
      const Seconds tolerance = alignment_->options().tolerance.in_time(alignment_->options().row_time);
      if (!decision.error || abs(*decision.error) > tolerance) camera.set_light(v1::AMBER);
    }
    if (states[i] == v1::CameraStatus::LOST || states[i] == v1::CameraStatus::QUARANTINED) {
      camera.set_light(v1::RED);
      camera.set_reason(states[i] == v1::CameraStatus::LOST ? "went away, is being looked for"
                                                            : "doesn't answer");
    }
    if (states[i] == v1::CameraStatus::ENDED) {
      camera.set_light(v1::AMBER);
      camera.set_reason("the recording that it replays is over; restart emberlockd to begin it anew");
    }
  }
}

void Conductor::describe_alignment(v1::AlignmentStatus& status) const {
  const smear::AlignOptions& options = alignment_ ? alignment_->options() : align_options_.align;
  status.set_policy(std::string(name(options.policy)));
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
  status.set_reason(last.reason);
  if (last.round == 0) return;
  status.set_verdict(verdict());
  if (const auto worst = alignment_->worst_pair(now)) status.set_worst_pair_s(worst->value());
  if (last.verdict == smear::AlignVerdict::aligned) {
    status.set_next_check_s(alignment_->next_check(now).value());
    if (const double left = alignment_->time_left(now).value(); std::isfinite(left))
      status.set_time_left_s(left);
  }
  for (const smear::AlignOffer& offer : last.offers) {
    v1::AlignmentOffer& shown = *status.add_offers();
    shown.set_policy(std::string(name(offer.policy)));
    shown.set_tolerance_rows(offer.tolerance.in_rows(options.row_time).value());
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
