// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/carried_board.h"

#include <cmath>
#include <cstddef>
#include <cstdint>

#include <Eigen/Geometry>

namespace emberlock::recon {
namespace {

constexpr double kRingRadius = 0.3;  // metres
constexpr double kRadiansOfDegree = M_PI / 180;

/// On a sphere around the origin; angles in radians.
Eigen::Vector3d at_angles(double radius, double azimuth, double elevation) {
  return radius * Eigen::Vector3d(std::cos(elevation) * std::cos(azimuth),
                                  std::cos(elevation) * std::sin(azimuth), std::sin(elevation));
}

/// A board of this orientation whose middle lies at `middle`.
Rigid3 board_at(const Board& board, const Eigen::Matrix3d& rotation, const Eigen::Vector3d& middle) {
  return {rotation, middle - rotation * (0.5 * (board.point(0) + board.point(board.corners() - 1)))};
}

/// x to the right, y up and z out of a board, for one whose face looks along `out`.
Eigen::Matrix3d face_towards(const Eigen::Vector3d& out) {
  const Eigen::Vector3d right = Eigen::Vector3d::UnitZ().cross(out).normalized();
  Eigen::Matrix3d rotation;
  rotation << right, out.cross(right), out;
  return rotation;
}

}  // namespace

std::vector<CameraModel> ring_cameras(int cameras, ImageSize image, RandomStream& random) {
  std::vector<CameraModel> ring;
  const double focal = 0.5 * image.width / std::tan(M_PI / 6);
  for (int i = 0; i < cameras; ++i) {
    const bool eleventh = i == 10;
    const double azimuth = eleventh ? 90 : 36.0 * i;
    const double elevation = eleventh ? 0 : i % 2 == 0 ? 10 : -10;
    Intrinsics lens{image,
                    focal * random.uniform(0.97, 1.03),
                    0,
                    0.5 * image.width + random.uniform(-8, 8),
                    0.5 * image.height + random.uniform(-8, 8),
                    {random.uniform(-0.15, -0.05), random.uniform(0, 0.05), random.uniform(-1e-3, 1e-3),
                     random.uniform(-1e-3, 1e-3), 0}};
    lens.fy = lens.fx * random.uniform(0.995, 1.005);
    ring.push_back(look_at(lens,
                           at_angles(kRingRadius, azimuth * kRadiansOfDegree, elevation * kRadiansOfDegree),
                           Eigen::Vector3d(random.uniform(-0.01, 0.01), random.uniform(-0.01, 0.01),
                                           random.uniform(-0.01, 0.01))));
  }
  return ring;
}

Rigid3 carried_board(const Board& board, double azimuth, RandomStream& random) {
  // One after another: the operands of a product would be drawn in any order.
  const Eigen::Vector3d out = at_angles(1, azimuth + random.uniform(-0.3, 0.3), random.uniform(-0.8, 0.8));
  const Eigen::AngleAxisd turn(random.uniform(-0.6, 0.6), Eigen::Vector3d::UnitZ());
  const Eigen::Vector3d middle(random.uniform(-0.06, 0.06), random.uniform(-0.06, 0.06),
                               random.uniform(-0.06, 0.06));
  return board_at(board, face_towards(out) * turn, middle);
}

Rigid3 upright_board(const Board& board, double azimuth) {
  return board_at(board, face_towards(at_angles(1, azimuth, 0)), Eigen::Vector3d::Zero());
}

std::vector<BoardCorner> seen_corners(const CameraModel& camera, const Board& board,
                                      const Rigid3& world_from_board) {
  const Eigen::Vector3d middle =
      world_from_board * (0.5 * (board.point(0) + board.point(board.corners() - 1)));
  const double facing = world_from_board.rotation.col(2).dot((camera.center() - middle).normalized());
  if (facing < 0.5) return {};
  std::vector<BoardCorner> corners;
  const ImageSize size = camera.intrinsics.size;
  for (int id = 0; id < board.corners(); ++id) {
    const Eigen::Vector3d world = world_from_board * board.point(id);
    if ((camera.camera_from_world * world).z() < 0.02) return {};
    const Eigen::Vector2d pixel = camera.project(world);
    if (pixel.minCoeff() < 2 || pixel.x() > size.width - 2 || pixel.y() > size.height - 2) return {};
    corners.push_back({id, pixel});
  }
  return corners;
}

Image board_picture(const CameraModel& camera, const Board& board, const Rigid3& world_from_board) {
  constexpr int kSquare = 77;  // pixels of the print: whole ones a bit of markers that are 8/11 of a square
  constexpr int kRays = 3;     // along a pixel's edge
  const Image print = draw_board(board, kSquare);
  const ImageView paper = print.view();
  const Rigid3 board_from_world = world_from_board.inverse();
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

}  // namespace emberlock::recon
