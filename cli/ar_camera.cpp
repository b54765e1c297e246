// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <optional>

#include <fmt/format.h>

#include "cli/ar_film.h"
#include "cli/commands.h"
#include "cli/interrupt.h"
#include "rig/config/config.h"
#include "rig/devices/device_list.h"
#include "rig/devices/rig.h"

namespace emberlock::cli {
namespace {

/// A rig of the one camera that is connected.
Result<rig::RigConfig> rig_of_connected(const std::string& camera) {
  EMBERLOCK_ASSIGN_OR_RETURN(const rig::ListedCamera listed, rig::find_camera(rig::list_devices(), camera));
  rig::RigConfig config;
  rig::CameraConfig one;
  one.id = camera;
  one.source = listed.driver == "aravis" ? rig::CameraSource::aravis
               : listed.driver == "ptp"  ? rig::CameraSource::ptp
                                         : rig::CameraSource::v4l2;
  config.cameras = {one};
  return config;
}

Result<std::size_t> index_of(rig::Rig& rig, const std::string& camera) {
  std::string all;
  for (std::size_t i = 0; i < rig.size(); ++i) {
    const std::string& id = rig.camera(i).info().id;
    if (id == camera) return i;
    all += (all.empty() ? "" : ", ") + id;
  }
  return Error{ErrorKind::bad_input, "the rig has no such camera", camera, "Its cameras are " + all};
}

}  // namespace

Result<ArFilm> film_camera(const std::string& camera, const std::filesystem::path& config, Seconds seconds) {
  rig::RigConfig setup;
  if (config.empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(setup, rig_of_connected(camera));
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(rig::DaemonConfig all, rig::load_config(config));
    setup = std::move(all.rig);
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto rig, rig::Rig::open(setup));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::size_t index, index_of(*rig, camera));
  drivers::Camera& source = rig->camera(index);
  EMBERLOCK_RETURN_IF_ERROR(source.start());
  const Progress bar = progress_bar("film");
  const Interrupt interrupt;
  std::vector<Image> frames;
  std::vector<Seconds> times;
  std::optional<TimePoint> first;
  std::size_t bytes = 0;
  constexpr std::size_t kMost = std::size_t{4} << 30;
  while (!Interrupt::asked()) {
    const Result<Frame> frame = source.next_frame(drivers::kCallDeadline);
    if (!frame && frame.error().kind == ErrorKind::out_of_data && !frames.empty()) break;
    if (!frame) return frame.error();
    if (frame->stamp.status != FrameStatus::complete) continue;
    if (!first) first = frame->stamp.monotonic_time;
    const Seconds time = frame->stamp.monotonic_time - *first;
    if (time > seconds) break;
    if (!times.empty() && !(time > times.back())) continue;
    bytes += 3 * static_cast<std::size_t>(frame->image->layout().size.width) *
             static_cast<std::size_t>(frame->image->layout().size.height);
    if (bytes > kMost)
      return Error{ErrorKind::refused, "its frames take more than 4 GB of memory", camera,
                   "Give fewer --seconds, or record it and give the video"};
    frames.push_back(*frame->image);
    times.push_back(time);
    tell(bar, time / seconds, fmt::format("frame {}", frames.size()));
  }
  source.stop();
  tell(bar, 1, "done");
  if (frames.empty()) return Error{ErrorKind::refused, "ended before its first frame", camera};
  return ArFilm(camera, std::move(frames), std::move(times));
}

}  // namespace emberlock::cli
