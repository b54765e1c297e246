// SPDX-License-Identifier: Apache-2.0
#include "report/tradeoff_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/file.h"
#include "evaluate/work_points.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr double kLeastGain = 0.02;  // of the error; less per doubling of time doesn't count

std::string views_text(int views) { return views == 0 ? "all" : std::to_string(views); }

std::string command_start(const Tradeoff& t) {
  return "emberlock reconstruct " + t.input + " --out result" + (t.options.empty() ? "" : " " + t.options);
}

/// Held-out error along the front at each doubling of time.
void doublings(HtmlPage& page, const std::vector<recon::WorkPoint>& front) {
  std::vector<std::vector<std::string>> rows;
  double before = NAN;
  for (double s = std::exp2(std::ceil(std::log2(front.front().seconds) - 1e-9));; s *= 2) {
    const recon::WorkPoint* best = recon::best_within(front, s);
    if (best == nullptr) continue;
    const recon::Settings& c = best->settings;
    rows.push_back({fmt::format("{:.3g} s", s), fmt::format("{:.2f}", best->error),
                    std::isnan(before)     ? ""
                    : best->error < before ? fmt::format("-{:.2f}", before - best->error)
                                           : "nothing",
                    fmt::format("{} voxels, {} iteration{}, effects {}{}", c.voxels, c.iterations,
                                c.iterations == 1 ? "" : "s", c.effects,
                                c.views == 0 ? "" : ", " + views_text(c.views) + " views")});
    before = best->error;
    if (s >= front.back().seconds) break;
  }
  page.table({"within", "held-out error", "the doubling bought", "with"}, rows);
}

void front_table(HtmlPage& page, const Tradeoff& t, const std::vector<recon::WorkPoint>& front) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < front.size(); ++i) {
    const recon::WorkPoint& p = front[i];
    const recon::Settings& s = p.settings;
    const std::string price =
        i == 0 ? ""
               : fmt::format("{:.2g}", (front[i - 1].error - p.error) / (p.seconds - front[i - 1].seconds));
    rows.push_back({fmt::format("{:.3f}", p.seconds), fmt::format("{:.2f}", p.error), price,
                    std::to_string(s.voxels), std::to_string(s.iterations), views_text(s.views), s.effects,
                    evaluate::command_options(s)});
  }
  page.raw("<p>To repeat a point, add its options to <code>" + html_escape(command_start(t)) + "</code></p>");
  page.raw(command_table(
      {"seconds", "held-out error", "levels a second", "voxels", "iterations", "views", "effects"}, rows));
}

/// The last point of each run that differs from the first run in one setting.
void knobs(HtmlPage& page, const evaluate::Sweep& sweep) {
  std::vector<recon::WorkPoint> ends;
  for (std::size_t i = 0; i < sweep.points.size(); ++i) {
    if (i + 1 == sweep.points.size() || sweep.run[i + 1] != sweep.run[i]) ends.push_back(sweep.points[i]);
  }
  const recon::WorkPoint& base = ends.front();
  std::vector<std::vector<std::string>> rows{
      {"as the base run", fmt::format("{:.2f}", base.seconds), fmt::format("{:.2f}", base.error), "", ""}};
  for (const recon::WorkPoint& p : ends) {
    const recon::Settings& a = base.settings;
    const recon::Settings& b = p.settings;
    std::vector<std::string> changed;
    if (a.voxels != b.voxels) changed.push_back(fmt::format("{} voxels", b.voxels));
    if (a.views != b.views) changed.push_back(views_text(b.views) + " views");
    if (a.step != b.step) changed.push_back(fmt::format("step {:g}", b.step));
    if (a.precision != b.precision) changed.emplace_back(name(b.precision));
    if (a.effects != b.effects) changed.push_back("effects " + b.effects);
    if (a.solver != b.solver) changed.push_back("solver " + std::string(name(b.solver)));
    if (changed.size() != 1) continue;
    rows.push_back({changed[0], fmt::format("{:.2f}", p.seconds), fmt::format("{:.2f}", p.error),
                    fmt::format("x {:.2f}", p.seconds / base.seconds),
                    fmt::format("{:+.2f}", p.error - base.error)});
  }
  if (rows.size() == 1) return;
  page.heading("What each setting does");
  page.paragraph("Each run to its end, one setting changed at a time. Base: " +
                 evaluate::command_options(base.settings));
  page.table({"changed", "seconds", "held-out error", "time", "error"}, rows);
}

void all_points(HtmlPage& page, const Tradeoff& t) {
  page.heading("All points");
  std::vector<std::vector<std::string>> rows;
  for (const recon::WorkPoint& p : t.sweep.points) {
    rows.push_back({fmt::format("{:.3f}", p.seconds), fmt::format("{:.2f}", p.error),
                    command_start(t) + " " + evaluate::command_options(p.settings)});
  }
  page.raw("<details><summary>" + std::to_string(rows.size()) +
           " points, each with the command that repeats it</summary>" +
           command_table({"seconds", "held-out error"}, rows) + "</details>");
}

}  // namespace

std::string command_table(const std::vector<std::string>& header,
                          const std::vector<std::vector<std::string>>& rows) {
  std::string html = "<div class=\"scroll\"><table><tr>";
  for (const std::string& cell : header) html += "<th>" + html_escape(cell) + "</th>";
  html += "<th style=\"text-align:left\">options</th>";
  for (const auto& row : rows) {
    html += "</tr>\n<tr>";
    for (std::size_t i = 0; i + 1 < row.size(); ++i) html += "<td>" + html_escape(row[i]) + "</td>";
    html +=
        "<td style=\"text-align:left;white-space:nowrap\"><code>" + html_escape(row.back()) + "</code></td>";
  }
  return html + "</tr></table></div>\n";
}

std::string what_a_second_buys(const std::vector<recon::WorkPoint>& points) {
  const std::vector<recon::WorkPoint> front = evaluate::pareto_front(points);
  if (front.empty()) return {};
  std::string words = fmt::format("Within {:.2g} s the held-out error falls to {:.1f} grey levels",
                                  front.front().seconds, front.front().error);
  double said = front.front().error;
  double from = front.front().seconds;
  for (double s = 2 * from; s < 2 * front.back().seconds; s *= 2) {  // the last one covers the whole front
    const recon::WorkPoint* best = recon::best_within(front, s);
    if (best->error > (1 - kLeastGain) * said) continue;
    words += fmt::format(", within {:.2g} s to {:.1f}", best->seconds, best->error);
    said = best->error;
    from = best->seconds;
  }
  const double longest = std::max_element(points.begin(), points.end(),
                                          [](const recon::WorkPoint& a, const recon::WorkPoint& b) {
                                            return a.seconds < b.seconds;
                                          })
                             ->seconds;
  if (longest > 1.5 * from) words += fmt::format("; going on to {:.2g} s buys no more", longest);
  return words + ".";
}

std::string tradeoff_html(const Tradeoff& t) {
  const std::vector<recon::WorkPoint> front = evaluate::pareto_front(t.sweep.points);
  HtmlPage page("Emberlock: what accuracy costs, " + t.input);
  page.raw("<p style=\"font-size:1.25rem\">" + html_escape(what_a_second_buys(t.sweep.points)) + "</p>");
  page.raw("<div class=\"scroll wide\">" + tradeoff_svg(t.sweep.points) + "</div><div class=\"narrow\">" +
           tradeoff_svg(t.sweep.points, SheetSize::phone) + "</div>");
  page.paragraph(
      "Below and to the left is better. A line is one run, iteration by iteration; the orange staircase is "
      "the "
      "Pareto front: no other setting was both quicker and better. Point at a mark to see its settings.");
  if (!t.sweep.skipped.empty()) {
    std::string left_out = "<p>Not in the diagram:</p><ul>";
    for (const std::string& skipped : t.sweep.skipped) left_out += "<li>" + html_escape(skipped) + "</li>";
    page.raw(left_out + "</ul>");
  }
  page.heading("What a doubling of time buys");
  doublings(page, front);
  page.heading("The front");
  front_table(page, t, front);
  knobs(page, t.sweep);
  all_points(page, t);
  page.heading("How it was measured");
  page.paragraph(
      fmt::format("{} points in {:.0f} s on {}. Seconds count from the pictures in memory to all views "
                  "rendered; the judging of held-out views is left out. Errors are those of the held-out "
                  "views, which no run was given: RMS over R, G, B and the flame's bounding box.",
                  t.sweep.points.size(), t.sweep.total.value(), t.machine));
  return page.str();
}

Status write_tradeoff_files(const TradeoffFiles& files, const OutputRequest& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "points.csv", files.csv));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "diagram.svg", files.svg));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "index.html", files.html));
  return staging.commit();
}

Status write_tradeoff(const Tradeoff& tradeoff, const OutputRequest& where) {
  return write_tradeoff_files(
      {evaluate::to_csv(tradeoff.sweep.points), tradeoff_svg(tradeoff.sweep.points), tradeoff_html(tradeoff)},
      where);
}

}  // namespace emberlock::report
