#pragma once

#include <optional>
#include <span>

namespace emberlock {

// All in rows: a flash of `width` rows about x row periods after the start of the read phase leaves its dot u
// rows from the lamp, where u stands still while the flash stays within one row period and moves over by the
// share of it that falls into the next one. From a width of one row on, u = x - 1/2: no stairs.

/// Where the dot stands of a flash of `width` rows whose centre comes x row periods after the start.
double stair(double x, double width);

struct StairPoint {
  double t = 0;      ///< seconds from the middle of all
  double u = 0;      ///< rows from the lamp
  double sigma = 0;  ///< of u as read: of dot and lamp
};

/// The line to start from, of x against t.
struct StairStart {
  double level = 0;  ///< rows
  double rate = 0;   ///< rows a second
  double span = 1;   ///< seconds, from first to last
  double turn = 0;   ///< T / t_row
  double width = 0;  ///< of the flash, rows
};

/// Mean and deviation of what the stairs leave possible.
struct StairFit {
  double level = 0;  ///< x at t = 0
  double level_sigma = 0;
  double rate = 0;
  double rate_sigma = 0;
};

/// The line x = level + rate t whose stairs the points stand on: mean and deviation of the likelihood over
/// all lines near the start. The lamp's own constant error is what all points miss the stairs by, and is
/// taken out. Nothing when the points scatter so far that rows can't be told apart, or the flash is about as
/// long as a row.
std::optional<StairFit> fit_stairs(std::span<const StairPoint> points, const StairStart& start);

}  // namespace emberlock
