// SPDX-License-Identifier: Apache-2.0
#include "report/sync_tradeoff_report.h"

#include <cmath>

#include <fmt/format.h>

#include "report/html.h"
#include "report/tradeoff_report.h"

namespace emberlock::report {
namespace {

constexpr int kPlotHeight = 300;
constexpr int kPlotWidth = 1000;

/// Styles of a stand-alone diagram; a page's own style contains the same.
constexpr const char* kPlotStyle = R"(<style>
.sync { --ink: #222; --line: #ddd; }
@media (prefers-color-scheme: dark) { .sync { --ink: #ddd; --line: #444; } }
.sync text { fill: var(--ink); font: 12px system-ui, sans-serif; } .sync .grid { stroke: var(--line); }
</style>)";

bool is_recommended(const evaluate::SyncTradeoff& t, const evaluate::SyncCost& cost) {
  return t.recommended && &cost == &t.costs[*t.recommended];
}

/// Why a point has no numbers.
std::string missing(const evaluate::SyncCost& cost) {
  if (cost.statistics.rigs == 0) return fmt::format("about {:.0f} resets: not simulated", cost.expected);
  return fmt::format("not met: by {} rigs of {}", cost.statistics.aligned, cost.statistics.rigs);
}

/// A policy's curve over tolerances.
Series line(const evaluate::SyncTradeoff& t, smear::AlignPolicy policy, const char* of, bool dashed,
            double (*value)(const smear::AlignStatistics&)) {
  Series s{std::string(name(policy)) + of, {}, {}, dashed};
  for (const evaluate::SyncCost& cost : t.costs) {
    if (cost.policy != policy) continue;
    s.x.push_back(cost.tolerance.value());
    s.y.push_back(cost.reached() ? value(cost.statistics) : NAN);
    s.notes.push_back(fmt::format("{}, {}: {:.1f} resets (95 %: {}), {} (95 %: {})\n{}", name(policy),
                                  evaluate::tolerance_text(t, cost.tolerance), cost.statistics.resets,
                                  cost.statistics.resets_p95, evaluate::time_text(cost.statistics.seconds),
                                  evaluate::time_text(cost.statistics.seconds_p95),
                                  evaluate::repeat_command(t, cost)));
  }
  return s;
}

PlotOptions plot(const evaluate::SyncTradeoff& t, const char* title, const char* y_label) {
  PlotOptions options{.title = title,
                      .x_label = "tolerance to either side, rows",
                      .y_label = y_label,
                      .x_axis = Axis::logarithmic,
                      .y_axis = Axis::logarithmic,
                      .width = kPlotWidth,
                      .height = kPlotHeight};
  if (t.recommended) options.mark = t.costs[*t.recommended].tolerance.value();
  return options;
}

std::string cost_plot(const evaluate::SyncTradeoff& t, const char* title, const char* y_label,
                      double (*mean)(const smear::AlignStatistics&),
                      double (*p95)(const smear::AlignStatistics&)) {
  std::vector<Series> series;
  for (const smear::AlignPolicy policy : t.options.policies)
    series.push_back(line(t, policy, "", false, mean));
  for (const smear::AlignPolicy policy : t.options.policies)
    series.push_back(line(t, policy, ", 95 %", true, p95));
  for (std::size_t i = 0; i < series.size(); ++i) series[i].colour = i % t.options.policies.size();
  return svg_plot(series, plot(t, title, y_label));
}

std::vector<std::string> plots(const evaluate::SyncTradeoff& t) {
  std::vector<std::string> result;
  result.push_back(cost_plot(
      t, "Minutes until all cameras are in tolerance", "minutes",
      [](const smear::AlignStatistics& s) { return s.seconds / 60; },
      [](const smear::AlignStatistics& s) { return s.seconds_p95 / 60; }));
  result.push_back(cost_plot(
      t, "Resets until all cameras are in tolerance", "resets",
      [](const smear::AlignStatistics& s) { return std::max(s.resets, 0.5); },
      [](const smear::AlignStatistics& s) { return std::max<double>(s.resets_p95, 0.5); }));
  if (t.errors.empty()) return result;
  Series error{"held-out error", {}, {}, false};
  Series floor{"in perfect step", {}, {}, true};
  Series allowed{fmt::format("{:g} % more", t.options.added_error), {}, {}, true};
  for (const evaluate::SyncError& e : t.errors) {
    error.x.push_back(e.tolerance.value());
    error.y.push_back(e.error);
    error.notes.push_back(fmt::format("{}: {:.2f} grey levels, {:+.1f} %",
                                      evaluate::tolerance_text(t, e.tolerance), e.error,
                                      100 * (e.error / t.floor - 1)));
    floor.x.push_back(e.tolerance.value());
    floor.y.push_back(t.floor);
    allowed.x.push_back(e.tolerance.value());
    allowed.y.push_back(t.floor * (1 + t.options.added_error / 100));
  }
  PlotOptions options =
      plot(t, "What it leaves in the reconstruction of a rising flame", "grey levels of 255, RMS");
  options.y_axis = Axis::linear;
  result.push_back(svg_plot({error, floor, allowed}, options));
  return result;
}

/// Tolerances as rows, policies as columns.
void overview(HtmlPage& page, const evaluate::SyncTradeoff& t) {
  std::vector<std::string> header{"tolerance"};
  if (!t.errors.empty()) header.emplace_back("adds to the error");
  for (const smear::AlignPolicy policy : t.options.policies) header.emplace_back(name(policy));
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < t.options.tolerances.size(); ++i) {
    const Rows tolerance = t.options.tolerances[i];
    const bool chosen = t.recommended && t.costs[*t.recommended].tolerance == tolerance;
    std::vector<std::string> row{evaluate::tolerance_text(t, tolerance) +
                                 (chosen ? "  \u2190 recommended" : "")};
    if (!t.errors.empty()) row.push_back(fmt::format("{:+.1f} %", 100 * (t.errors[i].error / t.floor - 1)));
    for (const evaluate::SyncCost& cost : t.costs) {
      if (cost.tolerance != tolerance) continue;
      const smear::AlignStatistics& s = cost.statistics;
      row.push_back(cost.reached()
                        ? fmt::format("{:.1f}\u00a0({}), {}\u00a0({}){}", s.resets, s.resets_p95,
                                      evaluate::time_text(s.seconds), evaluate::time_text(s.seconds_p95),
                                      is_recommended(t, cost) ? " \u2190" : "")
                        : missing(cost));
    }
    rows.push_back(std::move(row));
  }
  page.table(header, rows);
}

void all_points(HtmlPage& page, const evaluate::SyncTradeoff& t) {
  std::vector<std::vector<std::string>> rows;
  for (const evaluate::SyncCost& cost : t.costs) {
    const smear::AlignStatistics& s = cost.statistics;
    rows.push_back({std::string(name(cost.policy)), evaluate::tolerance_text(t, cost.tolerance),
                    cost.reached() ? fmt::format("{:.1f}", s.resets) : missing(cost),
                    cost.reached() ? std::to_string(s.resets_p95) : "",
                    cost.reached() ? evaluate::time_text(s.seconds) : "",
                    cost.reached() ? evaluate::time_text(s.seconds_p95) : "",
                    evaluate::repeat_command(t, cost)});
  }
  page.raw("<details><summary>" + std::to_string(rows.size()) +
           " points, each with the command that repeats it</summary>" +
           command_table({"policy", "tolerance", "resets", "95 %", "time", "95 %"}, rows) + "</details>");
}

}  // namespace

std::string sync_tradeoff_svg(const evaluate::SyncTradeoff& t) {
  const std::vector<std::string> parts = plots(t);
  std::string svg =
      fmt::format(R"(<svg xmlns="http://www.w3.org/2000/svg" class="sync" viewBox="0 0 {0} {1}" )"
                  R"(width="{0}" height="{1}" role="img" aria-label="What synchrony costs">)",
                  kPlotWidth, kPlotHeight * static_cast<int>(parts.size()));
  svg += kPlotStyle;
  for (std::size_t i = 0; i < parts.size(); ++i)
    svg += fmt::format(R"svg(<g transform="translate(0 {})">{}</g>)svg", kPlotHeight * static_cast<int>(i),
                       parts[i]);
  return svg + "</svg>";
}

std::string sync_tradeoff_csv(const evaluate::SyncTradeoff& t) {
  std::string csv =
      "policy,tolerance_rows,tolerance_ms,rigs,aligned,resets,resets_p95,seconds,seconds_p95,heldout_rmse,"
      "heldout_rmse_sigma,added_percent,recommended,command\n";
  for (const evaluate::SyncCost& cost : t.costs) {
    const smear::AlignStatistics& s = cost.statistics;
    csv += fmt::format("{},{:g},{:.6g},{},{},", name(cost.policy), cost.tolerance.value(),
                       in_milliseconds(cost.tolerance * t.options.row_time), s.rigs, s.aligned);
    csv += cost.reached()
               ? fmt::format("{:.3f},{},{:.3f},{:.3f},", s.resets, s.resets_p95, s.seconds, s.seconds_p95)
               : ",,,,";
    std::string flame = ",,,";
    for (const evaluate::SyncError& e : t.errors) {
      if (e.tolerance == cost.tolerance)
        flame = fmt::format("{:.4f},{:.4f},{:.2f},", e.error, e.spread, 100 * (e.error / t.floor - 1));
    }
    csv += flame + (is_recommended(t, cost) ? "yes" : "no") + "," + evaluate::repeat_command(t, cost) + "\n";
  }
  return csv;
}

std::string sync_tradeoff_html(const evaluate::SyncTradeoff& t) {
  const evaluate::SyncTradeoffOptions& o = t.options;
  HtmlPage page(fmt::format("Emberlock: what synchrony costs, {} cameras", o.cameras));
  page.raw("<p style=\"font-size:1.25rem\">" + html_escape(t.why) + "</p>");
  overview(page, t);
  page.paragraph(
      "Resets, then time, of the mean rig; 95 rigs of 100 take no more than what stands in brackets. "
      "Tolerances "
      "hold to either side of the target: two cameras may differ by twice as much.");
  for (const std::string& part : plots(t)) page.raw("<div class=\"scroll\">" + part + "</div>");
  page.paragraph("Point at a mark for its figures and the command that repeats it.");
  page.heading("What the policies are");
  page.raw(
      "<ul><li>fixed-reference: the paper's. One camera stays, the others are reset by hand until they "
      "fit.</li>"
      "<li>densest: by hand, the farthest first; the target moves to where most cameras lie already.</li>"
      "<li>timed: on command, at the moment that lands a camera on the target; its latency is learnt.</li>"
      "<li>trimmed: timed until trims of the frame rates reach; those then bring the cameras in, and hold "
      "them there.</li></ul>");
  page.heading("All points");
  all_points(page, t);
  page.heading("How it was measured");
  page.paragraph(fmt::format(
      "{} rigs a point, drawn by seed {}, through the policy that `emberlock align` runs: {:g} frames/s, "
      "{:g} us "
      "a row, latencies that differ by {:g} ms between cameras and jitter by {:g} ms, crystals by {:g} ppm, "
      "{:g} "
      "s a round, {:g} s a reset by hand, trims of +-{:g} ppm in steps of {:g}.",
      o.rigs, o.seed, o.frame_rate.value(), o.row_time.value() * 1e6, in_milliseconds(o.latency_spread),
      in_milliseconds(o.latency_jitter), o.crystal_spread.value(), o.round_time.value(), o.reset_time.value(),
      o.trim_range.value(), o.trim_step.value()));
  if (!t.errors.empty()) {
    page.paragraph(fmt::format(
        "The flame is simulated, 16 cm high, and rises at {:g} m/s; ten cameras film it, each late or early "
        "by "
        "its own draw within the tolerance, an eleventh in time judges the reconstruction of {} voxels along "
        "an edge. Errors are means over {} draws, the same at every tolerance, scaled.",
        o.flame_speed, o.voxels, o.draws));
  }
  page.paragraph(t.next_step);
  return page.str();
}

nlohmann::ordered_json sync_tradeoff_json(const evaluate::SyncTradeoff& t) {
  nlohmann::ordered_json points = nlohmann::ordered_json::array();
  for (const evaluate::SyncCost& cost : t.costs) {
    const smear::AlignStatistics& s = cost.statistics;
    nlohmann::ordered_json point{{"policy", name(cost.policy)},
                                 {"tolerance_rows", cost.tolerance.value()},
                                 {"tolerance_ms", in_milliseconds(cost.tolerance * t.options.row_time)},
                                 {"rigs", s.rigs},
                                 {"aligned", s.aligned}};
    const auto known = [&](double value) {
      return cost.reached() ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
    };
    point["resets"] = known(s.resets);
    point["resets_p95"] = known(s.resets_p95);
    point["seconds"] = known(s.seconds);
    point["seconds_p95"] = known(s.seconds_p95);
    point["recommended"] = is_recommended(t, cost);
    point["command"] = evaluate::repeat_command(t, cost);
    points.push_back(std::move(point));
  }
  nlohmann::ordered_json errors = nlohmann::ordered_json::array();
  for (const evaluate::SyncError& e : t.errors) {
    errors.push_back({{"tolerance_rows", e.tolerance.value()},
                      {"heldout_rmse", e.error},
                      {"sigma", e.spread},
                      {"added_percent", 100 * (e.error / t.floor - 1)}});
  }
  nlohmann::ordered_json json;
  json["points"] = std::move(points);
  json["flame_speed_m_s"] = t.options.flame_speed;
  json["heldout_rmse_in_step"] =
      t.errors.empty() ? nlohmann::ordered_json(nullptr) : nlohmann::ordered_json(t.floor);
  json["errors"] = std::move(errors);
  json["recommended"] = t.recommended ? nlohmann::ordered_json(*t.recommended) : nullptr;
  json["reason"] = t.why;
  return json;
}

Status write_sync_tradeoff(const evaluate::SyncTradeoff& t, const OutputRequest& where) {
  return write_tradeoff_files({sync_tradeoff_csv(t), sync_tradeoff_svg(t), sync_tradeoff_html(t)}, where);
}

}  // namespace emberlock::report
