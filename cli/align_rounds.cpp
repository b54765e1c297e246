// SPDX-License-Identifier: Apache-2.0
#include "cli/align_rounds.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include <fmt/format.h>

#include "cli/phase_circle.h"

namespace emberlock::cli {
namespace {

std::string rows_and_ms(Seconds time, SecondsPerRow row) {
  return fmt::format("{:.1f} rows ({:.3f} ms)", (time / row).value(), in_milliseconds(time));
}

/// "round 3: 6 cameras out of tolerance; 1 reset so far; worst pair 377.8 rows (20.399 ms)"
std::string round_line(const rig::AlignRoundReport& report) {
  const smear::AlignDecision& decision = report.decision;
  std::string line = fmt::format("round {}: {}; {} reset{} so far", decision.round, report.words.reason,
                                 decision.resets_so_far, decision.resets_so_far == 1 ? "" : "s");
  if (decision.worst_pair)
    line += "; worst pair " + rows_and_ms(*decision.worst_pair, report.options.row_time);
  return line;
}

bool has_dial_news(const smear::AlignDecision& decision) {
  return decision.dial && decision.dial->ready && !decision.dial->act;
}

/// Every camera, its offset once: in its sentence.
std::string whole_table(const rig::AlignRoundReport& report) {
  std::string text = round_line(report) + "\n";
  if (has_dial_news(report.decision)) text += "    " + report.words.dial + "\n";
  const bool mixed = std::any_of(report.sensors.begin(), report.sensors.end(),
                                 [](SensorKind kind) { return kind != SensorKind::ccd; });
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const smear::CameraDecision& camera = report.decision.cameras[i];
    const char mark = camera.reset ? '*' : camera.trim ? '~' : report.decision.reference == i ? '=' : ' ';
    text += fmt::format("  {} {:<12} ", mark, report.cameras[i].id);
    if (mixed) text += fmt::format("{:<8}", name(report.sensors[i]));
    text += report.words.cameras[i] + "\n";
  }
  return text;
}

/// What somebody may want to know at once, and what doesn't come and go with the target.
bool is_told(smear::CameraCause cause) {
  switch (cause) {
    case smear::CameraCause::fixed:
    case smear::CameraCause::by_hand:
    case smear::CameraCause::leaving_by_hand:
    case smear::CameraCause::slewing:
    case smear::CameraCause::locked:
    case smear::CameraCause::away:
    case smear::CameraCause::doubted:
    case smear::CameraCause::blind:
    case smear::CameraCause::unreadable:
    case smear::CameraCause::unheard:
      return true;
    default:
      return false;
  }
}

/// "; resets virtual-04 (-368.2 rows), virtual-05 (+350.1 rows)"
std::string resets_words(const rig::AlignRoundReport& report) {
  std::string text;
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const smear::CameraDecision& camera = report.decision.cameras[i];
    if (!camera.reset || is_told(camera.reason.cause)) continue;
    text += (text.empty() ? "; resets " : ", ") + report.cameras[i].id;
    if (camera.error)
      text += fmt::format(" ({:+.1f} rows)", (*camera.error / report.options.row_time).value());
  }
  return text;
}

/// What was measured of a sensor other than a CCD.
std::string sensor_line(const drivers::CameraInfo& camera, const std::optional<smear::RowClock>& clock,
                        const std::optional<Seconds>& exposure) {
  if (camera.sensor == SensorKind::ccd) return {};
  std::string text = fmt::format("  {}, {} shutter:", camera.id, name(camera.sensor));
  if (exposure) text += fmt::format(" exposes about {:.1f} ms", in_milliseconds(*exposure));
  if (clock)
    text +=
        fmt::format(", t_row {:.3f} +- {:.3f} us", clock->row_time.value() * 1e6, clock->sigma.value() * 1e6);
  return (exposure || clock ? text : text + " nothing could be told of it") + "\n";
}

}  // namespace

std::string AlignRounds::changes(const rig::AlignRoundReport& report) {
  const smear::AlignDecision& decision = report.decision;
  const std::string resets = resets_words(report);
  bool news = !resets.empty() || std::exchange(reason_, decision.reason.cause) != decision.reason.cause;
  // What somebody is asked to set changes with what they have set.
  if (decision.dial) news |= std::exchange(asked_, report.words.reason) != report.words.reason;
  std::string below;
  if (has_dial_news(decision) && std::exchange(dial_, report.words.dial) != report.words.dial)
    below += "    " + report.words.dial + "\n";
  std::vector<smear::CameraCause> causes;
  for (std::size_t i = 0; i < report.cameras.size(); ++i) {
    const smear::CameraCause cause = decision.cameras[i].reason.cause;
    causes.push_back(cause);
    const bool same = i < causes_.size() && causes_[i] == cause && decision.reset_next != i;
    if (!same && is_told(cause))
      below += fmt::format("    {:<12} {}\n", report.cameras[i].id, report.words.cameras[i]);
  }
  causes_ = std::move(causes);
  return news || !below.empty() ? round_line(report) + resets + "\n" + below : std::string();
}

std::string AlignRounds::take(const rig::AlignRoundReport& report) {
  return detail_ == AlignDetail::all ? whole_table(report) : changes(report);
}

std::string align_summary(const rig::AlignRunResult& result) {
  const smear::AlignDecision& last = result.last;
  const SecondsPerRow row = result.options.row_time;
  const Rows tolerance = result.options.tolerance.in_rows(row);
  std::string text =
      fmt::format("{} after {} rounds and {} resets (policy {}, tolerance {}, t_row {:.4f} us): {}\n",
                  last.verdict == smear::AlignVerdict::aligned   ? "aligned"
                  : last.verdict == smear::AlignVerdict::refused ? "REFUSED"
                                                                 : "NOT aligned",
                  last.round, result.resets, name(result.options.policy),
                  words(result.options.tolerance, row), row.value() * 1e6, result.words.reason);
  if (!result.offsets.empty())
    text +=
        fmt::format("  staggered: {} instants a second, {:.3f} ms apart\n",
                    std::lround(static_cast<double>(result.offsets.size()) / result.options.period.value()),
                    in_milliseconds(result.options.period / static_cast<double>(result.offsets.size())));
  if (result.checks > 0) text += fmt::format("  held by {} checks\n", result.checks);
  for (std::size_t i = 0; i < result.cameras.size(); ++i)
    text += sensor_line(result.cameras[i], result.row_clocks[i], result.exposures[i]);
  std::vector<CirclePoint> points;
  for (std::size_t i = 0; i < last.cameras.size(); ++i)
    points.push_back({result.cameras[i].id, last.cameras[i].error});
  if (std::any_of(points.begin(), points.end(), [](const CirclePoint& p) { return p.error.has_value(); }))
    text += phase_circle(points, result.options.period, tolerance * row, row, !result.offsets.empty());
  return text;
}

}  // namespace emberlock::cli
