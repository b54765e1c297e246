// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "recon/adjust/solver.h"
#include "recon/temperature/joint_temperature.h"
#include "recon/temperature/line_emitter.h"
#include "recon/temperature/thermometer.h"
#include "recon/temperature/view_errors.h"

namespace emberlock::recon {

/// What became of the key points that emit at least kShareThatCounts of the brightest one.
struct TemperatureCounts {
  std::size_t emitting = 0;
  std::size_t told = 0;
  std::size_t colder = 0, hotter = 0;  ///< than the table
  std::size_t unclear = 0;             ///< no temperature stands out, or its error is above a fifth of it
  std::size_t other = 0;  ///< no temperature shows these channels: no body of this kind (sodium, a blue base)
  std::size_t saturated = 0;  ///< most views that see them are saturated there: a bound, no value
  std::size_t mixed = 0;      ///< of those told: beside lines
  std::size_t lines = 0;      ///< lines and no soot: there is no temperature to tell
  std::size_t alike = 0;      ///< soot, or this line or that, explains them as well
};

/// A line emitter that was looked for (line_emitter.h).
struct LineSummary {
  std::string name;
  double share = 0;      ///< of the light of the key points that count
  std::size_t seen = 0;  ///< key points
  double as_if_hot = 0;  ///< K: soot of this temperature has its colour; 0: none has
};

/// How temperatures were read, and how they came out; weighted by emission, in K.
struct TemperatureSummary {
  Emitter emitter = Emitter::grey;
  bool emitter_told = false;   ///< else the other kind's temperature is part of each voxel's error
  bool absolute = false;       ///< the response's scale was known
  bool by_absorption = false;  ///< the reconstructed extinction told too
  double opacity = 0;          ///< of the paper's convention, a voxel edge; else 0
  TemperatureCounts counts;
  double mean = 0, low = 0, high = 0;  ///< mean, and what 5 % and 95 % lie below
  double sigma = 0;                    ///< the median of the voxels' errors
  double chi_square = 0;               ///< mean per degree of freedom, as each was read; 0: there were none
  bool response_given = true;          ///< by the user or the scene; else standard_response() is assumed
  /// What soot of a constant E(m) would be read too hot by, K at the mean; each error of soot holds it,
  /// divided by the square root of 3: any dispersion between is as likely.
  double dispersion = 0;
  double if_other = 0;  ///< what the mean were if the glow were soot's instead of grey, or the reverse; as
                        ///< it is read, without a joint solve
  bool lines_automatic = false;         ///< chosen by the program
  bool lines_tried = false;             ///< automatic, and enough of the light is no black body's
  std::vector<LineSummary> lines = {};  ///< those that were looked for, or chosen
  /// Automatic and none chosen: those that explain what no soot does alike; empty: none explains it.
  std::vector<std::string> lines_alike = {};
  int solves = 0;             ///< of errors_by_views()
  JointSolve joint;           ///< of all voxels' temperatures, after each was read
  bool joint_failed = false;  ///< it diverged or needed more memory than there is: what was read stands
  Seconds errors_time{0}, time{0};
};

/// A temperature in each voxel that tells one.
struct TemperatureField {
  std::vector<float> kelvin, sigma;  ///< at key points, K; 0 where not told
  TemperatureSummary summary;
  /// Where the response is absolute and there are no lines: the absorption at 550 nm that emits what was
  /// reconstructed at these temperatures, 1/m; and by how much it falls if a temperature rises by its sigma.
  std::vector<float> absorption = {}, absorption_sigma = {};
  std::vector<std::vector<float>> line_share = {};  ///< of the light, one list for each of summary.lines
};

inline constexpr double kShareThatCounts = 0.05;

/// Reads each voxel's temperature; grey and soot then solve for all of them together (joint_temperature.h)
/// where the effects allow it and no self-absorption was corrected, and what that changes is part of their
/// errors. `scene` tells where views are saturated. Grey and soot: by the three channels, joined by their
/// covariance (soot's after self_absorption.h), and where extinction was reconstructed, the response is
/// absolute and nothing scatters, by emission over extinction. The paper: by green and its constant opacity
/// of 0.05 a voxel edge, between 1000 and 2300 K; where the response is relative the brightest green is 2300
/// K. With `lines`, valid by check_lines(), each voxel's light is taken apart into soot and lines
/// (unmixing.h), and nothing is solved together. Without lines errors hold what one more voxel's blend of hot
/// and cold would change. Soot's errors hold what a constant E(m) would change. An emitter that isn't told is
/// read as grey, and what soot would tell is part of each voxel's error.
TemperatureField temperature_of(const Scene& scene, const Reconstruction& done, const VolumeErrors& errors,
                                const CameraResponse& response, std::optional<Emitter> emitter,
                                const SolveOptions& options = {}, const Elapsed& elapsed = {},
                                const LineRequest& lines = {});

}  // namespace emberlock::recon
