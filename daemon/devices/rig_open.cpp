// From the configuration to opened devices.
#include <algorithm>
#include <map>
#include <utility>

#include <fmt/format.h>

#include "daemon/devices/device_list.h"
#include "daemon/devices/rig.h"
#include "daemon/devices/stage.h"
#include "drivers/replay/replay.h"
#include "drivers/strobe_serial/strobe_serial.h"
#include "drivers/virtual/virtual_clock.h"
#include "drivers/virtual/virtual_rig.h"
#include "recon/calibrate/transforms.h"

namespace emberlock {
namespace {

/// Of the flame that simulated cameras film: voxels along the edge of the truth.
constexpr int kFlameVoxels = 96;

Error bad(std::string what, std::string where, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// A camera that says of itself what the configuration says of it.
class ConfiguredCamera final : public Camera {
 public:
  ConfiguredCamera(std::shared_ptr<Camera> camera, const CameraConfig& config)
      : camera_(std::move(camera)), info_(camera_->info()) {
    if (config.sensor) info_.sensor = *config.sensor;
    if (config.reset) info_.reset = *config.reset;
  }
  [[nodiscard]] const CameraInfo& info() const override { return info_; }
  [[nodiscard]] FrameCounts counts() const override { return camera_->counts(); }
  Status start() override { return camera_->start(); }
  void stop() override { camera_->stop(); }
  Result<Frame> next_frame(Seconds deadline) override { return camera_->next_frame(deadline); }
  std::uint64_t pass_over(TimePoint until) override { return camera_->pass_over(until); }
  Status reset_shutter(TimePoint at) override { return camera_->reset_shutter(at); }
  Status trim_rate(PartsPerMillion trim) override { return camera_->trim_rate(trim); }

 private:
  std::shared_ptr<Camera> camera_;
  CameraInfo info_;
};

CcdTiming timing_of(const CameraConfig& config, const CameraInfo& info) {
  CcdTiming timing;
  timing.rows = config.rows.value_or(info.layout.size.height);
  timing.shifts = config.shifts.value_or(timing.rows);
  timing.direction = config.direction;
  if (config.row_time) timing.row_time = *config.row_time;
  if (info.frame_rate > Hertz(0)) timing.frame_period = period(info.frame_rate);
  return timing;
}

/// The rig's devices while they are opened one after the other.
class Opening {
 public:
  Opening(const RigConfig& config, RigParts& parts) : config_(config), parts_(parts) {}

  Status all() {
    EMBERLOCK_RETURN_IF_ERROR(choose_clock());
    EMBERLOCK_RETURN_IF_ERROR(make_virtual_rig());
    for (const CameraConfig& camera : config_.cameras) {
      EMBERLOCK_RETURN_IF_ERROR(open(camera));
    }
    if (parts_.cameras.empty()) {
      return bad("the rig has no camera", "[[rig.camera]]",
                 "Add one; `emberlock devices` lists what is plugged in");
    }
    EMBERLOCK_RETURN_IF_ERROR(open_strobe());
    return calibrate();
  }

 private:
  [[nodiscard]] bool has(CameraSource source) const {
    return std::any_of(config_.cameras.begin(), config_.cameras.end(),
                       [&](const CameraConfig& camera) { return camera.source == source; });
  }

  Status choose_clock() {
    const bool only_replayed =
        std::all_of(config_.cameras.begin(), config_.cameras.end(),
                    [](const CameraConfig& camera) { return camera.source == CameraSource::replay; });
    if (has(CameraSource::replay) || config_.strobe.source == StrobeSource::replay) {
      EMBERLOCK_ASSIGN_OR_RETURN(SessionReader session, SessionReader::open(config_.replay_session));
      replay_ = std::make_shared<SessionReader>(std::move(session));
      replay_clock_ = std::make_shared<ReplayClock>(*replay_);
    }
    if (replay_ && only_replayed) {
      parts_.clock = replay_clock_;
      parts_.pace = Pace::when_asked;
    } else if (config_.virtual_rig.time == VirtualConfig::Time::fast && has(CameraSource::virtual_)) {
      parts_.clock = std::make_shared<VirtualClock>();
      parts_.pace = Pace::when_asked;
    } else {
      parts_.clock = std::make_shared<SteadyClock>();
    }
    return {};
  }

  /// All virtual cameras share one rig, since they film one strobe.
  Status make_virtual_rig() {
    if (!has(CameraSource::virtual_)) return {};
    VirtualRigOptions options;
    std::map<std::string, int> numbers;
    for (const CameraConfig& camera : config_.cameras) {
      if (camera.source == CameraSource::virtual_) EMBERLOCK_RETURN_IF_ERROR(draw(camera, options, numbers));
    }
    if (config_.virtual_rig.scene == VirtualConfig::Scene::lit_room) options.scene = lit_room_scene();
    dark_ = options.scene;
    EMBERLOCK_ASSIGN_OR_RETURN(auto rig, VirtualRig::create(options, parts_.clock));
    virtual_ = std::move(rig);
    if (config_.virtual_rig.scene == VirtualConfig::Scene::flame) light_flame(options);
    return {};
  }

  Status draw(const CameraConfig& camera, VirtualRigOptions& options, std::map<std::string, int>& numbers) {
    VirtualRigDraw draw = config_.virtual_rig.draw;
    draw.cameras = camera.count;
    draw.seed += options.cameras.size();
    draw.sensors.assign(static_cast<std::size_t>(camera.count), camera.sensor.value_or(SensorKind::ccd));
    if (camera.request.size) draw.layout.size = *camera.request.size;
    if (camera.request.format) {
      draw.layout.format = *camera.request.format;
      draw.layout.bit_depth = 8 * bytes_per_sample(*camera.request.format);
    }
    if (camera.request.frame_rate) draw.rate = *camera.request.frame_rate;
    if (camera.reset) draw.reset = *camera.reset;
    // The rows fill about nine tenths of the frame period, as those of a CCD do.
    draw.row_time = SecondsPerRow(0.93 * period(draw.rate).value() / draw.layout.size.height);
    VirtualRigOptions drawn = draw_virtual_rig(draw);
    for (VirtualCameraOptions& one : drawn.cameras) {
      const std::string prefix = camera.id.empty() ? "virtual" : camera.id;
      const bool named = camera.count == 1 && !camera.id.empty();
      one.id = named ? camera.id : fmt::format("{}-{:02}", prefix, numbers[prefix]++);
      if (camera.request.exposure) one.exposure = *camera.request.exposure;
      options.cameras.push_back(one);
    }
    if (options.cameras.size() == drawn.cameras.size() || drawn.scene.has(Pass::room))
      options.scene = drawn.scene;
    options.seed = config_.virtual_rig.draw.seed;
    return {};
  }

  /// The flame burns while something is recorded, as the operator of a real rig would have it.
  void light_flame(const VirtualRigOptions& options) {
    stage_ = demo_stage(static_cast<int>(options.cameras.size()), options.cameras.front().layout.size);
    FlameOptions flame;
    flame.seed = options.seed;
    const auto light =
        std::make_shared<StillFlame>(FlameLight(*stage_, flame, kFlameVoxels), *stage_, TimePoint{});
    parts_.burn = [rig = virtual_, lit = flame_scene(light), dark = dark_](bool burns) {
      static_cast<void>(rig->set_scene(burns ? lit : dark));
    };
    parts_.box = emberlock::describe(stage_->box);
  }

  Status open(const CameraConfig& config) {
    switch (config.source) {
      case CameraSource::virtual_:
        return take_virtual(config);
      case CameraSource::replay:
        return take_replayed(config);
      case CameraSource::v4l2:
        return open_real(config, "v4l2");
      case CameraSource::aravis:
        return open_real(config, "aravis");
      case CameraSource::ptp:
        return open_real(config, "ptp");
    }
    return {};
  }

  Status take_virtual(const CameraConfig& config) {
    for (int i = 0; i < config.count; ++i, ++next_virtual_) {
      const std::shared_ptr<Camera> camera(virtual_, &virtual_->camera(next_virtual_));
      // What a data sheet says of the model: the direction, the rows and the shifts. t_row is measured.
      const CcdTiming& truth = virtual_->truth(next_virtual_).timing;
      RigCamera entry{
          camera, "virtual", {.rows = truth.rows, .shifts = truth.shifts, .direction = truth.direction}};
      if (stage_) {
        const auto& model = stage_->cameras[static_cast<std::size_t>(next_virtual_)];
        entry.calibration = emberlock::describe(camera->info(), model).calibration();
      }
      parts_.cameras.push_back(std::move(entry));
    }
    return {};
  }

  Status take_replayed(const CameraConfig& config) {
    bool found = false;
    for (std::size_t i = 0; i < replay_->camera_count(); ++i) {
      const v1::CameraStream& stream = replay_->manifest().cameras(static_cast<int>(i));
      if (!config.id.empty() && config.id != stream.camera_id()) continue;
      found = true;
      const auto camera = std::make_shared<ReplayCamera>(replay_, i, replay_clock_);
      RigCamera entry{std::make_shared<ConfiguredCamera>(camera, config), "replay",
                      timing_of(config, camera->info())};
      if (stream.has_calibration()) entry.calibration = stream.calibration();
      parts_.cameras.push_back(std::move(entry));
    }
    if (replay_->manifest().has_box()) parts_.box = replay_->manifest().box();
    if (found) return {};
    return bad(fmt::format("the session has no camera \"{}\"", config.id), config_.replay_session.string(),
               "Name one of its cameras, or none for all");
  }

  Status open_real(const CameraConfig& config, std::string_view driver) {
    const auto drivers = camera_drivers();
    const auto found =
        std::find_if(drivers.begin(), drivers.end(), [&](const CameraDriver& d) { return d.name == driver; });
    EMBERLOCK_ASSIGN_OR_RETURN(std::shared_ptr<Camera> camera, found->open(config.id, config.request));
    const CcdTiming timing = timing_of(config, camera->info());
    parts_.cameras.push_back(
        {std::make_shared<ConfiguredCamera>(std::move(camera), config), std::string(driver), timing});
    return {};
  }

  Status open_strobe() {
    switch (config_.strobe.source) {
      case StrobeSource::none:
        return {};
      case StrobeSource::virtual_:
        if (!virtual_) {
          return bad("a virtual strobe is seen by virtual cameras alone, and there are none", "[rig.strobe]",
                     "Add a [[rig.camera]] of driver virtual");
        }
        parts_.strobe = std::shared_ptr<Strobe>(virtual_, &virtual_->strobe());
        return {};
      case StrobeSource::replay:
        parts_.strobe = std::make_shared<ReplayStrobe>(replay_, replay_clock_);
        return {};
      case StrobeSource::serial: {
        EMBERLOCK_ASSIGN_OR_RETURN(parts_.strobe,
                                   open_serial_strobe(config_.strobe.id, config_.strobe.request));
        return {};
      }
    }
    return {};
  }

  Status calibrate() {
    if (config_.calibration.empty()) return {};
    EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, read_transforms(config_.calibration));
    for (RigCamera& camera : parts_.cameras) {
      const CameraInfo& info = camera.camera->info();
      const auto frame =
          std::find_if(transforms.frames.begin(), transforms.frames.end(),
                       [&](const TransformsFrame& f) { return f.image.stem().string() == info.id; });
      if (frame == transforms.frames.end()) {
        return bad(fmt::format("no frame is of camera {}", info.id), config_.calibration.string(),
                   fmt::format("Add one whose file_path is {}.png", info.id));
      }
      EMBERLOCK_ASSIGN_OR_RETURN(const Intrinsics lens, intrinsics_of(*frame, info.layout.size));
      camera.calibration =
          emberlock::describe(info, CameraModel{lens, frame->camera_from_world}).calibration();
    }
    if (transforms.box) parts_.box = emberlock::describe(*transforms.box);
    return {};
  }

  const RigConfig& config_;
  RigParts& parts_;
  std::shared_ptr<SessionReader> replay_;
  std::shared_ptr<ReplayClock> replay_clock_;
  std::shared_ptr<VirtualRig> virtual_;
  std::optional<Stage> stage_;
  VirtualScene dark_;
  int next_virtual_ = 0;
};

}  // namespace

Result<std::unique_ptr<Rig>> Rig::open(const RigConfig& config, CameraTap tap) {
  RigParts parts;
  EMBERLOCK_RETURN_IF_ERROR(Opening(config, parts).all());
  return std::make_unique<Rig>(std::move(parts), tap);
}

}  // namespace emberlock
