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

/// A dot as the model computes it.
struct TrueDot {
  Rows y;            ///< centre, averaged over the row periods that the flash overlaps
  double level = 0;  ///< grey levels at its centre, on the scale 0..255, in the scene of the frame
  TimePoint flash;   ///< centre of the flash that caused it
};

/// Virtual cameras and the strobe that they film, behind the interfaces of real ones. Cameras are interline
/// CCDs unless specified otherwise. With a VirtualClock the rig is deterministic for a seed and as fast as
/// its pictures are drawn; with a SteadyClock it runs in real time.
///
/// A frame's pixels depend only on (seed, camera id, frame id, phase, strobe, scene). They are drawn when
/// fetched, in any order. On a virtual clock, one thread may use the cameras one after another: frames that
/// end while another camera is waited for are queued; beyond `queue_frames` the oldest are dropped and show
/// as a gap in frame_id. Frame i is read during [t_start_i, t_start_i + K t_row) and arrives at the end of
/// that. The first image after start() or a reset is dropped, because the register still held the previous
/// cycle. For rolling and global shutters too, the read phase begins when the exposure of the part that is
/// read first ends.
///
/// Thread safety: each camera and the strobe has one owner thread; these may differ. set_scene and the
/// accessors of the truth may be called from any thread, but those of a camera not while its owner starts,
/// stops or resets it.
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
  /// The strobe if it is set by hand; else null.
  [[nodiscard]] VirtualDial* dial();
  [[nodiscard]] Clock& clock();

  /// The scene of frames whose read phase begins from now on.
  Status set_scene(VirtualScene scene);
  /// Sets how shutters are reset from now on: by an operator, by the driver, or not at all.
  void set_reset(ShutterReset reset);

  // The true values, for tests and demonstrations.

  /// True timing, lamp and latency of a camera.
  [[nodiscard]] const VirtualCameraOptions& truth(int index) const;
  /// The start of the read phase that delivered (or will deliver) a frame.
  [[nodiscard]] TimePoint read_start(int index, std::uint64_t frame_id) const;
  /// The start of a read phase in the current cycle: the first instant >= `after`.
  [[nodiscard]] TimePoint read_start_after(int index, TimePoint after) const;
  /// The dots in a CCD's frame in the order of the flashes, whether a pass draws them or not; none for steady
  /// light.
  [[nodiscard]] std::vector<TrueDot> dots(int index, std::uint64_t frame_id) const;

 private:
  struct Parts;
  explicit VirtualRig(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace emberlock::drivers
