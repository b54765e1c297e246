// SPDX-License-Identifier: Apache-2.0
#include "smear_sync/detect/bright.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "smear_sync/detect/target_clones.h"

namespace emberlock::smear::detail {
namespace {

constexpr int kChunk = 256;          // bytes tested at once
constexpr int kWidest = 2;           // width of a hot cluster in pixels
constexpr std::size_t kMost = 4000;  // runs of bright pixels; a lamp has tens

template <class Sample>
inline Sample largest_of(const Sample* v, int count) {
  constexpr int kWhole = kChunk / static_cast<int>(sizeof(Sample));
  Sample top = 0;
  if (count == kWhole) {  // a length known at compile time
    for (int i = 0; i < kWhole; ++i) top = top > v[i] ? top : v[i];
  } else {
    for (int i = 0; i < count; ++i) top = top > v[i] ? top : v[i];
  }
  return top;
}
EMBERLOCK_TARGET_CLONES std::uint8_t largest(const std::uint8_t* v, int count) {
  return largest_of(v, count);
}
EMBERLOCK_TARGET_CLONES std::uint16_t largest(const std::uint16_t* v, int count) {
  return largest_of(v, count);
}

/// Finds runs of more than kWidest neighbouring pixels above the threshold in columns [first, last] of a row.
void find_runs(const Plane& plane, int y, int first, int last, float threshold, std::vector<Extent>& runs) {
  constexpr int kBuffer = 512;
  std::array<float, kBuffer> v;  // NOLINT(cppcoreguidelines-pro-type-member-init): read() fills what is used
  int start = -1;
  const auto end = [&](int x) {
    if (start >= 0 && x - start > kWidest) runs.push_back({start, x - 1, y, y});
    start = -1;
  };
  for (int at = first; at <= last; at += kBuffer) {
    const int count = std::min(kBuffer, last + 1 - at);
    plane.read(y, at, count, v.data());
    for (int i = 0; i < count; ++i) {
      const bool bright = v[static_cast<std::size_t>(i)] > threshold;
      if (!bright) {
        end(at + i);
      } else if (start < 0) {
        start = at + i;
      }
    }
  }
  end(last + 1);
}

/// In samples of the view: if a sum exceeds the threshold, at least one of its samples exceeds the mean.
template <class Sample>
Sample sample_limit(const Plane& plane, float threshold) {
  return static_cast<Sample>(std::clamp<double>(std::floor(static_cast<double>(threshold) * plane.level), 0,
                                                std::numeric_limits<Sample>::max()));
}

template <class Sample>
void scan(const Plane& plane, float threshold, RowStep rows, BrightAreas& found) {
  const int per_pixel = channels(plane.view.layout.format);
  const int samples = plane.view.width() * per_pixel;
  const int chunk = kChunk / static_cast<int>(sizeof(Sample));
  const auto limit = sample_limit<Sample>(plane, threshold);
  Sample peak = 0;
  for (int y = rows.first; y < plane.size.height && found.areas.size() < kMost; y += rows.step) {
    const Sample* row = plane.view.row_as<Sample>(y);
    for (int at = 0; at < samples; at += chunk) {
      Sample top = largest(row + at, std::min(chunk, samples - at));
      peak = std::max(peak, top);
      if (top <= limit) continue;
      int first = at;
      while (at + chunk < samples && top > limit) {  // extends to its bright neighbours
        at += chunk;
        top = largest(row + at, std::min(chunk, samples - at));
        peak = std::max(peak, top);
      }
      int end = std::min(samples, at + chunk);
      while (row[first] <= limit) ++first;
      while (row[end - 1] <= limit) --end;
      const int last = end / per_pixel;
      find_runs(plane, y, std::max(0, first / per_pixel - 4), std::min(plane.size.width - 1, last + 4),
                threshold, found.areas);
    }
  }
  found.peak = peak / plane.level;
}

template <class Sample>
void scan_columns(const Plane& plane, int left, int right, float threshold, std::vector<Extent>& runs) {
  const int per_pixel = channels(plane.view.layout.format);
  const auto limit = sample_limit<Sample>(plane, threshold);
  const RowStep rows = every_lamp(plane);
  for (int y = rows.first; y < plane.size.height; y += rows.step) {
    const Sample* row = plane.view.row_as<Sample>(y);
    if (largest(row + left * per_pixel, (right + 1 - left) * per_pixel) > limit)
      find_runs(plane, y, left, right, threshold, runs);
  }
}

/// Joins runs that share columns or touch each other.
std::vector<Extent> merge(std::vector<Extent> runs) {
  std::sort(runs.begin(), runs.end(), [](const Extent& a, const Extent& b) { return a.left < b.left; });
  std::vector<Extent> merged;
  for (const Extent& run : runs) {
    if (merged.empty() || run.left > merged.back().right + 1) {
      merged.push_back(run);
      continue;
    }
    Extent& area = merged.back();
    area.right = std::max(area.right, run.right);
    area.top = std::min(area.top, run.top);
    area.bottom = std::max(area.bottom, run.bottom);
  }
  return merged;
}

}  // namespace

RowStep every_lamp(const Plane& plane) {
  // In a Bayer mosaic a red lamp is visible only in every other row.
  return {0, is_bayer(plane.view.layout.format) ? 1 : 2};
}

BrightAreas find_bright(const Plane& plane, double threshold, RowStep rows) {
  BrightAreas found;
  if (bytes_per_sample(plane.view.layout.format) == 1) {
    scan<std::uint8_t>(plane, static_cast<float>(threshold), rows, found);
  } else {
    scan<std::uint16_t>(plane, static_cast<float>(threshold), rows, found);
  }
  found.everywhere = found.areas.size() >= kMost;
  for (const Extent& run : found.areas) found.pixels += run.right - run.left + 1;
  found.areas = merge(std::move(found.areas));
  return found;
}

std::vector<Extent> find_bright_in(const Plane& plane, int left, int right, double threshold) {
  left = std::max(0, left);
  right = std::min(plane.size.width - 1, right);
  std::vector<Extent> runs;
  if (bytes_per_sample(plane.view.layout.format) == 1) {
    scan_columns<std::uint8_t>(plane, left, right, static_cast<float>(threshold), runs);
  } else {
    scan_columns<std::uint16_t>(plane, left, right, static_cast<float>(threshold), runs);
  }
  return runs;
}

}  // namespace emberlock::smear::detail
