// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "recon/adjust/solver.h"

namespace emberlock::recon {

// Work-precision diagrams: what accuracy costs. Work is seconds, from the scene in memory to the views
// rendered; precision is the held-out views' RMS error over all channels, in grey levels.

/// Everything that trades seconds against error. With these `emberlock reconstruct` repeats the run.
struct Settings {
  int voxels = 0;      ///< along the box's longest edge
  int views = 0;       ///< input views used; 0: all
  int iterations = 0;  ///< at full resolution; 0: the solver's own rule
  double step = 1;     ///< voxel edges
  Precision precision = Precision::float32;
  std::string effects = "auto";  ///< as parse_effects() takes them
  Solver solver = Solver::standard;

  friend bool operator==(const Settings&, const Settings&) = default;
};

/// Both above 0 and finite; in other units where a function says so.
struct WorkPoint {
  Settings settings;
  double seconds = 0;
  double error = 0;
};

/// The lowest error among the points within so many seconds, the quicker of equal ones; nullptr without any.
const WorkPoint* best_within(const std::vector<WorkPoint>& points, double seconds);

/// The quickest point whose error is at most this; nullptr without any.
const WorkPoint* quickest_reaching(const std::vector<WorkPoint>& points, double error);

/// What a reconstruction is asked for; at least one of the two.
struct Goal {
  std::optional<double> seconds;  ///< that are left
  std::optional<double> error;
};

/// The point to try: the quickest that reaches the error within the seconds, otherwise the lowest error
/// within the seconds, otherwise the quickest of all. More seconds never choose a higher error, and a lower
/// error never fewer seconds. nullptr without points.
const WorkPoint* choose(const std::vector<WorkPoint>& points, const Goal& goal);

/// What waiting is worth to someone who has asked for nothing.
struct Patience {
  double seconds_a_percent = 1;  ///< a run may take so much longer for an error that is 1 % lower
  double most_seconds = 8;       ///< and this at most
};

/// The knee of time against error: the point where a further step costs more seconds than it is worth, which
/// is the least of seconds + 100 seconds_a_percent ln(error). Of the points within most_seconds, or the
/// quickest where there are none. nullptr without points.
const WorkPoint* knee(const std::vector<WorkPoint>& points, const Patience& patience = {});

/// Points at a number of voxels that need not be among those measured: between the two nearest numbers (or
/// from the two last ones on) seconds and error follow a power of the voxels, for each combination of other
/// settings that both have. From one number alone: as measured.
std::vector<WorkPoint> at_voxels(const std::vector<WorkPoint>& points, int voxels);

}  // namespace emberlock::recon
