// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/quantity.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/render/volume.h"
#include "recon/views/view.h"

namespace emberlock::recon {

enum class FlameShape {
  plume,       ///< one turbulent plume around the z axis, with a dark core at its base, holes and tongues
  two_plumes,  ///< a tall one and a small one beside it, with a dark gap between them
};

/// The distribution of the flame's extinction.
enum class Absorber {
  medium,  ///< uniform inside
  soot,    ///< proportional to the medium's density, with the same mean inside
};

struct FlameOptions {
  FlameShape shape = FlameShape::plume;
  std::uint64_t seed = 1;
  Meters height{0.16};        ///< of the envelope, centred on the origin
  double rise_speed = 1.0;    ///< m/s, of the turbulence
  double peak = 230;          ///< approximate grey level of the brightest pixel seen from the side
  PerMeter extinction{32.8};  ///< inside the flame; default: the paper's 0.05 per step of 20 cm / 128
  Absorber absorber = Absorber::medium;
  Scattering scattering;  ///< requires extinction
};

/// A flame with known truth on a grid.
struct FlameTruth {
  Volume volume;
  Hull medium;  ///< the voxels that contain flame
  Effects effects;
};

/// A procedural flame: periodic fractal noise moves upwards and shapes an envelope and its colours.
/// Deterministic for a seed; immutable and thread-safe once constructed.
class Flame {
 public:
  explicit Flame(const FlameOptions& options = {});
  Flame(Flame&&) noexcept;
  Flame& operator=(Flame&&) noexcept;
  ~Flame();

  [[nodiscard]] const FlameOptions& options() const;
  /// The true volume at an instant, on any grid (metres; z is up).
  [[nodiscard]] FlameTruth at(Seconds time, const Grid& grid) const;

 private:
  struct Noise;
  FlameOptions options_;
  std::unique_ptr<const Noise> noise_;
  double gain_ = 1;
};

struct PaperSceneOptions {
  FlameOptions flame;
  Seconds time{0};
  std::vector<Seconds> lateness = {};  ///< by view: delay relative to `time`; empty: no delays
  ImageSize image{640, 480};
  int truth_voxels = 192;   ///< the truth's own grid, different from any solver's
  double truth_step = 0.5;  ///< of the march that films it, in its voxel edges
  double noise = 0;         ///< standard deviation of the pixels, grey levels
  int averaged_frames = 0;  ///< number of frames, 24 per second around `time`, for View::average; 0: unknown
  int cameras = 10;         ///< number of input views
  Seconds exposure{0};      ///< of every view, around its instant
};

/// The paper's set-up: ten input views every 36 degrees, 30 cm from the origin, alternately slightly above
/// and below the plane, with a field of view of 60 degrees, around a volume of 20 cm. The eleventh view,
/// between two of them, is held out. The views contain their delays. Other numbers of cameras stand evenly
/// around, so that the held-out view is the same.
Scene paper_scene(const PaperSceneOptions& options = {});

/// The same flame in the same box, filmed by any cameras: pictures for views that have all else. The options'
/// cameras, image and lateness aren't heeded; those of the views are.
Scene filmed_scene(std::vector<View> views, const PaperSceneOptions& options);

}  // namespace emberlock::recon
