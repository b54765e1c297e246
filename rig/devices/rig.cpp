// SPDX-License-Identifier: Apache-2.0
#include "rig/devices/rig.h"

#include <algorithm>
#include <filesystem>
#include <string>

#include <fmt/format.h>

#include "drivers/manual_strobe.h"
#include "drivers/strobe_serial/strobe_serial.h"
#include "drivers/virtual/virtual_clock.h"
#include "rig/align/record.h"
#include "rig/align/stagger.h"
#include "rig/devices/flame_scene.h"
#include "rig/devices/lazy_devices.h"
#include "rig/devices/virtual_setup.h"

namespace emberlock::rig {
namespace {

/// For cameras whose rate is unknown before they are opened.
constexpr Hertz kUsualRate{23.976};

Error refuse(std::string what, std::string where, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

std::string_view driver_name(CameraSource source) {
  switch (source) {
    case CameraSource::virtual_:
      return "virtual";
    case CameraSource::v4l2:
      return "v4l2";
    case CameraSource::aravis:
      return "aravis";
    case CameraSource::ptp:
      return "ptp";
    case CameraSource::replay:
      return "replay";
    case CameraSource::remote:
      return "remote";
  }
  return "";
}

bool all_are(const RigConfig& config, CameraSource source) {
  return std::all_of(config.cameras.begin(), config.cameras.end(),
                     [&](const CameraConfig& camera) { return camera.source == source; });
}

/// The frame rate of the rig, as far as the configuration gives it.
Hertz rate_of(const RigConfig& config) {
  for (const CameraConfig& camera : config.cameras) {
    if (camera.request.frame_rate) return *camera.request.frame_rate;
  }
  return kUsualRate;
}

Result<Rig::Pace> pace_of(const RigConfig& config) {
  if (config.strobe.source == StrobeSource::replay) {
    if (all_are(config, CameraSource::replay)) return Rig::Pace::recorded;
    return refuse("a recorded strobe lights no live camera", "rig.strobe",
                  "replay all cameras with it, or say another driver");
  }
  if (config.virtual_rig.time == VirtualConfig::Time::real) return Rig::Pace::real_time;
  if (all_are(config, CameraSource::virtual_) && config.strobe.source != StrobeSource::serial)
    return Rig::Pace::fast;
  return refuse("only virtual devices run faster than real time", "rig.virtual",
                "say time = \"real\", or take the others out of the rig");
}

}  // namespace

Result<std::unique_ptr<Rig>> Rig::open(const RigConfig& config, RigOptions options) {
  if (config.cameras.empty())
    return refuse("there is no camera", "rig",
                  "add a [[rig.camera]] block for each; `emberlock devices` "
                  "lists what is plugged in");
  std::unique_ptr<Rig> rig(new Rig(std::move(options)));
  EMBERLOCK_ASSIGN_OR_RETURN(rig->pace_, pace_of(config));
  rig->clock_ = std::make_shared<SteadyClock>();
  if (rig->pace_ == Pace::fast) rig->clock_ = std::make_shared<drivers::VirtualClock>();
  EMBERLOCK_RETURN_IF_ERROR(rig->open_replay(config));
  EMBERLOCK_RETURN_IF_ERROR(rig->open_virtual(config));
  int virtual_cameras = 0;
  for (const CameraConfig& camera : config.cameras) {
    if (camera.source == CameraSource::virtual_) {
      for (int i = 0; i < camera.count; ++i)
        rig->add_borrowed(rig->virtual_->camera(virtual_cameras++), driver_name(camera.source), camera);
    } else if (camera.source == CameraSource::replay) {
      EMBERLOCK_RETURN_IF_ERROR(rig->add_recorded(camera));
    } else if (camera.source != CameraSource::remote) {
      EMBERLOCK_RETURN_IF_ERROR(rig->add_real(camera, rate_of(config)));
    }
  }
  rig->own_ = rig->cameras_.size();
  for (const CameraConfig& camera : config.cameras) {
    if (camera.source == CameraSource::remote)
      EMBERLOCK_RETURN_IF_ERROR(rig->add_remote(camera, rate_of(config)));
  }
  EMBERLOCK_RETURN_IF_ERROR(rig->open_strobe(config));
  return rig;
}

Status Rig::open_virtual(const RigConfig& config) {
  EMBERLOCK_ASSIGN_OR_RETURN(const drivers::VirtualRigOptions setup, virtual_setup(config));
  if (setup.cameras.empty()) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(virtual_, drivers::VirtualRig::create(setup, clock_));
  room_ = setup.scene;
  if (config.virtual_rig.scene == VirtualConfig::Scene::flame)
    flame_ = still_flame(virtual_->size(), setup.cameras.front().layout.size);
  return {};
}

Status Rig::open_replay(const RigConfig& config) {
  const bool replays = std::any_of(config.cameras.begin(), config.cameras.end(),
                                   [](const CameraConfig& c) { return c.source == CameraSource::replay; });
  if (!replays) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(replay_, drivers::ReplayRig::open(config.replay_session));
  if (pace_ == Pace::recorded) {
    clock_ = replay_->clock;
  } else {
    replay_pace_ = std::make_shared<ReplayPace>(*replay_->session, clock_);
  }
  return {};
}

Status Rig::open_strobe(const RigConfig& config) {
  switch (config.strobe.source) {
    case StrobeSource::none:
      return {};
    case StrobeSource::virtual_:
      if (!virtual_) {
        return refuse("a virtual strobe lights virtual cameras alone", "rig.strobe",
                      "add a virtual camera, or say another driver");
      }
      strobe_.emplace(virtual_->strobe());
      return {};
    case StrobeSource::serial:
      own_strobe_ = std::make_unique<LazyStrobe>(config.strobe.id,
                                                 [strobe = config.strobe, open = options_.serial_strobe] {
                                                   return open(strobe.id, strobe.request);
                                                 });
      strobe_.emplace(*own_strobe_);
      return {};
    case StrobeSource::replay:
      strobe_.emplace(*replay_->strobe);
      return {};
    case StrobeSource::manual:
      EMBERLOCK_RETURN_IF_ERROR(check(config.strobe.dial));
      if (virtual_) {  // its dial is turned by the caller, who plays the operator
        strobe_.emplace(virtual_->strobe());
      } else {
        own_strobe_ = std::make_unique<drivers::ManualStrobe>("manual", config.strobe.dial);
        strobe_.emplace(*own_strobe_);
      }
      return {};
  }
  return {};
}

Status Rig::add_real(const CameraConfig& config, Hertz rate) {
  const std::string_view name = driver_name(config.source);
  const auto driver = std::find_if(options_.drivers.begin(), options_.drivers.end(),
                                   [&](const drivers::CameraDriver& d) { return d.name == name; });
  if (driver == options_.drivers.end())
    return refuse(fmt::format("there is no driver {}", name), "camera " + config.id, "say another one");
  drivers::CameraInfo expected{.id = config.id, .model = "", .layout = {}, .frame_rate = rate};
  expected.layout.size = config.request.size.value_or(ImageSize{});
  expected.layout.format = config.request.format.value_or(PixelFormat::gray8);
  const auto configure = [config](drivers::CameraInfo& info) {
    info.sensor = config.sensor.value_or(info.sensor);
    info.reset = config.reset.value_or(info.reset);
  };
  add(std::make_unique<LazyCamera>(
          std::move(expected), [open = driver->open, config] { return open(config.id, config.request); },
          configure),
      name, config);
  return {};
}

Status Rig::add_remote(const CameraConfig& config, Hertz rate) {
  if (!options_.remote)
    return refuse("another host's camera is led by emberlockd alone", "camera " + config.id,
                  "put it into emberlockd's configuration");
  drivers::CameraInfo expected{.id = config.id, .model = "", .layout = {}, .frame_rate = rate};
  add(options_.remote(config, std::move(expected)), driver_name(config.source), config);
  return {};
}

Status Rig::add_recorded(const CameraConfig& config) {
  bool found = false;
  for (std::size_t i = 0; i < replay_->cameras.size(); ++i) {
    drivers::Camera& camera = *replay_->cameras[i];
    if (!config.id.empty() && camera.info().id != config.id) continue;
    found = true;
    if (pace_ == Pace::recorded) {
      add_borrowed(camera, driver_name(config.source), config);
    } else {
      add(std::make_unique<PacedCamera>(replay_->session, i, replay_pace_), driver_name(config.source),
          config);
    }
  }
  if (found) return {};
  return refuse("the session has no such camera", "camera " + config.id,
                "leave the id out for all of the session");
}

void Rig::add(std::unique_ptr<drivers::Camera> camera, std::string_view driver, const CameraConfig& config) {
  drivers::CameraThreadOptions options{.queue_frames = options_.queue_frames,
                                       .absent = drivers::CameraThreadOptions::Absent::is_looked_for};
  if (!config.host.empty()) options.reset_ahead = kRemoteAhead;
  if (options_.on_frame) {
    options.on_frame = [show = options_.on_frame, index = cameras_.size()](const Frame& frame) {
      show(index, frame);
    };
  }
  auto thread = std::make_unique<drivers::CameraThread>(std::move(camera), std::move(options));
  Member member{nullptr, driver, config, thread.get(), nullptr};
  member.camera = std::move(thread);
  cameras_.push_back(std::move(member));
}

void Rig::add_borrowed(drivers::Camera& camera, std::string_view driver, const CameraConfig& config) {
  if (pace_ == Pace::real_time) return add(std::make_unique<ObservedCamera>(camera), driver, config);
  std::function<void(const Frame&)> on_frame;
  if (options_.on_frame) {
    on_frame = [show = options_.on_frame, index = cameras_.size()](const Frame& frame) {
      show(index, frame);
    };
  }
  auto observed = std::make_unique<ObservedCamera>(camera, std::move(on_frame));
  Member member{nullptr, driver, config, nullptr, observed.get()};
  member.camera = std::move(observed);
  cameras_.push_back(std::move(member));
}

std::future<Result<drivers::StrobeSettings>> Rig::ask_strobe(std::optional<drivers::StrobeSettings> wanted) {
  const std::launch when = pace_ == Pace::real_time ? std::launch::async : std::launch::deferred;
  return std::async(when,
                    [strobe = strobe(), wanted = std::move(wanted)]() -> Result<drivers::StrobeSettings> {
                      if (wanted) EMBERLOCK_RETURN_IF_ERROR(strobe->apply(*wanted));
                      return strobe->read_back();
                    });
}

AlignRig Rig::devices() {
  AlignRig devices{{}, strobe(), clock_.get(), nullptr};
  for (const Member& member : cameras_) devices.cameras.push_back(member.camera.get());
  return devices;
}

drivers::CameraThread::State Rig::state(std::size_t index) const {
  const Member& member = cameras_.at(index);
  if (member.thread) return member.thread->state();
  if (member.observed->ended()) return drivers::CameraThread::State::ended;
  return member.observed->filming() ? drivers::CameraThread::State::filming
                                    : drivers::CameraThread::State::idle;
}

drivers::FrameCounts Rig::feed(std::size_t index, drivers::FrameSink sink) {
  const Member& member = cameras_.at(index);
  return member.thread ? member.thread->feed(std::move(sink)) : member.observed->feed(std::move(sink));
}

std::optional<Error> Rig::trouble(std::size_t index) const {
  const Member& member = cameras_.at(index);
  return member.thread ? member.thread->trouble() : std::nullopt;
}

std::vector<smear::CcdTiming> Rig::timing() const {
  std::vector<smear::CcdTiming> all;
  int virtual_cameras = 0;
  for (const Member& member : cameras_) {
    const CameraConfig& config = member.config;
    smear::CcdTiming timing;
    timing.rows = config.rows.value_or(member.camera->info().layout.size.height);
    timing.shifts = config.shifts.value_or(timing.rows);
    timing.direction = config.direction;
    if (config.source == CameraSource::remote && options_.remote_timing) {
      if (const auto there = options_.remote_timing(config)) {
        timing = *there;
        timing.rows = config.rows.value_or(timing.rows);
        timing.shifts = config.shifts.value_or(timing.shifts);
      }
    }
    timing.row_time = config.row_time.value_or(timing.row_time);
    if (config.source == CameraSource::virtual_) {
      // From a data sheet; t_row is measured.
      const smear::CcdTiming& truth = virtual_->truth(virtual_cameras++).timing;
      timing.rows = truth.rows;
      timing.shifts = truth.shifts;
      timing.direction = truth.direction;
      if (strobe_ && strobe_->dial()) timing.row_time = config.row_time.value_or(truth.row_time);
    }
    all.push_back(timing);
  }
  return all;
}

Status Rig::show(Scene scene) {
  if (!flame_) return {};
  return virtual_->set_scene(scene == Scene::flame ? flame_and_strobe(flame_, room_) : room_);
}

Result<AlignRunOptions> Rig::align_options(const AlignmentConfig& config) {
  AlignRunOptions options = config.run;
  options.align.tolerance = config.tolerance.value_or(smear::tolerance_for(config.flame));
  options.timing = timing();
  options.align.reset_by = smear::ResetBy::anybody;
  if (strobe_) options.align.dial = strobe_->dial();
  if (config.stagger) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.offsets, stagger(devices().cameras));
  }
  if (!config.reference.empty()) {
    const auto named = std::find_if(cameras_.begin(), cameras_.end(), [&](const Member& member) {
      return member.camera->info().id == config.reference;
    });
    if (named == cameras_.end()) {
      return refuse("there is no camera " + config.reference, "alignment.reference",
                    "name one of the rig's cameras");
    }
    options.align.reference = static_cast<std::size_t>(named - cameras_.begin());
  }
  if (!config.delays.empty() && std::filesystem::exists(config.delays)) {
    EMBERLOCK_ASSIGN_OR_RETURN(options.delays, read_delays(config.delays, devices()));
  }
  return options;
}

}  // namespace emberlock::rig
