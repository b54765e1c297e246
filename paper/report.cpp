// SPDX-License-Identifier: Apache-2.0
#include "paper/report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>

#include <fmt/format.h>

#include "base/file.h"
#include "paper/baselines/algebraic_tomography/algebraic_tomography.h"
#include "paper/methods.h"
#include "paper/pictures.h"
#include "report/html.h"

namespace emberlock::paper {
namespace {

using report::Axis;
using report::HtmlPage;
using report::PlotOptions;
using report::sentence;
using report::Series;
using report::svg_plot_for_any_width;

std::string by_channel(const std::array<double, 3>& v, double scale = 1, int digits = 1) {
  return fmt::format("{:.{}f} / {:.{}f} / {:.{}f}", scale * v[0], digits, scale * v[1], digits, scale * v[2],
                     digits);
}
double mean_square(const std::array<double, 3>& v) {
  return std::sqrt((v[0] * v[0] + v[1] * v[1] + v[2] * v[2]) / 3);
}
std::string name_of_run(const MethodRun& run) {
  return run.device == "cpu" ? run.method : run.method + ", " + run.device;
}
bool of_protocol(const MethodRun& run, const Protocol& protocol) { return run.protocol == protocol.name; }

/// A run on the CPU that made something; null otherwise.
const MethodRun* find_run(const PaperEvaluation& e, std::string_view protocol, std::string_view method,
                          std::string_view of = {}) {
  for (const MethodRun& run : e.runs)
    if (run.protocol == protocol && run.method == method && run.device == "cpu" && run.failed.empty() &&
        (of.empty() || run.of == of))
      return &run;
  return nullptr;
}

/// How many times as large, by channel.
std::array<double, 3> times(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  std::array<double, 3> out{};
  for (std::size_t c = 0; c < 3; ++c) out[c] = b[c] > 0 ? a[c] / b[c] : 0;
  return out;
}

void add_runs(HtmlPage& page, const PaperEvaluation& e, const Protocol& protocol) {
  std::vector<std::string> header = {"case", "method", "input, R / G / B", "test", "volume, %", "seconds"};
  if (protocol.temperatures)
    header.insert(header.end(), {"temperature, median K", "95 %", "bias", "told, %"});
  std::vector<std::vector<std::string>> rows;
  for (const MethodRun& run : e.runs) {
    if (!of_protocol(run, protocol)) continue;
    if (!run.failed.empty()) {
      rows.push_back({run.of, name_of_run(run), "failed: " + run.failed});
      rows.back().resize(header.size());
      continue;
    }
    rows.push_back({run.of, name_of_run(run), by_channel(run.errors.input), by_channel(run.errors.test),
                    by_channel(run.errors.volume, 100, 0), fmt::format("{:.2f}", run.time.value())});
    if (!protocol.temperatures) continue;
    if (const auto& t = run.temperature) {
      for (const double kelvin : {t->median, t->most}) rows.back().push_back(fmt::format("{:.0f}", kelvin));
      rows.back().push_back(fmt::format("{:+.0f}", t->bias));
      rows.back().push_back(fmt::format("{:.0f}", 100 * t->told));
    }
    rows.back().resize(header.size());
  }
  page.table(header, rows);
  for (const MethodRun& run : e.runs)
    if (of_protocol(run, protocol) && !run.passes_failed.empty())
      page.paragraph(fmt::format("{}, {}: the curve ends early. {}", run.of, name_of_run(run),
                                 sentence(run.passes_failed)));
  for (const MethodRun& run : e.runs)
    if (of_protocol(run, protocol) && !run.chose.empty())
      page.paragraph(fmt::format("{}, {} chose: {}", run.of, name_of_run(run), sentence(run.chose)));
}

void add_printed(HtmlPage& page, const Protocol& protocol) {
  if (protocol.printed.empty()) return;
  std::vector<std::vector<std::string>> rows;
  for (const PrintedErrors& p : protocol.printed)
    rows.push_back({std::string(p.method), std::string(p.what), by_channel(p.rgb)});
  page.paragraph("What the paper prints, for its own scene:").table({"method", "of", "R / G / B"}, rows);
}

/// Errors of the test views against what `x` says of each run of a method, a line a channel.
template <class X>
std::vector<Series> channels(const std::vector<const MethodRun*>& runs, const std::string& method,
                             bool dashed, const X& x) {
  std::vector<Series> lines;
  for (std::size_t c = 0; c < 3; ++c) {
    Series line{method + ", " + std::string(1, "RGB"[c]), {}, {}};
    line.dashed = dashed;
    line.colour = std::array<std::size_t, 3>{1, 2, 0}[c];  // red, green, blue of the palette
    for (const MethodRun* run : runs) x(*run, c, line);
    lines.push_back(std::move(line));
  }
  return lines;
}

std::vector<const MethodRun*> runs_of(const PaperEvaluation& e, const Protocol& protocol,
                                      std::string_view method) {
  std::vector<const MethodRun*> runs;
  for (const MethodRun& run : e.runs)
    if (of_protocol(run, protocol) && run.method == method && run.device == "cpu" && run.failed.empty())
      runs.push_back(&run);
  return runs;
}

void add_passes_plots(HtmlPage& page, const PaperEvaluation& e, const Protocol& protocol) {
  for (const bool of_volume : {false, true}) {
    std::vector<Series> all;
    for (const std::string_view method : protocol.methods) {
      const auto lines =
          channels(runs_of(e, protocol, method), std::string(method), method == kPapersMethod,
                   [&](const MethodRun& run, std::size_t c, Series& line) {
                     for (const RunPoint& p : run.points) {
                       line.x.push_back(std::max(1e-3, p.time.value()));
                       line.y.push_back(of_volume ? 100 * p.errors.volume[c] : p.errors.test[c]);
                       line.notes.push_back(fmt::format("{} iterations", p.iteration));
                     }
                   });
      all.insert(all.end(), lines.begin(), lines.end());
    }
    PlotOptions plot;
    plot.title = of_volume ? "Volume data error" : "Pixel error of the test view";
    plot.x_label = "seconds";
    plot.y_label = of_volume ? "% of the truth's RMS" : "RMSE, grey levels";
    plot.x_axis = Axis::logarithmic;
    page.raw(svg_plot_for_any_width(all, plot));
  }
}

std::size_t inputs_of(const Protocol& protocol, const MethodRun& run) {
  for (const Case& of : protocol.cases)
    if (of.name == run.of)
      return static_cast<std::size_t>(
          std::count_if(of.cameras.begin(), of.cameras.end(),
                        [](const CameraPlace& place) { return place.role == recon::ViewRole::input; }));
  return 0;
}

void add_camera_plots(HtmlPage& page, const PaperEvaluation& e, const Protocol& protocol) {
  std::vector<Series> pixels;
  std::vector<Series> kelvin;
  for (const std::string_view method : protocol.methods) {
    const std::vector<const MethodRun*> runs = runs_of(e, protocol, method);
    const auto lines = channels(runs, std::string(method), method == kPapersMethod,
                                [&](const MethodRun& run, std::size_t c, Series& line) {
                                  line.x.push_back(static_cast<double>(inputs_of(protocol, run)));
                                  line.y.push_back(run.errors.test[c]);
                                });
    pixels.insert(pixels.end(), lines.begin(), lines.end());
    Series line{std::string(method) + ", median", {}, {}};
    for (const MethodRun* run : runs) {
      if (!run->temperature || !(run->temperature->told > 0)) continue;
      line.x.push_back(static_cast<double>(inputs_of(protocol, *run)));
      line.y.push_back(run->temperature->median);
    }
    if (!line.x.empty()) kelvin.push_back(std::move(line));
  }
  PlotOptions plot;
  plot.title = "Pixel error of the test view";
  plot.x_label = "input cameras";
  plot.y_label = "RMSE, grey levels";
  page.raw(svg_plot_for_any_width(pixels, plot));
  plot.title = "Temperature error";
  plot.y_label = "K";
  page.raw(svg_plot_for_any_width(kelvin, plot));
}

void add_methods(HtmlPage& page, const PaperEvaluation& e) {
  page.heading("The methods")
      .paragraph(
          "As the paper's table of methods, with the seconds that one frame takes here: ten cameras of which "
          "nine are the input, the same voxels. "
          "The paper prints 0.56 s for its own method on a GTX 850M, 0.91 s for Wu et al., more than 10 s "
          "for Zhou et al. and more than 60 s for all others.");
  std::vector<std::vector<std::string>> rows;
  for (const Method& method : methods()) {
    std::vector<std::string> row = {
        std::string(method.facts.name),
        std::string(method.facts.publication),
        method.facts.in_plane ? "yes" : "no",
        method.facts.projection == Projection::parallel ? "parallel" : "perspective",
        std::string(method.facts.model),
        method.facts.is_iterative ? "yes" : "no"};
    std::string cpu = "-";
    std::string gpu = "-";
    for (const MethodRun& run : e.runs)
      if (run.protocol == "nine-views" && run.method == method.facts.name && run.failed.empty())
        (run.device == "cpu" ? cpu : gpu) = fmt::format("{:.2f}", run.time.value());
    row.insert(row.end(), {cpu, gpu});
    rows.push_back(std::move(row));
  }
  page.table({"method", "publication", "in a plane", "projection", "light", "iterative", "CPU, s", "GPU, s"},
             rows);
}

void add_nine_views_words(const PaperEvaluation& e, const Case& of, std::vector<std::string>& words) {
  const auto found = [&](std::string_view method) { return find_run(e, "nine-views", method, of.name); };
  const MethodRun* ours = found(kDefaultMethod);
  for (const std::string_view other :
       {kConvergedAlgebraicTomographyFacts.name, kAlgebraicTomographyFacts.name, kPapersMethod})
    if (const MethodRun* run = found(other); run != nullptr && ours != nullptr)
      words.push_back(fmt::format("{}, the tenth view: {} errs {} times as much as emberlock (R / G / B)",
                                  of.name, other, by_channel(times(run->errors.test, ours->errors.test))));
  const MethodRun* algebraic = found(kConvergedAlgebraicTomographyFacts.name);
  const MethodRun* papers = found(kPapersMethod);
  if (algebraic != nullptr && papers != nullptr)
    words.push_back(fmt::format(
        "{}: converged algebraic tomography over the paper's method: {}; in the paper 4.5 / 6.0 / 9.6",
        of.name, by_channel(times(algebraic->errors.test, papers->errors.test))));
}

void add_cameras_words(const PaperEvaluation& e, const Protocol& protocol, std::vector<std::string>& words) {
  std::string line;
  for (const MethodRun* run : runs_of(e, protocol, kDefaultMethod))
    if (run->temperature)
      line += fmt::format("{}{} cameras {:.0f} K", line.empty() ? "" : ", ", inputs_of(protocol, *run),
                          run->temperature->median);
  if (!line.empty()) words.push_back("temperature, median error: " + line);
}

void add_smoke_words(const PaperEvaluation& e, const Protocol& protocol, std::vector<std::string>& words) {
  const MethodRun* ours = find_run(e, protocol.name, kDefaultMethod);
  for (const std::string_view method : protocol.methods)
    if (const MethodRun* run = find_run(e, protocol.name, method);
        ours != nullptr && run != nullptr && run != ours)
      words.push_back(fmt::format("smoke from three views, all views: {} {:.1f}, emberlock {:.1f}", method,
                                  mean_square(run->errors.all), mean_square(ours->errors.all)));
}

std::string optional_number(const std::optional<TemperatureErrors>& t) {
  return t ? fmt::format("{:.2f},{:.2f},{:.2f},{:.4f}", t->median, t->most, t->bias, t->told) : ",,,";
}

}  // namespace

std::string paper_csv(const PaperEvaluation& e) {
  std::string csv =
      "protocol,case,method,device,seconds,iterations,input_r,input_g,input_b,test_r,test_g,test_b,all_r,"
      "all_g,all_b,volume_r,volume_g,volume_b,median_k,95_k,bias_k,told,failed\n";
  for (const MethodRun& run : e.runs) {
    csv += fmt::format("{},{},{},{},", run.protocol, run.of, run.method, run.device);
    if (!run.failed.empty()) {
      csv += std::string(18, ',') + "yes\n";  // nothing was measured
      continue;
    }
    csv += fmt::format("{:.4f},{}", run.time.value(), run.iterations);
    for (const auto& v : {run.errors.input, run.errors.test, run.errors.all, run.errors.volume})
      csv += fmt::format(",{:.4f},{:.4f},{:.4f}", v[0], v[1], v[2]);
    csv += fmt::format(",{},\n", optional_number(run.temperature));
  }
  return csv;
}

std::vector<std::string> paper_words(const PaperEvaluation& e) {
  std::vector<std::string> words;
  for (const Protocol& protocol : e.protocols) {
    if (protocol.name == "nine-views")
      for (const Case& of : protocol.cases) add_nine_views_words(e, of, words);
    if (protocol.name == "cameras") add_cameras_words(e, protocol, words);
    if (protocol.name == "smoke") add_smoke_words(e, protocol, words);
  }
  return words;
}

std::string paper_html(const PaperEvaluation& e) {
  HtmlPage page("The paper's evaluation, on flames with known truth");
  page.paragraph(
      fmt::format("Every method has the same pictures: of a flame (and smoke) simulated on {0} x {0} x {0} "
                  "cells, 8 bits, linear. Every volume has {1} voxels along "
                  "its longest side, and is shown by the same renderer. Errors of pictures are root mean "
                  "squares over the box of the pixels that show the flame, grey "
                  "levels of 255; of the volume, root mean squares over all key points, in percent "
                  "of the truth's there. Times: {2}.",
                  *e.options.cells, *e.options.voxels, e.options.machine));
  if (e.options.extent == Extent::quick)
    page.paragraph(
        "This is the quick variant: small pictures, few voxels. It shows that all of it works, not how good "
        "it is.");
  for (const std::string& line : paper_words(e)) page.paragraph(sentence(line));
  for (const Protocol& protocol : e.protocols) {
    page.heading(protocol.title);
    page.paragraph(sentence("In the paper: " + std::string(protocol.paper)));
    page.paragraph("How the scenes differ: " + std::string(protocol.differs));
    add_runs(page, e, protocol);
    add_printed(page, protocol);
    if (!protocol.iterations.empty()) {
      add_passes_plots(page, e, protocol);
      page.gallery(pass_pictures(e, protocol));
    }
    if (protocol.cases.size() > 2) add_camera_plots(page, e, protocol);
    if (protocol.temperatures) page.gallery(slice_pictures(e, protocol));
    if (protocol.iterations.empty()) page.gallery(method_pictures(e, protocol));
  }
  add_methods(page, e);
  return page.str();
}

Status write_paper_report(const PaperEvaluation& e, const OutputRequest& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "runs.csv", paper_csv(e)));
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "index.html", paper_html(e)));
  return staging.commit();
}

}  // namespace emberlock::paper
