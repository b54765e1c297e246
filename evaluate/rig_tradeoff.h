// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <compare>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string_view>
#include <vector>

namespace emberlock::evaluate {

// The whole workflow's error against its minutes and euros. A few set-ups are simulated (measure_rig.h); this
// joins them to all combinations, and chooses. Pure: numbers in, numbers out.

/// What can be chosen.
enum class RigAxis : std::uint8_t { cameras, image, voxels, effects, exposure, tolerance, device };
inline constexpr std::size_t kRigAxes = 7;
inline constexpr std::array<RigAxis, kRigAxes> kAllRigAxes{
    RigAxis::cameras,  RigAxis::image,     RigAxis::voxels, RigAxis::effects,
    RigAxis::exposure, RigAxis::tolerance, RigAxis::device};
std::string_view name(RigAxis axis);

/// Of each axis the index of its choice.
struct RigSetup {
  std::array<std::size_t, kRigAxes> choice{};
  [[nodiscard]] std::size_t at(RigAxis axis) const { return choice[static_cast<std::size_t>(axis)]; }
  [[nodiscard]] RigSetup with(RigAxis axis, std::size_t index) const;
  friend auto operator<=>(const RigSetup&, const RigSetup&) = default;
};

/// A frame, filmed and reconstructed.
struct RigFrame {
  double error = 0;   ///< held-out RMS, grey levels
  double search = 0;  ///< seconds of the search for effects
  double solve = 0;   ///< seconds of all else of the reconstruction
  [[nodiscard]] double seconds() const { return search + solve; }
};
using RigFrames = std::map<RigSetup, RigFrame>;

/// What the combinations are made of.
struct RigGrid {
  std::array<std::size_t, kRigAxes> counts{};  ///< of each axis's choices
  RigSetup base;
  std::vector<double> euros;  ///< by choice of cameras
  /// Minutes of alignment by choice of cameras, then tolerance; infinite where it isn't reached.
  std::vector<std::vector<double>> align_minutes;
  int frames = 1;  ///< to reconstruct
};

/// The base, and each other choice of each axis with all else as in the base: what join() needs simulated.
std::vector<RigSetup> along_axes(const RigGrid& grid);

/// What along_axes() says of any set-up: squares of errors add up, E^2 = E_0^2 + sum (E_axis^2 - E_0^2), but
/// never below the lowest error along the axes. Ratios of seconds multiply, those of search and solve apart;
/// exposure and tolerance change none.
RigFrame predict(const RigGrid& grid, const RigFrames& frames, const RigSetup& setup);

struct RigPoint {
  enum class Source : std::uint8_t { simulated, joined };
  RigSetup setup;
  Source source = Source::joined;
  RigFrame frame;
  double minutes = 0;  ///< of alignment, and of all frames' reconstruction
  double euros = 0;
};

/// Every combination whose tolerance is reached, simulated where `frames` has it and predicted elsewhere.
/// `frames` must contain along_axes().
std::vector<RigPoint> join(const RigGrid& grid, const RigFrames& frames);

/// Indices of the points that no other beats in minutes and error, by rising minutes.
std::vector<std::size_t> pareto_front(const std::vector<RigPoint>& points);

/// Of the points whose error is at most `target` the one of fewest euros, then fewest minutes, then lowest
/// error.
std::optional<std::size_t> cheapest(const std::vector<RigPoint>& points, double target);
std::optional<std::size_t> most_accurate(const std::vector<RigPoint>& points);

/// Another choice of one axis that lowers the error.
struct RigStep {
  RigAxis axis = RigAxis::cameras;
  std::size_t to = 0;  ///< index of the point that it leads to
  double gain = 0;     ///< of error, grey levels; above 0
  double minutes = 0;  ///< more; negative: fewer
  double euros = 0;
};

/// The neighbours of a set-up: on each axis the choice before and after.
std::vector<RigSetup> neighbours(const RigGrid& grid, const RigSetup& setup);

/// Steps from a point to its neighbours: first those that cost nothing, then those that cost minutes alone by
/// gain a minute, then those that cost euros by gain a euro.
std::vector<RigStep> next_steps(const RigGrid& grid, const std::vector<RigPoint>& points, std::size_t from);

}  // namespace emberlock::evaluate
