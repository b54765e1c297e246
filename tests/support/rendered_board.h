#pragma once

#include <algorithm>
#include <cmath>

#include "base/image.h"
#include "recon/calibrate/board.h"
#include "recon/calibrate/camera_model.h"

namespace emberlock::test {

/// The board as a camera films it: rays meet its plane, nine a pixel; grey behind it.
inline Image rendered_board(const CameraModel& camera, const Board& board, const Rigid3& world_from_board) {
  constexpr int kSquare = 24;  // pixels of the print
  constexpr int kRays = 3;     // along a pixel's edge
  const Image print = draw_board(board, kSquare);
  const ImageView paper = print.view();
  const Rigid3 board_from_world = world_from_board.inverse();
  const Eigen::Vector3d eye = board_from_world * camera.center();
  Image image(ImageLayout{camera.intrinsics.size, PixelFormat::gray8, 8});
  for (int y = 0; y < camera.intrinsics.size.height; ++y) {
    for (int x = 0; x < camera.intrinsics.size.width; ++x) {
      double sum = 0;
      for (int i = 0; i < kRays * kRays; ++i) {
        const Eigen::Vector2d pixel(x + (i % kRays + 0.5) / kRays, y + (i / kRays + 0.5) / kRays);
        const Eigen::Vector3d ray = board_from_world.rotation * camera.ray(pixel).direction;
        const double along = -eye.z() / ray.z();
        const Eigen::Vector3d hit = eye + along * ray;
        const int u = static_cast<int>(std::floor((hit.x() / board.square.value() + 2) * kSquare));
        const int v = static_cast<int>(std::floor((-hit.y() / board.square.value() + 2) * kSquare));
        const bool on_paper =
            along > 0 && eye.z() > 0 && u >= 0 && v >= 0 && u < paper.width() && v < paper.height();
        sum += on_paper ? 20 + 0.8 * paper.sample(u, v) : 110;
      }
      image.row_as<std::uint8_t>(y)[x] = static_cast<std::uint8_t>(std::lround(sum / (kRays * kRays)));
    }
  }
  return image;
}

}  // namespace emberlock::test
