// SPDX-License-Identifier: Apache-2.0
#include "report/verify_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/file.h"
#include "report/html.h"
#include "report/smear_strip.h"

namespace emberlock::report {
namespace {

constexpr std::size_t kMostPoints = 800;  // points in a plot: more would only enlarge the file

const char* colour(smear::ClipState state) {
  switch (state) {
    case smear::ClipState::in_sync:
      return "#009e73";
    case smear::ClipState::out_of_tolerance:
      return "#d55e00";
    default:
      return "#e69f00";
  }
}

std::string signed_ms(Seconds t) { return fmt::format("{:+.3f}", in_milliseconds(t)); }

/// Never rounds up to certainty.
std::string probability_in_words(double p) {
  return p > 0.9999 ? "> 0.9999" : fmt::format("{:.4f}", std::floor(p * 1e4) / 1e4);
}

std::string duration(Seconds t) {
  if (!std::isfinite(t.value())) return "always";
  if (t < Seconds(120)) return fmt::format("{:.0f} s", t.value());
  return t < Seconds(7200) ? fmt::format("{:.0f} min", t.value() / 60)
                           : fmt::format("{:.1f} h", t.value() / 3600);
}

void verdict(HtmlPage& page, const films::VerifyRunResult& run) {
  const smear::VerifyResult& r = run.result;
  const smear::ClipState as = r.verdict == smear::ClipsVerdict::in_sync ? smear::ClipState::in_sync
                              : r.verdict == smear::ClipsVerdict::out_of_tolerance
                                  ? smear::ClipState::out_of_tolerance
                                  : smear::ClipState::ambiguous;
  page.raw(fmt::format(R"-(<p style="border-left:.6rem solid {};padding:.6rem 1rem;font-size:1.25rem;)-"
                       R"-(background:var(--soft)"><strong>{}</strong></p>)-",
                       colour(as), html_escape(r.summary)));
  if (r.worst_pair) {
    page.paragraph(
        fmt::format("The two cameras that lie farthest apart differ by {:.3f} ms ({:.1f} rows). All errors "
                    "are those at frame "
                    "{} of {}, the middle of the reference.",
                    in_milliseconds(*r.worst_pair), (*r.worst_pair / r.options.clip.row_time).value(),
                    r.middle, r.cameras[r.reference].name));
  }
  page.paragraph(fmt::format("The strobe gave {:g} flashes a second; t_row is {:.4f} \u00b5s.",
                             r.options.clip.flash_rate.value(), r.options.clip.row_time.value() * 1e6));
  if (r.to_do.empty() && run.notes.empty()) return;
  page.heading("What to do");
  std::string list = "<ul>";
  for (const std::string& line : r.to_do) list += "<li>" + html_escape(line) + "</li>";
  for (const std::string& line : run.notes) list += "<li>" + html_escape(line) + "</li>";
  page.raw(list + "</ul>");
}

void table(HtmlPage& page, const smear::VerifyResult& r) {
  page.heading("The cameras");
  std::vector<std::vector<std::string>> rows;
  for (const smear::CameraVerdict& c : r.cameras) {
    const bool reference = &c == &r.cameras[r.reference];
    const bool stays = c.time_left && c.state == smear::ClipState::in_sync;
    const std::string none = "\u2013";
    rows.push_back(
        {c.name, reference ? "reference" : std::string(name(c.state)),
         c.error && !reference ? signed_ms(*c.error) : none,
         c.error && !reference ? fmt::format("{:.3f}", in_milliseconds(c.sigma)) : none,
         c.error && !reference ? fmt::format("{:+.1f}", (*c.error / r.options.clip.row_time).value()) : none,
         c.frame_offset ? fmt::format("{:+d}", *c.frame_offset) : none,
         reference || !c.frame_offset ? none : std::string(name(c.offset_by)),
         reference || !c.frame_offset ? none : probability_in_words(c.offset_probability),
         c.drift && !reference ? fmt::format("{:+.2f} \u00b1 {:.2f}", c.drift->value(), c.drift_sigma.value())
                               : none,
         stays ? duration(c.time_left->expected) : none, stays ? duration(c.time_left->earliest) : none});
  }
  page.table({"camera", "state", "error (ms)", "sigma (ms)", "error (rows)", "frame offset", "told by",
              "probability", "drift (ppm)", "stays in for", "at least"},
             rows);
  page.paragraph(
      "Error: positive when the camera reads earlier than the reference. Frame offset: frame i + offset of "
      "the "
      "camera starts nearest to frame i of the reference; told by the strobe's own code, or by whatever "
      "pattern of "
      "lit and unlit frames the clips share, with the probability that it is right. Drift: the camera's "
      "frame rate over the "
      "reference's. "
      "The camera stays within the tolerance for so long from the middle of the reference on; \"at least\" "
      "holds "
      "with 97.5 % probability.");
}

/// Errors on a common scale; the tolerance is shaded, whiskers are two standard errors.
void error_diagram(HtmlPage& page, const smear::VerifyResult& r) {
  const double tolerance = in_milliseconds(r.options.tolerance.in_time(r.options.clip.row_time));
  double reach = 1.3 * tolerance;
  for (const smear::CameraVerdict& c : r.cameras) {
    if (c.error) reach = std::max(reach, 1.1 * std::abs(in_milliseconds(*c.error)));
  }
  const double left = 190;
  const double width = 640;
  const double row = 24;
  const double height = row * static_cast<double>(r.cameras.size()) + 34;
  const auto x = [&](double ms) { return left + width / 2 * (1 + std::clamp(ms / reach, -1.0, 1.0)); };
  std::string svg =
      fmt::format(R"(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img" aria-label="errors">)",
                  left + width + 20, height);
  svg +=
      fmt::format(R"(<rect x="{:.1f}" y="0" width="{:.1f}" height="{:.1f}" fill="#009e73" opacity=".15"/>)",
                  x(-tolerance), x(tolerance) - x(-tolerance), height - 30);
  for (const double ms : {-tolerance, 0.0, tolerance}) {
    svg += fmt::format(R"(<line class="grid" x1="{0:.1f}" x2="{0:.1f}" y1="0" y2="{1:.1f}"/>)", x(ms),
                       height - 30);
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{:+.3g} ms</text>)", x(ms),
                       height - 12, ms);
  }
  for (std::size_t i = 0; i < r.cameras.size(); ++i) {
    const smear::CameraVerdict& c = r.cameras[i];
    const double y = row * (static_cast<double>(i) + 0.5);
    svg += fmt::format(R"(<text x="{}" y="{:.1f}" text-anchor="end">{}</text>)", left - 12, y + 4,
                       html_escape(c.name));
    if (!c.error) {
      svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{}</text>)", x(0), y + 4,
                         html_escape(name(c.state)));
      continue;
    }
    const double ms = in_milliseconds(*c.error);
    const double two_sigma = 2 * in_milliseconds(c.sigma);
    svg +=
        fmt::format(R"(<line x1="{:.1f}" x2="{:.1f}" y1="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="2"/>)",
                    x(ms - two_sigma), x(ms + two_sigma), y, y, colour(c.state));
    svg += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="5" fill="{}"/>)", x(ms), y, colour(c.state));
  }
  page.raw("<div class=\"scroll\">" + svg + "</svg></div>");
  page.paragraph(
      "Left: reads later than the reference. Right: reads earlier. Shaded: the tolerance. Whiskers: two "
      "standard "
      "errors.");
}

/// The row at which the fitted line predicts the dot of frame `i`; NaN if it isn't displayed.
double row_on_line(const smear::ClipClock& clock, std::int64_t i) {
  const smear::CcdTiming& t = clock.timing;
  const double shifted = std::floor((clock.phase_of_frame(i).tau / t.row_time).value());
  if (shifted >= t.shifts) return NAN;
  const bool top_first = t.direction == smear::ReadDirection::top_first;
  const double last = t.rows - 1;
  const double start = top_first ? clock.lamp.value() : last - clock.lamp.value();
  double packet = start + shifted;
  if (packet >= t.shifts - 0.5) packet -= t.shifts;
  if (packet > last + 0.5) return NAN;
  return top_first ? packet : last - packet;
}

/// The stride that leaves not too many items.
std::size_t stride_of(std::size_t count) {
  return std::max<std::size_t>(1, (count + kMostPoints - 1) / kMostPoints);
}

void plots(HtmlPage& page, const smear::CameraVerdict& c, const smear::VerifyOptions& options,
           std::size_t frames) {
  const smear::ClipClock& clock = c.clock;
  if (!clock.line) return;
  const auto seconds = [&](std::int64_t i) {
    return static_cast<double>(clock.count_of(i)) * clock.timing.frame_period.value();
  };
  Series dots{.name = "dots", .x = {}, .y = {}, .mark = Mark::points};
  Series residuals{.name = "dots", .x = {}, .y = {}, .mark = Mark::points};
  for (std::size_t i = 0; i < clock.points.size(); i += stride_of(clock.points.size())) {
    const smear::ClipPoint& p = clock.points[i];
    dots.x.push_back(seconds(p.frame));
    dots.y.push_back(p.y.value());
    residuals.x.push_back(seconds(p.frame));
    residuals.y.push_back((p.residual / options.clip.row_time).value());
  }
  Series line{.name = "fitted walk", .x = {}, .y = {}};
  double before = NAN;
  for (std::size_t i = 0; i < frames; i += stride_of(frames)) {
    const double row = row_on_line(clock, static_cast<std::int64_t>(i));
    line.x.push_back(seconds(static_cast<std::int64_t>(i)));
    line.y.push_back(std::abs(row - before) > clock.timing.rows / 4.0 ? NAN : row);
    before = row;
  }
  page.raw("<div class=\"gallery\">" +
           svg_plot({line, dots}, {.title = "Where the dot stands",
                                   .x_label = "seconds of the clip, by the strobe's clock",
                                   .y_label = "row (0 is the top)",
                                   .width = 600,
                                   .height = 300}) +
           svg_plot({residuals}, {.title = "What the fit leaves",
                                  .x_label = "seconds of the clip, by the strobe's clock",
                                  .y_label = "rows; shaded: one row",
                                  .band = 0.5,
                                  .width = 600,
                                  .height = 300}) +
           "</div>");
}

/// Lit and unlit frames, and what the code predicts for the flashes assigned to them by the line.
void code_diagram(HtmlPage& page, const smear::CameraVerdict& c, const smear::ClipReading& clip,
                  const smear::FrameCode& code) {
  const smear::ClipClock& clock = c.clock;
  const auto pattern = smear::flash_pattern(code);
  if (clock.numbers.runs.empty() || !pattern.ok()) return;
  const std::size_t shown = std::min<std::size_t>(clip.frames.size(), 300);
  const double step = 1200.0 / static_cast<double>(shown);
  std::string svg = R"(<svg viewBox="0 0 1260 46" width="1260" height="46" role="img" aria-label="the code">)"
                    R"(<text x="1206" y="15">seen</text><text x="1206" y="37">code</text>)";
  const auto bar = [&](std::size_t i, int y, const char* fill) {
    svg += fmt::format(R"(<rect x="{:.1f}" y="{}" width="{:.1f}" height="16" fill="{}"/>)",
                       step * static_cast<double>(i), y, 0.85 * step, fill);
  };
  for (std::size_t i = 0; i < shown; ++i) {
    const auto place = static_cast<std::int64_t>(i);
    const smear::NumberedRun& run = *clock.run_at(place);
    const double start = run.start + static_cast<double>(place - run.first) * run.flashes_per_frame;
    // A frame's picture is lit by the last flash before its read phase.
    const double flash = wrap_positive(std::ceil(start) - 1, code.flashes());
    const bool given = (*pattern)[static_cast<std::size_t>(flash)];
    const smear::FlashSeen seen = smear::flash_seen(clip.frames[i]);
    const bool agrees = seen == smear::FlashSeen::unknown || (seen == smear::FlashSeen::yes) == given;
    bar(i, 3, seen == smear::FlashSeen::yes ? "#e69f00" : seen == smear::FlashSeen::no ? "#444" : "#999");
    bar(i, 25, !agrees ? "#d55e00" : given ? "#e69f00" : "#444");
  }
  page.raw("<div class=\"scroll\">" + svg + "</svg></div>");
  page.paragraph(
      fmt::format("Which of the first {} frames the strobe lit (orange) and which it skipped (black), above "
                  "its code as it was "
                  "told; red where the two disagree.",
                  shown));
}

void strips(HtmlPage& page, const smear::CameraVerdict& c, const films::FilmedClip& clip) {
  if (clip.strips.empty()) return;
  std::vector<HtmlPage::Picture> pictures;
  for (const films::ClipStrip& strip : clip.strips) {
    std::string caption = fmt::format("frame {}", strip.frame);
    if (strip.reading.dots.size() == 1)
      caption += fmt::format(", dot at row {:.1f}", strip.reading.dots.front().y.value());
    pictures.push_back(
        {smear_strip_svg(strip.pixels.view(), strip.reading, {}, strip.pixels.layout().size.width / 2),
         caption});
  }
  page.paragraph(fmt::format(
      "Columns about the lamp (circle, at row {:.1f}); marks point at the dot. Contrast is stretched.",
      c.clock.lamp.value()));
  page.gallery(pictures);
}

std::string what_was_found(const smear::CameraVerdict& c) {
  const smear::ClipClock& clock = c.clock;
  std::string text = fmt::format("{} of {} lit frames show a single dot.", clock.points.size(), clock.lit);
  if (clock.line) {
    text += fmt::format(
        " The camera films {:.5f} frames a second by the strobe's clock; it reads the {} row first, K "
        "is {}.",
        1 / clock.timing.frame_period.value(),
        clock.timing.direction == smear::ReadDirection::top_first ? "top" : "bottom", clock.timing.shifts);
  }
  for (const std::string& reason :
       {clock.mode.direction_reason, clock.mode.shifts_reason, clock.numbers.reason}) {
    if (!reason.empty()) text += ' ' + sentence(reason);
  }
  return text;
}

void comb(HtmlPage& page, const films::VerifyRunResult& run) {
  if (!run.comb || !run.row_clock) return;
  page.heading("The row time");
  page.paragraph(fmt::format(
      "t_row = {:.4f} \u00b1 {:.4f} \u00b5s, from {} dots in {} frames of {}, {:.3f} rows "
      "apart.",
      run.row_clock->row_time.value() * 1e6, run.row_clock->sigma.value() * 1e6, run.row_clock->dots,
      run.row_clock->frames, run.comb->reading.name, run.row_clock->pitch.value()));
  std::vector<HtmlPage::Picture> pictures;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, run.comb->strips.size()); ++i) {
    const films::ClipStrip& strip = run.comb->strips[i];
    pictures.push_back(
        {smear_strip_svg(strip.pixels.view(), strip.reading, {}, strip.pixels.layout().size.width / 2),
         fmt::format("frame {}: {} dots", strip.frame, strip.reading.dots.size())});
  }
  page.gallery(pictures);
}

}  // namespace

Status write_verify_report(const films::VerifyRunResult& run, const OutputRequest& where) {
  const smear::VerifyResult& r = run.result;
  HtmlPage page(fmt::format("Synchronization of {} cameras, from their own clips", r.cameras.size()));
  verdict(page, run);
  table(page, r);
  error_diagram(page, r);
  for (std::size_t i = 0; i < r.cameras.size(); ++i) {
    const smear::CameraVerdict& c = r.cameras[i];
    const std::size_t frames = run.clips[i].reading.frames.size();
    page.heading(c.name + (i == r.reference ? ": the reference" : ": " + std::string(name(c.state))));
    if (i != r.reference) page.paragraph(sentence(c.reason));
    if (i != r.reference)
      page.paragraph(sentence((c.frame_offset ? "its frames are matched: " : "its frames are not matched: ") +
                              c.offset_reason));
    page.paragraph(what_was_found(c));
    plots(page, c, r.options, frames);
    code_diagram(page, c, run.clips[i].reading, r.options.clip.code);
    strips(page, c, run.clips[i]);
  }
  comb(page, run);
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "report.html", page.str()));
  return staging.commit();
}

}  // namespace emberlock::report
