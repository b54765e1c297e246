// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/clock.h"
#include "base/result.h"
#include "drivers/camera.h"
#include "drivers/strobe.h"
#include "drivers/virtual/options.h"
#include "drivers/virtual/scene.h"

namespace emberlock::drivers {

class VirtualDial;

/// One dot as the model knows it.
struct TrueDot {
  Rows y;            ///< centre, mean over the row periods that the flash overlaps
  double level = 0;  ///< grey levels at its centre, on the scale 0..255, for the scene of the frame
  TimePoint flash;   ///< centre of the flash that made it
};

/// Cameras and the strobe they film, interline CCDs unless told otherwise, behind the interfaces of real
/// ones. With a VirtualClock the rig is deterministic by seed and as fast as the pictures are drawn; with a
/// SteadyClock it runs in real time.
///
/// Each frame's pixels depend on (seed, camera id, frame id, phase, what strobe and scene did) alone: they
/// are drawn when asked for, in any order. Cameras on a virtual clock may be used one after the other from
/// one thread: frames that end while another camera is waited for queue up, and beyond `queue_frames` the
/// oldest show as a gap in frame_id. Frame i is read during [t_start_i, t_start_i + K t_row) and arrives at
/// its end; the first image after start() or a reset is kept back, since the register still held the old
/// cycle. Read phases of rolling and global shutters begin as the exposure of what they read first ends, too.
///
/// Thread safety: each camera and the strobe has one owner thread, different ones may differ. set_scene and
/// the truth accessors may be called from any thread, but a camera's truth not while its owner starts, stops
/// or resets it.
class VirtualRig {
 public:
  /// Errors: bad_input, naming camera and field.
  static Result<std::unique_ptr<VirtualRig>> create(const VirtualRigOptions& options,
                                                    const std::shared_ptr<Clock>& clock);
  ~VirtualRig();
  VirtualRig(const VirtualRig&) = delete;
  VirtualRig& operator=(const VirtualRig&) = delete;

  [[nodiscard]] int size() const;
  [[nodiscard]] Camera& camera(int index);
  [[nodiscard]] Strobe& strobe();
  /// The strobe, where it is one that is set by hand; else null.
  [[nodiscard]] VirtualDial* dial();
  [[nodiscard]] Clock& clock();

  /// Frames whose read phase begins from now on show this scene.
  Status set_scene(VirtualScene scene);
  /// Who resets the shutters from now on: an operator, the driver, or nobody.
  void set_reset(ShutterReset reset);

  // The truth, for tests and demonstrations.

  /// True timing, lamp and latency of a camera.
  [[nodiscard]] const VirtualCameraOptions& truth(int index) const;
  /// The start of the read phase that delivered (or will deliver) a frame.
  [[nodiscard]] TimePoint read_start(int index, std::uint64_t frame_id) const;
  /// The same modulo the frame period, for the current read cycle: the first instant >= `after`.
  [[nodiscard]] TimePoint read_start_after(int index, TimePoint after) const;
  /// The dots of a CCD's frame by order of flash, whether a pass draws them or not; none for steady light.
  [[nodiscard]] std::vector<TrueDot> dots(int index, std::uint64_t frame_id) const;

 private:
  struct Parts;
  explicit VirtualRig(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::drivers
