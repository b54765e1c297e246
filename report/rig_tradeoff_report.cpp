// SPDX-License-Identifier: Apache-2.0
#include "report/rig_tradeoff_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/file.h"
#include "evaluate/sync_tradeoff.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

using evaluate::RigAxis;
using evaluate::RigPoint;
using evaluate::RigSetup;
using evaluate::RigTradeoff;

const char* source(const RigPoint& p) {
  return p.source == RigPoint::Source::simulated ? "simulated" : "joined";
}

std::string minutes_text(double minutes) { return evaluate::time_text(60 * minutes); }

double align_minutes(const RigTradeoff& t, const RigSetup& setup) {
  return t.grid.align_minutes[setup.at(RigAxis::cameras)][setup.at(RigAxis::tolerance)];
}

/// "3.91 grey levels, 360 EUR, 2.3 min (alignment 3.0 s, 0.56 s a frame)"
std::string result_text(const RigTradeoff& t, const RigPoint& p) {
  return fmt::format("{:.2f} grey levels for {:g} EUR in {} (alignment {}, {:.2f} s a frame)", p.frame.error,
                     p.euros, minutes_text(p.minutes), minutes_text(align_minutes(t, p.setup)),
                     p.frame.seconds());
}

std::string verdict(const RigTradeoff& t) {
  const RigPoint& p = t.points[t.chosen.value_or(t.best)];
  const std::string words =
      t.chosen ? fmt::format("The cheapest set-up that reaches {:.2f} grey levels", *t.options.target)
               : fmt::format("No set-up reaches {:.2f} grey levels. The most accurate", *t.options.target);
  return fmt::format("{}: {}. Simulated: {}.", words, setup_text(t.options, p.setup), result_text(t, p));
}

struct Deviation {
  double rms = 0, worst = 0;  ///< of predicted / simulated - 1
};

Deviation deviation(const RigTradeoff& t, double (*of)(const evaluate::RigFrame&)) {
  Deviation d;
  for (const evaluate::RigCheck& check : t.checks) {
    const double off = std::abs(of(check.predicted) / of(check.simulated) - 1);
    d.rms += off * off / static_cast<double>(t.checks.size());
    d.worst = std::max(d.worst, off);
  }
  d.rms = std::sqrt(d.rms);
  return d;
}

std::string trust(const RigTradeoff& t) {
  if (t.checks.empty()) return "All set-ups that count lie on the axes, so nothing was joined.";
  const Deviation error = deviation(t, [](const evaluate::RigFrame& f) { return f.error; });
  const Deviation seconds = deviation(t, [](const evaluate::RigFrame& f) { return f.seconds(); });
  return fmt::format(
      "{} of {} set-ups were simulated, the others joined from those along the axes. {} joint set-ups were "
      "joined and simulated: joined errors were off by {:.0f} % (RMS; worst {:.0f} %), seconds by {:.0f} % "
      "(worst {:.0f} %).",
      t.frames.size(), t.points.size(), t.checks.size(), 100 * error.rms, 100 * error.worst,
      100 * seconds.rms, 100 * seconds.worst);
}

/// "0.84 a minute", or for no minutes more "free"
std::string rate(const evaluate::RigStep& step) {
  if (step.euros > 0) return fmt::format("{:.2f} per 100 EUR", 100 * step.gain / step.euros);
  if (step.minutes > 0) return fmt::format("{:.2f} a minute", step.gain / step.minutes);
  return "free";
}

std::string step_text(const RigTradeoff& t, const evaluate::RigStep& step) {
  return choice_text(t.options, step.axis, t.points[step.to].setup.at(step.axis));
}

/// Curves of least error within so many minutes, one for each number of cameras.
std::string plot(const RigTradeoff& t) {
  std::vector<Series> series;
  for (std::size_t c = 0; c < t.options.cameras.size(); ++c) {
    std::vector<RigPoint> same;
    std::copy_if(t.points.begin(), t.points.end(), std::back_inserter(same),
                 [&](const RigPoint& p) { return p.setup.at(RigAxis::cameras) == c; });
    Series s{fmt::format("{} cameras, {:g} EUR", t.options.cameras[c], t.grid.euros[c]), {}, {}, false};
    for (const std::size_t i : evaluate::pareto_front(same)) {
      s.x.push_back(same[i].minutes);
      s.y.push_back(same[i].frame.error);
      s.notes.push_back(fmt::format("{}\n{}, {}", setup_text(t.options, same[i].setup),
                                    result_text(t, same[i]), source(same[i])));
    }
    series.push_back(std::move(s));
  }
  const auto marked = [&](const char* words, const std::vector<std::size_t>& points) {
    Series s{words, {}, {}, false, Mark::points};
    for (const std::size_t i : points) {
      s.x.push_back(t.points[i].minutes);
      s.y.push_back(t.points[i].frame.error);
      s.notes.push_back(fmt::format("{}\n{}, {}", setup_text(t.options, t.points[i].setup),
                                    result_text(t, t.points[i]), source(t.points[i])));
    }
    series.push_back(std::move(s));
  };
  marked("Pareto front of all", t.front);
  Series target{fmt::format("target, {:.2f}", *t.options.target), {}, {}, true};
  for (const std::size_t i : {t.front.front(), t.front.back()}) {
    target.x.push_back(t.points[i].minutes);
    target.y.push_back(*t.options.target);
  }
  series.push_back(std::move(target));
  PlotOptions options{.title = "What accuracy costs, the cameras aligned and all frames reconstructed",
                      .x_label = "minutes",
                      .y_label = "held-out RMS error, grey levels",
                      .x_axis = Axis::logarithmic,
                      .y_axis = Axis::logarithmic,
                      .width = 1100,
                      .height = 460};
  if (t.chosen) options.mark = t.points[*t.chosen].minutes;
  return svg_plot_for_any_width(series, options);
}

/// For narrow pages: breaks after commas alone.
std::string setup_cell(const RigTradeoff& t, const RigSetup& setup) {
  std::string cell;
  for (const char c : setup_text(t.options, setup))
    cell += c == ' ' && !cell.ends_with(',') ? "\u00a0" : std::string(1, c);
  return cell;
}

void steps_table(HtmlPage& page, const RigTradeoff& t) {
  if (t.steps.empty()) {
    page.paragraph("No single step from there lowers the error.");
    return;
  }
  std::vector<std::vector<std::string>> rows;
  for (const evaluate::RigStep& step : t.steps)
    rows.push_back({step_text(t, step), fmt::format("-{:.2f}", step.gain), rate(step),
                    fmt::format("{:+.2f}", step.minutes), fmt::format("{:+g}", step.euros),
                    fmt::format("{:.2f}", t.points[step.to].frame.error), source(t.points[step.to])});
  page.table({"change to", "error", "buys", "minutes", "euros", "leads to", ""}, rows);
}

void front_table(HtmlPage& page, const RigTradeoff& t) {
  std::vector<std::vector<std::string>> rows;
  for (const std::size_t i : t.front) {
    const RigPoint& p = t.points[i];
    rows.push_back({setup_cell(t, p.setup) + (t.chosen == i ? "  \u2190 chosen" : ""),
                    fmt::format("{:.2f}", p.frame.error), minutes_text(p.minutes),
                    minutes_text(align_minutes(t, p.setup)), fmt::format("{:.2f}", p.frame.seconds()),
                    fmt::format("{:g}", p.euros), source(p)});
  }
  page.table({"set-up", "error", "time", "alignment", "s a frame", "euros", ""}, rows);
}

void checks_table(HtmlPage& page, const RigTradeoff& t) {
  std::vector<std::vector<std::string>> rows;
  for (const evaluate::RigCheck& c : t.checks)
    rows.push_back({setup_cell(t, c.setup), fmt::format("{:.2f}", c.predicted.error),
                    fmt::format("{:.2f}", c.simulated.error),
                    fmt::format("{:+.0f}\u00a0%", 100 * (c.predicted.error / c.simulated.error - 1)),
                    fmt::format("{:.2f}", c.predicted.seconds()),
                    fmt::format("{:.2f}", c.simulated.seconds())});
  if (!rows.empty())
    page.table({"set-up", "error joined", "simulated", "off by", "s a frame joined", "simulated"}, rows);
}

void axes_table(HtmlPage& page, const RigTradeoff& t) {
  const evaluate::RigFrame& base = t.frames.at(t.grid.base);
  page.paragraph(fmt::format("The base: {}.", setup_text(t.options, t.grid.base)));
  std::vector<std::vector<std::string>> rows;
  for (const RigSetup& setup : along_axes(t.grid)) {
    const auto axis = std::find_if(evaluate::kAllRigAxes.begin(), evaluate::kAllRigAxes.end(),
                                   [&](RigAxis a) { return setup.at(a) != t.grid.base.at(a); });
    const evaluate::RigFrame& frame = t.frames.at(setup);
    rows.push_back({setup == t.grid.base ? "the base" : choice_text(t.options, *axis, setup.at(*axis)),
                    fmt::format("{:.2f}", frame.error),
                    fmt::format("{:+.0f}\u00a0%", 100 * (frame.error / base.error - 1)),
                    fmt::format("{:.2f}", frame.seconds())});
  }
  page.table({"one choice changed", "error", "", "s a frame"}, rows);
}

void alignment_table(HtmlPage& page, const RigTradeoff& t) {
  std::vector<std::string> header{"cameras"};
  for (std::size_t i = 0; i < t.options.tolerances.size(); ++i)
    header.push_back(choice_text(t.options, RigAxis::tolerance, i));
  std::vector<std::vector<std::string>> rows;
  for (std::size_t c = 0; c < t.options.cameras.size(); ++c) {
    rows.push_back({fmt::format("{}, {:g} EUR", t.options.cameras[c], t.grid.euros[c])});
    for (const double minutes : t.grid.align_minutes[c])
      rows.back().push_back(std::isfinite(minutes) ? minutes_text(minutes) : "not reached");
  }
  page.table(header, rows);
}

std::string method(const RigTradeoff& t) {
  const evaluate::RigTradeoffOptions& o = t.options;
  std::string policies;
  for (const smear::AlignPolicy policy : o.policies)
    policies += (policies.empty() ? "" : ", ") + std::string(name(policy));
  std::string words = fmt::format(
      "Simulated: a flame {:g} m high that rises at {:g} m/s, drawn by seed {}, on a ring of cameras that "
      "stand farther away the larger it is; exposures as means over their time; each camera late or early by "
      "its draw within the tolerance. One more view, in time, sharp and without noise, judges every set-up. "
      "Minutes: {} alignments for each number of cameras and tolerance, by {}, {:g} s a reset by hand; and "
      "{} frames' reconstruction on this machine. ",
      o.flame_size.value(), o.flame_speed, o.seed, o.rigs, policies, o.reset_time.value(), o.frames);
  words += fmt::format(
      "Assumed, not measured: {:g} EUR a camera (--camera-price), whatever its pictures' size; noise of {:g} "
      "grey levels at 4 ms (--noise), falling with the root of the exposure. ",
      o.camera_price, o.noise);
  if (std::find(o.devices.begin(), o.devices.end(), recon::Device::cuda) == o.devices.end())
    words += "No GPU was measured here. ";
  return words +
         "Joined: squares of the errors that each choice adds to the base's add up, and ratios of its "
         "seconds "
         "multiply.";
}

nlohmann::ordered_json setup_json(const RigTradeoff& t, const RigSetup& setup) {
  const evaluate::RigTradeoffOptions& o = t.options;
  return {{"cameras", o.cameras[setup.at(RigAxis::cameras)]},
          {"size", choice_text(o, RigAxis::image, setup.at(RigAxis::image))},
          {"voxels", o.voxels[setup.at(RigAxis::voxels)]},
          {"effects", o.effects[setup.at(RigAxis::effects)]},
          {"exposure_ms", in_milliseconds(o.exposures[setup.at(RigAxis::exposure)])},
          {"tolerance_ms", in_milliseconds(o.tolerances[setup.at(RigAxis::tolerance)])},
          {"device", choice_text(o, RigAxis::device, setup.at(RigAxis::device))}};
}

nlohmann::ordered_json point_json(const RigTradeoff& t, const RigPoint& p) {
  nlohmann::ordered_json json = setup_json(t, p.setup);
  json["error"] = p.frame.error;
  json["minutes"] = p.minutes;
  json["euros"] = p.euros;
  json["align_minutes"] = align_minutes(t, p.setup);
  json["frame_seconds"] = p.frame.seconds();
  json["source"] = source(p);
  return json;
}

}  // namespace

std::string rig_tradeoff_summary(const RigTradeoff& t) {
  std::string words = verdict(t) + "\n";
  for (const evaluate::RigStep& step : t.steps)
    words += fmt::format("  {:<24} error -{:.2f} ({}), {:+.2f} min, {:+g} EUR{}\n", step_text(t, step),
                         step.gain, rate(step), step.minutes, step.euros,
                         t.points[step.to].source == RigPoint::Source::joined ? " (joined)" : "");
  if (t.steps.empty()) words += "  No single step from there lowers the error.\n";
  return words + trust(t) + "\n";
}

std::string rig_tradeoff_csv(const RigTradeoff& t) {
  std::string csv =
      "cameras,size,voxels,effects,exposure_ms,tolerance_ms,device,heldout_rmse,minutes,euros,align_minutes,"
      "frame_seconds,source,front\n";
  std::vector<bool> on_front(t.points.size());
  for (const std::size_t i : t.front) on_front[i] = true;
  for (std::size_t i = 0; i < t.points.size(); ++i) {
    const RigPoint& p = t.points[i];
    const nlohmann::ordered_json s = setup_json(t, p.setup);
    csv +=
        fmt::format("{},{},{},\"{}\",{:g},{:g},{},{:.4f},{:.4f},{:g},{:.4f},{:.4f},{},{}\n",
                    s["cameras"].get<int>(), s["size"].get<std::string>(), s["voxels"].get<int>(),
                    s["effects"].get<std::string>(), s["exposure_ms"].get<double>(),
                    s["tolerance_ms"].get<double>(), s["device"].get<std::string>(), p.frame.error, p.minutes,
                    p.euros, align_minutes(t, p.setup), p.frame.seconds(), source(p), on_front[i] ? 1 : 0);
  }
  return csv;
}

nlohmann::ordered_json rig_tradeoff_json(const RigTradeoff& t) {
  nlohmann::ordered_json json{{"flame_speed_m_s", t.options.flame_speed},
                              {"flame_size_m", t.options.flame_size.value()},
                              {"frames", t.options.frames},
                              {"camera_price_eur", t.options.camera_price},
                              {"target", *t.options.target},
                              {"points", t.points.size()}};
  json["chosen"] = t.chosen ? point_json(t, t.points[*t.chosen]) : nullptr;
  json["best"] = point_json(t, t.points[t.best]);
  json["steps"] = nlohmann::ordered_json::array();
  for (const evaluate::RigStep& step : t.steps)
    json["steps"].push_back({{"axis", name(step.axis)},
                             {"gain", step.gain},
                             {"minutes", step.minutes},
                             {"euros", step.euros},
                             {"to", point_json(t, t.points[step.to])}});
  json["front"] = nlohmann::ordered_json::array();
  for (const std::size_t i : t.front) json["front"].push_back(point_json(t, t.points[i]));
  json["simulated"] = nlohmann::ordered_json::array();
  for (const auto& [setup, frame] : t.frames) {
    nlohmann::ordered_json one = setup_json(t, setup);
    one["error"] = frame.error;
    one["frame_seconds"] = frame.seconds();
    json["simulated"].push_back(std::move(one));
  }
  json["checks"] = nlohmann::ordered_json::array();
  for (const evaluate::RigCheck& c : t.checks)
    json["checks"].push_back({{"setup", setup_json(t, c.setup)},
                              {"joined_error", c.predicted.error},
                              {"simulated_error", c.simulated.error},
                              {"joined_seconds", c.predicted.seconds()},
                              {"simulated_seconds", c.simulated.seconds()}});
  return json;
}

std::string rig_tradeoff_html(const RigTradeoff& t) {
  HtmlPage page(fmt::format("Emberlock: what a flame of {:g} m at {:g} m/s costs",
                            t.options.flame_size.value(), t.options.flame_speed));
  page.raw("<p style=\"font-size:1.25rem\">" + html_escape(verdict(t)) + "</p>");
  page.paragraph(trust(t));
  page.raw("<div class=\"scroll\">" + plot(t) + "</div>");
  page.paragraph(
      "Each line: the least error within so many minutes by so many cameras. Point at a mark for its "
      "set-up.");
  page.heading("What the next euro or minute buys");
  steps_table(page, t);
  page.heading("The Pareto front");
  front_table(page, t);
  page.heading("How far joining is off");
  checks_table(page, t);
  page.heading("What was simulated along the axes");
  axes_table(page, t);
  page.heading("Time of alignment");
  alignment_table(page, t);
  page.heading("How it was made");
  page.paragraph(method(t));
  page.paragraph(fmt::format("This page took {}.", evaluate::time_text(t.took.value())));
  return page.str();
}

Status write_rig_tradeoff(const RigTradeoff& t, const OutputRequest& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "points.csv", rig_tradeoff_csv(t)));
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(staging.path() / "rig.json", rig_tradeoff_json(t).dump(1) + "\n"));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "index.html", rig_tradeoff_html(t)));
  return staging.commit();
}

}  // namespace emberlock::report
