// SPDX-License-Identifier: Apache-2.0
#include "paper/baselines/gaussian_splats/splats.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <numbers>

#include <Eigen/Core>

namespace emberlock::paper {
namespace {

// Four pixels at a time, in a vector register.
using Lanes = float __attribute__((vector_size(16)));
using WholeLanes = std::int32_t __attribute__((vector_size(16)));
constexpr int kLanes = 4;

constexpr double kReach = 3.5;  // standard deviations

Lanes load(const float* p) {
  Lanes lanes;  // NOLINT(cppcoreguidelines-pro-type-member-init): filled at once
  std::memcpy(&lanes, p, sizeof lanes);
  return lanes;
}
void store(const Lanes& lanes, float* p) { std::memcpy(p, &lanes, sizeof lanes); }
float total(const Lanes& lanes) { return (lanes[0] + lanes[1]) + (lanes[2] + lanes[3]); }

/// exp(x) for -80 < x <= 0, within 3e-7 of it: 2^n times a series of exp((x log2(e) - n) log(2)).
Lanes exp_below_one(const Lanes& x) {
  const Lanes power = x * std::numbers::log2e_v<float>;
  const WholeLanes whole = __builtin_convertvector(power - 0.5F, WholeLanes);
  const Lanes t = (power - __builtin_convertvector(whole, Lanes)) * std::numbers::ln2_v<float>;
  const Lanes series =
      1.F + t * (1.F + t * (0.5F + t * (1.F / 6 + t * (1.F / 24 + t * (1.F / 120 + t * (1.F / 720))))));
  return series * std::bit_cast<Lanes>((whole + 127) << 23);
}

/// A splat before a camera.
struct Footprint {
  std::array<float, 3> light = {}, from_camera = {}, u = {};
  std::array<float, 6> w = {};
  int first_column = 0, last_column = -1;  // the former a multiple of kLanes
  int first_row = 0, last_row = -1;

  [[nodiscard]] bool empty() const { return first_column > last_column || first_row > last_row; }
};

/// Indices of the pixels from `first` on that lie within `reach` of `middle`.
void range_of(double middle, double reach, int first, int stride, int count, int& low, int& high) {
  const auto at = [&](double pixel) { return (pixel - 0.5 - first) / stride; };
  low = static_cast<int>(std::ceil(std::clamp(at(middle - reach), 0.0, static_cast<double>(count))));
  high = static_cast<int>(std::floor(std::clamp(at(middle + reach), -1.0, count - 1.0)));
}

/// The standard deviation of W's Gaussian along a direction j: |W^-T j|.
double width_along(const std::array<float, 6>& w, const Eigen::Vector3d& j) {
  const double z = j.z() / static_cast<double>(w[5]);
  const double y = (j.y() - static_cast<double>(w[4]) * z) / static_cast<double>(w[2]);
  const double x =
      (j.x() - static_cast<double>(w[1]) * y - static_cast<double>(w[3]) * z) / static_cast<double>(w[0]);
  return std::sqrt(x * x + y * y + z * z);
}

Footprint footprint_of(const Splat& splat, float unit, const SplatView& view, const SplatPicture& picture,
                       const Eigen::Vector3d& eye) {
  Footprint f;
  const recon::CameraModel& camera = view.camera;
  const Eigen::Vector3d centre(static_cast<double>(splat[kCentre]), static_cast<double>(splat[kCentre + 1]),
                               static_cast<double>(splat[kCentre + 2]));
  const Eigen::Vector3d before = camera.camera_from_world * centre;
  if (before.z() < 1) return f;  // not a voxel edge in front of the camera
  f.w = sharpness_of(splat);
  const Eigen::Matrix3d& turn = camera.camera_from_world.rotation;
  const auto slope = [&](int axis, double focal) {  // of the pixel's coordinate by the centre's
    return Eigen::Vector3d(
        (focal / before.z() * (turn.row(axis) - before[axis] / before.z() * turn.row(2))).transpose());
  };
  const Eigen::Vector2d middle = camera.project(centre);
  if (!middle.allFinite()) return f;  // so far aside that the lens' polynomial overflows
  range_of(middle.x(), kReach * width_along(f.w, slope(0, camera.intrinsics.fx)), picture.first_x,
           view.stride, picture.columns, f.first_column, f.last_column);
  range_of(middle.y(), kReach * width_along(f.w, slope(1, camera.intrinsics.fy)), picture.first_y,
           view.stride, picture.rows, f.first_row, f.last_row);
  f.first_column -= f.first_column % kLanes;
  f.light = light_of(splat, unit);
  for (std::size_t a = 0; a < 3; ++a)
    f.from_camera[a] = static_cast<float>(centre[static_cast<int>(a)] - eye[static_cast<int>(a)]);
  const std::array<float, 3>& v = f.from_camera;
  f.u = {f.w[0] * v[0], f.w[1] * v[0] + f.w[2] * v[1], f.w[3] * v[0] + f.w[4] * v[1] + f.w[5] * v[2]};
  return f;
}

/// What four rays see of a splat of light 1, and what its derivatives need.
struct Sight {
  Lanes d[3], w[3], cross[3];
  Lanes per_square;  // 1 / |w|^2
  Lanes seen;

  // NOLINTNEXTLINE(cppcoreguidelines-pro-type-member-init): all are filled
  Sight(const Footprint& f, const SplatPicture& picture, std::size_t pixel) {
    for (std::size_t a = 0; a < 3; ++a) d[a] = load(&picture.direction[a][pixel]);
    w[0] = f.w[0] * d[0];
    w[1] = f.w[1] * d[0] + f.w[2] * d[1];
    w[2] = f.w[3] * d[0] + f.w[4] * d[1] + f.w[5] * d[2];
    cross[0] = f.u[1] * w[2] - f.u[2] * w[1];
    cross[1] = f.u[2] * w[0] - f.u[0] * w[2];
    cross[2] = f.u[0] * w[1] - f.u[1] * w[0];
    const Lanes square = w[0] * w[0] + w[1] * w[1] + w[2] * w[2];
    Lanes length = square;
    for (int i = 0; i < kLanes; ++i) length[i] = std::sqrt(square[i]);
    per_square = 1.F / square;
    const Lanes q = (cross[0] * cross[0] + cross[1] * cross[1] + cross[2] * cross[2]) * per_square;
    Lanes power = -0.5F * q;
    const WholeLanes far = power < -80.F;  // beyond what exp_below_one() takes: dark
    power = far ? Lanes{-80.F, -80.F, -80.F, -80.F} : power;
    constexpr float kRootOfTwoPi = 2.50662827F;
    seen = exp_below_one(power) * (kRootOfTwoPi / length);
  }
};

/// Calls act(first of four pixels) for all pixels of a footprint.
template <class Act>
void each_four(const Footprint& f, const SplatPicture& picture, const Act& act) {
  for (int row = f.first_row; row <= f.last_row; ++row) {
    const std::size_t begin = static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.pitch);
    for (int column = f.first_column; column <= f.last_column; column += kLanes)
      act(begin + static_cast<std::size_t>(column));
  }
}

/// Sums over the pixels of a footprint.
struct Slopes {
  Lanes light[3] = {};  // by the light
  Lanes u[3] = {};      // by u
  Lanes by_w[6] = {};   // by W through w alone, in sharpness_of()'s order
};

Slopes slopes_of(const Footprint& f, const SplatPicture& picture, const SplatLight& slope) {
  Slopes sum;
  each_four(f, picture, [&](std::size_t pixel) {
    const Sight sight(f, picture, pixel);
    Lanes along = {};
    for (std::size_t c = 0; c < 3; ++c) {
      const Lanes seen = load(&slope[c][pixel]) * sight.seen;
      sum.light[c] += seen;
      along += f.light[c] * seen;
    }
    // With p = u - (u.w / |w|^2) w = w x (u x w) / |w|^2: dq/du = 2 p, dq/dw = -2 (u.w / |w|^2) p.
    const Lanes* w = sight.w;
    const Lanes* cross = sight.cross;
    const Lanes share = (f.u[0] * w[0] + f.u[1] * w[1] + f.u[2] * w[2]) * sight.per_square;
    const Lanes p[3] = {(w[1] * cross[2] - w[2] * cross[1]) * sight.per_square,
                        (w[2] * cross[0] - w[0] * cross[2]) * sight.per_square,
                        (w[0] * cross[1] - w[1] * cross[0]) * sight.per_square};
    Lanes by_w[3];
    for (int a = 0; a < 3; ++a) {
      sum.u[a] -= along * p[a];
      by_w[a] = along * (share * p[a] - w[a] * sight.per_square);
    }
    sum.by_w[0] += by_w[0] * sight.d[0];
    sum.by_w[1] += by_w[1] * sight.d[0];
    sum.by_w[2] += by_w[1] * sight.d[1];
    sum.by_w[3] += by_w[2] * sight.d[0];
    sum.by_w[4] += by_w[2] * sight.d[1];
    sum.by_w[5] += by_w[2] * sight.d[2];
  });
  return sum;
}

float logistic(float x) { return 1 / (1 + std::exp(-x)); }

void add_slopes(const Slopes& sum, const Footprint& f, const Splat& splat, float unit, Splat& gradient) {
  const float u[3] = {total(sum.u[0]), total(sum.u[1]), total(sum.u[2])};
  const std::array<float, 3>& v = f.from_camera;
  const float by_w[6] = {total(sum.by_w[0]) + u[0] * v[0], total(sum.by_w[1]) + u[1] * v[0],
                         total(sum.by_w[2]) + u[1] * v[1], total(sum.by_w[3]) + u[2] * v[0],
                         total(sum.by_w[4]) + u[2] * v[1], total(sum.by_w[5]) + u[2] * v[2]};
  gradient[kCentre] += f.w[0] * u[0] + f.w[1] * u[1] + f.w[3] * u[2];
  gradient[kCentre + 1] += f.w[2] * u[1] + f.w[4] * u[2];
  gradient[kCentre + 2] += f.w[5] * u[2];
  gradient[kSharpness] += by_w[0] * f.w[0];
  gradient[kSharpness + 1] += by_w[2] * f.w[2];
  gradient[kSharpness + 2] += by_w[5] * f.w[5];
  gradient[kShear] += by_w[1];
  gradient[kShear + 1] += by_w[3];
  gradient[kShear + 2] += by_w[4];
  for (std::size_t c = 0; c < 3; ++c)
    gradient[kLight + c] += total(sum.light[c]) * unit * logistic(splat[kLight + c]);
}

SplatPicture picture_of(const recon::View& view, const recon::CameraModel& camera, const recon::PixelBox& box,
                        int first_x, int first_y, int stride) {
  SplatPicture picture;
  picture.first_x = first_x;
  picture.first_y = first_y;
  picture.columns = std::max(0, (box.x1 - first_x + stride - 1) / stride);
  picture.rows = std::max(0, (box.y1 - first_y + stride - 1) / stride);
  picture.pitch = (picture.columns + kLanes - 1) / kLanes * kLanes;
  const std::size_t pixels = static_cast<std::size_t>(picture.pitch) * static_cast<std::size_t>(picture.rows);
  for (std::size_t c = 0; c < 3; ++c) {
    picture.direction[c].assign(pixels, 1.F);
    picture.seen[c].assign(pixels, 0.F);
  }
  for (int row = 0; row < picture.rows; ++row)
    for (int column = 0; column < picture.columns; ++column) {
      const int x = first_x + stride * column;
      const int y = first_y + stride * row;
      const Eigen::Vector3d along = camera.ray({x + 0.5, y + 0.5}).direction;
      const std::size_t to = static_cast<std::size_t>(row) * static_cast<std::size_t>(picture.pitch) +
                             static_cast<std::size_t>(column);
      const std::size_t from =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(view.image->size.width) +
          static_cast<std::size_t>(x);
      for (std::size_t c = 0; c < 3; ++c) {
        picture.direction[c][to] = static_cast<float>(along[static_cast<int>(c)]);
        picture.seen[c][to] = view.image->rgb[3 * from + c];
      }
    }
  return picture;
}

}  // namespace

std::array<float, 3> light_of(const Splat& splat, float unit) {
  std::array<float, 3> light = {};
  for (std::size_t c = 0; c < 3; ++c) {
    const float x = splat[kLight + c];
    light[c] = unit * (std::max(x, 0.F) + std::log1p(std::exp(-std::abs(x))));
  }
  return light;
}

float number_of_light(float light, float unit) {
  const float y = std::max(light / unit, 1e-6F);
  return y + std::log(-std::expm1(-y));
}

std::array<float, 6> sharpness_of(const Splat& splat) {
  return {std::exp(splat[kSharpness]), splat[kShear],     std::exp(splat[kSharpness + 1]),
          splat[kShear + 1],           splat[kShear + 2], std::exp(splat[kSharpness + 2])};
}

float volume_of(const Splat& splat) {
  constexpr float kOfOne = 15.7496099F;  // (2 pi)^(3/2)
  return kOfOne * std::exp(-(splat[kSharpness] + splat[kSharpness + 1] + splat[kSharpness + 2]));
}

SplatView splat_view(const recon::View& view, const recon::PixelBox& box, const recon::Grid& grid,
                     int stride) {
  SplatView made{view.camera, stride, {}};
  recon::Rigid3& pose = made.camera.camera_from_world;
  const Eigen::Vector3d origin(static_cast<double>(grid.origin[0]), static_cast<double>(grid.origin[1]),
                               static_cast<double>(grid.origin[2]));
  pose.translation = (pose.rotation * origin + pose.translation) / static_cast<double>(grid.edge);
  for (int y = 0; y < stride; ++y)
    for (int x = 0; x < stride; ++x)
      made.pictures.push_back(picture_of(view, made.camera, box, box.x0 + x, box.y0 + y, stride));
  return made;
}

SplatLight show(const Splats& splats, const SplatView& view, const SplatPicture& picture) {
  SplatLight light;
  for (std::vector<float>& channel : light) channel.assign(picture.seen[0].size(), 0.F);
  const Eigen::Vector3d eye = view.camera.center();
  for (const Splat& splat : splats.all) {
    const Footprint f = footprint_of(splat, splats.unit, view, picture, eye);
    if (f.empty()) continue;
    each_four(f, picture, [&](std::size_t pixel) {
      const Lanes seen = Sight(f, picture, pixel).seen;
      for (std::size_t c = 0; c < 3; ++c) store(load(&light[c][pixel]) + f.light[c] * seen, &light[c][pixel]);
    });
  }
  return light;
}

void add_gradient(const Splats& splats, const SplatView& view, const SplatPicture& picture,
                  const SplatLight& slope, std::vector<Splat>& gradient) {
  const Eigen::Vector3d eye = view.camera.center();
  for (std::size_t s = 0; s < splats.all.size(); ++s) {
    const Footprint f = footprint_of(splats.all[s], splats.unit, view, picture, eye);
    if (!f.empty()) add_slopes(slopes_of(f, picture, slope), f, splats.all[s], splats.unit, gradient[s]);
  }
}

}  // namespace emberlock::paper
