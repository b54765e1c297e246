// SPDX-License-Identifier: Apache-2.0
#include "report/import_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "films/small_picture.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr std::size_t kMostShown = 600;  // points in a plot: more would only enlarge the file
constexpr const char* kNone = "–";
constexpr const char* kGood = "#009e73";
constexpr const char* kStrobeColour = "#e69f00";
constexpr const char* kFlameColour = "#0072b2";
constexpr const char* kDoubtful = "#d55e00";

constexpr Seconds kNegligible = milliseconds(0.5);  // smaller delays need no correction
constexpr Seconds kDoubt = milliseconds(0.2);       // a larger standard error calls for another film

bool by_strobe(const films::ImportResult& r) { return r.clip.has_value(); }

/// The stride that leaves at most kMostShown items.
std::size_t thinned(std::size_t count) { return std::max<std::size_t>(1, count / kMostShown); }

const films::ImportedCamera& reference_of(const films::ImportResult& r) { return r.cameras[r.reference]; }

/// Seconds since the first common instant, by the reference's count.
double seconds_at(const films::ImportResult& r, std::size_t instant) {
  const films::ImportedCamera& c = reference_of(r);
  return (c.times.read_start(c.places[instant]) - c.times.read_start(c.places.front())).value();
}

Seconds latest(const films::ImportResult& r) {
  double most = 0;
  for (const films::ImportedCamera& c : r.cameras)
    for (const double late : c.late_s) most = std::max(most, std::abs(late));
  return Seconds(most);
}

Seconds most_uncertain(const films::ImportResult& r) {
  double most = 0;
  for (const films::ImportedCamera& c : r.cameras)
    for (const double sigma : c.sigma_s) most = std::max(most, sigma);
  return Seconds(most);
}

std::string list_of(const std::vector<std::string>& lines) {
  std::string list = "<ul>";
  for (const std::string& line : lines) list += "<li>" + html_escape(line) + "</li>";
  return list + "</ul>";
}

void summary(HtmlPage& page, const films::ImportResult& r) {
  const bool one = r.instants == 1;
  const bool synchronised = by_strobe(r) || one || r.cameras.size() == 1;
  std::string text = one ? fmt::format("One instant of {} cameras.", r.cameras.size())
                         : fmt::format("{} cameras, {} instants: {:.2f} s.", r.cameras.size(), r.instants,
                                       seconds_at(r, static_cast<std::size_t>(r.instants) - 1));
  if (by_strobe(r)) {
    text += fmt::format(
        " Frames are paired by the strobe. The cameras read {:.3f} ms off the reference at most; how much is "
        "known to {:.1f} µs or better.",
        in_milliseconds(latest(r)), in_microseconds(most_uncertain(r)));
  } else if (!one) {
    text += " Frames are paired as told or by their numbers; nothing says when each was taken.";
  }
  page.raw(fmt::format(R"-(<p style="border-left:.6rem solid {};padding:.6rem 1rem;font-size:1.25rem;)-"
                       R"-(background:var(--soft)"><strong>{}</strong></p>)-",
                       synchronised ? kGood : kDoubtful, html_escape(text)));
}

std::vector<std::string> advice(const films::ImportResult& r) {
  std::vector<std::string> lines;
  std::string uncalibrated;
  bool none = true;
  for (const films::ImportedCamera& c : r.cameras) {
    none = none && !c.calibrated;
    if (!c.calibrated) uncalibrated += (uncalibrated.empty() ? "" : ", ") + c.id;
  }
  if (none) uncalibrated = "the cameras";
  if (!uncalibrated.empty())
    lines.push_back("Calibrate " + uncalibrated +
                    " (emberlock calibrate cameras) and name its rig.json with --rig, here or when "
                    "reconstructing.");
  if (by_strobe(r) && latest(r) > kNegligible)
    lines.push_back(
        fmt::format("The cameras read up to {:.2f} ms apart. Nothing is to be done: reconstruct knows each "
                    "frame's time by times.json and corrects for it where that gains. To have less of it, "
                    "align the shutters before filming.",
                    in_milliseconds(latest(r))));
  for (const films::ImportedCamera& c : r.cameras) {
    if (!c.clock) continue;
    const Seconds sigma(*std::max_element(c.sigma_s.begin(), c.sigma_s.end()));
    if (sigma > kDoubt)
      lines.push_back(fmt::format(
          "{} is known to {:.2f} ms only: film the strobe for longer, after the flame too, and with "
          "an exposure that doesn't saturate its lamp.",
          c.id, in_milliseconds(sigma)));
  }
  return lines;
}

/// Why a film belongs to this camera.
std::string why_it_is(const films::ImportOptions& options, const films::ImportedCamera& c) {
  if (options.ids.contains(c.name)) return "--camera says so";
  return c.files.size() > 1 || c.name == c.id ? "its subfolder's name" : "its file's name";
}

void cameras(HtmlPage& page, const films::ImportOptions& options, const films::ImportResult& r) {
  page.heading("Which film is which camera");
  std::vector<HtmlPage::Picture> pictures;
  for (const films::ImportedCamera& c : r.cameras) {
    if (c.preview)
      pictures.push_back(
          {fmt::format(R"(<img alt="{}" src="{}">)", html_escape(c.id), png_data_uri(*c.preview)),
           fmt::format("{}, frame {}", c.id, c.places[c.places.size() / 2])});
  }
  page.gallery(pictures);
  std::vector<std::vector<std::string>> rows;
  for (const films::ImportedCamera& c : r.cameras) {
    const bool is_reference = &c == &reference_of(r);
    const auto late = [&](std::size_t i) {
      if (!c.clock || is_reference) return std::string(kNone);
      return fmt::format("{:+.4f} ± {:.4f}", 1e3 * c.late_s[i], 1e3 * c.sigma_s[i]);
    };
    const std::string files = c.files.size() > 1 ? fmt::format(" ({} files)", c.files.size()) : "";
    rows.push_back(
        {c.id + (is_reference && r.instants > 1 ? " (reference)" : ""), c.name + files, why_it_is(options, c),
         fmt::format("{}", c.frames), fmt::format("{} to {}", c.places.front(), c.places.back()),
         fmt::format("{:+d}", c.frame_offset), late(0), late(c.late_s.empty() ? 0 : c.late_s.size() - 1),
         c.drift && !is_reference ? fmt::format("{:+.2f}", c.drift->value()) : kNone,
         c.calibrated ? "yes" : "no"});
  }
  page.table({"camera", "film", "known by", "frames", "imported", "frame offset", "late at first (ms)",
              "late at last (ms)", "drift (ppm)", "calibrated"},
             rows);
  page.paragraph(
      "Frame offset: frame i + offset of the film belongs to frame i of the reference. Late: begins to be "
      "read "
      "after the reference, with one standard error. Drift: its frame rate over the reference's.");
}

/// The films on the common clock: the parts with strobe, with flame, and the rest.
void timeline(HtmlPage& page, const films::ImportResult& r) {
  if (r.instants < 2) return;
  page.heading("What was filmed when");
  const double origin = reference_of(r).times.read_start(reference_of(r).places.front()).value();
  double from = 0;
  double to = 0;
  for (const films::ImportedCamera& c : r.cameras) {
    from = std::min(from, c.times.read_start(0).value() - origin);
    to = std::max(to, c.times.read_start(c.frames).value() - origin);
  }
  constexpr double kLeft = 160;
  constexpr double kWidth = 900;
  constexpr double kRow = 26;
  const double height = kRow * static_cast<double>(r.cameras.size());
  const auto x = [&](double s) { return kLeft + kWidth * (s - from) / (to - from); };
  std::string svg =
      fmt::format(R"(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img" aria-label="films">)",
                  kLeft + kWidth + 30, height + 28);
  const auto bar = [&](const films::ImportedCamera& c, films::PlaceRange places, double y, const char* fill) {
    const double begin = x(c.times.read_start(places.first).value() - origin);
    const double end = x(c.times.read_start(places.last).value() - origin);
    svg += fmt::format(R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="16" fill="{}"/>)", begin, y,
                       std::max(1.0, end - begin), fill);
  };
  for (std::size_t i = 0; i < r.cameras.size(); ++i) {
    const films::ImportedCamera& c = r.cameras[i];
    const double y = kRow * static_cast<double>(i) + 4;
    svg += fmt::format(R"(<text x="{}" y="{:.1f}" text-anchor="end">{}</text>)", kLeft - 10, y + 13,
                       html_escape(c.id));
    bar(c, {0, c.frames}, y, "#bbb");
    for (const films::PlaceRange& lit : c.strobe) bar(c, lit, y, kStrobeColour);
    bar(c, {c.places.front(), c.places.back() + 1}, y, kFlameColour);
  }
  for (const double s : {from, 0.0, seconds_at(r, static_cast<std::size_t>(r.instants) - 1)})
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}" text-anchor="middle">{:+.1f} s</text>)", x(s),
                       height + 20, s);
  page.raw("<div class=\"scroll\">" + svg + "</svg></div>");
  page.paragraph(fmt::format(
      "Orange: the strobe, which stays in the originals. Blue: the {} instants that are common to "
      "all, and imported; {} within lack a frame of some camera. Grey: neither.",
      r.instants, r.left_out));
}

void times(HtmlPage& page, const films::ImportResult& r) {
  if (!by_strobe(r) || r.cameras.size() < 2) return;
  page.heading("When each camera took the common instants");
  std::vector<Series> late;
  std::vector<Series> sigma;
  for (std::size_t c = 0; c < r.cameras.size(); ++c) {
    const films::ImportedCamera& camera = r.cameras[c];
    if (c == r.reference) continue;
    Series& at = late.emplace_back();
    Series& error = sigma.emplace_back();
    at.name = error.name = camera.id;
    for (std::size_t i = 0; i < camera.late_s.size(); i += thinned(camera.late_s.size())) {
      at.x.push_back(seconds_at(r, i));
      at.y.push_back(1e3 * camera.late_s[i]);
      error.x.push_back(at.x.back());
      error.y.push_back(1e6 * camera.sigma_s[i]);
    }
  }
  page.raw("<div class=\"gallery\">" +
           svg_plot(late, {.title = "Later than the reference",
                           .x_label = "seconds from the first instant",
                           .y_label = "ms",
                           .width = 600,
                           .height = 300}) +
           svg_plot(sigma, {.title = "Standard error of that",
                            .x_label = "seconds from the first instant",
                            .y_label = "µs",
                            .width = 600,
                            .height = 300}) +
           "</div>");
  page.paragraph(
      "The error grows with the distance from the strobe, as a camera's rate is known the better the longer "
      "it "
      "filmed it. times.json holds each frame's time and the largest of its camera's errors.");
}

std::string what_the_strobe_told(const films::ImportedCamera& c) {
  const smear::ClipClock& clock = *c.clock;
  std::string parts;
  for (const films::PlaceRange& lit : c.strobe)
    parts += fmt::format("{}{} to {}", parts.empty() ? "" : ", ", lit.first, lit.last - 1);
  const bool other = c.whole && c.whole->witness != smear::FrameWitness::none;
  const std::string matched = other ? fmt::format(" Its frames are matched to the reference's by {}: {}.",
                                                  name(c.whole->witness), c.whole->reason)
                                    : "";
  return fmt::format(
             "The strobe is in frames {}: {} of {} lit ones show a single dot. By its clock the camera films "
             "{:.5f} "
             "frames a second. It reads the {} row first, as {}; K is {}{}{}.",
             parts, clock.points.size(), clock.lit, 1 / clock.timing.frame_period.value(),
             clock.timing.direction == smear::ReadDirection::top_first ? "top" : "bottom",
             clock.mode.direction ? clock.mode.direction_reason : "told", clock.timing.shifts,
             clock.mode.shifts ? ", as " : ", taken since ", clock.mode.shifts_reason) +
         matched;
}

void clocks(HtmlPage& page, const films::ImportResult& r) {
  if (!by_strobe(r)) return;
  page.heading("What the strobe told of each camera");
  page.paragraph(fmt::format("All are read with t_row = {:.4f} ± {:.4f} µs.", 1e6 * r.clip->row_time.value(),
                             1e6 * r.clip->row_time_sigma.value()));
  std::vector<HtmlPage::Picture> pictures;
  for (const films::ImportedCamera& c : r.cameras) {
    if (!c.clock) continue;
    Series residuals{.name = "dots", .x = {}, .y = {}, .mark = Mark::points};
    for (std::size_t i = 0; i < c.clock->points.size(); i += thinned(c.clock->points.size())) {
      const smear::ClipPoint& p = c.clock->points[i];
      residuals.x.push_back(p.frame);
      residuals.y.push_back((p.residual / r.clip->row_time).value());
    }
    pictures.push_back({svg_plot({residuals}, {.title = c.id + ": what the clock's fit leaves",
                                               .x_label = "frame of the film",
                                               .y_label = "rows; shaded: one row",
                                               .band = 0.5,
                                               .width = 600,
                                               .height = 220}),
                        what_the_strobe_told(c)});
  }
  page.gallery(pictures);
}

}  // namespace

std::string import_json(const films::ImportOptions& options, const films::ImportResult& result) {
  using nlohmann::ordered_json;
  ordered_json cameras = ordered_json::array();
  for (const films::ImportedCamera& c : result.cameras) {
    const auto ends = [](const std::vector<double>& seconds) {
      return seconds.empty() ? ordered_json({nullptr, nullptr})
                             : ordered_json({1e3 * seconds.front(), 1e3 * seconds.back()});
    };
    ordered_json strobe = ordered_json::array();
    for (const films::PlaceRange& part : c.strobe) strobe.push_back({part.first, part.last});
    ordered_json camera;
    camera["id"] = c.id;
    camera["files"] = c.files;
    camera["frames"] = c.frames;
    camera["frame_rate"] = c.frame_rate.value();
    camera["strobe_frames"] = std::move(strobe);
    camera["first_frame"] = c.first;
    camera["frame_offset"] = c.frame_offset;
    const bool told = c.whole && c.whole->witness != smear::FrameWitness::none;
    camera["offset_by"] = told ? ordered_json(name(c.whole->witness)) : ordered_json(nullptr);
    camera["offset_probability"] = told ? ordered_json(c.whole->probability) : ordered_json(nullptr);
    camera["offset_reason"] = c.whole ? ordered_json(c.whole->reason) : ordered_json(nullptr);
    camera["late_ms"] = ends(c.late_s);
    camera["sigma_ms"] = ends(c.sigma_s);
    camera["drift_ppm"] = c.drift ? ordered_json(c.drift->value()) : ordered_json(nullptr);
    camera["calibrated"] = c.calibrated;
    cameras.push_back(std::move(camera));
  }
  ordered_json json;
  json["source"] = options.folder.string();
  json["aligned_by"] = by_strobe(result) ? "strobe" : "numbers";
  json["reference"] = result.cameras.empty() ? "" : reference_of(result).id;
  json["instants"] = result.instants;
  json["instants_left_out"] = result.left_out;
  json["cameras"] = std::move(cameras);
  json["notes"] = result.notes;
  return json.dump(2, ' ', false, ordered_json::error_handler_t::replace) + "\n";
}

std::string import_page(const films::ImportOptions& options, const films::ImportResult& result) {
  HtmlPage page(fmt::format("Import of {}", options.folder.string()));
  summary(page, result);
  if (!result.notes.empty()) {
    page.heading("What was left out, or isn't as it should be");
    page.raw(list_of(result.notes));
  }
  if (const auto lines = advice(result); !lines.empty()) {
    page.heading("What to do");
    page.raw(list_of(lines));
  }
  cameras(page, options, result);
  timeline(page, result);
  times(page, result);
  clocks(page, result);
  return page.str();
}

films::ImportReports reports_of(const films::ImportOptions& options, const films::ImportResult& result) {
  return {import_json(options, result), import_page(options, result)};
}

}  // namespace emberlock::report
