// SPDX-License-Identifier: Apache-2.0
#include "recon/temperature/radiant.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "recon/compute/pool.h"

namespace emberlock::recon {
namespace {

constexpr double kPi = 3.14159265358979323846;
constexpr double kStefanBoltzmannConstant = 5.670374419e-8;  // W / (m^2 K^4), CODATA 2018
constexpr int kDirections = 64;
constexpr int kTowards = 4096;
constexpr int kSpherePoints = 256;
constexpr int kTowardsOfEach = 1024;
constexpr double kGoldenAngle = 2.399963229728653;

/// Evenly over the sphere, by equal steps of the height.
Eigen::Vector3d on_fibonacci_sphere(int i, int count, double lowest) {
  const double z = lowest + (1 - lowest) * (i + 0.5) / count;
  const double r = std::sqrt(std::max(0.0, 1 - z * z));
  return {r * std::cos(kGoldenAngle * i), r * std::sin(kGoldenAngle * i), z};
}

/// Two directions across a third.
std::array<Eigen::Vector3d, 2> across(const Eigen::Vector3d& along) {
  const Eigen::Vector3d other =
      std::abs(along.x()) < 0.7 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  const Eigen::Vector3d a = along.cross(other).normalized();
  return {a, along.cross(a)};
}

struct Bounds {
  Eigen::Vector3d low, high;
  explicit Bounds(const Grid& g) : low(g.origin[0], g.origin[1], g.origin[2]) {
    high = low + static_cast<double>(g.edge) * Eigen::Vector3d(g.nx - 1, g.ny - 1, g.nz - 1);
  }
  [[nodiscard]] Eigen::Vector3d middle() const { return (low + high) / 2; }
  [[nodiscard]] double radius() const { return (high - low).norm() / 2; }
  /// Where a ray is inside; empty if from >= to.
  [[nodiscard]] std::array<double, 2> clip(const Eigen::Vector3d& eye,
                                           const Eigen::Vector3d& direction) const {
    double from = 0;
    double to = std::numeric_limits<double>::infinity();
    for (int d = 0; d < 3; ++d) {
      if (direction[d] == 0) {
        if (eye[d] < low[d] || eye[d] > high[d]) return {0, 0};
        continue;
      }
      const double a = (low[d] - eye[d]) / direction[d];
      const double b = (high[d] - eye[d]) / direction[d];
      from = std::max(from, std::min(a, b));
      to = std::min(to, std::max(a, b));
    }
    return {from, to};
  }
};

/// Absorption, and absorption times T^4: both are trilinear.
struct Sample {
  double absorption = 0, glow = 0;
};
Sample sample_at(const HotVolume& v, const Eigen::Vector3d& place) {
  const Grid& g = v.grid;
  const std::array<int, 3> n = {g.nx, g.ny, g.nz};
  std::array<int, 3> low = {};
  std::array<double, 3> part = {};
  for (std::size_t d = 0; d < 3; ++d) {
    const double x = (place[static_cast<Eigen::Index>(d)] - static_cast<double>(g.origin[d])) /
                     static_cast<double>(g.edge);
    low[d] = std::clamp(static_cast<int>(std::floor(x)), 0, n[d] - 2);
    part[d] = std::clamp(x - low[d], 0.0, 1.0);
  }
  Sample out;
  for (int corner = 0; corner < 8; ++corner) {
    const std::array<int, 3> up = {corner & 1, (corner >> 1) & 1, corner >> 2};
    double weight = 1;
    for (std::size_t d = 0; d < 3; ++d) weight *= up[d] != 0 ? part[d] : 1 - part[d];
    if (weight == 0) continue;
    const std::size_t p = g.index(low[0] + up[0], low[1] + up[1], low[2] + up[2]);
    const double kappa = static_cast<double>(v.absorption[p]);
    out.absorption += weight * kappa;
    const double square = static_cast<double>(v.kelvin[p]) * static_cast<double>(v.kelvin[p]);
    out.glow += weight * kappa * square * square;
  }
  return out;
}

/// Directions from a point that reach all of a volume, of equal solid angles.
class Towards {
 public:
  Towards(const Bounds& bounds, const Eigen::Vector3d& point, const Eigen::Vector3d& normal, int count)
      : count_(count), axis_(normal) {
    const Eigen::Vector3d way = bounds.middle() - point;
    const double sine = bounds.radius() / way.norm();
    if (sine < 1) {
      axis_ = way.normalized();
      lowest_ = std::sqrt(1 - sine * sine);
    }
    side_ = across(axis_);
  }
  [[nodiscard]] Eigen::Vector3d direction(int i) const {
    const Eigen::Vector3d d = on_fibonacci_sphere(i, count_, lowest_);
    return d.x() * side_[0] + d.y() * side_[1] + d.z() * axis_;
  }
  [[nodiscard]] double solid_angle() const { return 2 * kPi * (1 - lowest_) / count_; }  // of each

 private:
  int count_;
  Eigen::Vector3d axis_;
  std::array<Eigen::Vector3d, 2> side_;
  double lowest_ = 0;  // cosine of the cone's half angle
};

/// Of directions `begin` to `end`.
double flux_part(const HotVolume& volume, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                 const Towards& towards, int begin, int end) {
  double flux = 0;
  for (int i = begin; i < end; ++i) {
    const Eigen::Vector3d direction = towards.direction(i);
    const double cosine = direction.dot(normal);
    if (cosine > 0) flux += cosine * total_radiance(volume, point, direction);
  }
  return flux * towards.solid_angle();
}

/// The share of what radiates that lies within a sphere.
double held_by(const TargetSphere& sphere, const HotVolume& v) {
  const Grid& g = v.grid;
  const Eigen::Vector3d origin(g.origin[0], g.origin[1], g.origin[2]);
  double within = 0;
  double all = 0;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t p = g.index(i, j, k);
        if (!(v.kelvin[p] > 0 && v.absorption[p] > 0)) continue;
        const double radiates =
            static_cast<double>(v.absorption[p]) * std::pow(static_cast<double>(v.kelvin[p]), 4);
        all += radiates;
        const Eigen::Vector3d place = origin + static_cast<double>(g.edge) * Eigen::Vector3d(i, j, k);
        if ((place - sphere.center).norm() <= sphere.radius) within += radiates;
      }
  return all > 0 ? within / all : 0;
}

}  // namespace

double total_radiance(const HotVolume& volume, const Eigen::Vector3d& eye, const Eigen::Vector3d& direction) {
  const auto [from, to] = Bounds(volume.grid).clip(eye, direction);
  if (!(from < to)) return 0;
  const int steps =
      std::max(1, static_cast<int>(std::ceil((to - from) / (0.5 * static_cast<double>(volume.grid.edge)))));
  const double length = (to - from) / steps;
  double left = 1;
  double sum = 0;
  for (int i = 0; i < steps && left > 1e-9; ++i) {
    const Sample s = sample_at(volume, eye + (from + (i + 0.5) * length) * direction);
    if (!(s.absorption > 0)) continue;
    const double taken = -std::expm1(-s.absorption * length);
    sum += left * taken * s.glow / s.absorption;
    left *= 1 - taken;
  }
  return kStefanBoltzmannConstant / kPi * sum;
}

double radiated_power(const HotVolume& volume, const ComputeOptions& compute) {
  const Bounds bounds(volume.grid);
  const double spacing = 2 * static_cast<double>(volume.grid.edge);
  const double radius = bounds.radius();
  const int rays = static_cast<int>(std::ceil(radius / spacing));
  std::vector<double> power(kDirections);
  Pool(compute.threads).run(kDirections, [&](int i) {
    const Eigen::Vector3d along = on_fibonacci_sphere(i, kDirections, -1);
    const auto [right, up] = across(along);
    double sum = 0;
    for (int y = -rays; y <= rays; ++y)
      for (int x = -rays; x <= rays; ++x)
        sum +=
            total_radiance(volume, bounds.middle() - radius * along + spacing * (x * right + y * up), along);
    power[static_cast<std::size_t>(i)] = sum * spacing * spacing * 4 * kPi / kDirections;
  });
  double sum = 0;
  for (const double p : power) sum += p;
  return sum;
}

double radiant_flux(const HotVolume& volume, const Eigen::Vector3d& point, const Eigen::Vector3d& normal,
                    const ComputeOptions& compute) {
  constexpr int kTasks = 64;
  const Towards towards(Bounds(volume.grid), point, normal, kTowards);
  std::vector<double> flux(kTasks);
  Pool(compute.threads).run(kTasks, [&](int task) {
    const auto [begin, end] = slice(kTowards, kTasks, task);
    flux[static_cast<std::size_t>(task)] =
        flux_part(volume, point, normal, towards, static_cast<int>(begin), static_cast<int>(end));
  });
  double sum = 0;
  for (const double f : flux) sum += f;
  return sum;
}

SphereFlux radiant_flux(const HotVolume& volume, const TargetSphere& target, const ComputeOptions& compute) {
  SphereFlux out;
  out.held = held_by(target, volume);
  const double side = out.held > 0.5 ? -1 : 1;
  const Bounds bounds(volume.grid);
  std::vector<double> flux(kSpherePoints);
  Pool(compute.threads).run(kSpherePoints, [&](int i) {
    const Eigen::Vector3d outwards = on_fibonacci_sphere(i, kSpherePoints, -1);
    const Eigen::Vector3d point = target.center + target.radius * outwards;
    const Towards towards(bounds, point, side * outwards, kTowardsOfEach);
    flux[static_cast<std::size_t>(i)] = flux_part(volume, point, side * outwards, towards, 0, kTowardsOfEach);
  });
  for (const double f : flux) {
    out.mean += f / kSpherePoints;
    out.most = std::max(out.most, f);
  }
  out.power = out.mean * 4 * kPi * target.radius * target.radius;
  return out;
}

HotStatistics statistics_of(const HotVolume& volume, const std::vector<float>& sigma,
                            const Eigen::Vector3d& up) {
  HotStatistics out;
  const Grid& g = volume.grid;
  double weights = 0;
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  for (int k = 0; k < g.nz; ++k)
    for (int j = 0; j < g.ny; ++j)
      for (int i = 0; i < g.nx; ++i) {
        const std::size_t p = g.index(i, j, k);
        const auto kelvin = static_cast<double>(volume.kelvin[p]);
        if (!(kelvin > 0)) continue;
        ++out.points;
        const double weight = volume.absorption[p] > 0 ? static_cast<double>(volume.absorption[p]) : 1;
        weights += weight;
        out.mean += weight * kelvin;
        out.mean_error += weight * static_cast<double>(sigma[p]);
        if (kelvin > out.most) {
          out.most = kelvin;
          out.most_error = static_cast<double>(sigma[p]);
        }
        const double height = up.dot(Eigen::Vector3d(i, j, k)) * static_cast<double>(g.edge);
        low = std::min(low, height);
        high = std::max(high, height);
      }
  if (out.points == 0) return out;
  out.volume = static_cast<double>(out.points) * std::pow(static_cast<double>(g.edge), 3);
  out.height = high - low + static_cast<double>(g.edge);
  out.mean /= weights;
  out.mean_error /= weights;
  return out;
}

}  // namespace emberlock::recon
