// SPDX-License-Identifier: Apache-2.0
// The work-precision diagram as SVG.
#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "evaluate/work_points.h"
#include "report/html.h"
#include "report/tradeoff_report.h"

namespace emberlock::report {
namespace {

/// Where things stand, in pixels. The legend is to the right, or below where there is no room for it.
struct Sheet {
  double width, height;
  double left, right, top, bottom;
  bool labels;  ///< of the front's points
  double legend_x, legend_y;
};
constexpr Sheet kWide{1000, 560, 64, 800, 40, 500, true, 824, 50};
constexpr Sheet kNarrow{360, 300, 52, 348, 34, 250, false, 62, 310};  // its height grows with the legend
constexpr double kLegendLine = 22;
constexpr double kPerCharacter = 6.2;  // approximate width of a character in small labels
constexpr double kLabelHeight = 14;
constexpr double kLabelGain =
    0.95;  // labels a point if its error is below this share of the last labelled one's

// From few voxels to many: light to dark blue, which colour-blind readers see as an order too.
constexpr std::array<const char*, 6> kShades{"#9ecae1", "#6baed6", "#4292c6",
                                             "#2171b5", "#08519c", "#08306b"};
constexpr const char* kFront = "#d55e00";

/// A logarithmic axis from data to pixels.
struct LogScale {
  double low, high;  // log10
  double from, to;
  LogScale(double smallest, double largest, double from_px, double to_px)
      : low(std::log10(smallest)), high(std::log10(largest)), from(from_px), to(to_px) {
    const double margin = std::max(0.06, 0.08 * (high - low));
    low -= margin;
    high += margin;
  }
  double operator()(double v) const { return from + (to - from) * (std::log10(v) - low) / (high - low); }
  [[nodiscard]] std::vector<double> ticks() const {
    std::vector<double> result;
    const auto steps = high - low > 0.9 ? std::vector<double>{1, 2, 5}
                                        : std::vector<double>{1, 1.2, 1.5, 2, 2.5, 3, 3.5, 4, 5, 6, 7, 8, 9};
    for (int e = static_cast<int>(std::floor(low)); e <= static_cast<int>(std::ceil(high)); ++e) {
      for (const double m : steps) {
        const double t = std::log10(m) + e;
        if (t >= low && t <= high) result.push_back(m * std::pow(10, e));
      }
    }
    return result;
  }
};

std::string axes(const LogScale& x, const LogScale& y, const Sheet& f) {
  std::string svg;
  for (const double t : x.ticks()) {
    svg += fmt::format(R"(<line class="grid" x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/>)", x(t), f.top,
                       f.bottom);
    svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{:g}</text>)", x(t), f.bottom + 18, t);
  }
  for (const double t : y.ticks()) {
    svg += fmt::format(R"(<line class="grid" x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}"/>)", y(t), f.left,
                       f.right);
    svg += fmt::format(R"(<text x="{}" y="{:.1f}" text-anchor="end">{:g}</text>)", f.left - 8, y(t) + 4, t);
  }
  svg += fmt::format(R"(<text class="title" x="{}" y="20">What accuracy costs</text>)", f.left);
  svg +=
      fmt::format(R"(<text x="{}" y="{}" text-anchor="middle">seconds until the views are rendered</text>)",
                  (f.left + f.right) / 2, f.bottom + 40);
  svg += fmt::format(R"svg(<text transform="translate(16 {}) rotate(-90)" text-anchor="middle">)svg"
                     "held-out RMS error, grey levels of 255</text>",
                     (f.top + f.bottom) / 2);
  return svg;
}

/// A shade for each number of voxels.
std::map<int, const char*> shades(const std::vector<recon::WorkPoint>& points) {
  std::map<int, const char*> result;
  for (const recon::WorkPoint& p : points) result[p.settings.voxels] = kShades[0];
  std::size_t i = 0;
  for (auto& [voxels, shade] : result) {
    shade =
        kShades[result.size() == 1 ? kShades.size() - 1 : i++ * (kShades.size() - 1) / (result.size() - 1)];
  }
  return result;
}

std::string tooltip(const recon::WorkPoint& p) {
  return fmt::format("<title>{:.3g} s, {:.3g} grey levels&#10;{}</title>", p.seconds, p.error,
                     html_escape(evaluate::command_options(p.settings)));
}

/// Connects the points of a run; those of the paper's solver are hollow squares.
std::string runs(const std::vector<recon::WorkPoint>& points, const LogScale& x, const LogScale& y) {
  const auto shade = shades(points);
  std::string lines;
  std::string marks;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const recon::WorkPoint& p = points[i];
    const char* colour = shade.at(p.settings.voxels);
    recon::Settings same = p.settings;
    if (i > 0) same.iterations = points[i - 1].settings.iterations;
    if (i > 0 && same == points[i - 1].settings && p.settings.iterations > same.iterations) {
      lines +=
          fmt::format(R"(<line x1="{:.1f}" y1="{:.1f}" x2="{:.1f}" y2="{:.1f}" stroke="{}" class="run"/>)",
                      x(points[i - 1].seconds), y(points[i - 1].error), x(p.seconds), y(p.error), colour);
    }
    marks +=
        p.settings.solver == recon::Solver::paper
            ? fmt::format(
                  R"(<rect x="{:.1f}" y="{:.1f}" width="7" height="7" class="paper" stroke="{}">{}</rect>)",
                  x(p.seconds) - 3.5, y(p.error) - 3.5, colour, tooltip(p))
            : fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="3.5" fill="{}">{}</circle>)", x(p.seconds),
                          y(p.error), colour, tooltip(p));
  }
  return lines + marks;
}

struct Label {
  double x, y, width;
};

bool overlap(const Label& a, const Label& b) {
  return std::abs(a.y - b.y) < kLabelHeight && a.x < b.x + b.width && b.x < a.x + a.width;
}

/// A short label that distinguishes a point of the front.
std::string label_text(const recon::WorkPoint& p) {
  const recon::Settings& s = p.settings;
  std::string words =
      fmt::format("{:.2g} s: {:.1f} ({} voxels, {} it.", p.seconds, p.error, s.voxels, s.iterations);
  if (s.views > 0) words += fmt::format(", {} views", s.views);
  if (s.effects != "auto") words += ", effects " + s.effects;
  return words + ")";
}

/// The Pareto front as a staircase, its points ringed. A point is labelled, below the line where there is
/// space, if its error is sufficiently below that of the last label.
std::string front(const std::vector<recon::WorkPoint>& points, const LogScale& x, const LogScale& y,
                  const Sheet& f) {
  const std::vector<recon::WorkPoint> best = evaluate::pareto_front(points);
  std::string path;
  std::string rings;
  std::vector<Label> placed;
  double said = INFINITY;
  for (std::size_t i = 0; i < best.size(); ++i) {
    const double px = x(best[i].seconds);
    const double py = y(best[i].error);
    path += i == 0 ? fmt::format("M{:.1f} {:.1f}", px, py) : fmt::format("H{:.1f}V{:.1f}", px, py);
    rings += fmt::format(R"(<circle class="front" cx="{:.1f}" cy="{:.1f}" r="6" stroke="{}">{}</circle>)", px,
                         py, kFront, tooltip(best[i]));
    if (!f.labels) continue;
    const std::string words = html_escape(label_text(best[i]));
    const double width = kPerCharacter * static_cast<double>(words.size());
    const Label label{std::clamp(px - 10 - width, f.left + 4, f.right - width), py + 17, width};
    if (best[i].error > kLabelGain * said || label.y > f.bottom ||
        std::any_of(placed.begin(), placed.end(), [&](const Label& other) { return overlap(label, other); }))
      continue;
    placed.push_back(label);
    said = best[i].error;
    rings += fmt::format(R"(<text class="label" x="{:.1f}" y="{:.1f}">{}</text>)", label.x, label.y, words);
  }
  path += fmt::format("H{}", f.right);
  return fmt::format(R"(<path class="front" d="{}" stroke="{}"/>)", path, kFront) + rings;
}

std::string legend(const std::vector<recon::WorkPoint>& points, const Sheet& f) {
  double line = f.legend_y;
  const double x = f.legend_x;
  std::string svg = fmt::format(R"(<line class="front" x1="{}" x2="{}" y1="{}" y2="{}" stroke="{}"/>)"
                                R"(<text x="{}" y="{}">Pareto front: best so far</text>)",
                                x - 8, x + 8, line, line, kFront, x + 16, line + 4);
  for (const auto& [voxels, shade] : shades(points)) {
    line += kLegendLine;
    svg += fmt::format(R"(<circle cx="{}" cy="{}" r="4.5" fill="{}"/><text x="{}" y="{}">{} voxels</text>)",
                       x, line, shade, x + 16, line + 4, voxels);
  }
  if (std::any_of(points.begin(), points.end(),
                  [](const recon::WorkPoint& p) { return p.settings.solver == recon::Solver::paper; })) {
    line += kLegendLine;
    svg += fmt::format(R"(<rect x="{}" y="{}" width="8" height="8" class="paper" stroke="{}"/>)"
                       R"(<text x="{}" y="{}">the paper's solver</text>)",
                       x - 4, line - 4, kShades[3], x + 16, line + 4);
  }
  return svg;
}

constexpr const char* kDiagramStyle = R"(<style>
.work { --ink: #222; --line: #ddd; --paper: #fff; }
@media (prefers-color-scheme: dark) { .work { --ink: #ddd; --line: #444; --paper: #151515; } }
.work text { fill: var(--ink); font: 13px system-ui, sans-serif; }
.work .title { font-weight: bold; font-size: 15px; }
.work .label { font-size: 11.5px; paint-order: stroke; stroke: var(--paper); stroke-width: 4px; }
.work .grid { stroke: var(--line); } .work .run { stroke-width: 1.2; opacity: .55; }
.work .paper { fill: none; stroke-width: 1.5; } .work .front { fill: none; stroke-width: 2.5; }
</style>)";

}  // namespace

std::string tradeoff_svg(const std::vector<recon::WorkPoint>& points, SheetSize size) {
  Sheet f = size == SheetSize::desktop ? kWide : kNarrow;
  if (size == SheetSize::phone)
    f.height = f.legend_y + kLegendLine * static_cast<double>(shades(points).size() + 2);
  const auto seconds = std::minmax_element(
      points.begin(), points.end(),
      [](const recon::WorkPoint& a, const recon::WorkPoint& b) { return a.seconds < b.seconds; });
  const auto error = std::minmax_element(
      points.begin(), points.end(),
      [](const recon::WorkPoint& a, const recon::WorkPoint& b) { return a.error < b.error; });
  const LogScale x(seconds.first->seconds, seconds.second->seconds, f.left, f.right);
  const LogScale y(error.first->error, error.second->error, f.bottom, f.top);
  return fmt::format(
             R"(<svg xmlns="http://www.w3.org/2000/svg" class="work" viewBox="0 0 {0} {1}" width="{0}" )"
             R"(height="{1}" role="img" aria-label="Held-out error against seconds">)",
             f.width, f.height) +
         kDiagramStyle + axes(x, y, f) + runs(points, x, y) + front(points, x, y, f) + legend(points, f) +
         "</svg>";
}

}  // namespace emberlock::report
