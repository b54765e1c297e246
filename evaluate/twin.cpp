// SPDX-License-Identifier: Apache-2.0
#include "evaluate/twin.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include <fmt/format.h>

#include "base/random.h"
#include "evaluate/filmed_rig.h"
#include "recon/adjust/picture_error.h"
#include "recon/pipeline/reconstruct.h"
#include "recon/synthetic/flame.h"

namespace emberlock::evaluate {
namespace {

constexpr double kTwinRadian = std::numbers::pi / 180;
constexpr double kTwinFlame = 0.16;                   // metres, in a box of 0.2, as filmed_scene() has it
constexpr double kTwinDistance = 0.3;                 // metres
const double kHalfPicture = 1 / std::numbers::sqrt3;  // tan(30 degrees)
constexpr double kBox = 0.2;
constexpr int kRaysAcross = 320;  // of small pictures, so that their pixels are averages
constexpr int kJudgeWidth = 240;
constexpr int kTwinTruth = 97;  // voxels: no solver's grid

recon::CameraModel twin_camera(const Eigen::Vector3d& towards, int width) {
  const double focal = width / (2 * kHalfPicture);
  const int height = width * 3 / 4;
  const recon::Intrinsics lens{{width, height}, focal, focal, width / 2.0, height / 2.0, {}};
  return recon::look_at(lens, kTwinDistance * towards, Eigen::Vector3d::Zero());
}

/// Evenly, alternately 10 degrees above and below.
std::vector<Eigen::Vector3d> on_arc(int cameras, double degrees) {
  std::vector<Eigen::Vector3d> all;
  for (int i = 0; i < cameras; ++i) {
    const double a = (i + 0.5) * degrees / cameras * kTwinRadian;
    const double e = (i % 2 == 0 ? 10 : -10) * kTwinRadian;
    all.emplace_back(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  }
  return all;
}

/// Rises by a height a second, so that TwinRig's lengths are its times.
recon::PaperSceneOptions twin_flame(std::uint64_t seed) {
  recon::PaperSceneOptions options;
  options.flame.seed = seed;
  options.flame.height = Meters(kTwinFlame);
  options.flame.rise_speed = kTwinFlame;
  options.truth_voxels = kTwinTruth;
  options.truth_step = 1;
  return options;
}

/// What the rig's cameras see.
std::vector<recon::View> filmed(const TwinRig& rig, std::uint64_t seed) {
  const int width = std::max(16, static_cast<int>(std::lround(twin_pixel(1) / rig.pixel)));
  const int rays = std::max(1, static_cast<int>(std::lround(1.0 * kRaysAcross / width)));
  recon::PaperSceneOptions options = twin_flame(seed);
  options.exposure = Seconds(rig.exposed);
  std::vector<recon::View> views;
  for (const Eigen::Vector3d& towards : rig.towards) {
    const std::uint64_t i = views.size();
    views.push_back({fmt::format("camera {}", i), twin_camera(towards, width * rays), {}});
    views.back().lateness = Seconds(rig.late * (2 * random_uniform(seed, 100, i) - 1));
  }
  views = recon::filmed_scene(std::move(views), options).views;
  for (std::size_t i = 0; i < views.size(); ++i) {
    views[i] = averaged(views[i], rays, rig.noise, seed, 200 + i);
    views[i].lateness = Seconds(0);  // within the tolerance nobody knows it
  }
  return views;
}

}  // namespace

double twin_pixel(int width) { return 2 * kHalfPicture * kTwinDistance / kTwinFlame / width; }

int twin_voxels(int width) {
  return std::clamp(static_cast<int>(std::lround(kBox / kTwinFlame / (2 * twin_pixel(width)))), 8, 192);
}

double resolved(double pixel) { return std::max(pixel, kBox / kTwinFlame / (2 * 192)); }

std::vector<NamedRig> sweep_rigs() {
  const TwinRig base{even_planes(9), twin_pixel(96), 1, 0, 0};
  std::vector<NamedRig> rigs{{"nine cameras, 96 pixels", base}};
  const auto vary = [&](const std::string& what, auto change) {
    rigs.push_back({what, base});
    change(rigs.back().rig);
  };
  for (const int cameras : {4, 6, 16})
    vary(fmt::format("{} cameras", cameras), [&](TwinRig& rig) { rig.towards = even_planes(cameras); });
  for (const double arc : {150.0, 240.0})
    vary(fmt::format("on {:g} degrees", arc), [&](TwinRig& rig) { rig.towards = on_arc(9, arc); });
  vary("8 on a ring", [](TwinRig& rig) { rig.towards = on_arc(8, 360); });
  for (const int width : {48, 64, 160})
    vary(fmt::format("{} pixels", width), [&](TwinRig& rig) { rig.pixel = twin_pixel(width); });
  for (const double noise : {0.0, 5.0})
    vary(fmt::format("noise {:g}", noise), [&](TwinRig& rig) { rig.noise = noise; });
  for (const double rise : {0.06, 0.15})
    vary(fmt::format("exposed {:g}", rise), [&](TwinRig& rig) { rig.exposed = rise; });
  for (const double rise : {0.02, 0.06})
    vary(fmt::format("late {:g}", rise), [&](TwinRig& rig) { rig.late = rise; });
  // In several parts, so that the law's spread tells of such rigs too.
  rigs.push_back({"6 cameras, 64 pixels, moving", {even_planes(6), twin_pixel(64), 0.5, 0.04, 0.01}});
  rigs.push_back({"12 on a ring, 160 pixels, late", {on_arc(12, 360), twin_pixel(160), 2, 0, 0.03}});
  return rigs;
}

std::vector<NamedRig> check_rigs() {
  std::vector<Eigen::Vector3d> scattered;
  for (std::uint64_t i = 0; i < 12; ++i) {
    const double azimuth = 360 * random_uniform(5, 0, i);
    const double height = std::sin(0.5 * (2 * random_uniform(5, 1, i) - 1));
    const double across = std::sqrt(1 - height * height);
    scattered.emplace_back(across * std::cos(azimuth * kTwinRadian), across * std::sin(azimuth * kTwinRadian),
                           height);
  }
  const auto rise = [](double speed, double size, double ms) { return speed / size * ms * 1e-3; };
  return {{"5 on planes of their own, 128 pixels; 0.16 m, 2 m/s, 1 ms, within 0.5 ms",
           {even_planes(5), twin_pixel(128), 1.5, rise(2, 0.16, 1), rise(2, 0.16, 0.5)}},
          {"10 on a ring, opposite one another, 200 pixels; 0.5 m, 3 m/s, 8 ms, within 2 ms",
           {on_arc(10, 360), twin_pixel(200), 0.7, rise(3, 0.5, 8), rise(3, 0.5, 2)}},
          {"7 on an arc of 200 degrees, 160 pixels; 2 m, 4 m/s, 10 ms, within 5 ms",
           {on_arc(7, 200), twin_pixel(160), 1, rise(4, 2, 10), rise(4, 2, 5)}},
          {"12 scattered, 80 pixels; 0.1 m, 1 m/s, 4 ms, within 0.5 ms",
           {scattered, twin_pixel(80), 2, rise(1, 0.1, 4), rise(1, 0.1, 0.5)}},
          {"14 on planes of their own, 240 pixels; 1 m, 5 m/s, 20 ms, within 2 ms",
           {even_planes(14), twin_pixel(240), 0.5, rise(5, 1, 20), rise(5, 1, 2)}}};
}

std::vector<std::string> list_extrapolated(const TwinRig& rig) {
  std::vector<NamedRig> simulated = sweep_rigs();
  const std::vector<NamedRig> checked = check_rigs();
  simulated.insert(simulated.end(), checked.begin(), checked.end());
  std::vector<std::string> beyond;
  const auto compare = [&](auto part, const char* words) {
    double low = INFINITY, high = -INFINITY;
    for (const NamedRig& one : simulated) {
      low = std::min(low, part(one.rig));
      high = std::max(high, part(one.rig));
    }
    const double value = part(rig);
    const double slack = 1e-9 * high;
    if (value >= low - slack && value <= high + slack) return;
    beyond.push_back(fmt::format("{:.3g} {} (simulated: {:.3g} to {:.3g})", value, words, low, high));
  };
  compare([](const TwinRig& r) { return static_cast<double>(r.towards.size()); }, "cameras");
  compare([](const TwinRig& r) { return twin_pixel(1) / r.pixel; }, "pixels across");
  compare([](const TwinRig& r) { return r.noise; }, "grey levels of noise");
  compare([](const TwinRig& r) { return r.exposed; }, "heights of rise in an exposure");
  compare([](const TwinRig& r) { return r.late; }, "heights of rise within the tolerance");
  return beyond;
}

Result<double> Twin::measure(const TwinRig& rig, const Clock& clock) {
  if (judges_.empty()) {
    for (const Eigen::Vector3d& towards : judge_directions())
      judges_.push_back({"judge", twin_camera(towards, kJudgeWidth), {}, recon::ViewRole::held_out});
    judges_ = recon::filmed_scene(std::move(judges_), twin_flame(seed_)).views;
  }
  recon::Scene scene;
  scene.box = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Constant(kBox)};
  scene.views = filmed(rig, seed_);
  const int width = scene.views.front().camera.intrinsics.size.width;
  scene.views.insert(scene.views.end(), judges_.begin(), judges_.end());
  recon::ReconstructOptions options;
  options.voxels = twin_voxels(width);
  options.solve.compute = {recon::Device::cpu, threads_};
  EMBERLOCK_ASSIGN_OR_RETURN(options.effects, recon::parse_effects("auto"));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Outcome outcome, recon::reconstruct(scene, options, clock));
  return recon::all_channels(*outcome.report.heldout_rmse);
}

Result<std::vector<MeasuredRig>> measure_all(Twin& twin, const std::vector<NamedRig>& rigs,
                                             const Clock& clock, const Progress& progress) {
  std::vector<MeasuredRig> measured;
  for (const NamedRig& named : rigs) {
    tell(progress, static_cast<double>(measured.size()) / static_cast<double>(rigs.size()), named.name);
    EMBERLOCK_ASSIGN_OR_RETURN(const double error, twin.measure(named.rig, clock));
    measured.push_back({named.rig, error});
  }
  tell(progress, 1, "done");
  return measured;
}

}  // namespace emberlock::evaluate
