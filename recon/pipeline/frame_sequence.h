// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "recon/pipeline/reconstruct.h"

namespace emberlock::recon {

/// What a frame of a sequence started from.
enum class FrameStart {
  darkness,  ///< coarse to fine, as a frame alone
  before,    ///< the volume of the frame before
  carried,   ///< that volume carried on by the flow between the last two (volume_flow.h)
};
/// "darkness", "the frame before" or "the frame before, carried on".
std::string_view name(FrameStart start);

/// The emission's integral over the volume, mean of the channels, grey levels m2.
double light_of(const Volume& volume);

/// The frames of one film, in their order. The first is reconstructed as one alone is, and what it finds out
/// holds for the next ones: voxels, effects, smoothness, cameras that point elsewhere. Each of these starts
/// from where the flame was, or from where it is thought to be by now, whichever shows pixels left out of the
/// fit better; in darkness where neither shows them better than no light at all. When the light has doubled
/// or halved, all but the voxels is decided anew, by a frame as one alone. Memory is that of one frame and
/// two volumes.
///
/// A function of the scenes and the options, as reconstruct() is. So who has the volumes of the last two
/// frames goes on as if there had been no interruption.
class FrameSequence {
 public:
  /// The clock must outlive it.
  FrameSequence(ReconstructOptions options, const Clock& clock);

  /// The next frame. Errors: reconstruct()'s; the sequence goes on behind such a frame from what was before.
  Result<Outcome> next(const Scene& scene, const Progress& progress = {},
                       const std::function<void(const Preview&)>& preview = {});
  // Of the last frame that succeeded:
  [[nodiscard]] FrameStart started_from() const { return start_; }
  /// Whether it decided for the next ones.
  [[nodiscard]] bool decided() const { return decided_; }

  /// Goes on behind frames that were done before: the last of them that decided was done again by next(),
  /// with the same options and voxels; `last` is the volume of the last one and `before_last` that of the one
  /// before it, if there is one.
  void go_on_behind(std::shared_ptr<const Volume> before_last, std::shared_ptr<const Volume> last);

 private:
  void take_from(const Outcome& deciding);
  /// Whether the light is by now what it was when it was decided, within a factor of two.
  [[nodiscard]] bool holds() const;
  [[nodiscard]] ReconstructOptions options_for(const Scene& scene);

  ReconstructOptions options_;
  const Clock& clock_;
  std::optional<TakenOver> taken_;  ///< of the frame that decided
  double light_then_ = 0;           ///< of that
  bool decided_ = false;
  std::shared_ptr<const Volume> before_last_, last_;
  FrameStart start_ = FrameStart::darkness;
};

}  // namespace emberlock::recon
