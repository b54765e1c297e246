// SPDX-License-Identifier: Apache-2.0
#include "report/demo_report.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "base/file.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/advice.h"
#include "recon/preprocess/radiance.h"
#include "recon/views/flame_mask.h"
#include "report/flame_pictures.h"
#include "report/html.h"
#include "report/smear_strip.h"

namespace emberlock::report {
namespace {

constexpr double kDifferenceGain = 4;
constexpr int kShownViews = 3;
constexpr int kPanelWidth = 300;  // pixels

std::string rgb(const recon::ChannelRmse& e) {
  return fmt::format("{:.2f} / {:.2f} / {:.2f}", e[0], e[1], e[2]);
}
std::string rgb(const std::optional<recon::ChannelRmse>& e) { return e ? rgb(*e) : "none held out"; }

/// The largest error of a measured row time compared with the rig's true one.
Seconds worst_row_time_error(const rig::DemoResult& r) {
  double worst = 0;
  for (std::size_t i = 0; i < r.row_clocks.size(); ++i) {
    worst = std::max(worst, std::abs((r.row_clocks[i].row_time - r.true_row_times[i]).value()));
  }
  return Seconds(worst);
}

std::uint64_t recorded(const v1::Manifest& session) {
  std::uint64_t frames = 0;
  for (const auto& camera : session.cameras()) frames += camera.counts().recorded();
  return frames;
}

void headline(HtmlPage& page, const rig::DemoResult& r) {
  const rig::AlignStage& by_hand = r.stages.front();
  const rig::AlignStage& timed = r.stages.back();
  const recon::Report& report = r.outcome.report;
  page.heading("What came out");
  page.table({"", ""}, {{"held-out error, R / G / B of 255", rgb(report.heldout_rmse)},
                        {"the paper's solver on the same pictures", rgb(r.paper.report.heldout_rmse)},
                        {"row time, worst of all cameras against the truth",
                         fmt::format("{:.3f} us, {:.1f} ns off", r.row_clocks[0].row_time.value() * 1e6,
                                     worst_row_time_error(r).value() * 1e9)},
                        {fmt::format("resets until {} cameras were within 100 rows", r.options.cameras),
                         fmt::format("{} in {} rounds", by_hand.result.resets, by_hand.errors.size())},
                        {"timed resets from there to within 10 rows",
                         fmt::format("{} in {} rounds", timed.result.resets, timed.errors.size())},
                        {"worst pair then, measured / true",
                         fmt::format("{:.3f} / {:.3f} ms",
                                     in_milliseconds(timed.result.last.worst_pair.value_or(Seconds(NAN))),
                                     in_milliseconds(r.true_worst_pair))},
                        {"flame frames recorded",
                         fmt::format("{} from {} cameras", recorded(r.flame_session), r.options.cameras)},
                        {"reconstruction", fmt::format("{:.2f} s: effects {:.2f}, hull {:.2f}, solve {:.2f}",
                                                       report.total_time.value(), report.effects_time.value(),
                                                       report.hull_time.value(), report.solve_time.value())},
                        {"whole demonstration", fmt::format("{:.0f} s", r.total_seconds.value())}});
}

void strips(HtmlPage& page, const rig::SmearSnapshot& shot, const rig::AlignStage& stage) {
  std::vector<HtmlPage::Picture> pictures;
  for (std::size_t i = 0; i < shot.cameras.size(); ++i) {
    const auto& camera = shot.cameras[i];
    std::vector<RowSpan> band;
    if (shot.target_tau && camera.reading.lamp) {
      band =
          tolerance_band(stage.result.timing[i], camera.reading.lamp->y, *shot.target_tau, stage.tolerance);
    }
    const std::string error =
        camera.error ? fmt::format("{:+.1f} rows", camera.error->value()) : "not known yet";
    pictures.push_back({smear_strip_svg(camera.frame.image->view(), camera.reading, band),
                        camera.id + ": " + error + " (" + std::string(name(camera.phase.state)) + ")"});
  }
  page.gallery(pictures);
}

void alignment(HtmlPage& page, const rig::DemoResult& r) {
  page.heading("Before: shutters as they happened to start");
  page.paragraph(
      "The lamp's column in one frame of each camera, contrast stretched. Blue circle: the lamp. Orange "
      "ticks: the smear dot "
      "of one flash. Its distance from the lamp, times the row time, is the shutter's phase. Green: where "
      "the dot must "
      "lie to be within 100 rows of their common target.");
  strips(page, r.stages.front().first, r.stages.front());
  page.heading("After: within 10 rows");
  strips(page, r.stages.back().last, r.stages.back());
  page.heading("Offsets, round by round");
  for (const rig::AlignStage& stage : r.stages) {
    std::vector<Series> series;
    for (std::size_t camera = 0; camera < stage.last.cameras.size(); ++camera) {
      Series s{stage.last.cameras[camera].id, {}, {}};
      for (std::size_t round = 0; round < stage.errors.size(); ++round) {
        s.x.push_back(static_cast<double>(round + 1));
        s.y.push_back(stage.errors[round][camera].value_or(Rows(NAN)).value());
      }
      series.push_back(std::move(s));
    }
    page.raw(svg_plot(series, {.title = stage.title,
                               .x_label = "round",
                               .y_label = "rows from the target",
                               .band = stage.tolerance.value()}));
    page.paragraph(fmt::format("{}: {} resets, {:.1f} s. {}", stage.title, stage.result.resets,
                               stage.seconds.value(), stage.result.words.reason));
  }
}

/// Captured, rendered, and their difference, cropped to the flame.
std::vector<Image> triptych(const recon::View& view, const recon::RadianceImage& rendered) {
  const recon::FlameMask mask = recon::noise_mask(*view.image);
  const recon::PixelBox box = with_margin(mask.box, 12, view.image->size);
  const auto panel = [&](const recon::RadianceImage& image) {
    return scaled(crop(recon::to_rgb8(image), box), kPanelWidth);
  };
  return {panel(*view.image), panel(rendered), panel(difference(*view.image, rendered, kDifferenceGain))};
}

void pictures(HtmlPage& page, const rig::DemoResult& r) {
  page.heading("Captured, rendered, difference");
  page.paragraph(fmt::format(
      "The first row is the camera that was held out: the solver never saw it. Differences are shown {:g} "
      "times as bright.",
      kDifferenceGain));
  std::vector<std::size_t> shown{static_cast<std::size_t>(r.held_out)};
  for (std::size_t i = 0; i < r.scene.views.size() && shown.size() < kShownViews; i += 4) {
    if (i != shown[0]) shown.push_back(i);
  }
  for (const std::size_t i : shown) {
    const recon::View& view = r.scene.views[i];
    const recon::ViewReport& report = r.outcome.report.views[i];
    const std::string role = view.role == recon::ViewRole::held_out ? "held out" : "input";
    const auto images = triptych(view, r.outcome.renders[i]);
    std::vector<HtmlPage::Picture> row;
    const std::vector<std::string> captions{view.name + ", captured (" + role + ")",
                                            "rendered from the volume",
                                            "difference, RMS " + rgb(report.rmse)};
    for (std::size_t k = 0; k < images.size(); ++k) {
      row.push_back({"<img src=\"" + png_data_uri(images[k]) + "\" alt=\"\">", captions[k]});
    }
    page.gallery(row);
  }
}

void error_plot(HtmlPage& page, const rig::DemoResult& r) {
  page.heading("Error against time");
  std::vector<Series> series;
  for (const auto& [outcome, solver] : {std::pair{&r.outcome, "default"}, std::pair{&r.paper, "paper"}}) {
    Series held_out{std::string(solver) + ", held out", {}, {}};
    Series input{std::string(solver) + ", input", {}, {}, true};
    for (const recon::TracePoint& point : outcome->report.trace) {
      held_out.x.push_back(point.time.value());
      held_out.y.push_back(recon::all_channels(point.heldout_rmse));
      input.x.push_back(point.time.value());
      input.y.push_back(recon::all_channels(point.input_rmse));
    }
    series.push_back(std::move(held_out));
    series.push_back(std::move(input));
  }
  page.raw(svg_plot(series, {.title = "RMS error over the flame",
                             .x_label = "seconds",
                             .y_label = "grey levels of 255",
                             .x_axis = Axis::logarithmic,
                             .y_axis = Axis::logarithmic}));
  page.paragraph(recon::next_step(r.outcome.report));
  std::vector<std::vector<std::string>> rows;
  for (const recon::EffectReport& effect : r.outcome.report.effects) {
    rows.push_back({effect.name, effect.on ? "on" : "off", fmt::format("{:.2f}", effect.predicted_change),
                    fmt::format("{:.2f}", effect.seconds.value()), effect.reason});
  }
  page.table({"effect", "", "changes the pictures by (grey levels)", "finding out took (s)", "why"}, rows);
  for (const std::string& warning : r.outcome.report.warnings) page.paragraph(warning);
}

}  // namespace

Status write_demo_report(const rig::DemoResult& result, const std::filesystem::path& folder) {
  HtmlPage page(
      fmt::format("Emberlock: from strobe to volume with {} simulated cameras", result.options.cameras));
  headline(page, result);
  alignment(page, result);
  pictures(page, result);
  error_plot(page, result);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(folder / "report.html", page.str()));
  const auto held_out = static_cast<std::size_t>(result.held_out);
  return write_file_atomically(
      folder / "summary.png",
      png_file(side_by_side(triptych(result.scene.views[held_out], result.outcome.renders[held_out]))));
}

}  // namespace emberlock::report
