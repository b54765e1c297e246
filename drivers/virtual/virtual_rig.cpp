// SPDX-License-Identifier: Apache-2.0
#include "drivers/virtual/virtual_rig.h"

#include <algorithm>
#include <utility>

#include "drivers/virtual/shared_light.h"
#include "drivers/virtual/virtual_camera.h"
#include "drivers/virtual/virtual_dial.h"
#include "drivers/virtual/virtual_strobe.h"

namespace emberlock::drivers {

struct VirtualRig::Parts {
  Parts(const VirtualRigOptions& options, const std::shared_ptr<Clock>& clock,
        std::unique_ptr<LightWriter> light)
      : room(std::make_shared<VirtualRoom>(clock, options)),
        strobe(options.strobe, clock, own_timeline(options, *room), std::move(light)) {
    if (options.strobe.dial) dial = std::make_unique<VirtualDial>(options.strobe, clock, room->strobe());
    cameras.reserve(options.cameras.size());
    for (const VirtualCameraOptions& camera : options.cameras) {
      cameras.emplace_back(camera, static_cast<int>(cameras.size()), options, room);
    }
  }

  /// The timeline of the rig's own strobe: no camera sees it where another process's lights the room.
  static std::shared_ptr<StrobeTimeline> own_timeline(const VirtualRigOptions& options,
                                                      const VirtualRoom& room) {
    if (!options.light || options.light->leads) return room.strobe();
    return std::make_shared<StrobeTimeline>(options.strobe.rate_error);
  }

  std::shared_ptr<VirtualRoom> room;
  VirtualStrobe strobe;
  std::unique_ptr<VirtualDial> dial;  ///< replaces it, if present
  std::vector<VirtualCamera> cameras;
};

VirtualRig::VirtualRig(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
VirtualRig::~VirtualRig() = default;

Result<std::unique_ptr<VirtualRig>> VirtualRig::create(const VirtualRigOptions& options,
                                                       const std::shared_ptr<Clock>& clock) {
  EMBERLOCK_RETURN_IF_ERROR(check(options));
  std::unique_ptr<LightWriter> light;
  if (options.light && options.light->leads) {
    EMBERLOCK_ASSIGN_OR_RETURN(light,
                               LightWriter::create(options.light->file, options.strobe.rate_error, clock));
  }
  return std::unique_ptr<VirtualRig>(
      new VirtualRig(std::make_unique<Parts>(options, clock, std::move(light))));
}

int VirtualRig::size() const { return static_cast<int>(parts_->cameras.size()); }
Camera& VirtualRig::camera(int index) { return parts_->cameras.at(index); }
Strobe& VirtualRig::strobe() {
  if (parts_->dial) return *parts_->dial;
  return parts_->strobe;
}
VirtualDial* VirtualRig::dial() { return parts_->dial.get(); }
Clock& VirtualRig::clock() { return parts_->room->clock(); }

Status VirtualRig::set_scene(VirtualScene scene) {
  EMBERLOCK_RETURN_IF_ERROR(check(scene));
  for (const VirtualCamera& camera : parts_->cameras) {
    EMBERLOCK_RETURN_IF_ERROR(check_exposure(scene, camera.truth()));
  }
  parts_->room->set_scene(std::move(scene));
  return {};
}

void VirtualRig::set_reset(ShutterReset reset) {
  for (VirtualCamera& camera : parts_->cameras) camera.set_reset(reset);
}

const VirtualCameraOptions& VirtualRig::truth(int index) const { return parts_->cameras.at(index).truth(); }

TimePoint VirtualRig::read_start(int index, std::uint64_t frame_id) const {
  return parts_->cameras.at(index).read_start(frame_id);
}

TimePoint VirtualRig::read_start_after(int index, TimePoint after) const {
  return parts_->cameras.at(index).read_start_after(after);
}

std::vector<TrueDot> VirtualRig::dots(int index, std::uint64_t frame_id) const {
  const VirtualCamera& camera = parts_->cameras.at(index);
  const VirtualCameraOptions& truth = camera.truth();
  if (truth.sensor != SensorKind::ccd) return {};
  const auto scene = camera.scene_of(frame_id);
  const TimePoint start = camera.read_start(frame_id);
  std::vector<TrueDot> dots;
  for (const LightPulse& pulse : camera.light_on(frame_id)) {
    if (pulse.kind != StrobeOutput::flashing) continue;
    const Seconds centre = pulse.begin + pulse.width / 2;
    double seen = 0;
    double brightest = 0;
    Rows sum;
    for (const smear::FlashPart& part : split(truth.timing, {centre, pulse.width})) {
      const bool rest = part.shifts >= truth.timing.shifts;
      const auto at = smear::smear_centre(truth.timing, truth.lamp.y, part, truth.sweep_out);
      if (rest || !at || at->image != 0) continue;
      seen += part.fraction;
      brightest = std::max(brightest, part.fraction);
      sum += at->row * part.fraction;
    }
    if (seen > 0)
      dots.push_back({sum / seen, scene->flash_level * scene->smear_leak * brightest, start + centre});
  }
  return dots;
}

}  // namespace emberlock::drivers
