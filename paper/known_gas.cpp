// SPDX-License-Identifier: Apache-2.0
#include "paper/known_gas.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "base/random.h"
#include "recon/export/volume_file.h"
#include "recon/render/render.h"
#include "recon/temperature/emitter.h"

namespace emberlock::paper {
namespace {

constexpr double kFieldOfView = 60;  // degrees
constexpr double kPeak = 230;        // grey levels
constexpr float kFaintest = 0.01F;   // of the brightest light: beyond it there is no medium
constexpr double kFlameWidth = 0.4, kSmokeWidth = 0.6;  // metres

double radians(double degrees) { return degrees * std::numbers::pi / 180; }

/// How long gas is followed on each grid, each twice as fine as the one before: to stand, to find its
/// structures, to sharpen them.
struct Stage {
  int cells;  // of the finest: a share
  double seconds;
};
constexpr Stage kStages[] = {{4, 0.8}, {2, 0.1}, {1, 0.02}};
constexpr int kParts = 20;  // of a stage, for progress

recon::FlameSimulationOptions simulation_of(Subject subject, int cells,
                                            const recon::ComputeOptions& compute) {
  recon::FlameSimulationOptions o;
  o.nx = o.ny = o.nz = cells;
  o.edge = Meters((subject == Subject::flame ? kFlameWidth : kSmokeWidth) / cells);
  o.compute = compute;
  o.eddies = 0.1;
  o.confinement = 0.1;
  o.burners = {{Meters(0), Meters(0), Meters(0.01), 1.0}};
  o.gas.mixing_time = 0.004F;
  if (subject == Subject::smoke) {
    o.combustion = recon::Combustion::none;
    o.burners = {{Meters(0), Meters(0), Meters(0.05), 0.5}};
    o.gas.burner_temperature = 600;
    o.burner_soot = 0.01;
  }
  return o;
}

recon::CameraModel camera_at(const CameraPlace& place, const recon::Box& box, ImageSize size) {
  const double focal = std::max(size.width, size.height) / 2.0 / std::tan(radians(kFieldOfView / 2));
  const recon::Intrinsics pinhole{size, focal, focal, size.width / 2.0, size.height / 2.0, {}};
  const double a = radians(place.azimuth);
  const double e = radians(place.elevation);
  const Eigen::Vector3d direction(std::cos(e) * std::cos(a), std::cos(e) * std::sin(a), std::sin(e));
  return recon::look_at(pinhole, box.center + 1.5 * box.size.x() * direction, box.center);
}

/// Turned by small angles about its own axes.
recon::CameraModel pointing_beside(recon::CameraModel camera, double pixels, std::uint64_t seed,
                                   std::uint64_t view) {
  const double sigma = pixels / camera.intrinsics.fx;
  Eigen::Matrix3d turn = Eigen::Matrix3d::Identity();
  for (std::uint64_t axis = 0; axis < 3; ++axis)
    turn = Eigen::AngleAxisd(sigma * random_normal(seed, view, axis),
                             Eigen::Vector3d::Unit(static_cast<Eigen::Index>(axis))) *
           turn;
  const Eigen::Vector3d center = camera.center();
  camera.camera_from_world.rotation = turn * camera.camera_from_world.rotation;
  camera.camera_from_world.translation = -(camera.camera_from_world.rotation * center);
  return camera;
}

/// As a camera of 8 bits gives it.
void digitise(recon::RadianceImage& image, double noise, std::uint64_t seed, std::uint64_t view) {
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    double level = static_cast<double>(image.rgb[i]);
    if (noise > 0) level += noise * random_normal(seed, 1000 + view, i);
    image.rgb[i] = static_cast<float>(std::clamp(std::round(level), 0.0, 255.0));
  }
}

/// What cameras see of it.
std::vector<recon::RadianceImage> pictures_of(const KnownGas& gas,
                                              const std::vector<recon::CameraModel>& models,
                                              const recon::ComputeOptions& compute) {
  std::vector<const recon::CameraModel*> cameras;
  cameras.reserve(models.size());
  for (const recon::CameraModel& model : models) cameras.push_back(&model);
  if (gas.optics == Optics::physical)
    return recon::film_gas(gas.gas, gas.response, gas.sun, cameras, compute);
  recon::Effects effects;
  effects.extinction.model = recon::Extinction::Model::field;
  recon::RenderOptions march;
  march.compute = compute;
  return recon::render_views(gas.light, recon::whole_grid(gas.light.grid), effects, cameras,
                             std::vector<const recon::RadianceImage*>(cameras.size()), march);
}

/// By what the light is to be multiplied so that the brightest of a few pictures from the side has kPeak
/// levels.
Result<double> exposure_of(const KnownGas& gas, const recon::ComputeOptions& compute) {
  std::vector<recon::CameraModel> models;
  for (const double azimuth : {0.0, 50.0, 100.0})
    models.push_back(camera_at({azimuth, 0}, gas.box, {160, 160}));
  float brightest = 0;
  for (const recon::RadianceImage& picture : pictures_of(gas, models, compute))
    brightest = std::max(brightest, *std::max_element(picture.rgb.begin(), picture.rgb.end()));
  if (!(brightest > 0) || !std::isfinite(brightest))
    return Error{ErrorKind::refused, "nothing is seen of it", std::string(name(gas.subject)),
                 "Take more cells"};
  return kPeak / static_cast<double>(brightest);
}

void expose(KnownGas& gas, double gain) {
  for (std::vector<double>& channel : gas.response.level)
    for (double& level : channel) level *= gain;
}

/// What follows from the gas.
Result<KnownGas> known(Subject subject, recon::GasState gas, const recon::ComputeOptions& compute) {
  KnownGas out;
  out.subject = subject;
  out.gas = std::move(gas);
  if (subject == Subject::smoke) out.sun = recon::Sun{{0.5, -1, 1}, 0.8};
  const recon::Grid& g = out.gas.grid;
  out.box.size = static_cast<double>(g.edge) * Eigen::Vector3d(g.nx, g.ny, g.nz);
  out.response = daylight_camera();
  EMBERLOCK_ASSIGN_OR_RETURN(const double gain, exposure_of(out, compute));
  expose(out, gain);
  out.light = recon::visible_gas(out.gas, out.response, out.sun, compute);
  return out;
}

}  // namespace

std::string_view name(Subject subject) { return subject == Subject::flame ? "flame" : "smoke"; }

recon::CameraResponse daylight_camera() {
  recon::CameraResponse camera;
  camera.absolute = true;
  constexpr std::array<double, 3> kMiddle = {600, 540, 460};
  constexpr std::array<double, 3> kWidth = {40, 40, 30};
  for (double nm = 380; nm <= 780; nm += 5) {
    camera.wavelength_nm.push_back(nm);
    for (std::size_t c = 0; c < 3; ++c)
      camera.level[c].push_back(std::exp(-0.5 * std::pow((nm - kMiddle[c]) / kWidth[c], 2)));
  }
  const recon::EmitterLevels white = recon::levels_of(camera, recon::Emitter::grey, Kelvin(5500));
  for (std::size_t c = 0; c < 3; ++c)
    for (double& level : camera.level[c]) level /= white.value[c];
  return camera;
}

Result<KnownGas> simulate_gas(Subject subject, int cells, const recon::ComputeOptions& compute,
                              const Observer& observer) {
  if (cells < 32 || cells > 512 || cells % 32 != 0)
    return Error{ErrorKind::bad_input, fmt::format("{} cells", cells), "--cells",
                 "Give a multiple of 32 from 32 to 512"};
  const std::string what = fmt::format("the {} settles", name(subject));
  EMBERLOCK_ASSIGN_OR_RETURN(
      recon::FlameSimulation simulation,
      recon::FlameSimulation::make(simulation_of(subject, cells / kStages[0].cells, compute)));
  for (std::size_t stage = 0; stage < std::size(kStages); ++stage) {
    if (stage > 0) {
      EMBERLOCK_ASSIGN_OR_RETURN(simulation, simulation.finer());
    }
    for (int part = 0; part < kParts; ++part) {
      const double done =
          (static_cast<double>(stage) + static_cast<double>(part) / kParts) / std::size(kStages);
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, done, what));
      EMBERLOCK_RETURN_IF_ERROR(simulation.step(Seconds(kStages[stage].seconds / kParts)));
    }
  }
  recon::GasState gas = simulation.state();
  gas.grid.origin[2] -= gas.grid.edge * static_cast<float>(gas.grid.nz) / 2;
  return known(subject, std::move(gas), compute);
}

Result<KnownGas> as_the_paper_renders(const KnownGas& gas, int steps, const recon::ComputeOptions& compute) {
  KnownGas out = gas;
  out.optics = Optics::papers;
  const Meters step(gas.box.size.x() / steps);
  const auto sigma =
      static_cast<float>(recon::extinction_of_opacity(recon::kPaperOpacityOfAStep, step).value());
  std::vector<float>& light = out.light.emission;
  const float least = kFaintest * *std::max_element(light.begin(), light.end());
  for (std::size_t p = 0; p < out.light.extinction.size(); ++p)
    out.light.extinction[p] =
        std::max({light[3 * p], light[3 * p + 1], light[3 * p + 2]}) > least ? sigma : 0;
  EMBERLOCK_ASSIGN_OR_RETURN(const double gain, exposure_of(out, compute));
  expose(out, gain);
  for (float& level : light) level *= static_cast<float>(gain);
  return out;
}

Status write_gas(const KnownGas& gas, const std::filesystem::path& path) {
  return recon::write_volume(
      gas.light, path, {{"temperature", "K", gas.gas.temperature}, {"absorption", "1/m", gas.gas.absorption}},
      {}, recon::simulated());
}

Result<KnownGas> read_gas(Subject subject, const std::filesystem::path& path,
                          const recon::ComputeOptions& compute) {
  recon::GasState gas;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::Volume light, recon::read_volume(path));
  gas.grid = light.grid;
  EMBERLOCK_ASSIGN_OR_RETURN(gas.temperature, recon::read_grid(path, "temperature"));
  EMBERLOCK_ASSIGN_OR_RETURN(gas.absorption, recon::read_grid(path, "absorption"));
  return known(subject, std::move(gas), compute);
}

recon::Scene film(const KnownGas& gas, const Case& of, std::uint64_t seed,
                  const recon::ComputeOptions& compute) {
  recon::Scene scene;
  scene.box = gas.box;
  std::vector<recon::CameraModel> models;
  for (const CameraPlace& place : of.cameras) models.push_back(camera_at(place, gas.box, of.image));
  std::vector<recon::RadianceImage> pictures = pictures_of(gas, models, compute);
  for (std::size_t v = 0; v < models.size(); ++v) {
    const CameraPlace& place = of.cameras[v];
    const bool input = place.role == recon::ViewRole::input;
    digitise(pictures[v], input ? of.noise : 0, seed, v);
    recon::View view{fmt::format("{:.0f} degrees", place.azimuth), models[v],
                     recon::share(std::move(pictures[v])), place.role};
    if (input && of.pose_error > 0) view.camera = pointing_beside(models[v], of.pose_error, seed, v);
    scene.views.push_back(std::move(view));
  }
  return scene;
}

}  // namespace emberlock::paper
