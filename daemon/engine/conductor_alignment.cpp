// SPDX-License-Identifier: Apache-2.0
// Aligning the cameras, and holding what was reached.
#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "daemon/engine/conductor.h"
#include "drivers/replay/record.h"
#include "rig/align/record.h"

namespace emberlock::daemon {
namespace {

constexpr std::size_t kHistory = 500;
constexpr Seconds kRemoteLead = milliseconds(150);

v1::RoundPoint point_of(const rig::AlignRoundReport& report, TimePoint began) {
  v1::RoundPoint point;
  point.set_round(static_cast<std::uint32_t>(report.decision.round));
  point.set_at_s((report.round.at - began).value());
  point.set_resets(static_cast<std::uint32_t>(report.decision.resets_so_far));
  for (const smear::CameraDecision& camera : report.decision.cameras) {
    point.add_error_rows(camera.error ? (*camera.error / report.options.row_time).value()
                                      : std::numeric_limits<double>::quiet_NaN());
  }
  return point;
}

/// The flame as it was told before, with what is told now.
Result<smear::FlameMotion> flame_of(const v1::AlignRequest& request, smear::FlameMotion flame) {
  for (const auto& [field, value] :
       {std::pair("flame_speed_m_s", request.flame_speed_m_s()), std::pair("detail_m", request.detail_m())}) {
    if (!std::isfinite(value) || value < 0)
      return Error{ErrorKind::bad_input, "is no speed or size", field,
                   "Give a positive number; 0: as before"};
  }
  if (request.flame_speed_m_s() > 0) flame.speed = smear::MetersPerSecond(request.flame_speed_m_s());
  if (request.detail_m() > 0) flame.detail = Meters(request.detail_m());
  return flame;
}

bool tells_flame(const v1::AlignRequest& request) {
  return request.flame_speed_m_s() > 0 || request.detail_m() > 0;
}

Result<rig::AlignRunOptions> options_of(const v1::AlignRequest& request, rig::AlignmentConfig config,
                                        const smear::FlameMotion& flame, rig::Rig& rig) {
  if (request.has_stagger()) config.stagger = request.stagger();
  EMBERLOCK_ASSIGN_OR_RETURN(rig::AlignRunOptions options, rig.align_options(config));
  if (!config.tolerance || tells_flame(request)) options.align.tolerance = smear::tolerance_for(flame);
  if (!request.tolerance().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.align.tolerance, smear::parse_tolerance(request.tolerance()));
  }
  if (!request.policy().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.align.policy, smear::parse_align_policy(request.policy()));
  }
  if (request.anyway()) options.align.limits.reset();
  // An order to another host is on its way for a while.
  if (rig.own() < rig.size()) options.reset_lead = std::max(options.reset_lead, kRemoteLead);
  return options;
}

}  // namespace

Status Conductor::align(const v1::AlignRequest& request) {
  EMBERLOCK_RETURN_IF_ERROR(check_not_lent());
  if (devices_.strobe == nullptr) {
    return Error{ErrorKind::refused, "the rig has no strobe, so nothing tells the shutters' phases",
                 "[rig.strobe]", "Configure one"};
  }
  if (request.renew()) return renew(request);
  EMBERLOCK_ASSIGN_OR_RETURN(const smear::FlameMotion flame, flame_of(request, flame_));
  EMBERLOCK_ASSIGN_OR_RETURN(rig::AlignRunOptions options,
                             options_of(request, parts_.config.alignment, flame, parts_.rig));
  std::swap(options, align_options_);
  Status asked = happen(AskAlign{});
  if (!asked.ok()) {
    std::swap(options, align_options_);
    return asked;
  }
  flame_ = flame;
  tolerance_told_ =
      !request.tolerance().empty() || (parts_.config.alignment.tolerance && !tells_flame(request));
  return asked;
}

Status Conductor::renew(const v1::AlignRequest& request) {
  if (!std::isfinite(request.hold_s()) || request.hold_s() < 0)
    return Error{ErrorKind::bad_input, "is no length of time", "hold_s", "Give 0 or more"};
  EMBERLOCK_RETURN_IF_ERROR(happen(AskRenew{}));
  constexpr Seconds kUntilItBegins{5};  // from the renewal's last round to the take
  const Seconds usual = align_options_.align.shortest_take;
  if (alignment_)
    alignment_->hold_for(request.hold_s() > 0 ? Seconds(request.hold_s()) + kUntilItBegins : usual);
  return {};
}

TakeLength Conductor::take_length(Seconds asked) const {
  if (!alignment_) return {asked};
  const Seconds sure = alignment_->time_left(parts_.rig.clock().now());
  return {asked, std::isfinite(sure.value()) ? std::optional(sure) : std::nullopt,
          alignment_->last().renewed};
}

LockLeft Conductor::lock_left() const {
  if (!alignment_) return {};
  const TimePoint now = parts_.rig.clock().now();
  LockLeft left{take_length({}).sure, alignment_->likely_left(now), {}};
  if (!std::isfinite(left.likely->value())) left.likely.reset();
  if (const auto first = alignment_->last().reason.first_out)
    left.leaves_first = alignment_->cameras()[*first].id;
  return left;
}

Status Conductor::stop_sync() { return happen(AskIdle{}); }

void Conductor::begin_alignment() {
  await_strobe();
  alignment_.reset();
  history_.clear();
  foretold_.reset();
  align_began_ = parts_.rig.clock().now();
  auto alignment = rig::Alignment::create(
      devices_, align_options_, [this](const rig::AlignRoundReport& round) { remember(round); }, {}, stop_);
  if (!alignment.ok()) {
    static_cast<void>(happen(RoundDone{v1::AlignmentStatus::REFUSED, alignment.error()}));
    return;
  }
  alignment_ = std::move(*alignment);
}

void Conductor::end_alignment() {
  if (!alignment_) return;
  if (!parts_.config.alignment.delays.empty()) {
    const rig::AlignRunResult result = alignment_->result();
    if (const Status kept = rig::write_delays(parts_.config.alignment.delays, devices_, result.delays);
        !kept.ok())
      parts_.board.notice(v1::AMBER, kept.error().message());
  }
  alignment_.reset();
  if (devices_.strobe->dial()) return;  // somebody switches it off
  darken_strobe();
}

void Conductor::measure_row_time() {
  if (!alignment_) {  // a device is waited for
    drain();
    const bool strobe_answers = strobe_status_.ok();
    if (watch_.all_film() && strobe_answers) static_cast<void>(happen(Recovered{}));
    return;
  }
  const Status started = alignment_->start();
  if (!started.ok()) return explain_failure(started.error());
  if (!alignment_->stopped()) static_cast<void>(happen(RowTimeMeasured{}));
}

void Conductor::film_round() {
  const bool check = std::exchange(check_now_, false);
  const Status filmed = alignment_->round();
  if (!filmed.ok()) return explain_failure(filmed.error());
  if (alignment_->stopped()) {
    check_now_ = check;
    return;
  }
  expired_ = false;
  const smear::AlignDecision& last = alignment_->last();
  const smear::AlignWords& said = alignment_->words();
  static_cast<void>(
      happen(RoundDone{verdict(), AlignmentSays{said.reason, said.remedy}, last.renews, last.in_time}));
}

void Conductor::hold() {
  const TimePoint now = parts_.rig.clock().now();
  const Seconds left = alignment_->next_check(now);
  if (check_now_ || left < milliseconds(1)) return film_round();  // clocks count whole nanoseconds
  if (real_time()) return drain();
  alignment_->wait(now + left);
}

void Conductor::break_alignment(Why why) {
  alignment_.reset();
  static_cast<void>(happen(AlignmentBroken{why}));
}

void Conductor::explain_failure(const Error& error) {
  watch_devices();
  if (!alignment_) return;
  if (!watch_.all_film()) return break_alignment(Why::camera_away);
  if (!update_strobe_state(devices_.strobe->read_back()).ok()) return break_alignment(Why::strobe_away);
  static_cast<void>(happen(RoundDone{v1::AlignmentStatus::GIVEN_UP, error}));
}

void Conductor::remember(const rig::AlignRoundReport& round) {
  if (round.decision.effort && !foretold_) foretold_ = round.decision.effort;
  history_.push_back(point_of(round, align_began_));
  if (history_.size() > kHistory) history_.pop_front();
}

v1::AlignmentStatus::Verdict Conductor::verdict() const {
  switch (alignment_->last().verdict) {
    case smear::AlignVerdict::go_on:
      return v1::AlignmentStatus::GO_ON;
    case smear::AlignVerdict::aligned:
      return v1::AlignmentStatus::ALIGNED;
    case smear::AlignVerdict::refused:
      return v1::AlignmentStatus::REFUSED;
    case smear::AlignVerdict::given_up:
      return v1::AlignmentStatus::GIVEN_UP;
  }
  return v1::AlignmentStatus::VERDICT_UNSPECIFIED;
}

}  // namespace emberlock::daemon
