// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/sensors/rolling_band.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "smear_sync/detect/classify.h"
#include "smear_sync/detect/plane.h"

namespace emberlock::smear {
namespace {

constexpr double kLeastContrast = 8;  // difference of a row's two levels, relative to their noise
constexpr std::size_t kReach = 3;     // rows on each side of an edge that determine its place and must agree

/// The share of the flash's light in each row: 0 dark, 1 in the band.
std::vector<double> parts(const RowProfile& frame, const BandReference& reference, ReadDirection direction) {
  std::vector<double> part(frame.level.size());
  for (std::size_t r = 0; r < part.size(); ++r) {
    part[r] = (frame.level[r] - reference.dark[r]) / (reference.lit[r] - reference.dark[r]);
  }
  if (direction == ReadDirection::bottom_first) std::reverse(part.begin(), part.end());
  return part;
}

/// Places in read order where a band begins (rising) or ends, with sub-row resolution.
struct Edge {
  double row = 0;
  bool rising = false;
};

std::vector<Edge> edges_of(const std::vector<double>& part) {
  std::vector<Edge> edges;
  for (std::size_t r = kReach; r + kReach <= part.size(); ++r) {
    const bool rising = part[r] >= 0.5 && part[r - 1] < 0.5;
    const bool falling = part[r] < 0.5 && part[r - 1] >= 0.5;
    if (!rising && !falling) continue;
    double sum = 0;
    bool clean = true;
    for (std::size_t i = 0; i < kReach; ++i) {
      sum += part[r + i] + part[r - 1 - i];
      // Apart from the rows next to the edge, each side must be entirely lit or dark.
      if (i > 0) clean = clean && (part[r + i] >= 0.5) == rising && (part[r - 1 - i] >= 0.5) == falling;
    }
    if (!clean) continue;
    // The sum of the lit parts equals the number of lit rows beyond the edge.
    const double lit = rising ? static_cast<double>(kReach) - sum : sum - static_cast<double>(kReach);
    edges.push_back({static_cast<double>(r) - 0.5 + lit, rising});
  }
  return edges;
}

}  // namespace

RowProfile row_profile(const ImageView& frame) {
  RowProfile profile;
  if (!detail::unreadable(frame).empty()) return profile;
  const detail::Plane plane = detail::to_plane(frame);
  std::vector<float> row(static_cast<std::size_t>(plane.size.width));
  std::vector<double> squares;
  for (int y = 0; y < plane.size.height; ++y) {
    plane.read(y, 0, plane.size.width, row.data());
    double sum = row.front();
    double differences = 0;  // between neighbours: noise without the scene's gradients
    double clipped = row.front() >= plane.white ? row.front() : 0;
    for (std::size_t x = 1; x < row.size(); ++x) {
      sum += row[x];
      clipped += row[x] >= plane.white ? row[x] : 0;
      differences += (row[x] - row[x - 1]) * (row[x] - row[x - 1]) / 2;
    }
    profile.level.push_back(sum / plane.size.width * plane.level);
    profile.clipped += clipped / plane.size.width / plane.size.height * plane.level;
    squares.push_back(differences / (plane.size.width - 1));
  }
  // Rows of the lamp itself and of hot pixels are few.
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  const double square = std::max(*middle, plane.rounding * plane.rounding);
  profile.noise = std::sqrt(square / plane.size.width) * plane.level;
  return profile;
}

Result<BandReference> learn_band_reference(std::span<const RowProfile> frames) {
  const auto refuse = [](const std::string& what) {
    return Error{ErrorKind::bad_input, what, "rolling band",
                 "film a detuned strobe until its band has crossed the frame"};
  };
  if (frames.empty() || frames.front().level.empty()) return refuse("there are no frames");
  BandReference reference;
  for (std::size_t r = 0; r < frames.front().level.size(); ++r) {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    double noise = 0;
    for (const RowProfile& f : frames) {
      if (f.level.size() != frames.front().level.size()) return refuse("frames differ in size");
      low = std::min(low, f.level[r]);
      high = std::max(high, f.level[r]);
      noise = std::max(noise, f.noise);
    }
    if (!(high - low > kLeastContrast * noise) || high <= low)
      return refuse("row " + std::to_string(r) + " was never lit, or never dark");
    // Means of the values near either extreme; rows at the band's edge are in neither.
    double sums[2] = {0, 0};
    double counts[2] = {0, 0};
    for (const RowProfile& f : frames) {
      const double part = (f.level[r] - low) / (high - low);
      if (part > 0.2 && part < 0.8) continue;
      const int side = part > 0.5 ? 1 : 0;
      sums[side] += f.level[r];
      ++counts[side];
    }
    reference.dark.push_back(sums[0] / counts[0]);
    reference.lit.push_back(sums[1] / counts[1]);
  }
  return reference;
}

BandReading read_bands(const RowProfile& frame, const BandReference& reference, const BandOptions& options) {
  BandReading bands;
  SmearReading& reading = bands.reading;
  const std::size_t rows = frame.level.size();
  const auto say = [&](SmearState state, std::string reason) {
    reading.state = state;
    reading.reason = std::move(reason);
    return bands;
  };
  if (rows < 2 * kReach || reference.dark.size() != rows || reference.lit.size() != rows)
    return say(SmearState::ambiguous, "the frame and its reference differ in size");
  double flash = 0;
  for (std::size_t r = 0; r < rows; ++r)
    flash += (reference.lit[r] - reference.dark[r]) / static_cast<double>(rows);
  if (!(flash > options.min_snr * frame.noise))
    return say(SmearState::ambiguous, "the flash is too faint against the noise");

  const std::vector<double> part = parts(frame, reference, options.direction);
  const auto lit =
      static_cast<std::size_t>(std::count_if(part.begin(), part.end(), [](double p) { return p >= 0.5; }));
  if (lit == 0) return say(SmearState::no_lamp, "no row was lit by a flash");
  const bool down = options.direction == ReadDirection::top_first;
  const auto displayed = [&](double row) { return Rows(down ? row : static_cast<double>(rows) - 1 - row); };
  const Rows sigma(frame.noise / flash * std::sqrt(2.0 * kReach));
  reading.lamp = LampReading{.y = displayed(0.5), .sigma = Rows(0), .saturated = false};
  std::optional<double> first;
  for (const Edge& edge : edges_of(part)) {
    if (edge.rising) {
      DotReading dot;
      dot.y = displayed(edge.row);
      dot.sigma = sigma;
      dot.snr = flash / std::max(frame.noise, 1e-9);
      dot.amplitude = flash;
      dot.side = down ? Side::below : Side::above;
      reading.dots.push_back(dot);
      first = edge.row;
    } else if (first) {
      bands.lengths.emplace_back(edge.row - *first);
      first.reset();
    }
  }
  if (!down) std::reverse(reading.dots.begin(), reading.dots.end());
  if (reading.dots.empty()) {
    return lit == rows
               ? say(SmearState::steady, "every row is lit: the exposure is as long as the flashes' distance")
               : say(SmearState::no_dot, "the band begins in the pause between two frames");
  }
  return say(reading.dots.size() == 1 ? SmearState::dot : SmearState::comb, "");
}

}  // namespace emberlock::smear
