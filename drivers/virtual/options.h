// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"
#include "base/result.h"
#include "base/sensor_kind.h"
#include "base/strobe_dial.h"
#include "base/time_point.h"
#include "drivers/camera.h"
#include "drivers/virtual/scene.h"
#include "smear_sync/ccd_model.h"
#include "smear_sync/ccd_timing.h"

namespace emberlock::drivers {

/// The image of the strobe's lamp in one camera: a disk. Columns and rows count from 0 at the centre of the
/// top left pixel. The disk may be cut by the image's edge or lie outside.
struct VirtualLamp {
  double x = 640;
  Rows y{360};
  double radius = 4;  ///< pixels, 0.5..50
};

struct VirtualCameraOptions {
  std::string id = "virtual-00";  ///< unique in the rig
  SensorKind sensor = SensorKind::ccd;
  ImageLayout layout{.size = {1280, 720}};
  Hertz nominal_rate{23.976};         ///< by the maker's data; the true one is timing.frame_period
  smear::CcdTiming timing{};          ///< its rows must equal the layout's height
  std::optional<Seconds> exposure{};  ///< > 0, at most the frame period; default: the scene's
  smear::SweepOut sweep_out = smear::SweepOut::none;
  VirtualLamp lamp{};
  ShutterReset reset = ShutterReset::on_command;
  Seconds reset_latency = milliseconds(180);  ///< from the command to the new read cycle, 0..10 s
  Seconds reset_jitter = milliseconds(0.2);   ///< RMS of the latency with on_command, 0..1 s
  Seconds transport{0};  ///< from a frame's last row to its arrival (USB cameras delay frames); 0..2 s
  std::optional<FrameRateTrim> trim{};  ///< range up to 1000 ppm; takes effect at the read phase closest to
                                        ///< the command plus its latency
  PartsPerMillion wander{0};  ///< of the crystal's rate with temperature: RMS change within an hour, 0..20
  std::optional<Seconds> first_phase{};  ///< from the first start() to the first read phase; random if absent
};

/// The dial of a virtual strobe. Only a test or a demonstration turns it.
struct VirtualDialOptions {
  StrobeDial dial{};
  PartsPerMillion error{};           ///< of its scale: the true rate is higher by this; |.| <= 200 000
  Seconds width = microseconds(20);  ///< of the flashes, 1 us..1 ms
};

struct VirtualStrobeOptions {
  std::string id = "virtual-strobe";
  Hertz rate_step{1.0 / 600};                ///< 0.1 flashes per minute, as with the paper's Nova-Strobe dbx
  Seconds time_step = nanoseconds(100);      ///< of phase and width
  PartsPerMillion rate_error{0};             ///< of its time base, not visible in read_back; |.| <= 1000
  std::optional<VirtualDialOptions> dial{};  ///< present: a strobe that is set by hand (virtual_dial.h)
};

/// One strobe for the rigs of several processes (shared_light.h). Each needs a SteadyClock.
struct SharedLightOptions {
  std::filesystem::path file;
  bool leads = false;  ///< this rig's strobe lights all of them; else the leader's does, and its own none
};

struct VirtualRigOptions {
  std::uint64_t seed = 1;
  std::vector<VirtualCameraOptions> cameras{};  ///< 1..64
  VirtualStrobeOptions strobe{};
  std::optional<SharedLightOptions> light{};  ///< not with a dial
  VirtualScene scene = smear_scene();
  int queue_frames = 64;  ///< capacity of each camera's queue, 1..4096; the oldest frames are dropped first
  TimePoint wall_at_zero{946684800'000'000'000};  ///< the wall clock when the rig's clock is 0
};

/// Parameters of a random rig.
struct VirtualRigDraw {
  int cameras = 11;                   ///< 1..64
  std::vector<SensorKind> sensors{};  ///< by camera; cameras beyond the end of the list are CCDs
  std::uint64_t seed = 1;
  ImageLayout layout{.size = {1280, 720}};
  /// `same`: one model, read from the top, with 20 dummy lines if the frame period allows it. `mixed`: random
  /// read direction for each camera, and K one of n, n + 20 and floor(T / t_row).
  enum class Models { same, mixed } models = Models::same;
  Seconds shutter_exposure = milliseconds(4);  ///< of rolling and global shutters
  Hertz rate{23.976};
  SecondsPerRow row_time = microseconds_per_row(54);
  PartsPerMillion crystal_spread{20};  ///< largest common deviation of frame period and row time
  ShutterReset reset = ShutterReset::on_command;
  Seconds reset_latency = milliseconds(180);        ///< mean over cameras
  Seconds reset_latency_spread = milliseconds(15);  ///< largest deviation of a camera
  Seconds reset_jitter = milliseconds(0.2);
  std::optional<FrameRateTrim> trim{};
};

/// Draws cameras "virtual-00"... from the seed: crystals, lamps (rows 0.28 n..0.72 n, radius 3..5), latencies
/// and models. The room is lit if any camera isn't a CCD. All values may be changed before the rig is
/// created.
VirtualRigOptions draw_virtual_rig(const VirtualRigDraw& draw);

/// Draws one camera from its id and the seed; uses all of `draw` except the number of cameras.
VirtualCameraOptions draw_virtual_camera(const VirtualRigDraw& draw, std::string id, SensorKind sensor);

/// Parses a rig's name: "virtual:N" is draw_virtual_rig of N CCDs, 1280 x 720 gray8;
/// "virtual:4ccd+3rolling+2global" has that many of each kind. Error bad_input otherwise.
Result<VirtualRigOptions> parse_virtual_rig(std::string_view name, std::uint64_t seed = 1);

/// The seed for everything that belongs to one camera.
std::uint64_t stream_seed(std::uint64_t seed, std::string_view camera_id);

/// Checks that the exposure fits into the camera's frame period.
Status check_exposure(const VirtualScene& scene, const VirtualCameraOptions& camera);

/// Checks every range above, unique camera ids and possible timings. Error bad_input names camera and field.
Status check(const VirtualRigOptions& options);

}  // namespace emberlock::drivers
