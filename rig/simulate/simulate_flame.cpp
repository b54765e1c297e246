// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/simulate_flame.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"
#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "recon/render/render.h"
#include "recon/temperature/emitter.h"
#include "rig/devices/stage.h"
#include "session/writer.h"

namespace emberlock::rig {
namespace {

constexpr double kPeak = 230;                     // grey levels of the first frame's brightest pixel
constexpr double kElectronsPerLevel = 60;         // as drivers::VirtualScene has
constexpr std::int64_t kFirstNs = 1'000'000'000;  // the first frame's instant on all clocks
const Kelvin kReference{1800};                    // whose glow has about unit levels

Status check_simulate(const SimulateOptions& o) {
  const auto bad = [](const char* what, const char* range) {
    return Error{ErrorKind::bad_input, std::string(what) + " out of range", "simulate flame", range};
  };
  if (o.frames < 1 || o.frames > 10000) return bad("frames", "Take 1 to 10000");
  if (o.cameras < 2 || o.cameras > 64) return bad("cameras", "Take virtual:2 to virtual:64");
  for (const int side : {o.image.width, o.image.height})
    if (side < 64 || side > 4096 || side % 2 != 0)
      return bad("the image's size", "Take even sides of 64 to 4096");
  if (o.cells < 8 || o.cells > 512 || o.cells % 8 != 0)
    return bad("cells", "Take a multiple of 8 from 8 to 512");
  if (!(o.rate.value() >= 1 && o.rate.value() <= 10000)) return bad("the frame rate", "Take 1 to 10000 Hz");
  if (!(o.read_noise >= 0 && o.read_noise <= 50)) return bad("the noise", "Take 0 to 50 grey levels");
  if (o.preset == recon::FlamePreset::smoke)
    return Error{ErrorKind::refused, "smoke doesn't glow, so cameras in the dark would see nothing",
                 "simulate flame", "Take another preset"};
  return {};
}

/// The domain of the simulation, and cameras around it that see all of it.
Stage stage_around(const recon::FlameSimulationOptions& o, int cameras, ImageSize image) {
  const double edge = o.edge.value();
  const Eigen::Vector3d size(o.nx * edge, o.ny * edge, o.nz * edge);
  const Eigen::Vector3d center(0, 0, size.z() / 2);
  const double distance = 2.5 * size.z();
  const double focal = 0.75 * std::min(image.width, image.height) * distance / size.z();
  const recon::Intrinsics intrinsics{image, focal, focal, image.width / 2.0, image.height / 2.0, {}};
  Stage stage{{center, size}, {}};
  for (int i = 0; i < cameras; ++i) {
    const double azimuth = 300.0 / 180 * std::numbers::pi * i / (cameras - 1);
    const Eigen::Vector3d away(distance * std::cos(azimuth), distance * std::sin(azimuth),
                               (i % 2 == 0 ? 0.12 : -0.08) * distance);
    stage.cameras.push_back(recon::look_at(intrinsics, center + away, center));
  }
  return stage;
}

/// What the cameras see of a gas, in levels before the exposure.
recon::Volume glowing(const recon::GasState& gas, const recon::EmitterTable& table) {
  recon::Volume volume{gas.grid, std::vector<float>(3 * gas.grid.size()), gas.absorption};
  const double reference = table.at(kReference).log_scale;
  for (std::size_t p = 0; p < gas.grid.size(); ++p) {
    if (!(gas.absorption[p] > 0) || static_cast<double>(gas.temperature[p]) < table.coldest().value())
      continue;
    const recon::EmitterLevels levels = table.at(Kelvin(static_cast<double>(gas.temperature[p])));
    const double strength = static_cast<double>(gas.absorption[p]) * std::exp(levels.log_scale - reference);
    for (std::size_t c = 0; c < 3; ++c)
      volume.emission[3 * p + c] = static_cast<float>(strength * levels.value[c]);
  }
  return volume;
}

/// The camera's samples: exposed, with noise, in 8 bits.
Image sampled(const recon::RadianceImage& picture, double gain, const SimulateOptions& o,
              std::uint64_t stream) {
  Image image(ImageLayout{o.image, PixelFormat::rgb8, 8});
  const std::size_t row = 3 * static_cast<std::size_t>(o.image.width);
  for (int y = 0; y < o.image.height; ++y) {
    auto* to = image.row_as<std::uint8_t>(y);
    for (std::size_t x = 0; x < row; ++x) {
      const std::size_t at = static_cast<std::size_t>(y) * row + x;
      double level = gain * static_cast<double>(picture.rgb[at]);
      if (o.read_noise > 0)
        level += random_normal(o.seed, stream, at) *
                 std::sqrt(o.read_noise * o.read_noise + std::max(0.0, level) / kElectronsPerLevel);
      to[x] = static_cast<std::uint8_t>(std::clamp(std::lround(level), 0L, 255L));
    }
  }
  return image;
}

Result<session::SessionWriter> begin_session(const SimulateOptions& o, const Stage& stage,
                                             const std::filesystem::path& folder) {
  v1::Manifest manifest;
  manifest.set_session_id(fmt::format("simulated-{}", recon::name(o.preset)));
  manifest.set_purpose("flame");
  *manifest.mutable_box() = recon::message_of(stage.box);
  for (std::size_t i = 0; i < stage.cameras.size(); ++i)
    *manifest.add_cameras() = describe({.id = fmt::format("camera-{}", i),
                                        .model = "simulated",
                                        .layout = {o.image, PixelFormat::rgb8, 8},
                                        .frame_rate = o.rate},
                                       stage.cameras[i]);
  return session::SessionWriter::create(folder / "session", manifest);
}

/// One simulation and the cameras around it.
class Filming {
 public:
  Filming(const SimulateOptions& options, recon::FlameSimulation flame, Stage stage,
          session::SessionWriter writer, std::filesystem::path folder)
      : options_(options),
        flame_(std::move(flame)),
        stage_(std::move(stage)),
        writer_(std::move(writer)),
        folder_(std::move(folder)),
        table_(recon::standard_response(), recon::Emitter::soot) {
    for (const recon::CameraModel& camera : stage_.cameras) cameras_.push_back(&camera);
    film_.frames = options.frames;
    film_.cameras = options.cameras;
  }

  Status step(Seconds time) {
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::FluidStats stats, flame_.step(time));
    film_.relative_divergence = std::max(film_.relative_divergence, stats.relative_divergence);
    film_.hottest = std::max(film_.hottest, stats.hottest);
    return {};
  }
  /// Until gas that began at the floor has passed the top a few times.
  Status settle(const Observer& observer) {
    const auto& o = flame_.options();
    film_.settled = Seconds(5 * std::sqrt(o.nz * o.edge.value() / 9.81));
    constexpr int kParts = 50;
    for (int i = 0; i < kParts; ++i) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, static_cast<double>(i) / kParts, "the flame settles"));
      EMBERLOCK_RETURN_IF_ERROR(step(film_.settled / kParts));
    }
    return {};
  }
  Status film_frame(int frame) {
    const recon::GasState gas = flame_.state();
    recon::Volume volume = glowing(gas, table_);
    recon::Effects effects;
    effects.extinction.model = recon::Extinction::Model::field;
    recon::RenderOptions march;
    march.compute = options_.compute;
    const std::vector<const recon::RadianceImage*> backgrounds(cameras_.size());  // black
    const std::vector<recon::RadianceImage> pictures =
        recon::render_views(volume, recon::whole_grid(volume.grid), effects, cameras_, backgrounds, march);
    if (frame == 0) EMBERLOCK_RETURN_IF_ERROR(expose(pictures));
    const double gain = film_.levels_per_radiance;
    for (std::size_t c = 0; c < pictures.size(); ++c) {
      const auto id = static_cast<std::uint64_t>(frame);
      const TimePoint at = TimePoint{kFirstNs} + frame * period(options_.rate);
      const std::uint64_t stream = id * pictures.size() + c;
      EMBERLOCK_RETURN_IF_ERROR(writer_.write(
          c, {{id, at, at, at}, std::make_shared<Image>(sampled(pictures[c], gain, options_, stream))}));
    }
    for (float& e : volume.emission) e *= static_cast<float>(gain);
    return recon::write_volume(volume, folder_ / "truth" / fmt::format("frame-{:04}.vdb", frame),
                               {{"temperature", "K", gas.temperature}, {"velocity", "m/s", gas.velocity}});
  }
  Result<SimulatedFilm> finish() {
    const auto manifest = writer_.finish();
    if (!manifest.ok()) return manifest.error();
    return film_;
  }

 private:
  Status expose(const std::vector<recon::RadianceImage>& pictures) {
    float brightest = 0;
    for (const recon::RadianceImage& picture : pictures)
      brightest = std::max(brightest, *std::max_element(picture.rgb.begin(), picture.rgb.end()));
    if (!(brightest > 0))
      return Error{ErrorKind::refused, "nothing glows yet", "simulate flame", "Take more cells"};
    film_.levels_per_radiance = kPeak / static_cast<double>(brightest);
    return {};
  }

  SimulateOptions options_;
  recon::FlameSimulation flame_;
  Stage stage_;
  session::SessionWriter writer_;
  std::filesystem::path folder_;
  recon::EmitterTable table_;
  std::vector<const recon::CameraModel*> cameras_;
  SimulatedFilm film_;
};

}  // namespace

Result<SimulatedFilm> simulate_flame(const SimulateOptions& options, const std::filesystem::path& folder,
                                     const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(check_simulate(options));
  recon::FlameSimulationOptions gas = recon::flame_preset(options.preset, options.cells);
  gas.seed = options.seed;
  gas.compute = options.compute;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::FlameSimulation flame, recon::FlameSimulation::make(gas));
  std::error_code failed;
  std::filesystem::create_directories(folder / "truth", failed);
  if (failed) return Error{ErrorKind::io, failed.message(), (folder / "truth").string()};
  Stage stage = stage_around(gas, options.cameras, options.image);
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionWriter writer, begin_session(options, stage, folder));
  Filming filming(options, std::move(flame), std::move(stage), std::move(writer), folder);
  EMBERLOCK_RETURN_IF_ERROR(filming.settle(part_of(observer, 0, 0.3)));
  for (int frame = 0; frame < options.frames; ++frame) {
    EMBERLOCK_RETURN_IF_ERROR(
        observe(observer, 0.3 + 0.7 * frame / options.frames, fmt::format("frame {}", frame)));
    EMBERLOCK_RETURN_IF_ERROR(filming.step(period(options.rate)));
    EMBERLOCK_RETURN_IF_ERROR(filming.film_frame(frame));
  }
  return filming.finish();
}

}  // namespace emberlock::rig
