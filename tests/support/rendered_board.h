// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "base/image.h"
#include "recon/calibrate/board.h"
#include "recon/calibrate/camera_model.h"

namespace emberlock::test {

/// The board as a camera films it: rays through the pixels' corners meet its plane, and what lies between is
/// taken nine times a pixel; grey behind it. The camera stands in front of the board's whole plane, as far as
/// it sees it.
inline Image rendered_board(const recon::CameraModel& camera, const recon::Board& board,
                            const recon::Rigid3& world_from_board) {
  constexpr int kSquare = 77;  // pixels of the print: whole ones a bit of markers that are 8/11 of a square
  constexpr int kRays = 3;     // along a pixel's edge
  const Image print = recon::draw_board(board, kSquare);
  const ImageView paper = print.view();
  const recon::Rigid3 board_from_world = world_from_board.inverse();
  const Eigen::Vector3d eye = board_from_world * camera.center();
  const int width = camera.intrinsics.size.width;
  const int height = camera.intrinsics.size.height;
  struct Place {
    double u, v;  // on the print
  };
  std::vector<Place> corners;
  for (int y = 0; y <= height; ++y) {
    for (int x = 0; x <= width; ++x) {
      const Eigen::Vector3d ray = board_from_world.rotation * camera.ray(Eigen::Vector2d(x, y)).direction;
      const double along = -eye.z() / ray.z();
      const bool meets = along > 0 && eye.z() > 0;
      corners.push_back({meets ? ((eye.x() + along * ray.x()) / board.square.value() + 2) * kSquare : -1e6,
                         meets ? (-(eye.y() + along * ray.y()) / board.square.value() + 2) * kSquare : -1e6});
    }
  }
  Image image(ImageLayout{camera.intrinsics.size, PixelFormat::gray8, 8});
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      const Place* top = corners.data() + static_cast<std::ptrdiff_t>(y) * (width + 1) + x;
      const Place* bottom = top + width + 1;
      double sum = 0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const double fx = (i % kRays + 0.5) / kRays;
        const double fy = (i / kRays + 0.5) / kRays;  // NOLINT(bugprone-integer-division): whole rows
        const auto mixed = [fx, fy](double a, double b, double c, double d) {
          return (1 - fy) * ((1 - fx) * a + fx * b) + fy * ((1 - fx) * c + fx * d);
        };
        const double u = mixed(top[0].u, top[1].u, bottom[0].u, bottom[1].u);
        const double v = mixed(top[0].v, top[1].v, bottom[0].v, bottom[1].v);
        const bool on_paper = u >= 0 && v >= 0 && u < paper.width() && v < paper.height();
        sum += on_paper ? 20 + 0.8 * paper.sample(static_cast<int>(u), static_cast<int>(v)) : 110;
      }
      image.row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(std::lround(sum / (kRays * kRays)));
    }
  }
  return image;
}

}  // namespace emberlock::test
