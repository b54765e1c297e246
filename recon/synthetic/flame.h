// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "base/quantity.h"
#include "recon/effects/effects.h"
#include "recon/hull/hull.h"
#include "recon/preprocess/view.h"
#include "recon/render/volume.h"

namespace emberlock::recon {

enum class FlameShape {
  plume,       ///< one turbulent plume around the z axis, dark core at its root, holes and tongues
  two_plumes,  ///< a tall one and a small one beside it, with a dark gap between them
};

/// How the flame's extinction is spread.
enum class Absorber {
  medium,  ///< the same everywhere inside
  soot,    ///< proportional to the medium's density, with the same mean inside
};

struct FlameOptions {
  FlameShape shape = FlameShape::plume;
  std::uint64_t seed = 1;
  Meters height{0.16};        ///< of the envelope, centred on the origin
  double rise_speed = 1.0;    ///< m/s, of the turbulence
  double peak = 230;          ///< grey level of the brightest pixel from the side, about
  PerMeter extinction{32.8};  ///< inside the flame; the default is the paper's 0.05 a step of 20 cm / 128
  Absorber absorber = Absorber::medium;
  Scattering scattering;  ///< needs extinction
};

/// A flame with known truth on a grid.
struct FlameTruth {
  Volume volume;
  Hull medium;  ///< the voxels that truly hold flame
  Effects effects;
};

/// A procedural flame: periodic fractal noise, carried upwards, shapes an envelope and its colours.
/// Deterministic by seed; immutable and thread-safe once constructed.
class Flame {
 public:
  explicit Flame(const FlameOptions& options = {});
  Flame(Flame&&) noexcept;
  Flame& operator=(Flame&&) noexcept;
  ~Flame();

  [[nodiscard]] const FlameOptions& options() const;
  /// The truth at an instant, on any grid (metres; z is up).
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
  std::vector<Seconds> lateness = {};  ///< by view: by how much it is filmed after `time`; none: all at once
  ImageSize image{640, 480};
  int truth_voxels = 192;   ///< the truth's own grid, unlike any solver's
  double truth_step = 0.5;  ///< of the march that films it, in its voxel edges
  double noise = 0;         ///< standard deviation of the pixels, grey levels
  int averaged_frames =
      0;  ///< at 24 a second, around `time`, that make each View::average; 0: it isn't known
};

/// The paper's set-up: ten input views at intervals of 36 degrees, 30 cm from the origin, alternately
/// somewhat above and below the plane, 60 degrees of view, around a volume of 20 cm; the eleventh view,
/// between two of them, is held out. The views' lateness is theirs to know.
Scene paper_scene(const PaperSceneOptions& options = {});

}  // namespace emberlock::recon
