// SPDX-License-Identifier: Apache-2.0
#include "report/calibrate_report.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <fmt/format.h>

#include "films/board_search.h"
#include "recon/calibrate/next_pictures.h"
#include "report/camera_plan.h"
#include "report/html.h"

namespace emberlock::report {
namespace {

constexpr double kDegreesPerRadian = 180 / M_PI;
constexpr double kMillimetres = 1e3;

/// The worst of three.
double worst_axis(const recon::CalibratedCamera& camera, int first) {
  return camera.sigma.segment<3>(first).maxCoeff();
}

std::vector<std::vector<std::string>> camera_rows(const recon::RigCalibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    if (!camera.calibrated) {
      rows.push_back(
          {camera.id, fmt::format("0 of {}", camera.views), "-", "-", "-", "-", "-", "-", camera.why});
      continue;
    }
    const recon::Intrinsics& in = camera.fit.model.intrinsics;
    const auto with = [&](double value, int i) {
      return fmt::format("{:.2f} ± {:.2f}", value, camera.sigma[i]);
    };
    rows.push_back({camera.id, fmt::format("{} of {}", camera.views_used, camera.views),
                    camera.placed ? fmt::format("{:.3f}", camera.rms) : "-",
                    fmt::format("{:.3f}", camera.fit.noise), with(in.fx, 0) + ", " + with(in.fy, 1),
                    with(in.cx, 2) + ", " + with(in.cy, 3),
                    camera.placed ? fmt::format("{:.2f}", worst_axis(camera, 9) * kMillimetres) : "-",
                    camera.placed ? fmt::format("{:.3f}", worst_axis(camera, 12) * kDegreesPerRadian) : "-",
                    camera.placed ? "" : camera.why});
  }
  return rows;
}

std::vector<std::vector<std::string>> distortion_rows(const recon::RigCalibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    if (!camera.calibrated) continue;
    const recon::Distortion& d = camera.fit.model.intrinsics.distortion;
    std::vector<std::string> row = {camera.id};
    int i = 4;
    for (const double k : {d.k1, d.k2, d.p1, d.p2, d.k3}) {
      row.push_back(camera.sigma[i] > 0 ? fmt::format("{:.5f} ± {:.5f}", k, camera.sigma[i])
                                        : fmt::format("{:.5f} (held)", k));
      ++i;
    }
    rows.push_back(std::move(row));
  }
  return rows;
}

/// Residuals as magnified arrows, over the cells that contain corners.
std::string coverage_svg(const recon::RigCalibration& calibration, std::size_t camera,
                         const recon::CornerCoverage& coverage) {
  const recon::Bundle& bundle = calibration.bundle;
  const ImageSize size = bundle.cameras[camera].model.intrinsics.size;
  constexpr double kWidth = 360;
  constexpr double kMagnified = 60;  // magnification, in pixels of the drawing
  const double scale = kWidth / size.width;
  const double height = scale * size.height;
  const double cell_w = kWidth / recon::CornerCoverage::kColumns;
  const double cell_h = height / recon::CornerCoverage::kRows;
  std::string svg = fmt::format(
      R"(<svg viewBox="0 0 {0:.0f} {1:.0f}" width="{0:.0f}" height="{1:.0f}" role="img">)", kWidth, height);
  const std::size_t most =
      std::max<std::size_t>(1, *std::max_element(coverage.corners.begin(), coverage.corners.end()));
  for (std::size_t i = 0; i < coverage.corners.size(); ++i) {
    const std::size_t rows_above = i / recon::CornerCoverage::kColumns;
    const auto row = static_cast<double>(rows_above);
    const auto column = static_cast<double>(i % recon::CornerCoverage::kColumns);
    const double share = static_cast<double>(coverage.corners[i]) / static_cast<double>(most);
    svg +=
        coverage.corners[i] == 0
            ? fmt::format(
                  R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#d55e00" opacity=".25"/>)",
                  column * cell_w, row * cell_h, cell_w, cell_h)
            : fmt::format(
                  R"(<rect x="{:.1f}" y="{:.1f}" width="{:.1f}" height="{:.1f}" fill="#0072b2" opacity="{:.2f}"/>)",
                  column * cell_w, row * cell_h, cell_w, cell_h, 0.05 + 0.3 * share);
    svg += fmt::format(R"(<text x="{:.1f}" y="{:.1f}">{}</text>)", column * cell_w + 4, row * cell_h + 13,
                       coverage.corners[i]);
  }
  std::string used;
  std::string wrong;
  for (const recon::BundleView& view : bundle.views) {
    if (view.camera != camera) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      const Eigen::Vector2d at = scale * view.corners[i].pixel;
      if (view.use[i] == recon::CornerUse::used) {
        const Eigen::Vector2d to = at + scale * kMagnified * recon::residual(bundle, view, i);
        used += fmt::format("M{:.1f} {:.1f}L{:.1f} {:.1f}", at.x(), at.y(), to.x(), to.y());
      } else {
        wrong += fmt::format("M{:.1f} {:.1f}h4M{:.1f} {:.1f}v4", at.x() - 2, at.y(), at.x(), at.y() - 2);
      }
    }
  }
  svg += fmt::format(R"(<path d="{}" fill="none" stroke="#009e73" stroke-width=".7"/>)", used);
  svg += fmt::format(R"(<path d="{}" fill="none" stroke="#d55e00" stroke-width="1.2"/>)", wrong);
  return svg + R"(<rect class="grid" x="0" y="0" width="100%" height="100%" fill="none"/></svg>)";
}

std::string residual_plot(const recon::RigCalibration& calibration, std::size_t camera) {
  const recon::Bundle& bundle = calibration.bundle;
  Series series{"corners", {}, {}};
  series.mark = Mark::points;
  for (const recon::BundleView& view : bundle.views) {
    if (view.camera != camera) continue;
    for (std::size_t i = 0; i < view.corners.size(); ++i) {
      if (view.use[i] != recon::CornerUse::used) continue;
      const Eigen::Vector2d r = recon::residual(bundle, view, i);
      series.x.push_back(r.x());
      series.y.push_back(r.y());
    }
  }
  PlotOptions options;
  options.title = "residuals";
  options.x_label = "x, pixels";
  options.y_label = "y, pixels";
  options.width = 460;
  options.height = 300;
  return svg_plot({series}, options);
}

std::vector<std::vector<std::string>> left_out_rows(const recon::BoardReading& reading,
                                                    const recon::RigCalibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const auto& rejected : calibration.rejected)
    rows.push_back({reading.sightings.sightings[rejected.sighting].picture, rejected.why});
  for (const auto& unused : reading.unused) rows.push_back({unused.path.string(), unused.why});
  return rows;
}

std::vector<std::vector<std::string>> pair_rows(const recon::RigCalibration& calibration) {
  std::vector<std::vector<std::string>> rows;
  for (const recon::CameraPair& pair : calibration.pairs) {
    rows.push_back({calibration.cameras[pair.a].id + " - " + calibration.cameras[pair.b].id,
                    fmt::format("{}", pair.instants),
                    fmt::format("{:.3f}", pair.distance_sigma * kMillimetres),
                    fmt::format("{:.4f}", pair.turn_sigma * kDegreesPerRadian)});
  }
  return rows;
}

std::vector<std::vector<std::string>> cost_rows(const recon::RigCalibration& calibration) {
  std::size_t views = 0;
  double place = 0;
  double turn = 0;
  double focal = 0;
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    if (!camera.placed) continue;
    views += camera.views_used;
    place = std::max(place, worst_axis(camera, 9));
    turn = std::max(turn, worst_axis(camera, 12));
    focal = std::max(focal, camera.sigma[0]);
  }
  std::vector<std::vector<std::string>> rows;
  for (const std::size_t times : {0U, 1U, 3U, 8U}) {
    const double factor = recon::expected_factor(views, times * views);
    rows.push_back({times == 0 ? fmt::format("these {}", views) : fmt::format("{} more", times * views),
                    fmt::format("{:.3f} mm", place * factor * kMillimetres),
                    fmt::format("{:.4f}°", turn * factor * kDegreesPerRadian),
                    fmt::format("{:.2f} pixels", focal * factor)});
  }
  return rows;
}

/// Of the placed cameras: the others stand nowhere yet.
std::vector<PlanCamera> placed_cameras(const recon::RigCalibration& calibration) {
  std::vector<PlanCamera> placed;
  for (const recon::CalibratedCamera& camera : calibration.cameras)
    if (camera.placed) placed.push_back(plan_camera(camera.id, camera.fit.model));
  return placed;
}

}  // namespace

std::string calibration_words(const recon::BoardReading& reading, const recon::RigCalibration& calibration) {
  std::size_t used = 0;
  std::size_t corners = 0;
  std::size_t all = 0;
  for (const recon::CalibratedCamera& camera : calibration.cameras) {
    used += camera.views_used;
    corners += camera.corners_used;
    all += camera.corners;
  }
  const auto placed = std::count_if(calibration.cameras.begin(), calibration.cameras.end(),
                                    [](const recon::CalibratedCamera& camera) { return camera.placed; });
  return fmt::format(
      "{} of {} cameras calibrated from {} pictures of {}: {} of {} views and {} of {} corners used, {:.3f} "
      "pixels RMS. "
      "The world is the board at instant {}: origin at its first corner, x along a row, y up the board, z "
      "out of it.",
      placed, calibration.cameras.size(), reading.sightings.sightings.size() + reading.unused.size(),
      recon::board_words(reading.sightings.board), used, reading.sightings.sightings.size(), corners, all,
      recon::rms_of(calibration.bundle), calibration.world);
}

std::string calibration_html(const recon::BoardReading& reading, const recon::RigCalibration& calibration) {
  HtmlPage page("Calibration of the cameras");
  page.paragraph(calibration_words(reading, calibration));
  if (reading.film) page.paragraph(films::film_words(reading) + ".");
  if (calibration.box) {
    const recon::Box& box = *calibration.box;
    page.paragraph(fmt::format("Flame volume: {:.3f} x {:.3f} x {:.3f} m around ({:.3f}, {:.3f}, {:.3f}).",
                               box.size.x(), box.size.y(), box.size.z(), box.center.x(), box.center.y(),
                               box.center.z()));
  }
  add_camera_plan(page, placed_cameras(calibration), calibration.box);
  page.heading("Take next");
  const auto advice = recon::next_pictures(calibration);
  for (const std::string& sentence : advice) page.paragraph(sentence);
  if (advice.empty()) page.paragraph("Nothing stands out: all cells have corners, and boards tilt enough.");
  page.heading("What accuracy costs");
  page.paragraph(
      "The worst camera's uncertainty with more views as good as these, by the square root law: an "
      "estimate.");
  page.table({"views", "place", "turn", "focal length"}, cost_rows(calibration));
  page.heading("Cameras");
  page.paragraph(
      "± is one standard deviation. Place and turn are those of the worst axis, in the world's frame: what "
      "the world's "
      "board lacks is in all of them; turns and principal points hang together. Noise is a corner's, each "
      "coordinate.");
  page.table({"camera", "views", "RMS, pixels", "noise, pixels", "fx, fy, pixels", "cx, cy, pixels",
              "place ±, mm", "turn ±, degrees", ""},
             camera_rows(calibration));
  page.table({"camera", "k1", "k2", "p1", "p2", "k3"}, distortion_rows(calibration));
  if (!calibration.pairs.empty()) {
    page.heading("Pairs of cameras");
    page.paragraph("How well two cameras know of each other, along and about the worst axis.");
    page.table({"pair", "instants", "place ±, mm", "turn ±, degrees"}, pair_rows(calibration));
  }
  page.heading("Where the corners were");
  page.paragraph(
      "Each picture's cells with their corners (orange: none), residuals as lines 60 times as long, wrong "
      "corners as "
      "crosses; beside them the residuals.");
  const auto coverage = recon::corner_coverage(calibration);
  std::vector<HtmlPage::Picture> pictures;
  for (std::size_t b = 0; b < coverage.size(); ++b) {
    const recon::CalibratedCamera& camera = calibration.cameras[calibration.bundle_camera[b]];
    pictures.push_back({coverage_svg(calibration, b, coverage[b]),
                        fmt::format("{}: {} corners, {} of {} cells empty", camera.id, camera.corners_used,
                                    coverage[b].empty_cells(), coverage[b].corners.size())});
    pictures.push_back(
        {residual_plot(calibration, b), fmt::format("{}: {:.3f} pixels RMS", camera.id, camera.rms)});
  }
  page.gallery(pictures);
  const auto left_out = left_out_rows(reading, calibration);
  if (!left_out.empty()) {
    page.heading("Pictures left out");
    page.table({"picture", "why"}, left_out);
  }
  return page.str();
}

}  // namespace emberlock::report
