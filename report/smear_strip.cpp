// SPDX-License-Identifier: Apache-2.0
#include "report/smear_strip.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "report/html.h"

namespace emberlock::report {
namespace {

/// Mean of a pixel's channels.
double brightness(const ImageView& frame, int x, int y) {
  const int n = channels(frame.layout.format);
  double sum = 0;
  for (int c = 0; c < n; ++c) sum += frame.sample(x, y, c);
  return sum / n;
}

/// The strip at half size, as floating-point brightness; each pixel is the mean of 2 x 2.
struct Strip {
  int left, width, height;
  std::vector<double> value;
};

Strip cut(const ImageView& frame, int center, int half_width) {
  const int width = std::min(half_width, std::max(1, frame.width() / 2));
  const int left = std::clamp(center - width, 0, std::max(0, frame.width() - 2 * width));
  Strip strip{left, width, std::max(1, frame.height() / 2), {}};
  for (int y = 0; y < strip.height; ++y) {
    for (int x = 0; x < width; ++x) {
      double sum = 0;
      for (int i = 0; i < 4; ++i) {
        sum += brightness(frame, std::min(left + 2 * x + i % 2, frame.width() - 1),
                          std::min(2 * y + i / 2, frame.height() - 1));
      }
      strip.value.push_back(sum / 4);
    }
  }
  return strip;
}

/// Stretches the contrast so that the background is nearly black and a faint dot is bright.
Image stretch(const Strip& strip, const smear::SmearReading& reading) {
  std::vector<double> sorted = strip.value;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  const double background = *middle;
  double faintest = 40;
  for (const smear::DotReading& dot : reading.dots) faintest = std::min(faintest, dot.amplitude);
  const double range = std::max(6.0, 1.5 * faintest);
  Image image({{strip.width, strip.height}, PixelFormat::gray8, 8});
  for (std::size_t i = 0; i < strip.value.size(); ++i) {
    const double v = (strip.value[i] - background) / range;
    image.bytes()[i] = static_cast<std::byte>(std::lround(255 * std::sqrt(std::clamp(0.02 + v, 0.0, 1.0))));
  }
  return image;
}

}  // namespace

std::vector<RowSpan> tolerance_band(const smear::CcdTiming& timing, Rows lamp, Seconds tau, Rows tolerance) {
  // In read order: row 0 is read first, however it is displayed.
  const bool top_first = timing.direction == smear::ReadDirection::top_first;
  const double last = timing.rows - 1;
  const double start = top_first ? lamp.value() : last - lamp.value();
  const double center = (tau / timing.row_time).value() - 0.5;
  const double low = std::max(center - tolerance.value(), 0.0);
  const double high = std::min(center + tolerance.value(), static_cast<double>(timing.shifts));
  std::vector<RowSpan> spans;
  for (const double turn : {0.0, static_cast<double>(timing.shifts)}) {
    const double from = std::max(start + low - turn, 0.0);
    const double to = std::min(start + high - turn, last);
    if (to <= from) continue;
    spans.push_back(top_first ? RowSpan{Rows(from), Rows(to)} : RowSpan{Rows(last - to), Rows(last - from)});
  }
  return spans;
}

std::string smear_strip_svg(const ImageView& frame, const smear::SmearReading& reading,
                            const std::vector<RowSpan>& band, int half_width) {
  const int center = reading.lamp ? static_cast<int>(std::lround(reading.lamp->x)) : frame.width() / 2;
  const Strip strip = cut(frame, center, half_width);
  std::string svg = fmt::format(
      R"(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}"><image href="{2}" width="{0}" height="{1}"/>)",
      strip.width, strip.height, png_data_uri(stretch(strip, reading)));
  // Readings count from pixel centres; the strip is at half size.
  const auto row = [](Rows y) { return (y.value() + 0.5) / 2; };
  for (const RowSpan& span : band) {
    svg += fmt::format(R"(<rect x="0" y="{:.1f}" width="{}" height="{:.1f}" fill="#009e73" opacity=".35"/>)",
                       row(span.from), strip.width, std::max(1.0, row(span.to) - row(span.from)));
  }
  if (reading.lamp) {
    svg += fmt::format(
        R"(<circle cx="{:.1f}" cy="{:.1f}" r="{:.1f}" fill="none" stroke="#56b4e9" stroke-width="1.5"/>)",
        (reading.lamp->x + 0.5 - strip.left) / 2, row(reading.lamp->y),
        std::max(3.0, reading.lamp->radius / 2 + 2));
  }
  for (const smear::DotReading& dot : reading.dots) {
    svg += fmt::format(R"(<path d="M0 {0:.1f}h8M{1} {0:.1f}h8" stroke="#e69f00" stroke-width="2"/>)",
                       row(dot.y), strip.width - 8);
  }
  return svg + "</svg>";
}

}  // namespace emberlock::report
