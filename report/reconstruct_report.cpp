// SPDX-License-Identifier: Apache-2.0
#include "report/reconstruct_report.h"

#include <algorithm>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "recon/adjust/picture_error.h"
#include "recon/export/picture.h"
#include "recon/pipeline/advice.h"
#include "recon/preprocess/radiance.h"
#include "recon/views/flame_mask.h"
#include "report/camera_plan.h"
#include "report/flame_pictures.h"
#include "report/html.h"
#include "report/measured_pictures.h"
#include "report/volume_axes.h"
#include "report/volume_pictures.h"
#include "report/volume_view.h"

namespace emberlock::report {
namespace {

constexpr double kDifferenceGainShown = 4;
// At most so large, in pixels: what is tall would make a long page.
constexpr ImageSize kViewSize{300, 400};
constexpr ImageSize kVolumeSize{256, 400};

constexpr const char* kPageStyle = R"(<style>
.three { display: grid; grid-template-columns: repeat(3, minmax(0, 1fr)); gap: .4rem; max-width: 58rem;
  margin: .2rem 0 1.2rem; } .three img { width: 100%; display: block;
  max-height: 26rem; object-fit: contain; object-position: left bottom; } .three figcaption { width: auto; }
.words td:last-child { text-align: left; min-width: 14rem; } .words td { vertical-align: top; }
@media (max-width: 700px) { .words, .words tbody { display: block; } .words tr { display: flex; flex-wrap: wrap; }
  .words th, .words td { flex: 1 0 3rem; } .words th:last-child { display: none; } .words td:last-child {
  flex-basis: 100%; } }
</style>)";

std::string rgb_text(const recon::ChannelRmse& e) {
  return fmt::format("{:.2f} / {:.2f} / {:.2f}", e[0], e[1], e[2]);
}

const char* caption(recon::ViewRole role) {
  if (role == recon::ViewRole::input) return ", captured";
  return role == recon::ViewRole::held_out ? ", captured (held out)" : ", captured (left out)";
}

bool is_held_out(const recon::View& view) { return view.role == recon::ViewRole::held_out; }

void what_came_out(HtmlPage& page, const recon::Report& r) {
  page.heading("What came out");
  std::vector<std::vector<std::string>> rows;
  if (r.heldout_rmse) rows.push_back({"held-out error, R / G / B of 255", rgb_text(*r.heldout_rmse)});
  rows.push_back({"input error, R / G / B of 255", rgb_text(r.input_rmse)});
  rows.push_back(
      {"volume", fmt::format("{} x {} x {} voxels of {:.2f} mm, {} in the hull", r.voxels[0], r.voxels[1],
                             r.voxels[2], 1e3 * r.voxel_edge.value(), r.hull_voxels)});
  rows.push_back({"time", fmt::format("{:.2f} s: effects {:.2f}, hull {:.2f}, solve {:.2f}, rendering {:.2f}",
                                      r.total_time.value(), r.effects_time.value(), r.hull_time.value(),
                                      r.solve_time.value(), r.render_time.value())});
  rows.push_back({"solver", fmt::format("{}, {} iterations, on {}", r.solver, r.iterations, r.device)});
  rows.push_back({"made from", r.input});
  page.table({"", ""}, rows);
  for (const std::string& warning : r.warnings) page.paragraph("Warning: " + warning + ".");
  if (r.stopped) page.paragraph("The run was ended early, as asked: this is the best until then.");
  if (const std::string kept = recon::what_was_kept(r); !kept.empty()) page.paragraph("Kept: " + kept + ".");
  if (r.plan)
    for (const std::string& words : r.plan->words) page.paragraph("Plan: " + words + ".");
  for (const std::string& words : r.voxel_choice.words) page.paragraph("Voxels: " + words + ".");
  for (const std::string& advice : recon::next_steps(r)) page.paragraph("Next step: " + advice + ".");
}

/// Small and for display alone: the result's folder has views/NNNN.png.
std::string jpeg_uri(const Image& image) {
  const auto bytes = recon::to_jpeg(image.view());
  return bytes ? data_uri("image/jpeg", *bytes) : png_data_uri(image);
}

void views(HtmlPage& page, const recon::Scene& scene, const recon::Outcome& outcome) {
  page.heading("Captured, rendered, difference");
  page.paragraph(
      fmt::format("Views that were held out come first: the solver never fitted them. Errors are RMS over "
                  "the flame, R / G / "
                  "B in grey levels of 255. Differences are shown {:g} times as bright.",
                  kDifferenceGainShown));
  std::vector<std::size_t> order(scene.views.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  std::stable_partition(order.begin(), order.end(),
                        [&](std::size_t i) { return is_held_out(scene.views[i]); });
  for (const std::size_t i : order) {
    const recon::View& view = scene.views[i];
    const recon::PixelBox box = with_margin(recon::noise_mask(*view.image).box, 12, view.image->size);
    const auto panel = [&](const recon::RadianceImage& image) {
      return jpeg_uri(scaled_into(crop(recon::to_rgb8(image), box), kViewSize));
    };
    const std::string name = fmt::format("{}: {}", i, view.name);
    page.raw("<div class=\"three\">" +
             figure(panel(*view.image), "captured", name + caption(outcome.report.views[i].role)) +
             figure(panel(outcome.renders[i]), "rendered", "rendered from the volume") +
             figure(panel(difference(*view.image, outcome.renders[i], kDifferenceGainShown)), "difference",
                    "difference, " + rgb_text(outcome.report.views[i].rmse)) +
             "</div>");
  }
}

/// As large as its pixels allow, which stay square.
std::string volume_figure(const Image& picture, const std::string& caption) {
  return figure(png_data_uri(enlarged(picture, kVolumeSize)), caption, caption);
}

void the_volume(HtmlPage& page, const recon::Scene& scene, const recon::Volume& volume,
                const ShownAxes& axes) {
  const SmallVolume small = small_volume(volume);
  page.heading("The volume");
  const Eigen::Vector3d from =
      scene.views.empty() ? Eigen::Vector3d(1, 0, 0) : scene.views.front().camera.center() - scene.box.center;
  page.raw(volume_view_html(small, axes, from));
  page.paragraph(fmt::format(
      "The light of {} x {} x {} points, 8 bits each by square root, {:.1f} mm apart; the whole volume is in "
      "volume.vdb.",
      small.points[0], small.points[1], small.points[2], 1e3 * small.edge));
  const std::string names[] = {"x", "y", "z"};
  std::string slices = "<div class=\"three\">";
  std::string sums = slices;
  for (const int along : {axes.across, axes.away, axes.up}) {
    const std::string& name = names[along];
    slices += volume_figure(volume_picture(small, axes, along, Across::slice),
                            "slice through the middle, across " + name);
    sums += volume_figure(volume_picture(small, axes, along, Across::projection), "all light along " + name);
  }
  page.raw(slices + "</div>" + sums + "</div>");
  std::string heights = "<div class=\"three\">";
  for (int n = 0; n < 6; ++n) {
    const double share = (n + 0.5) / 6;
    heights +=
        volume_figure(volume_picture(small, axes, axes.up, Across::slice, axes.sign > 0 ? share : 1 - share),
                      fmt::format("{:.0f} % of the height, from above", 100 * share));
  }
  page.raw(heights + "</div>");
  page.paragraph(
      fmt::format("In slices white is the brightest light, {:.3g} grey levels a centimetre; where all "
                  "light along an axis is shown, it is 255 grey levels.",
                  small.brightest / 100));
}

void effects(HtmlPage& page, const recon::Report& r) {
  page.heading("Effects");
  page.paragraph(
      "What light does on its way, each used only if it pays: by how much it changes the pictures, what "
      "finding "
      "that out took and what it adds to rendering the views once.");
  std::string html =
      "<div class=\"scroll\"><table class=\"words\"><tr><th>effect</th><th></th><th>grey "
      "levels</th><th>found in "
      "(s)</th><th>adds (s)</th><th style=\"text-align:left\">why</th>";
  for (const recon::EffectReport& e : r.effects)
    html +=
        fmt::format("</tr>\n<tr><td>{}</td><td>{}</td><td>{:.2f}</td><td>{:.2f}</td><td>{}</td><td>{}</td>",
                    html_escape(e.name), e.on ? "<b>on</b>" : "off", e.predicted_change, e.seconds.value(),
                    e.cost.value() > 0 ? fmt::format("{:.2g}", e.cost.value()) : "", html_escape(e.reason));
  page.raw(html + "</tr></table></div>");
  for (const recon::PreprocessStep& step : r.preprocessing)
    if (step.on) page.paragraph("Before it, " + step.name + ": " + step.reason + ".");
  if (!r.deviations.empty())
    page.paragraph(fmt::format("Not the paper's: {}.", fmt::join(r.deviations, "; ")));
}

void error_against_time(HtmlPage& page, const recon::Report& r) {
  page.heading("Error against time");
  std::vector<Series> series;
  const auto add = [&](const char* name, auto error, std::size_t colour) {
    Series kept{name, {}, {}};
    kept.colour = colour;
    for (const recon::TracePoint& p : r.trace) {
      kept.x.push_back(p.time.value());
      kept.y.push_back(recon::all_channels(error(p)));
    }
    series.push_back(kept);
    if (r.discarded.empty()) return;
    Series later{std::string(name) + ", not kept", {kept.x.back()}, {kept.y.back()}, true};
    later.colour = colour;
    for (const recon::TracePoint& p : r.discarded) {
      later.x.push_back(p.time.value());
      later.y.push_back(recon::all_channels(error(p)));
    }
    series.push_back(later);
  };
  if (r.heldout_rmse)
    add(
        "held out", [](const recon::TracePoint& p) { return p.heldout_rmse; }, 0);
  add(
      "input", [](const recon::TracePoint& p) { return p.input_rmse; }, 1);
  PlotOptions options{
      .title = "RMS error over the flame", .x_label = "seconds", .y_label = "grey levels of 255"};
  options.y_axis = Axis::logarithmic;
  if (!r.trace.empty()) options.mark = r.trace.back().time.value();
  page.raw(svg_plot_for_any_width(series, options));
  page.paragraph(
      fmt::format("The finest level alone, iteration by iteration; the green bar marks the iteration "
                  "that was kept, {} of {}.",
                  r.kept.iteration, r.iterations));
}

std::vector<PlanCamera> plan_cameras(const recon::Scene& scene) {
  std::vector<PlanCamera> cameras;
  for (const recon::View& view : scene.views)
    cameras.push_back(plan_camera(view.name, view.camera, view.role));
  return cameras;
}

}  // namespace

std::string reconstruct_html(const recon::Scene& scene, const recon::Outcome& outcome) {
  const recon::Report& r = outcome.report;
  HtmlPage page("Emberlock: reconstruction of " + r.input);
  page.raw(kPageStyle);
  const ShownAxes axes = shown_axes(scene.views);
  what_came_out(page, r);
  the_volume(page, scene, outcome.reconstruction.volume, axes);
  page.raw(temperature_html(outcome, axes));
  page.raw(errors_html(outcome, axes));
  views(page, scene, outcome);
  error_against_time(page, r);
  effects(page, r);
  add_camera_plan(page, plan_cameras(scene), scene.box);
  return page.str();
}

}  // namespace emberlock::report
