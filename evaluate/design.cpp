// SPDX-License-Identifier: Apache-2.0
#include "evaluate/design.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include "evaluate/machine_speed.h"
#include "evaluate/option_range.h"
#include "evaluate/twin.h"
#include "recon/kernels/planck.h"

namespace emberlock::evaluate {
namespace {

constexpr double kDesignRadian = std::numbers::pi / 180;
constexpr Seconds kDesignNoiseExposure = milliseconds(4);  // for which the noise is told
constexpr double kNoiseKelvin = 1800;
constexpr double kBrightnessNm = 600;
constexpr Seconds kShortestExposure = milliseconds(0.02);
constexpr double kLongestShare = 0.9;  // of the frame period
constexpr double kBeside = 20 * kDesignRadian;

DesignedRig with_tolerance(const ErrorLaw& law, DesignRequest request, const DesignedRig& rig,
                           Seconds tolerance) {
  request.tolerance = tolerance;
  return designed(law, request, rig.cameras, rig.size);
}

/// Noise and motion blur in balance.
Seconds exposure_for(const ErrorLaw& law, const DesignRequest& request, int cameras) {
  const Seconds longest = kLongestShare * period(request.rate);
  const double rise = request.speed / request.size.value();  // heights a second
  if (!(rise > 0)) return longest;
  const double noise = pixel_noise(request, Seconds(1 / rise));
  const double exposed = balanced_exposure(law, static_cast<std::size_t>(cameras), noise);
  return Seconds(std::clamp(exposed / rise, kShortestExposure.value(), longest.value()));
}

TwinRig seen_by(const DesignRequest& request, Seconds exposure, Seconds tolerance) {
  const double rise = request.speed / request.size.value();
  TwinRig twin;
  twin.noise = pixel_noise(request, exposure);
  twin.exposed = rise * exposure.value();
  twin.late = rise * tolerance.value();
  return twin;
}

std::vector<DesignStep> steps_from(const ErrorLaw& law, const DesignRequest& request,
                                   const DesignedRig& here) {
  std::vector<DesignStep> all;
  const auto add = [&](std::string what, const DesignedRig& to) {
    const double gain = here.error() - to.error();
    if (gain > 1e-3) all.push_back({std::move(what), to, gain});
  };
  if (here.cameras < request.most_cameras)
    add("one more camera", designed(law, request, here.cameras + 1, here.size));
  if (here.cameras + 3 < request.most_cameras)
    add("four more cameras", designed(law, request, here.cameras + 4, here.size));
  const std::vector<ImageSize> sizes = design_sizes();
  const auto finer =
      std::find_if(sizes.begin(), sizes.end(), [&](ImageSize size) { return size.width > here.size.width; });
  if (finer != sizes.end())
    add(fmt::format("pictures of {}x{}", finer->width, finer->height),
        designed(law, request, here.cameras, *finer));
  add("half the tolerance", with_tolerance(law, request, here, 0.5 * here.tolerance));
  DesignRequest brighter = request;
  brighter.noise *= 0.5;
  add("sensors with half the noise", designed(law, brighter, here.cameras, here.size));
  std::stable_sort(all.begin(), all.end(),
                   [](const DesignStep& a, const DesignStep& b) { return a.gain > b.gain; });
  return all;
}

}  // namespace

Status check_design(const DesignRequest& r) {
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame, size", r.size.value(), 1e-3, 100));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame, speed", r.speed, 0, 100));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--flame, temperature", r.temperature.value(), 600, 5000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--target-error", r.target, 1e-3, 255));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--tolerance", in_milliseconds(r.tolerance), 0, 1000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--noise", r.noise, 0, 50));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--lens", r.lens, 5, 120));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--most-cameras", r.most_cameras, 3, 64));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--fps", r.rate.value(), 0.1, 10000));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--bytes-per-pixel", r.bytes_per_pixel, 1, 8));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--camera-price", r.camera_price, 0, 1e6));
  EMBERLOCK_RETURN_IF_ERROR(in_range("--host-link", r.host_link / 1e6, 1, 1e6));
  return in_range("--seconds", r.film.value(), 0.1, 1e6);
}

double pixel_noise(const DesignRequest& request, Seconds exposure) {
  const double fainter = recon::log_planck(kBrightnessNm, kNoiseKelvin) -
                         recon::log_planck(kBrightnessNm, request.temperature.value());
  return request.noise * std::sqrt(kDesignNoiseExposure / exposure * std::exp(fainter));
}

std::vector<ImageSize> design_sizes() {
  return {{160, 120}, {320, 240}, {640, 480}, {1280, 960}, {1920, 1440}};
}

DesignedRig designed(const ErrorLaw& law, const DesignRequest& request, int cameras, ImageSize size) {
  DesignedRig rig;
  rig.cameras = cameras;
  rig.size = size;
  rig.voxels = twin_voxels(size.width);
  rig.exposure = exposure_for(law, request, cameras);
  rig.tolerance = request.tolerance;
  rig.twin = seen_by(request, rig.exposure, rig.tolerance);
  rig.twin.towards = even_planes(cameras);
  rig.twin.pixel = resolved(twin_pixel(size.width));
  rig.squares = predict(law, rig.twin);
  rig.euros = cameras * request.camera_price;
  return rig;
}

Design design(const ErrorLaw& law, const DesignRequest& request) {
  Design result;
  const auto better = [&](const DesignedRig& rig) {
    if (result.chosen.cameras == 0) return true;
    const bool reaches = rig.error() <= request.target;
    return reaches ? !result.reached : !result.reached && rig.error() < result.chosen.error();
  };
  for (int cameras = 3; cameras <= request.most_cameras; ++cameras)
    for (const ImageSize size : design_sizes()) {
      result.curve.push_back(designed(law, request, cameras, size));
      if (!better(result.curve.back())) continue;
      result.chosen = result.curve.back();
      result.reached = result.chosen.error() <= request.target;
    }
  result.steps = steps_from(law, request, result.chosen);
  return result;
}

std::vector<recon::CameraModel> placed(const DesignRequest& request, const DesignedRig& rig) {
  const double focal = rig.size.width / (2 * std::tan(0.5 * request.lens * kDesignRadian));
  const recon::Intrinsics lens{rig.size, focal, focal, rig.size.width / 2.0, rig.size.height / 2.0, {}};
  const double pixel = twin_pixel(rig.size.width) * request.size.value();
  std::vector<recon::CameraModel> cameras;
  for (const Eigen::Vector3d& towards : even_planes(rig.cameras))
    cameras.push_back(recon::look_at(lens, focal * pixel * towards, Eigen::Vector3d::Zero()));
  return cameras;
}

Result<Recording> recording_of(const DesignRequest& request, const DesignedRig& rig, double disk) {
  PlannedRig planned{rig.cameras, rig.size, request.rate.value(), request.bytes_per_pixel};
  EMBERLOCK_ASSIGN_OR_RETURN(const RigExpectation expected,
                             expectation(planned, disk, {Seconds(1), Seconds(1)}));
  Recording recording;
  recording.bytes_per_s = expected.bytes_per_s;
  recording.bytes = expected.bytes_per_s * request.film.value();
  const double of_one = expected.bytes_per_s / rig.cameras;
  const int a_host = static_cast<int>(request.host_link / of_one);
  if (a_host < 1 || expected.cameras_recorded < 1)
    return Error{ErrorKind::refused, fmt::format("one camera sends {:.3g} MB/s", of_one / 1e6),
                 a_host < 1 ? "--host-link" : "the disk, at half as much to spare",
                 "Film fewer frames a second, or use a faster link or disk"};
  recording.hosts = (rig.cameras + a_host - 1) / a_host;
  for (int host = 0; host < recording.hosts; ++host) {  // shared as evenly as can be
    const int cameras = rig.cameras / recording.hosts + (host < rig.cameras % recording.hosts ? 1 : 0);
    recording.disks += (cameras + expected.cameras_recorded - 1) / expected.cameras_recorded;
  }
  return recording;
}

std::vector<NextCamera> next_cameras(const ErrorLaw& law, const TwinRig& rig, std::size_t count) {
  std::vector<NextCamera> all;
  for (int elevation = -20; elevation <= 40; elevation += 10)
    for (int azimuth = 0; azimuth < 360; azimuth += 10) {
      const double e = elevation * kDesignRadian;
      const double a = azimuth * kDesignRadian;
      const Eigen::Vector3d towards(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
      TwinRig with = rig;
      with.towards.push_back(towards);
      all.push_back({towards, total(predict(law, with))});
    }
  std::stable_sort(all.begin(), all.end(),
                   [](const NextCamera& a, const NextCamera& b) { return a.error < b.error; });
  std::vector<NextCamera> best;
  for (const NextCamera& place : all) {
    if (best.size() == count) break;
    if (std::none_of(best.begin(), best.end(), [&](const NextCamera& other) {
          return place.towards.dot(other.towards) > std::cos(kBeside);
        }))
      best.push_back(place);
  }
  return best;
}

Result<StandingRig> standing(const std::vector<recon::CameraModel>& cameras,
                             const std::optional<Eigen::Vector3d>& middle) {
  const auto refused = [](const char* what, const char* remedy) {
    return Error{ErrorKind::bad_input, what, "--rig", remedy};
  };
  if (cameras.size() < 2) return refused("has fewer than two placed cameras", "Calibrate them first");
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  Eigen::Vector3d at = Eigen::Vector3d::Zero();
  Eigen::Vector3d up = Eigen::Vector3d::Zero();
  for (const recon::CameraModel& camera : cameras) {
    const Eigen::Matrix3d& axes = camera.camera_from_world.rotation;
    const Eigen::Vector3d forward = axes.row(2);
    const Eigen::Matrix3d across = Eigen::Matrix3d::Identity() - forward * forward.transpose();
    sum += across;
    at += across * camera.center();
    up -= axes.row(1).transpose();
  }
  StandingRig rig;
  if (middle) {
    rig.flame = *middle;
  } else {
    const double least = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(sum).eigenvalues().minCoeff();
    if (!(least > 1e-6 * static_cast<double>(cameras.size())))
      return refused("all cameras look the same way, so where the flame is isn't told", "Give the rig a box");
    rig.flame = sum.ldlt().solve(at);
  }
  if (!(up.norm() > 1e-6)) up = Eigen::Vector3d::UnitZ();
  rig.world_from_twin =
      Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), up.normalized()).toRotationMatrix();
  for (const recon::CameraModel& camera : cameras) {
    const Eigen::Vector3d from_flame = camera.center() - rig.flame;
    if (!(from_flame.norm() > 1e-6)) return refused("a camera stands in the flame's middle", "Move the box");
    rig.towards.push_back(rig.world_from_twin.transpose() * from_flame.normalized());
    rig.distance += from_flame.norm() / static_cast<double>(cameras.size());
    rig.pixel += std::pow(from_flame.norm() / camera.intrinsics.fx, 2) / static_cast<double>(cameras.size());
  }
  rig.pixel = std::sqrt(rig.pixel);
  return rig;
}

TwinRig twin_of(const ErrorLaw& law, const DesignRequest& request, const StandingRig& rig) {
  TwinRig twin =
      seen_by(request, exposure_for(law, request, static_cast<int>(rig.towards.size())), request.tolerance);
  twin.towards = rig.towards;
  twin.pixel = resolved(rig.pixel / request.size.value());
  return twin;
}

}  // namespace emberlock::evaluate
