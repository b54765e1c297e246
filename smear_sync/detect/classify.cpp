// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/classify.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "smear_sync/detect/column.h"

namespace emberlock::smear::detail {
namespace {

LampReading lamp_reading(const Plane& plane, const Lamp& lamp) {
  return {.x = lamp.x + plane.offset,
          .y = Rows(lamp.y + plane.offset),
          .sigma = Rows(lamp.sigma),
          .radius = lamp.radius,
          .saturated = lamp.saturated};
}

DotReading dot_reading(const Plane& plane, const Lamp& lamp, const DotFit& fit) {
  return {.x = fit.x + plane.offset,
          .y = Rows(fit.y + plane.offset),
          .sigma = Rows(fit.sigma_y),
          .snr = fit.snr,
          .amplitude = fit.amplitude / (1 + std::exp(-fit.radius / DotFit::kEdge)) * plane.level,
          .side = fit.y < lamp.y ? Side::above : Side::below};
}

/// Dots of one strobe have the same brightness, and three or more on one side of the lamp are multiples of
/// one pitch apart.
bool one_strobe(const std::vector<DotFit>& dots, double lamp_row) {
  const auto [weakest, strongest] = std::minmax_element(
      dots.begin(), dots.end(), [](const DotFit& a, const DotFit& b) { return a.amplitude < b.amplitude; });
  if (weakest->amplitude + 3 * weakest->amplitude / weakest->snr < 0.4 * strongest->amplitude) return false;
  for (const bool above : {true, false}) {
    std::vector<double> rows;
    for (const DotFit& d : dots) {
      if ((d.y < lamp_row) == above) rows.push_back(d.y);
    }
    if (rows.size() < 3) continue;
    double pitch = rows[1] - rows[0];
    for (std::size_t i = 2; i < rows.size(); ++i) pitch = std::min(pitch, rows[i] - rows[i - 1]);
    for (std::size_t i = 1; i < rows.size(); ++i) {
      const double gap = (rows[i] - rows[i - 1]) / pitch;
      // Because of whole-row shifts, a gap may be a row longer or shorter than the next.
      if (std::abs(gap - std::round(gap)) * pitch > 1.5 + 0.5 * std::round(gap)) return false;
    }
  }
  return true;
}

bool same_column(const Lamp& a, const Lamp& b) { return std::abs(a.x - b.x) < 0.8 * (a.radius + b.radius); }

SmearReading ambiguous(SmearReading reading, std::string reason) {
  reading.state = SmearState::ambiguous;
  for (DotReading& dot : reading.dots) reading.spots.push_back(dot);
  reading.dots.clear();
  std::sort(reading.spots.begin(), reading.spots.end(),
            [](const DotReading& a, const DotReading& b) { return a.y < b.y; });
  reading.reason = std::move(reason);
  return reading;
}

/// The state of one lamp that doesn't share its column.
SmearReading classify_lamp(const Plane& plane, const Lamp& lamp, const ColumnReading& column,
                           const DetectOptions& options) {
  SmearReading reading;
  reading.lamp = lamp_reading(plane, lamp);
  if (column.clipped) {
    reading.state = SmearState::saturated;
    reading.reason = "the lamp's column is saturated over its height, no dot could stand out; dim the lamp";
    return reading;
  }
  for (const DotFit& d : column.dots) reading.dots.push_back(dot_reading(plane, lamp, d));
  if (column.dots.size() >= 2 && !one_strobe(column.dots, lamp.y)) {
    return ambiguous(std::move(reading),
                     fmt::format("{} spots stand in the lamp's column, but their brightness or "
                                 "spacing isn't that of one strobe",
                                 column.dots.size()));
  }
  if (column.dots.size() >= 2) {
    reading.state = SmearState::comb;
    reading.reason = fmt::format("{} dots of one strobe stand in the lamp's column", column.dots.size());
  } else if (column.dots.size() == 1) {
    reading.state = SmearState::dot;
    reading.reason = fmt::format("one dot {:.1f} rows {} the lamp", std::abs(column.dots[0].y - lamp.y),
                                 column.dots[0].y < lamp.y ? "above" : "below");
  } else if (column.half_field) {
    return ambiguous(std::move(reading),
                     "a spot stands in every other row only: an interlaced frame; split its fields");
  } else if (column.line) {
    reading.state = SmearState::steady;
    reading.reason = fmt::format(
        "the lamp's column is brighter than its neighbours by {:.1f} grey levels over the "
        "full height: constant light",
        column.line_level * plane.level);
  } else if (!column.suspects.empty()) {
    const auto strongest = std::max_element(column.suspects.begin(), column.suspects.end(),
                                            [](const DotFit& a, const DotFit& b) { return a.snr < b.snr; });
    for (const DotFit& f : column.suspects) reading.spots.push_back(dot_reading(plane, lamp, f));
    return ambiguous(
        std::move(reading),
        fmt::format("a spot near row {:.0f} stands in the lamp's column, but doesn't {}",
                    column.reflection ? column.reflection->value() : strongest->y,
                    column.reflection   ? "have the lamp's width and less of its light: a reflection"
                    : column.compressed ? "rise far enough above what compression makes; raise the bit rate"
                                        : "look enough like the lamp to be its dot"));
  } else if (column.hidden > options.blind_fraction || lamp.centre_outside) {
    reading.state = SmearState::blind;
    reading.reason =
        lamp.centre_outside
            ? "the lamp's centre lies outside the frame, and no dot is seen; turn the camera to the lamp"
            : fmt::format("bloom or the image's edge hides {:.0f} % of the lamp's column; dim the lamp",
                          100 * column.hidden);
  } else {
    reading.state = SmearState::no_dot;
    reading.reason =
        "the lamp's column is clean: the flash came while the sensor rested, or its dot is in the bloom";
  }
  return reading;
}

/// Several lamps: chooses the one that behaves like a strobe. If several do, they must have the same shift.
SmearReading choose(std::vector<SmearReading> readings) {
  std::vector<const SmearReading*> strobes;
  for (const SmearReading& r : readings) {
    if (r.state == SmearState::dot || r.state == SmearState::comb) strobes.push_back(&r);
  }
  const std::size_t count = readings.size();
  if (strobes.empty()) {
    const auto is = [&](SmearState s) {
      return std::all_of(readings.begin(), readings.end(),
                         [s](const SmearReading& r) { return r.state == s; });
    };
    for (const SmearState s : {SmearState::steady, SmearState::no_dot, SmearState::saturated}) {
      if (is(s)) return readings.front();
    }
    return ambiguous(std::move(readings.front()),
                     fmt::format("{} lamps of like brightness, and their columns disagree", count));
  }
  SmearReading first = *strobes.front();
  for (const SmearReading* other : strobes) {
    const auto shift = [](const SmearReading& r) { return r.dots.front().y - r.lamp->y; };
    const Rows allowed = Rows(1) + 4 * (first.dots.front().sigma + other->dots.front().sigma +
                                        first.lamp->sigma + other->lamp->sigma);
    if (other->state != first.state || other->dots.size() != first.dots.size() ||
        abs(shift(*other) - shift(first)) > allowed) {
      return ambiguous(
          std::move(first),
          fmt::format("{} lamps of like brightness show different dots; cover all but one", count));
    }
  }
  first.reason += fmt::format("; {} of {} lamps in the frame show it", strobes.size(), count);
  return first;
}

/// Reads every lamp and combines the results.
SmearReading several(const Plane& plane, const Background& background, const std::vector<Lamp>& lamps,
                     const DetectOptions& options) {
  constexpr std::size_t kMostLamps = 4;
  if (lamps.size() > kMostLamps) {
    SmearReading main;
    main.lamp = lamp_reading(plane, lamps.front());
    return ambiguous(std::move(main),
                     fmt::format("{} lamps of like brightness; cover all but one", lamps.size()));
  }
  std::vector<SmearReading> readings;
  readings.reserve(lamps.size());
  for (const Lamp& lamp : lamps)
    readings.push_back(classify_lamp(plane, lamp, read_column(plane, background, lamp, options), options));
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    for (std::size_t j = i + 1; j < lamps.size(); ++j) {
      if (!same_column(lamps[i], lamps[j])) continue;
      // The other lamp is visible in this one's column, but isn't a dot of it.
      const auto is_lamp = [&](const DotReading& dot) {
        return std::any_of(lamps.begin(), lamps.end(), [&](const Lamp& lamp) {
          return std::abs(dot.y.value() - plane.offset - lamp.y) < 1.5 * lamp.radius + 2;
        });
      };
      std::erase_if(readings[i].dots, is_lamp);
      std::erase_if(readings[i].spots, is_lamp);
      return ambiguous(
          std::move(readings[i]),
          fmt::format("two spots of like brightness stand in one column (rows {:.0f} and {:.0f}): a "
                      "reflection or a second lamp; cover one",
                      lamps[i].y, lamps[j].y));
    }
  }
  return readings.size() == 1 ? readings.front() : choose(std::move(readings));
}

}  // namespace

std::string unreadable(const ImageView& v) {
  const bool well_formed = v.width() > 0 && v.height() > 0 && v.data != nullptr &&
                           v.stride >= v.layout.row_bytes() && v.layout.bit_depth >= 1 &&
                           v.layout.bit_depth <= 8 * bytes_per_sample(v.layout.format);
  if (!well_formed) return "the frame is empty or malformed";
  const int smallest = is_bayer(v.layout.format) ? 9 : 8;
  if (v.width() >= smallest && v.height() >= smallest) return {};
  return fmt::format("a frame of {} x {} pixels is too small to hold a lamp and its column", v.width(),
                     v.height());
}

SmearReading nothing(std::string reason) {
  SmearReading reading;
  reading.reason = std::move(reason);
  return reading;
}

SmearReading read_lamps(const Plane& plane, const Background& background, const LampSearch& search,
                        const DetectOptions& options) {
  if (search.lamps.empty()) {
    if (!search.bright_line) return nothing(search.why_none);
    SmearReading reading;
    reading.state = search.clipped_line ? SmearState::saturated : SmearState::ambiguous;
    reading.reason = search.clipped_line
                         ? "a column is saturated over its height and hides the lamp in it; dim the lamp"
                         : "a bright line over the full height, but no lamp stands out on it";
    return reading;
  }
  std::vector<LampReading> lamps;
  lamps.reserve(search.lamps.size());
  for (const Lamp& lamp : search.lamps) lamps.push_back(lamp_reading(plane, lamp));
  SmearReading reading = several(plane, background, search.lamps, options);
  reading.lamps = std::move(lamps);
  return reading;
}

}  // namespace emberlock::smear::detail
