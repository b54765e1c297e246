// SPDX-License-Identifier: Apache-2.0
#include "rig/simulate/simulate_flame.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include <fmt/format.h>

#include "base/random.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "recon/calibrate/rig.h"
#include "recon/export/volume_file.h"
#include "rig/devices/stage.h"
#include "rig/simulate/gas_light.h"
#include "session/shutter_times.h"
#include "session/writer.h"
#include "smear_sync/align/stagger.h"

namespace emberlock::rig {
namespace {

constexpr double kPeak = 230;  // grey levels of the first frame's brightest pixel
constexpr int kCellsAtOnce = 8, kMostCells = 512;
constexpr int kFewestCells = 16;  // across, on which a flame may begin
constexpr int kPasses = 5;        // of gas from the floor to the top, until the flame stands
constexpr int kParts = 10 * kPasses;
constexpr Seconds kFirst{2};  // the first frame's read-out on the rig's clock
constexpr Seconds kShortest = microseconds(1);
constexpr std::uint64_t kOffsetStream = 1;

/// How often a grid of so many cells is the finer one of a grid on which a flame may begin.
int refinements(int cells) {
  int times = 0;
  while (cells % (2 * kCellsAtOnce) == 0 && cells / 2 >= kFewestCells) {
    cells /= 2;
    ++times;
  }
  return times;
}

/// How often the grid will yet become finer as a part of the settling begins: the last passes of gas each
/// begin on a finer one.
int refinements_left(int part, int times) {
  return std::clamp(kPasses - 1 - part / (kParts / kPasses), 0, times);
}

/// Of the settling's work that is done as a part begins: twice the cells along each axis, and twice the
/// steps.
double share_settled(int part, int times) {
  double done = 0;
  double all = 0;
  for (int p = 0; p < kParts; ++p) {
    const double cost = std::pow(16.0, -refinements_left(p, times));
    all += cost;
    if (p < part) done += cost;
  }
  return done / all;
}

Status check_simulate(const SimulateOptions& o) {
  const auto bad = [](const char* what, const char* range) {
    return Error{ErrorKind::bad_input, std::string(what) + " out of range", "simulate flame", range};
  };
  if (o.frames < 1 || o.frames > 10000) return bad("frames", "Take 1 to 10000");
  if (o.cameras < 2 || o.cameras > 64) return bad("cameras", "Take virtual:2 to virtual:64");
  for (const int side : {o.image.width, o.image.height})
    if (side < SimulateOptions::kLeastSide || side > SimulateOptions::kMostSide || side % 2 != 0)
      return bad("the image's size", "Take even sides of 64 to 4096");
  if (o.cells < kCellsAtOnce || o.cells > kMostCells || o.cells % kCellsAtOnce != 0)
    return bad("cells", "Take a multiple of 8 from 8 to 512");
  if (!(o.rate.value() >= 1 && o.rate.value() <= 10000)) return bad("the frame rate", "Take 1 to 10000 Hz");
  if (!(o.read_noise >= 0 && o.read_noise <= 50)) return bad("the noise", "Take 0 to 50 grey levels");
  const Seconds frame = period(o.rate);
  if (!(o.offsets >= Seconds(0) && o.offsets <= frame / 2))
    return bad("the offsets", "Take 0 to half a frame period");
  if (o.stagger && o.offsets > Seconds(0))
    return bad("the offsets of staggered cameras", "Give offsets, or stagger the cameras");
  if (o.exposure && !(o.response && o.response->absolute))
    return Error{ErrorKind::bad_input, "an exposure changes no picture without a response that has a scale",
                 "simulate flame", "Give --response with levels per W / (sr m2), or leave the exposure out"};
  if (o.exposure && !(*o.exposure >= kShortest && *o.exposure <= frame))
    return bad("the exposure", "Take a microsecond to a frame period");
  if (o.sun && o.preset != recon::FlamePreset::smoke)
    return Error{ErrorKind::bad_input, "the sun is for smoke, and this preset glows", "simulate flame",
                 "Leave the sun out, or take the preset smoke"};
  if (o.sun && !(o.sun->towards.norm() > 0 && o.sun->towards.allFinite()))
    return bad("the sun's direction", "Take three numbers that aren't all 0");
  if (o.sun && !(o.sun->albedo > 0 && o.sun->albedo <= 0.99))
    return bad("the albedo", "Take above 0, to 0.99");
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

std::vector<Seconds> draw_offsets(const SimulateOptions& o) {
  if (o.stagger) return smear::staggered_offsets(static_cast<std::size_t>(o.cameras), period(o.rate));
  std::vector<Seconds> late(static_cast<std::size_t>(o.cameras));
  for (std::size_t i = 1; i < late.size(); ++i)
    late[i] = o.offsets * random_uniform(o.seed, kOffsetStream, i);
  return late;
}

/// Cameras with global shutters, each late by its offset.
drivers::VirtualRigOptions rig_of(const SimulateOptions& o, const std::vector<Seconds>& late) {
  drivers::VirtualRigOptions rig;
  rig.seed = o.seed;
  const int rows = o.image.height;
  for (std::size_t i = 0; i < late.size(); ++i) {
    drivers::VirtualCameraOptions camera;
    camera.id = fmt::format("camera-{}", i);
    camera.sensor = SensorKind::global_shutter;
    camera.layout = {o.image, o.format, 8 * bytes_per_sample(o.format)};
    camera.nominal_rate = o.rate;
    camera.timing = {rows, rows, period(o.rate), period(o.rate) / 2 / Rows(rows)};
    camera.first_phase = kFirst + late[i];
    rig.cameras.push_back(std::move(camera));
  }
  return rig;
}

/// What the pictures' levels are of: the response at the exposure.
v1::Colour colour_of(const recon::CameraResponse& response, const SimulatedFilm& film) {
  recon::CameraResponse used = response;
  if (used.absolute)
    for (std::vector<double>& channel : used.level)
      for (double& level : channel) level *= film.gain;
  v1::Colour colour;
  *colour.mutable_spectral() = recon::message_of(used);
  colour.set_exposure_s(film.exposure.value());
  return colour;
}

/// What a grey sensor makes of it: the luminance that VirtualSensor keeps, in each channel.
recon::CameraResponse as_grey(recon::CameraResponse response) {
  for (std::size_t i = 0; i < response.wavelength_nm.size(); ++i) {
    const double grey =
        0.2126 * response.level[0][i] + 0.7152 * response.level[1][i] + 0.0722 * response.level[2][i];
    for (std::vector<double>& channel : response.level) channel[i] = grey;
  }
  return response;
}

/// One simulation and the cameras around it.
class Filming {
 public:
  Filming(const SimulateOptions& options, recon::FlameSimulation flame, std::filesystem::path folder)
      : options_(options),
        flame_(std::move(flame)),
        stage_(stage_around(flame_.options(), options.cameras, options.image)),
        folder_(std::move(folder)),
        late_(draw_offsets(options)),
        light_(std::make_shared<GasLight>(options.cameras)) {
    if (options.preset == recon::FlamePreset::smoke) sun_ = options.sun.value_or(recon::Sun{});
    if (options.response) response_ = *options.response;
    if (channels(options.format) == 1 && !is_bayer(options.format)) response_ = as_grey(std::move(response_));
    film_.frames = options.frames;
    film_.cameras = options.cameras;
    const recon::CameraModel& first = stage_.cameras.front();
    film_.pixel = Meters((first.center() - stage_.box.center).norm() / first.intrinsics.fx);
    for (std::size_t i = 0; i < late_.size(); ++i) in_order_.push_back(i);
    std::stable_sort(in_order_.begin(), in_order_.end(),
                     [&](std::size_t a, std::size_t b) { return late_[a] < late_[b]; });
  }

  /// On the coarsest grid first: the last passes of gas each begin on one twice as fine.
  Status settle(const Observer& observer) {
    const auto& o = flame_.options();
    film_.settled = kPasses * Seconds(std::sqrt(o.nz * o.edge.value() / 9.81));
    const int times = refinements(options_.cells);
    int left = times;
    for (int i = 0; i < kParts; ++i) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, share_settled(i, times), "the flame settles"));
      for (; left > refinements_left(i, times); --left) {
        EMBERLOCK_ASSIGN_OR_RETURN(flame_, flame_.finer());
      }
      EMBERLOCK_RETURN_IF_ERROR(go_on_to(film_.settled / kParts * (i + 1)));
    }
    film_.cell = flame_.options().edge;
    return {};
  }
  /// Finds the exposure by the first frame, and opens cameras and session.
  Status open() {
    EMBERLOCK_RETURN_IF_ERROR(go_on_to(instant(0)));
    EMBERLOCK_RETURN_IF_ERROR(expose());
    light_->set_gain(film_.gain);
    drivers::VirtualRigOptions rig = rig_of(options_, late_);
    rig.scene = drivers::flame_scene(light_);
    rig.scene.exposure = film_.exposure;
    rig.scene.read_noise = options_.read_noise;
    if (options_.read_noise == 0) rig.scene.passes = {drivers::Pass::flame};
    EMBERLOCK_ASSIGN_OR_RETURN(rig_,
                               drivers::VirtualRig::create(rig, std::make_shared<drivers::VirtualClock>()));
    for (int i = 0; i < rig_->size(); ++i) EMBERLOCK_RETURN_IF_ERROR(rig_->camera(i).start());
    return begin_session();
  }
  Status film_frame(int frame) {
    EMBERLOCK_RETURN_IF_ERROR(go_on_to(instant(frame)));
    EMBERLOCK_RETURN_IF_ERROR(keep_truth(frame));
    // Cameras that are late alike film one instant.
    for (auto first = in_order_.begin(); first != in_order_.end();) {
      const Seconds late = late_[*first];
      const auto last =
          std::find_if(first, in_order_.end(), [&](std::size_t camera) { return late_[camera] > late; });
      EMBERLOCK_RETURN_IF_ERROR(go_on_to(instant(frame) + late));
      EMBERLOCK_RETURN_IF_ERROR(film_now({first, last}));
      first = last;
    }
    return {};
  }
  Result<SimulatedFilm> finish() {
    EMBERLOCK_RETURN_IF_ERROR(writer_->finish());
    if (options_.offsets > Seconds(0) || options_.stagger) {
      v1::ShutterTimes times;
      for (std::size_t i = 0; i < late_.size(); ++i) {
        v1::ShutterTimes::Camera& camera = *times.add_cameras();
        camera.set_camera_id(rig_->camera(static_cast<int>(i)).info().id);
        for (int frame = 0; frame < options_.frames; ++frame) camera.add_late_s(late_[i].value());
      }
      EMBERLOCK_RETURN_IF_ERROR(session::write_shutter_times(folder_ / "session", times));
    }
    return film_;
  }

 private:
  /// Of the gas, when the first camera's exposure is half over.
  [[nodiscard]] Seconds instant(int frame) const {
    return film_.settled + (frame + 1) * period(options_.rate);
  }
  Status go_on_to(Seconds time) {
    if (!(time > flame_.time())) return {};
    EMBERLOCK_ASSIGN_OR_RETURN(const recon::FluidStats stats, flame_.step(time - flame_.time()));
    film_.relative_divergence = std::max(film_.relative_divergence, stats.relative_divergence);
    film_.hottest = std::max(film_.hottest, stats.hottest);
    return {};
  }
  [[nodiscard]] std::vector<recon::RadianceImage> pictures(const std::vector<std::size_t>& cameras) const {
    std::vector<const recon::CameraModel*> models;
    models.reserve(cameras.size());
    for (const std::size_t camera : cameras) models.push_back(&stage_.cameras[camera]);
    return recon::film_gas(flame_.state(), response_, sun_, models, options_.compute);
  }
  Status film_now(const std::vector<std::size_t>& cameras) {
    std::vector<recon::RadianceImage> shown = pictures(cameras);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      light_->show(cameras[i], std::move(shown[i]));
      EMBERLOCK_ASSIGN_OR_RETURN(const Frame frame,
                                 rig_->camera(static_cast<int>(cameras[i])).next_frame(2 * kFirst));
      EMBERLOCK_RETURN_IF_ERROR(writer_->write(cameras[i], frame));
    }
    return {};
  }
  Status keep_truth(int frame) const {
    const recon::GasState gas = flame_.state();
    recon::Volume volume = recon::visible_gas(gas, response_, sun_, options_.compute);
    for (float& e : volume.emission) e *= static_cast<float>(film_.gain);
    return recon::write_volume(volume, folder_ / "truth" / fmt::format("frame-{:04}.vdb", frame),
                               {{"temperature", "K", gas.temperature}, {"velocity", "m/s", gas.velocity}}, {},
                               recon::simulated());
  }
  Status expose() {
    float brightest = 0;
    for (const recon::RadianceImage& picture : pictures(in_order_))
      brightest = std::max(brightest, *std::max_element(picture.rgb.begin(), picture.rgb.end()));
    if (!(brightest > 0))
      return Error{ErrorKind::refused, "the cameras see nothing yet", "simulate flame", "Take more cells"};
    const Seconds usual = SimulateOptions::kUsualExposure;
    const double wanted = kPeak / static_cast<double>(brightest);
    const Seconds longest = period(options_.rate);
    if (response_.absolute) {
      film_.exposure = options_.exposure.value_or(std::clamp(wanted * usual, kShortest, longest));
      film_.gain = film_.exposure / usual;
    } else {
      film_.exposure = std::min(usual, longest);
      film_.gain = wanted;
    }
    return {};
  }
  Status begin_session() {
    v1::Manifest manifest;
    manifest.set_session_id(fmt::format("simulated-{}", recon::name(options_.preset)));
    manifest.set_purpose("flame");
    *manifest.mutable_box() = recon::message_of(stage_.box);
    for (std::size_t i = 0; i < stage_.cameras.size(); ++i) {
      v1::CameraStream& stream = *manifest.add_cameras();
      stream = describe(rig_->camera(static_cast<int>(i)).info(), stage_.cameras[i]);
      if (options_.response) *stream.mutable_colour() = colour_of(response_, film_);
    }
    EMBERLOCK_ASSIGN_OR_RETURN(writer_, session::SessionWriter::create(folder_ / "session", manifest));
    return {};
  }

  SimulateOptions options_;
  recon::FlameSimulation flame_;
  Stage stage_;
  std::filesystem::path folder_;
  std::vector<Seconds> late_;          // by camera
  std::vector<std::size_t> in_order_;  // cameras, the latest last
  std::shared_ptr<GasLight> light_;
  std::optional<recon::Sun> sun_;
  recon::CameraResponse response_ = recon::standard_response();
  std::unique_ptr<drivers::VirtualRig> rig_;
  std::optional<session::SessionWriter> writer_;
  SimulatedFilm film_;
};

}  // namespace

std::optional<int> cells_for_pictures(int cells, const SimulatedFilm& film) {
  const double wanted = cells * film.cell.value() / film.pixel.value();
  if (!(wanted < kMostCells)) return {};
  constexpr int kStep = 4 * kCellsAtOnce;  // so that the flame may begin on a coarser grid
  return kStep * (static_cast<int>(wanted / kStep) + 1);
}

Result<SimulatedFilm> simulate_flame(const SimulateOptions& options, const std::filesystem::path& folder,
                                     const Observer& observer) {
  EMBERLOCK_RETURN_IF_ERROR(check_simulate(options));
  recon::FlameSimulationOptions gas =
      recon::flame_preset(options.preset, options.cells >> refinements(options.cells));
  gas.seed = options.seed;
  gas.compute = options.compute;
  EMBERLOCK_ASSIGN_OR_RETURN(recon::FlameSimulation flame, recon::FlameSimulation::make(gas));
  std::error_code failed;
  std::filesystem::create_directories(folder / "truth", failed);
  if (failed) return Error{ErrorKind::io, failed.message(), (folder / "truth").string()};
  Filming filming(options, std::move(flame), folder);
  EMBERLOCK_RETURN_IF_ERROR(filming.settle(part_of(observer, 0, 0.3)));
  EMBERLOCK_RETURN_IF_ERROR(filming.open());
  for (int frame = 0; frame < options.frames; ++frame) {
    EMBERLOCK_RETURN_IF_ERROR(
        observe(observer, 0.3 + 0.7 * frame / options.frames, fmt::format("frame {}", frame)));
    EMBERLOCK_RETURN_IF_ERROR(filming.film_frame(frame));
  }
  return filming.finish();
}

}  // namespace emberlock::rig
