// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
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

/// Where one camera images the strobe's lamp: a disk. Columns and rows count from 0 at the centre of the top
/// left pixel; the disk may be cut by the image's edge or lie outside it.
struct VirtualLamp {
  double x = 640;
  Rows y{360};
  double radius = 4;  ///< pixels, 0.5..50
};

struct VirtualCameraOptions {
  std::string id = "virtual-00";  ///< unique in the rig
  SensorKind sensor = SensorKind::ccd;
  ImageLayout layout{.size = {1280, 720}};
  Hertz nominal_rate{23.976};         ///< what the maker claims; the truth is timing.frame_period
  smear::CcdTiming timing{};          ///< rows equal to the layout's height
  std::optional<Seconds> exposure{};  ///< > 0, at most the frame period; absent: the scene's
  smear::SweepOut sweep_out = smear::SweepOut::none;
  VirtualLamp lamp{};
  ShutterReset reset = ShutterReset::on_command;
  Seconds reset_latency = milliseconds(180);  ///< from the action to the new read cycle, 0..10 s
  Seconds reset_jitter = milliseconds(0.2);   ///< RMS of the latency when on_command, 0..1 s
  Seconds transport{0};  ///< from a frame's last row to its arrival, as USB cameras hold frames back; 0..2 s
  std::optional<FrameRateTrim> trim{};  ///< range up to 1000 ppm; in force from the read phase nearest to its
                                        ///< latency after the order
  PartsPerMillion wander{0};  ///< of its crystal, as temperature goes: RMS change within an hour, 0..20
  std::optional<Seconds> first_phase{};  ///< from the first start() to the first read phase; drawn if absent
};

/// A virtual strobe's dial, which nobody but a test's or a demonstration's operator turns.
struct VirtualDialOptions {
  StrobeDial dial{};
  PartsPerMillion error{};           ///< of what it shows: it flashes so much faster; |.| <= 200 000
  Seconds width = microseconds(20);  ///< of its flashes, 1 us..1 ms
};

struct VirtualStrobeOptions {
  std::string id = "virtual-strobe";
  Hertz rate_step{1.0 / 600};            ///< 0.1 flashes a minute, as the paper's Nova-Strobe dbx has
  Seconds time_step = nanoseconds(100);  ///< of phase and width
  PartsPerMillion rate_error{0};         ///< of its time base, which read_back knows nothing of; |.| <= 1000
  std::optional<VirtualDialOptions> dial{};  ///< present: it is set by hand (virtual_dial.h)
};

struct VirtualRigOptions {
  std::uint64_t seed = 1;
  std::vector<VirtualCameraOptions> cameras{};  ///< 1..64
  VirtualStrobeOptions strobe{};
  VirtualScene scene = smear_scene();
  int queue_frames = 64;  ///< what each camera keeps for a reader that lags, 1..4096; the oldest go first
  TimePoint wall_at_zero{946684800'000'000'000};  ///< the wall clock when the rig's clock reads 0
};

/// How a rig of many cameras is drawn.
struct VirtualRigDraw {
  int cameras = 11;                   ///< 1..64
  std::vector<SensorKind> sensors{};  ///< by camera; CCDs beyond the list's end
  std::uint64_t seed = 1;
  ImageLayout layout{.size = {1280, 720}};
  /// `same`: one model, read from the top, with 20 dummy lines where the frame period leaves room. `mixed`:
  /// each camera draws its direction, and K from n, n + 20 and floor(T / t_row).
  enum class Models { same, mixed } models = Models::same;
  Seconds shutter_exposure = milliseconds(4);  ///< of rolling and global shutters
  Hertz rate{23.976};
  SecondsPerRow row_time = microseconds_per_row(54);
  PartsPerMillion crystal_spread{20};  ///< frame period and row time are off by up to this, together
  ShutterReset reset = ShutterReset::on_command;
  Seconds reset_latency = milliseconds(180);        ///< mean over cameras
  Seconds reset_latency_spread = milliseconds(15);  ///< each camera is off by up to this
  Seconds reset_jitter = milliseconds(0.2);
  std::optional<FrameRateTrim> trim{};
};

/// Cameras "virtual-00"...: crystals, lamps (rows 0.28 n..0.72 n, radius 3..5), latencies and models by the
/// seed; the room is lit where a camera is no CCD. Every value may be changed before the rig is made.
VirtualRigOptions draw_virtual_rig(const VirtualRigDraw& draw);

/// One camera, drawn by its id and the seed; `draw` says what it is, but for how many there are.
VirtualCameraOptions draw_virtual_camera(const VirtualRigDraw& draw, std::string id, SensorKind sensor);

/// A rig's name: "virtual:N" is draw_virtual_rig of N CCDs, 1280 x 720 gray8, "virtual:4ccd+3rolling+2global"
/// of as many of each kind. bad_input otherwise.
Result<VirtualRigOptions> parse_virtual_rig(std::string_view name, std::uint64_t seed = 1);

/// The seed of everything that belongs to one camera.
std::uint64_t stream_seed(std::uint64_t seed, std::string_view camera_id);

/// The exposure must fit into the camera's frame period.
Status check_exposure(const VirtualScene& scene, const VirtualCameraOptions& camera);

/// Every range above; camera ids unique; timings possible. bad_input that names camera and field otherwise.
Status check(const VirtualRigOptions& options);

}  // namespace emberlock::drivers
