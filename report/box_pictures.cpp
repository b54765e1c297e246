// SPDX-License-Identifier: Apache-2.0
#include "report/box_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <system_error>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

#include "base/file.h"
#include "recon/export/picture.h"
#include "recon/pipeline/grid_choice.h"
#include "recon/preprocess/radiance.h"
#include "report/html.h"

namespace emberlock::report {
namespace fs = std::filesystem;
namespace {

constexpr int kMostLines = 16;  // of the grid, along its longest side
const cv::Scalar kEdgeColour(255, 176, 0);
const cv::Scalar kLineColour(0, 114, 178);

Eigen::Vector3d key_point(const recon::Grid& g, double i, double j, double k) {
  return Eigen::Vector3f(g.origin[0], g.origin[1], g.origin[2]).cast<double>() +
         static_cast<double>(g.edge) * Eigen::Vector3d(i, j, k);
}

Eigen::Vector3d sides(const recon::Grid& g) { return {g.nx - 1.0, g.ny - 1.0, g.nz - 1.0}; }

/// A line in the world as the lens images it, in short segments; the part behind the camera is omitted.
void draw_line(cv::Mat& picture, const recon::CameraModel& camera, const Eigen::Vector3d& a,
               const Eigen::Vector3d& b, const cv::Scalar& colour) {
  constexpr int kPieces = 24;
  constexpr int kFraction = 4;  // fractional bits of a pixel coordinate
  constexpr double kFarthest = 1e5;
  std::optional<cv::Point> last;
  for (int n = 0; n <= kPieces; ++n) {
    const Eigen::Vector3d p = a + static_cast<double>(n) / kPieces * (b - a);
    std::optional<cv::Point> here;
    if ((camera.camera_from_world * p).z() > 0) {
      const Eigen::Vector2d pixel = (camera.project(p) - Eigen::Vector2d(0.5, 0.5)) * (1 << kFraction);
      if (pixel.allFinite() && pixel.cwiseAbs().maxCoeff() < kFarthest)
        here = cv::Point(static_cast<int>(std::lround(pixel.x())), static_cast<int>(std::lround(pixel.y())));
    }
    if (last && here) cv::line(picture, *last, *here, colour, 1, cv::LINE_AA, kFraction);
    last = here;
  }
}

/// The grid lines on the face at `at` on `axis` (0 or the last key point).
void draw_face(cv::Mat& picture, const recon::CameraModel& camera, const recon::Grid& grid, int axis,
               double at, int spacing) {
  const Eigen::Vector3d size = sides(grid);
  for (const int along : {(axis + 1) % 3, (axis + 2) % 3}) {
    const int across = 3 - axis - along;
    for (int n = spacing; n < static_cast<int>(size[across]); n += spacing) {
      Eigen::Vector3d from = Eigen::Vector3d::Zero();
      from[axis] = at;
      from[across] = n;
      Eigen::Vector3d to = from;
      to[along] = size[along];
      draw_line(picture, camera, key_point(grid, from.x(), from.y(), from.z()),
                key_point(grid, to.x(), to.y(), to.z()), kLineColour);
    }
  }
}

void draw_edges(cv::Mat& picture, const recon::CameraModel& camera, const recon::Grid& grid) {
  const Eigen::Vector3d size = sides(grid);
  for (int axis = 0; axis < 3; ++axis)
    for (int corner = 0; corner < 4; ++corner) {
      Eigen::Vector3d from = Eigen::Vector3d::Zero();
      from[(axis + 1) % 3] = (corner & 1) != 0 ? size[(axis + 1) % 3] : 0;
      from[(axis + 2) % 3] = (corner & 2) != 0 ? size[(axis + 2) % 3] : 0;
      Eigen::Vector3d to = from;
      to[axis] = size[axis];
      draw_line(picture, camera, key_point(grid, from.x(), from.y(), from.z()),
                key_point(grid, to.x(), to.y(), to.z()), kEdgeColour);
    }
}

/// Scales the brightest pixel to white, so that the box can be checked against faint flames too.
recon::RadianceImage brightened(const recon::RadianceImage& image) {
  const float most = image.rgb.empty() ? 0.F : *std::max_element(image.rgb.begin(), image.rgb.end());
  recon::RadianceImage bright = image;
  if (most > 0)
    for (float& v : bright.rgb) v *= 255 / most;
  return bright;
}

/// Size in pixels of a voxel in the middle of the grid.
double pixels_a_voxel(const recon::View& view, const recon::Grid& grid) {
  const Eigen::Vector3d half = 0.5 * sides(grid);
  const double depth = (view.camera.camera_from_world * key_point(grid, half.x(), half.y(), half.z())).z();
  return depth > 0 ? std::max(view.camera.intrinsics.fx, view.camera.intrinsics.fy) *
                         static_cast<double>(grid.edge) / depth
                   : 0;
}

}  // namespace

int voxels_between_lines(const recon::Grid& grid) {
  const double longest = sides(grid).maxCoeff();
  int spacing = 1;
  for (int n = 0; longest > kMostLines * spacing; ++n) spacing = n % 3 == 1 ? spacing * 5 / 2 : spacing * 2;
  return spacing;
}

Image box_picture(const recon::View& view, const recon::Grid& grid) {
  Image image = recon::to_rgb8(brightened(*view.image));
  const ImageSize size = image.layout().size;
  cv::Mat picture(size.height, size.width, CV_8UC3, image.bytes().data());
  const Eigen::Vector3d center = view.camera.center();
  const Eigen::Vector3d far = sides(grid);
  const Eigen::Vector3d middle = key_point(grid, 0.5 * far.x(), 0.5 * far.y(), 0.5 * far.z());
  for (int axis = 0; axis < 3; ++axis)
    draw_face(picture, view.camera, grid, axis, center[axis] > middle[axis] ? 0 : far[axis],
              voxels_between_lines(grid));
  draw_edges(picture, view.camera, grid);
  return image;
}

Status write_plan(const recon::Scene& scene, const recon::Grid& grid, const OutputRequest& where) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder staging, OutputFolder::create(where));
  std::error_code ec;
  fs::create_directory(staging.path() / "box", ec);
  const recon::Box& box = scene.box;
  const double edge = static_cast<double>(grid.edge);
  const int spacing = voxels_between_lines(grid);
  HtmlPage page("The volume, before it is reconstructed");
  page.paragraph(fmt::format(
      "A box of {:.0f} x {:.0f} x {:.0f} mm around ({:.1f}, {:.1f}, {:.1f}) mm, {} x {} x {} voxels of "
      "{:.2f} mm. "
      "Yellow: its edges. Blue: the grid on the faces behind the flame, a line every {} voxels ({:.1f} mm).",
      1e3 * box.size.x(), 1e3 * box.size.y(), 1e3 * box.size.z(), 1e3 * box.center.x(), 1e3 * box.center.y(),
      1e3 * box.center.z(), grid.nx - 1, grid.ny - 1, grid.nz - 1, 1e3 * edge, spacing,
      1e3 * edge * spacing));
  page.paragraph(
      html_escape(fmt::format("Two voxels for three pixels would be {} along the longest edge. The flame "
                              "must lie inside the box in every "
                              "picture; where it doesn't, give --box cx,cy,cz,sx,sy,sz.",
                              recon::voxels_by_the_paper(scene))));
  std::vector<HtmlPage::Picture> pictures;
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const recon::View& view = scene.views[v];
    const std::string name = fmt::format("box/{:04}.png", v);
    EMBERLOCK_RETURN_IF_ERROR(recon::write_png(box_picture(view, grid).view(), staging.path() / name));
    pictures.push_back(
        {"<img src=\"" + name + "\" alt=\"\" width=\"480\">",
         fmt::format("{}: {:.2f} pixels a voxel", html_escape(view.name), pixels_a_voxel(view, grid))});
  }
  page.gallery(pictures);
  EMBERLOCK_RETURN_IF_ERROR(write_file_atomically(staging.path() / "index.html", page.str()));
  return staging.commit();
}

}  // namespace emberlock::report
