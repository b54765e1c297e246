// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "recon/adjust/tracker.h"

namespace emberlock::recon {

/// What a search for motion looks at.
struct MotionSearch {
  const Scene& scene;      ///< linear in light
  const Grid& grid;        ///< of the reconstruction
  const Effects& effects;  ///< background, sensor and extinction are taken from it
  const SolveOptions& options;
  Pool& pool;
};

/// What views of different instants say of the flame's motion.
struct FoundMotion {
  Motion motion;            ///< none where the views' times can't tell or don't matter
  double still_error = 0;   ///< RMS that a coarse solve of the late pictures as they are leaves, grey levels
  double moving_error = 0;  ///< the same, each view at its own instant
  double change = 0;        ///< RMS by which the motion changes the input pictures, grey levels
  double gain = 0;          ///< by how much the held-out error is thought to fall, grey levels
};

/// Whether any input view is late by more than its time is uncertain.
bool any_late(const Scene& scene);

/// The speed along +z, which flames rise along, at which the views agree best, each at its own instant: cold
/// coarse solves from a fraction of the pixels. Nothing is solved where no view is late, or where not even
/// the fastest flame would change the pictures by `tolerance`.
FoundMotion find_rise(const MotionSearch& search, double tolerance);

/// The velocity near `from` at which they agree best; the search's effects should bring the extinction,
/// without which sideways motion is taken for what is hidden.
FoundMotion refine_motion(const MotionSearch& search, const Motion& from);

/// Change and gain of a motion that is given; nothing is solved.
FoundMotion measure_motion(const MotionSearch& search, const Motion& motion);

}  // namespace emberlock::recon
