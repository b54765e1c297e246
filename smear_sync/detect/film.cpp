// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/film.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

namespace emberlock::smear {
namespace {

constexpr double kSamePlace = 0.8;  // rows: the range of a spot that doesn't move
// Limit of standing spots per frame: there are few hot pixels and reflections. More are the dots of a comb at
// a multiple of the frame rate, which stand still too.
constexpr std::size_t kStandingComb = 3;
// Minimum number of unsaturated readings of an otherwise saturated lamp. Fewer are ignored: a flash cut in
// two by the transfer is that dim too, and its dot, a row from the lamp, distorts the lamp's outline by most
// of a row.
constexpr std::ptrdiff_t kFewestClear = 3;

double middle(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// All spots in the lamp's column that are dots or might be.
std::vector<DotReading> all_spots(const SmearReading& reading) {
  std::vector<DotReading> spots = reading.dots;
  spots.insert(spots.end(), reading.spots.begin(), reading.spots.end());
  std::sort(spots.begin(), spots.end(), [](const DotReading& a, const DotReading& b) { return a.y < b.y; });
  return spots;
}

/// The rows at which a spot is present in most frames that show any.
std::vector<double> standing_rows(std::span<const SmearReading> film) {
  std::vector<double> rows;
  int frames = 0;
  for (const SmearReading& reading : film) {
    const std::vector<DotReading> spots = all_spots(reading);
    for (const DotReading& spot : spots) rows.push_back(spot.y.value());
    if (!spots.empty()) ++frames;
  }
  std::sort(rows.begin(), rows.end());
  std::vector<double> standing;
  auto low = rows.begin();
  auto high = rows.begin();
  for (const double row : rows) {
    while (row - *low >= kSamePlace) ++low;
    while (high != rows.end() && *high - row < kSamePlace) ++high;
    if (2 * (high - low) > frames) standing.push_back(row);
  }
  return standing;
}

/// Whether the row is one of the sorted ones.
bool among(const std::vector<double>& rows, double row) {
  const auto from = std::upper_bound(rows.begin(), rows.end(), row - kSamePlace);
  return from != rows.end() && *from - row < kSamePlace;
}

/// The lamps whose dots fall into the columns of the reading's own lamp, top to bottom.
std::vector<LampReading> lamps_of_column(const SmearReading& reading) {
  std::vector<LampReading> lamps;
  const double reach = std::max(
      0.6, 0.15 * reading.lamp->radius);  // approximately the range in which the detector accepts dots
  for (const LampReading& lamp : reading.lamps) {
    if (std::abs(lamp.x - reading.lamp->x) < reach) lamps.push_back(lamp);
  }
  if (lamps.empty()) lamps.push_back(*reading.lamp);
  std::sort(lamps.begin(), lamps.end(), [](const LampReading& a, const LampReading& b) { return a.y < b.y; });
  return lamps;
}

/// The dot of the reading's own lamp among the moving spots; nullopt if there isn't exactly one for each
/// lamp, with equal motion.
std::optional<DotReading> own_dot(const SmearReading& reading, const std::vector<DotReading>& moving) {
  const std::vector<LampReading> lamps = lamps_of_column(reading);
  if (moving.size() != lamps.size()) return std::nullopt;
  std::optional<DotReading> own;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    const Rows shift = moving[i].y - lamps[i].y;
    const Rows allowed = Rows(1) + 4 * (moving[i].sigma + moving[0].sigma + lamps[i].sigma + lamps[0].sigma);
    if (abs(shift - (moving[0].y - lamps[0].y)) > allowed) return std::nullopt;
    if (lamps[i].y == reading.lamp->y) own = moving[i];
  }
  if (own) own->side = own->y < reading.lamp->y ? Side::above : Side::below;
  return own;
}

/// More than a pixel from (x, y).
bool away(const LampReading& lamp, double x, double y) {
  return std::abs(lamp.x - x) > 1 || std::abs(lamp.y.value() - y) > 1;
}

}  // namespace

std::optional<LampReading> combine_lamps(std::span<const SmearReading> film) {
  std::vector<LampReading> lamps;
  for (const SmearReading& reading : film) {
    if (reading.lamp) lamps.push_back(*reading.lamp);
  }
  const auto clear_lamps =
      std::count_if(lamps.begin(), lamps.end(), [](const LampReading& l) { return !l.saturated; });
  const bool clear = clear_lamps >= std::min(kFewestClear, std::ssize(lamps));
  std::erase_if(lamps, [clear](const LampReading& l) { return l.saturated == clear; });
  if (lamps.empty()) return std::nullopt;
  std::vector<double> xs;
  std::vector<double> ys;
  for (const LampReading& lamp : lamps) {
    xs.push_back(lamp.x);
    ys.push_back(lamp.y.value());
  }
  const double x = middle(xs);
  const double y = middle(ys);
  std::erase_if(lamps, [&](const LampReading& l) { return away(l, x, y); });
  LampReading mean;
  double weights = 0;
  double errors = 0;
  for (const LampReading& lamp : lamps) {
    const double weight = 1 / std::pow(std::max(lamp.sigma.value(), 1e-3), 2);
    weights += weight;
    mean.x += weight * lamp.x;
    mean.y += weight * lamp.y;
    mean.radius += weight * lamp.radius;
    errors += lamp.sigma.value() / static_cast<double>(lamps.size());
  }
  if (lamps.empty()) return std::nullopt;
  mean.x /= weights;
  mean.y /= weights;
  mean.radius /= weights;
  mean.saturated = !clear;
  double scatter = 0;
  for (const LampReading& lamp : lamps) scatter += std::pow((lamp.y - mean.y).value(), 2);
  const auto n = static_cast<double>(lamps.size());
  scatter = n > 1 ? std::sqrt(scatter / (n - 1) / n) : 0;
  const double own = clear ? std::sqrt(1 / weights) : errors;
  mean.sigma = Rows(std::max(own, scatter));
  return mean;
}

std::vector<SmearReading> share_lamp(std::span<const SmearReading> film) {
  std::vector<SmearReading> shared(film.begin(), film.end());
  const std::optional<LampReading> lamp = combine_lamps(film);
  if (!lamp) return shared;
  for (SmearReading& reading : shared)
    if (reading.lamp && !away(*reading.lamp, lamp->x, lamp->y.value())) reading.lamp = lamp;
  return shared;
}

std::vector<SmearReading> settle(std::span<const SmearReading> film, Rows least_travel) {
  std::vector<SmearReading> settled(film.begin(), film.end());
  const std::vector<double> standing = standing_rows(film);
  std::vector<std::optional<DotReading>> dots(film.size());
  double first = 1e9;
  double last = -1e9;
  for (std::size_t i = 0; i < film.size(); ++i) {
    if (!film[i].lamp) continue;
    std::vector<DotReading> moving = all_spots(film[i]);
    const std::size_t still =
        std::erase_if(moving, [&](const DotReading& spot) { return among(standing, spot.y.value()); });
    if (moving.empty() || still >= kStandingComb) continue;
    dots[i] = own_dot(film[i], moving);
    if (!dots[i]) continue;
    first = std::min(first, dots[i]->y.value());
    last = std::max(last, dots[i]->y.value());
  }
  const bool moved = Rows(last - first) >= least_travel;
  for (std::size_t i = 0; i < settled.size(); ++i) {
    SmearReading& reading = settled[i];
    // A dot that stands still while another spot moves isn't a dot.
    const bool standing_dot =
        moved && reading.state == SmearState::dot && among(standing, reading.dots[0].y.value());
    const bool open =
        reading.state == SmearState::ambiguous || reading.state == SmearState::comb || standing_dot;
    if (!open || !reading.lamp) continue;
    if (moved && dots[i]) {
      reading.state = SmearState::dot;
      reading.dots = {*dots[i]};
      reading.spots.clear();
      reading.reason = fmt::format("one dot {:.1f} rows {} the lamp, told by its walk from what stands still",
                                   abs(dots[i]->y - reading.lamp->y).value(), name(dots[i]->side));
    } else if (standing_dot) {
      reading.state = SmearState::ambiguous;
      reading.spots = std::exchange(reading.dots, {});
      reading.reason = "a spot stands still while the strobe's dots walk: a reflection or hot pixels";
    } else if (!moved && reading.state == SmearState::ambiguous) {
      reading.reason += "; nothing moved that would tell, detune the strobe";
    }
  }
  return settled;
}

}  // namespace emberlock::smear
