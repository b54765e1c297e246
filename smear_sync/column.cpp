#include "smear_sync/column.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

namespace emberlock::detail {
namespace {

constexpr double kQuantiserNoise =
    1.1;  // grey levels a pixel: JPEG of quality 75 on a dot of a few grey levels
constexpr double kQuantiserGate = 1.5;  // its errors aren't Gaussian: rare blocks keep one whole coefficient
constexpr double kQuantiserSpread = 2.3;  // and are shared by whole blocks, so that positions scatter more
constexpr int kLanes = 5;  // the lamp's own in the middle, two empty ones on either side to compare with

/// The columns around a lamp, levelled, and what is known of them.
struct Column {
  Patch patch;               // the lamp's lane and its neighbours, each column's own level taken out
  std::vector<float> level;  // that level, even rows then odd rows
  double x = 0, y = 0;       // the lamp in the patch
  double radius = 0;
  int half_width = 0;  // of a lane
  double noise = 0;    // of a pixel, in the lamp's lane
  double saturation = 0;
  double sample_level = 1;  // grey levels a sample
  bool flat = false;
  std::vector<char> hidden;  // rows in which a dot can't be seen
  std::vector<double> halo;  // around the lamp, by whole pixels of radius
  double halo_end = 0;       // at the last of them
  double halo_power = 6;     // with which it falls beyond

  [[nodiscard]] double halo_at(double r) const {
    if (halo.size() < 2) return 0;
    const double last = static_cast<double>(halo.size() - 1);
    if (r >= last - 0.5) return halo_end * std::pow((last - 0.5) / r, halo_power);
    const auto i = static_cast<std::size_t>(r);
    const double f = r - static_cast<double>(i);
    return halo[i] * (1 - f) + halo[i + 1] * f;
  }

  [[nodiscard]] int lane_centre(int lane) const {
    const int pitch = 2 * half_width + 3;
    return static_cast<int>(std::lround(x)) + (lane - kLanes / 2) * pitch;
  }
  [[nodiscard]] bool lane_inside(int lane) const {
    return lane_centre(lane) - half_width >= 0 && lane_centre(lane) + half_width < patch.width;
  }
  [[nodiscard]] bool visible(int row) const { return hidden[static_cast<std::size_t>(row)] == 0; }
};

/// Rows of the lamp's own disk and the soft edge around it.
bool near_lamp(const Column& c, int row, double margin) { return std::abs(row - c.y) <= c.radius + margin; }

/// Takes each column's level out, even and odd rows apart (interlaced fields differ), lamp and dots ignored.
void subtract_level(Column& c, double noise) {
  std::vector<float> values;
  const auto width = static_cast<std::size_t>(c.patch.width);
  c.level.assign(2 * width, 0);
  const double margin = 4 + c.radius;
  for (int parity = 0; parity < 2; ++parity) {
    for (int x = 0; x < c.patch.width; ++x) {
      values.clear();
      const bool across = std::abs(x - c.x) <= c.radius + margin;  // other columns miss the lamp
      for (int y = parity; y < c.patch.height; y += 2) {
        if (!across || !near_lamp(c, y, margin)) values.push_back(c.patch.row(y)[x]);
      }
      const double level = clipped_mean(values, noise);
      c.level[static_cast<std::size_t>(parity) * width + static_cast<std::size_t>(x)] =
          static_cast<float>(level);
      for (int y = parity; y < c.patch.height; y += 2) c.patch.row(y)[x] -= static_cast<float>(level);
    }
  }
}

/// Replaces pixels that tower over all their neighbours: a dot of a lamp never falls off that fast.
void mend_hot_pixels(Column& c) {
  struct Mend {
    int x, y;
    float value;
  };
  std::vector<Mend> mends;
  const auto threshold = static_cast<float>(6 * c.noise);
  for (int y = 1; y + 1 < c.patch.height; ++y) {
    for (int x = 1; x + 1 < c.patch.width; ++x) {
      const float v = c.patch.row(y)[x];
      // Bright to the left and right: perhaps a row of a dot that only one field of an interlaced frame
      // holds.
      if (v <= threshold || v < 2.5F * std::min(c.patch.row(y)[x - 1], c.patch.row(y)[x + 1])) continue;
      std::array<float, 9> around{};
      for (int i = 0; i < 9; ++i)
        around[static_cast<std::size_t>(i)] = c.patch.row(y + i / 3 - 1)[x + i % 3 - 1];
      const float middle = median(around);
      if (v > 2.5F * std::max(0.0F, middle) + threshold) mends.push_back({x, y, middle});
    }
  }
  for (const Mend& m : mends) c.patch.row(m.y)[m.x] = m.value;
}

/// The lamp's round halo (glare) is the same to the sides, where there is no smear: measured there in rings
/// and taken out. Beyond the patch's sides it goes on as the power of r with which it falls there.
void subtract_halo(Column& c) {
  const int reach = static_cast<int>(std::min(c.x, c.patch.width - 1 - c.x));
  if (reach < c.radius + 6) return;
  std::vector<std::vector<float>> rings(static_cast<std::size_t>(reach) + 1);
  for (int y = std::max(0, static_cast<int>(c.y) - reach);
       y <= std::min(c.patch.height - 1, static_cast<int>(c.y) + reach); ++y) {
    for (int x = 0; x < c.patch.width; ++x) {
      if (std::abs(x - c.x) < 1.2 * std::abs(y - c.y)) continue;
      const auto ring = static_cast<std::size_t>(std::lround(std::hypot(x - c.x, y - c.y)));
      if (ring < rings.size()) rings[ring].push_back(c.patch.row(y)[x]);
    }
  }
  c.halo.resize(rings.size());
  for (std::size_t i = 0; i < rings.size(); ++i)
    c.halo[i] = std::max(0.0, clipped_mean(rings[i], 2 * c.noise));
  const auto last = static_cast<std::size_t>(reach);
  const double far = (c.halo[last] + c.halo[last - 1]) / 2;
  const double near = (c.halo[last / 2] + c.halo[last / 2 + 1]) / 2;
  c.halo_power = far > 0 ? std::clamp(std::log2(std::max(near, far) / far), 0.5, 6.0) : 6;
  c.halo_end = far;
  // Far out it is less than a tenth of the noise.
  int extent = reach;
  while (extent < c.patch.height && c.halo_at(extent) > 0.1 * c.noise) ++extent;
  for (int y = std::max(0, static_cast<int>(c.y) - extent);
       y <= std::min(c.patch.height - 1, static_cast<int>(c.y) + extent); ++y) {
    for (int x = 0; x < c.patch.width; ++x) {
      const double r = std::hypot(x - c.x, y - c.y);
      if (r > c.radius + 1) c.patch.row(y)[x] -= static_cast<float>(c.halo_at(r));
    }
  }
}

/// Mean of the core columns in a row.
double core_mean(const Column& c, int row) {
  const int reach = std::max(1, static_cast<int>(0.6 * c.radius));
  const int centre = static_cast<int>(std::lround(c.x));
  double sum = 0;
  int count = 0;
  for (int x = std::max(0, centre - reach); x <= std::min(c.patch.width - 1, centre + reach); ++x, ++count) {
    sum += static_cast<double>(c.patch.row(row)[x]);
  }
  return sum / std::max(1, count);
}

/// Marks the lamp's disk and, walking away from it, its bloom: rows until the column has come down to its
/// level, or until it rises again (a dot on the bloom's flank).
void hide_bloom(Column& c) {
  c.hidden.assign(static_cast<std::size_t>(c.patch.height), 0);
  const double width = 2.0 * std::max(1, static_cast<int>(0.6 * c.radius)) + 1;
  const double gate = 4 * c.noise / std::sqrt(width * 3);
  const int guard = c.flat ? 9 : 2;  // a compressed edge rings through its 8 x 8 block
  for (const int step : {-1, +1}) {
    const int start = static_cast<int>(std::lround(c.y));
    const int edge = static_cast<int>(std::ceil(c.radius)) + guard;
    int quiet = 0;
    double lowest = 1e30;
    int lowest_row = start;
    for (int row = start; row >= 0 && row < c.patch.height; row += step) {
      c.hidden[static_cast<std::size_t>(row)] = 1;
      if (std::abs(row - start) < edge) continue;
      const int a = std::clamp(row - 1, 0, c.patch.height - 1);
      const int b = std::clamp(row + 1, 0, c.patch.height - 1);
      const double mean = (core_mean(c, a) + core_mean(c, row) + core_mean(c, b)) / 3;
      if (mean < lowest) {
        lowest = mean;
        lowest_row = row;
      }
      quiet = std::abs(mean) < gate ? quiet + 1 : 0;
      if (quiet >= 3) break;
      if (mean > lowest + 1.5 * gate + 0.25 * std::abs(lowest)) {
        for (int r = row; r != lowest_row; r -= step) c.hidden[static_cast<std::size_t>(r)] = 0;
        break;
      }
    }
  }
  const int centre = static_cast<int>(std::lround(c.x));
  for (int row = 0; row < c.patch.height; ++row) {
    // `level` was taken out: put it back to see what the sensor saw.
    const float level = c.level[static_cast<std::size_t>(row % 2) * static_cast<std::size_t>(c.patch.width) +
                                static_cast<std::size_t>(centre)];
    if (static_cast<double>(c.patch.row(row)[centre] + level) >= c.saturation)
      c.hidden[static_cast<std::size_t>(row)] = 1;
  }
}

/// Noise in the lamp's own lane from row to row, which photon noise on a bright line raises.
double lane_noise(const Column& c, double noise) {
  std::vector<float> differences;
  const int reach = std::max(1, static_cast<int>(0.6 * c.radius));
  const int centre = static_cast<int>(std::lround(c.x));
  for (int y = 0; y + 2 < c.patch.height; y += 2) {
    if (near_lamp(c, y, 2 * c.radius + 4)) continue;
    for (int x = std::max(0, centre - reach); x <= std::min(c.patch.width - 1, centre + reach); ++x) {
      differences.push_back(c.patch.row(y + 2)[x] - c.patch.row(y)[x]);
    }
  }
  const double rough = std::max(noise, robust_scale(differences) / std::numbers::sqrt2);
  // Dense dots raise this too; then the lanes beside say what noise is.
  return std::min(rough, 3 * noise);
}

/// Matched filter along one lane: for each row the amplitude of the lamp's profile on a free level, over its
/// noise.
std::vector<float> response(const Column& c, int lane, double radius) {
  const int height = c.patch.height;
  const int centre = c.lane_centre(lane);
  const double shift = lane == kLanes / 2 ? c.x - centre : 0;
  // The disk's marginals stand for the disk: exact enough to find a dot, which is then fitted in two
  // dimensions.
  const auto profile = [radius](double d) {
    const double half = std::sqrt(std::max(0.0, radius * radius - d * d)) / radius;
    return std::max(half, 0.6 / (1 + std::exp((std::abs(d) - radius) / DotFit::kEdge)));
  };
  std::vector<double> across;
  double across_power = 0;
  // The lane of a lamp at the image's edge is cut by it.
  const int first = std::max(0, centre - c.half_width);
  const int last = std::min(c.patch.width - 1, centre + c.half_width);
  for (int x = first; x <= last; ++x) {
    across.push_back(profile(x - centre - shift));
    across_power += across.back() * across.back();
  }
  std::vector<double> collapsed(static_cast<std::size_t>(height));
  for (int y = 0; y < height; ++y) {
    const float* row = c.patch.row(y) + first;
    double sum = 0;
    for (std::size_t i = 0; i < across.size(); ++i) sum += across[i] * static_cast<double>(row[i]);
    collapsed[static_cast<std::size_t>(y)] = sum;
  }
  const int reach = static_cast<int>(std::ceil(radius)) + 5;
  std::vector<double> along;
  for (int dy = -reach; dy <= reach; ++dy) along.push_back(profile(dy));
  std::vector<float> z(static_cast<std::size_t>(height), 0);
  for (int y = 0; y < height; ++y) {
    if (!c.visible(y)) continue;
    double n = 0;
    double sh = 0;
    double shh = 0;
    double sc = 0;
    double shc = 0;
    for (int r = std::max(0, y - reach); r <= std::min(height - 1, y + reach); ++r) {
      if (!c.visible(r)) continue;
      const int step = r - y + reach;
      const double h = along[static_cast<std::size_t>(step)];
      const double v = collapsed[static_cast<std::size_t>(r)];
      n += 1;
      sh += h;
      shh += h * h;
      sc += v;
      shc += h * v;
    }
    const double power = shh - sh * sh / n;
    if (power < 0.25) continue;
    z[static_cast<std::size_t>(y)] =
        static_cast<float>((shc - sh * sc / n) / (std::sqrt(power * across_power) * c.noise));
  }
  return z;
}

struct Candidate {
  int row = 0;
  double radius = 0;
  float z = 0;
};

struct Responses {
  std::vector<Candidate> candidates;  // top to bottom
  double scale = 1;                   // of the empty lanes' responses: 1 when noise is white
  double extreme = 0;                 // of the empty lanes' responses
};

Responses search_lanes(const Column& c, double min_snr) {
  Responses r;
  std::vector<float> best(static_cast<std::size_t>(c.patch.height), 0);
  std::vector<double> best_radius(best.size());
  std::vector<float> empty;
  std::vector<float> extremes(kLanes, 0);
  int lanes = 0;
  for (const double factor : {1.0, 0.55}) {
    const double radius = std::max(1.0, factor * c.radius);
    for (int lane = 0; lane < kLanes; ++lane) {
      if (!c.lane_inside(lane) && lane != kLanes / 2) continue;
      const std::vector<float> z = response(c, lane, radius);
      if (lane != kLanes / 2) {
        empty.insert(empty.end(), z.begin(), z.end());
        float& extreme = extremes[static_cast<std::size_t>(lane)];
        for (const float v : z) extreme = std::max(extreme, v);
        ++lanes;
        continue;
      }
      for (std::size_t y = 0; y < z.size(); ++y) {
        if (z[y] <= best[y]) continue;
        best[y] = z[y];
        best_radius[y] = radius;
      }
    }
  }
  std::erase_if(empty, [](float v) { return v == 0; });
  if (lanes > 0) r.scale = std::max(1.0, robust_scale(empty));
  std::erase_if(extremes, [](float v) { return v == 0; });
  // The median lane: one that holds another lamp's dots or hot pixels doesn't count.
  if (extremes.size() >= 2) r.extreme = median(extremes);
  const double gate = std::max(0.8 * min_snr * r.scale, 1.1 * r.extreme);
  for (int y = 0; y < c.patch.height; ++y) {
    const float z = best[static_cast<std::size_t>(y)];
    if (z < gate) continue;
    const int reach = std::max(1, static_cast<int>(best_radius[static_cast<std::size_t>(y)]));
    bool top = true;
    for (int o = std::max(0, y - reach); o <= std::min(c.patch.height - 1, y + reach) && top; ++o) {
      const float other = best[static_cast<std::size_t>(o)];
      top = other < z || (other == z && o >= y);
    }
    if (top) r.candidates.push_back({y, best_radius[static_cast<std::size_t>(y)], z});
  }
  return r;
}

enum class Verdict { dot, suspect, half_field, nothing };

Verdict judge(const Column& c, const DotFit& f, const FitWindow& w, double min_snr,
              const DetectOptions& options) {
  const double weakest =
      c.flat ? 2.5 / c.sample_level : 0;  // below that a quantiser makes blocks that look like dots
  if (f.amplitude <= weakest || f.snr < min_snr) return Verdict::nothing;
  if (f.y < -0.5 || f.y > c.patch.height - 0.5 || f.radius > 2.2 * c.radius + 2) return Verdict::nothing;
  if (!c.visible(std::clamp(static_cast<int>(std::lround(f.y)), 0, c.patch.height - 1)))
    return Verdict::nothing;
  // What is left of a halo whose shape isn't quite round looks like a dot of a part of it.
  if (f.amplitude < 0.3 * c.halo_at(std::abs(f.y - c.y))) return Verdict::nothing;
  const Evenness e = evenness(c.patch, w, f, c.noise);
  // Hot pixels: much smaller than the lamp, or nearly all of the light in a pixel or two.
  const double smallest = std::max(0.7, 0.33 * c.radius);
  if (f.radius < smallest || e.brightest_two > 0.62) return Verdict::nothing;
  if (std::abs(f.x - c.x) > std::max(0.8, 0.3 * c.radius) + 3 * f.sigma_x) return Verdict::nothing;
  if (e.least_field < 0.35 && e.least_field + 4 * e.half_sigma < 0.9 && e.least_half > 0.4)
    return Verdict::half_field;
  const bool shape = f.misfit <= 1.6 + 0.12 * f.amplitude / c.noise &&
                     e.least_half > 0.4 - 3 * e.half_sigma && f.radius <= 1.4 * c.radius + 0.7 && f.converged;
  if (!shape || f.snr < options.min_dot_snr) return Verdict::suspect;
  return Verdict::dot;
}

Column level_column(const Plane& plane, const Background& background, const Lamp& lamp) {
  Column c;
  c.radius = std::max(1.0, lamp.radius);
  c.half_width = static_cast<int>(std::ceil(0.9 * c.radius)) + 2;
  const int reach = (2 * c.half_width + 3) * (kLanes / 2) + c.half_width + 1;
  const int centre = static_cast<int>(std::lround(lamp.x));
  c.patch = columns(plane, centre - reach, centre + reach);
  c.x = lamp.x - c.patch.x0;
  c.y = lamp.y;
  c.saturation = background.saturation;
  c.sample_level = plane.level;
  c.flat = background.flat;
  c.noise = background.noise;
  subtract_level(c, std::max(background.noise, 0.5));
  mend_hot_pixels(c);
  subtract_halo(c);
  hide_bloom(c);
  c.noise = lane_noise(c, background.noise) * plane.correlation;
  // A compressor has removed the noise and left its rounding errors, which no flat area shows.
  if (c.flat) c.noise = std::max(c.noise, kQuantiserNoise / c.sample_level);
  return c;
}

/// The lamp's lane against its neighbours, in blocks of rows: a line is there in nearly all of them.
void find_line(const Column& c, ColumnReading& reading) {
  const int core = std::max(1, static_cast<int>(0.6 * c.radius));
  const int centre = static_cast<int>(std::lround(c.x));
  std::vector<float> beside;
  double inside = 0;
  int columns_inside = 0;
  int clipped = 0;
  for (int x = 0; x < c.patch.width; ++x) {
    const float level = (c.level[static_cast<std::size_t>(x)] +
                         c.level[static_cast<std::size_t>(c.patch.width) + static_cast<std::size_t>(x)]) /
                        2;
    if (std::abs(x - centre) <= core) {
      inside += static_cast<double>(level);
      ++columns_inside;
      if (level > 0.9 * c.saturation) ++clipped;
    } else if (std::abs(x - centre) > 2 * c.radius + 4) {
      beside.push_back(level);
    }
  }
  reading.clipped = 2 * clipped > columns_inside;
  if (beside.size() < 4 || columns_inside == 0) return;
  std::vector<float> deviations = beside;
  const float outside = median(beside);
  for (float& v : deviations) v -= outside;
  const double spread = robust_scale(deviations);  // of one column's level, fixed pattern included
  reading.line_level = inside / columns_inside - static_cast<double>(outside);
  const double rows = std::max(1.0, c.patch.height * (1 - reading.hidden));
  const double error =
      std::hypot(c.noise / std::sqrt(rows * columns_inside), spread / std::sqrt(columns_inside));
  if (reading.line_level < std::max(6 * error, 0.25 / c.sample_level)) return;
  constexpr int kBlock = 16;
  int blocks = 0;
  int bright = 0;
  for (int top = 0; top + kBlock <= c.patch.height; top += kBlock) {
    double sum = 0;
    int rows_seen = 0;
    for (int y = top; y < top + kBlock; ++y) {
      if (!c.visible(y)) continue;
      sum += core_mean(c, y);
      ++rows_seen;
    }
    if (rows_seen < kBlock / 2) continue;
    ++blocks;
    if (sum / rows_seen + reading.line_level > 0.4 * reading.line_level) ++bright;
  }
  reading.line = blocks >= 3 && bright >= 0.85 * blocks;
}

FitWindow window_around(const Column& c, const Candidate& candidate, int above, int below) {
  const int reach = static_cast<int>(std::ceil(c.radius)) + 4;
  const int centre = static_cast<int>(std::lround(c.x));
  FitWindow w;
  w.left = std::max(0, centre - c.half_width - 2);
  w.right = std::min(c.patch.width - 1, centre + c.half_width + 2);
  w.top = std::max({0, candidate.row - reach, (candidate.row + above) / 2});
  w.bottom = std::min({c.patch.height - 1, candidate.row + reach, (candidate.row + below + 1) / 2});
  while (w.top < candidate.row && !c.visible(w.top)) ++w.top;
  while (w.bottom > candidate.row && !c.visible(w.bottom)) --w.bottom;
  for (int y = candidate.row; y >= w.top; --y) {
    if (!c.visible(y)) w.top = y + 1;
  }
  for (int y = candidate.row; y <= w.bottom; ++y) {
    if (!c.visible(y)) w.bottom = y - 1;
  }
  return w;
}

}  // namespace

ColumnReading read_column(const Plane& plane, const Background& background, const Lamp& lamp,
                          const DetectOptions& options) {
  ColumnReading reading;
  const Column c = level_column(plane, background, lamp);
  reading.hidden = static_cast<double>(std::count(c.hidden.begin(), c.hidden.end(), 1)) / c.patch.height;
  find_line(c, reading);
  if (reading.clipped) return reading;
  const double gate = options.min_dot_snr * (c.flat ? kQuantiserGate : 1);
  const Responses found = search_lanes(c, gate);
  const double min_snr = std::max(gate * found.scale, 1.25 * found.extreme);
  double strongest = 0;
  const auto& list = found.candidates;
  for (std::size_t i = 0; i < list.size(); ++i) {
    const int above = i > 0 ? list[i - 1].row : -c.patch.height;
    const int below = i + 1 < list.size() ? list[i + 1].row : 2 * c.patch.height;
    const FitWindow window = window_around(c, list[i], above, below);
    DotFit start;
    start.x = c.x;
    start.y = list[i].row;
    start.radius = list[i].radius;
    start.amplitude =
        std::max(1.0, static_cast<double>(c.patch.row(list[i].row)[static_cast<int>(std::lround(c.x))]));
    DotFit fit = fit_dot(c.patch, window, start, c.noise);
    const Verdict verdict = judge(c, fit, window, min_snr, options);
    const double inflation = found.scale * (c.flat ? kQuantiserSpread : 1);
    fit.sigma_y *= inflation;
    fit.sigma_x *= inflation;
    fit.x += c.patch.x0;
    if (verdict == Verdict::dot) reading.dots.push_back(fit);
    if (verdict == Verdict::half_field) reading.half_field = true;
    if (verdict != Verdict::suspect) continue;
    ++reading.suspects;
    if (fit.snr > strongest) reading.suspect_row = fit.y;
    strongest = std::max(strongest, fit.snr);
  }
  std::sort(reading.dots.begin(), reading.dots.end(),
            [](const DotFit& a, const DotFit& b) { return a.y < b.y; });
  return reading;
}

}  // namespace emberlock::detail
