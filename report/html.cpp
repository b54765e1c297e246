// SPDX-License-Identifier: Apache-2.0
#include "report/html.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace emberlock::report {
namespace {

constexpr std::array<const char*, 8> kColours{"#0072b2", "#d55e00", "#009e73", "#cc79a7",
                                              "#e69f00", "#56b4e9", "#7f7f7f", "#b8a900"};

constexpr const char* kStyle = R"(
:root { color-scheme: light dark; --ink: #222; --paper: #fff; --line: #ccc; --soft: #f3f3f3; }
@media (prefers-color-scheme: dark) { :root { --ink: #ddd; --paper: #151515; --line: #444; --soft: #222; } }
body { font: 16px/1.5 system-ui, sans-serif; color: var(--ink); background: var(--paper); max-width: 78rem;
  margin: 2rem auto; padding: 0 1rem; }
h1, h2, p, li, figcaption { overflow-wrap: anywhere; } h1 { font-size: 1.6rem; } h2 { font-size: 1.25rem; margin-top: 2.5rem; border-bottom: 1px solid var(--line); }
table { border-collapse: collapse; margin: 1rem 0; } th, td { padding: .25rem .8rem; text-align: right; }
th:first-child, td:first-child { text-align: left; } tr:nth-child(even) td { background: var(--soft); }
.gallery { display: flex; flex-wrap: wrap; gap: .8rem; } figure { margin: 0; } img, svg { max-width: 100%; }
figcaption { font-size: .85rem; width: 0; min-width: 100%; } .scroll { overflow-x: auto; }
svg text { fill: var(--ink); font: 12px system-ui, sans-serif; } svg .grid { stroke: var(--line); }
@media (max-width: 44rem) { .gallery { overflow-x: auto; } .gallery svg, .scroll svg { max-width: none; } }
.narrow { display: none; } @media (max-width: 700px) { .wide { display: none; } .narrow { display: block; } }
)";

/// One plot axis: maps data to pixels and places the ticks.
class Scale {
 public:
  Scale(double low, double high, Axis axis, double from, double to)
      : log_(axis == Axis::logarithmic), low_(map(low)), high_(map(high)), from_(from), to_(to) {
    if (!(high_ > low_)) {
      low_ -= 0.5;
      high_ += 0.5;
    }
  }
  [[nodiscard]] double operator()(double v) const {
    return from_ + (to_ - from_) * (map(v) - low_) / (high_ - low_);
  }
  [[nodiscard]] std::vector<double> ticks() const {
    std::vector<double> result;
    if (log_) {
      const bool dense = high_ - low_ < 1.5;
      for (int e = static_cast<int>(std::floor(low_)); e <= static_cast<int>(std::ceil(high_)); ++e) {
        for (const double m : {1.0, 2.0, 5.0}) {
          if (m > 1 && !dense) continue;
          const double t = std::log10(m) + e;
          if (t >= low_ - 1e-9 && t <= high_ + 1e-9) result.push_back(m * std::pow(10, e));
        }
      }
      return result;
    }
    const double raw = (high_ - low_) / 6;
    const double power = std::pow(10, std::floor(std::log10(raw)));
    const double fraction = raw / power;
    const double step = power * (fraction < 1.5 ? 1 : fraction < 3.5 ? 2 : fraction < 7.5 ? 5 : 10);
    for (double t = std::ceil(low_ / step - 1e-9) * step; t <= high_ + 1e-9 * step; t += step) {
      result.push_back(std::abs(t) < 1e-9 * step ? 0 : t);
    }
    return result;
  }

 private:
  [[nodiscard]] double map(double v) const { return log_ ? std::log10(std::max(v, 1e-12)) : v; }
  bool log_;
  double low_, high_, from_, to_;
};

struct Range {
  double low = INFINITY;
  double high = -INFINITY;
  void include(double v, Axis axis) {
    if (!std::isfinite(v) || (axis == Axis::logarithmic && v <= 0)) return;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  void widen() {
    if (low > high) low = 0, high = 1;
  }
};

std::string polyline(const Series& s, const Scale& x, const Scale& y, const char* colour, bool dashed) {
  std::string path;
  std::string dots;
  bool pen_down = false;
  for (std::size_t i = 0; i < std::min(s.x.size(), s.y.size()); ++i) {
    if (!std::isfinite(s.y[i])) {
      pen_down = false;
      continue;
    }
    path += fmt::format("{}{:.1f} {:.1f}", pen_down ? "L" : "M", x(s.x[i]), y(s.y[i]));
    pen_down = true;
    if (s.x.size() <= 60 || s.mark == Mark::points) {
      dots += fmt::format(R"(<circle cx="{:.1f}" cy="{:.1f}" r="{}" fill="{}">{}</circle>)", x(s.x[i]),
                          y(s.y[i]), s.notes.empty() ? 2.5 : 3.5, colour,
                          i < s.notes.size() ? "<title>" + html_escape(s.notes[i]) + "</title>" : "");
    }
  }
  if (s.mark == Mark::points) return dots;
  return fmt::format(R"(<path d="{}" fill="none" stroke="{}" stroke-width="1.6"{}/>)", path, colour,
                     dashed ? R"( stroke-dasharray="6 4")" : "") +
         dots;
}

std::string axes(const Scale& x, const Scale& y, const PlotOptions& o, double left, double right, double top,
                 double bottom) {
  std::string svg;
  for (const double t : x.ticks()) {
    svg +=
        fmt::format(R"(<line class="grid" x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}"/>)", x(t), top, bottom);
    svg += fmt::format(R"(<text x="{:.1f}" y="{}" text-anchor="middle">{:g}</text>)", x(t), bottom + 16, t);
  }
  for (const double t : y.ticks()) {
    svg +=
        fmt::format(R"(<line class="grid" x1="{1}" x2="{2}" y1="{0:.1f}" y2="{0:.1f}"/>)", y(t), left, right);
    svg += fmt::format(R"(<text x="{}" y="{:.1f}" text-anchor="end">{:g}</text>)", left - 6, y(t) + 4, t);
  }
  svg += fmt::format(R"(<text x="{}" y="14" font-weight="bold">{}</text>)", left, html_escape(o.title));
  svg += fmt::format(R"(<text x="{}" y="{}" text-anchor="middle">{}</text>)", (left + right) / 2, bottom + 34,
                     html_escape(o.x_label));
  svg += fmt::format(R"svg(<text transform="translate(13 {}) rotate(-90)" text-anchor="middle">{}</text>)svg",
                     (top + bottom) / 2, html_escape(o.y_label));
  return svg;
}

}  // namespace

std::string html_escape(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      default:
        out += c;
    }
  }
  return out;
}

std::string png_file(const Image& image) {
  const bool rgb = image.layout().format == PixelFormat::rgb8;
  // OpenCV takes a mutable pointer, but doesn't write here.
  const cv::Mat mat(image.layout().size.height, image.layout().size.width, rgb ? CV_8UC3 : CV_8UC1,
                    const_cast<std::byte*>(image.bytes().data()), image.layout().row_bytes());  // NOLINT
  cv::Mat bgr = mat;
  if (rgb) cv::cvtColor(mat, bgr, cv::COLOR_RGB2BGR);
  std::vector<unsigned char> png;
  cv::imencode(".png", bgr, png);
  return {png.begin(), png.end()};
}

std::string base64(std::string_view content) {
  static constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve(content.size() * 4 / 3 + 4);
  for (std::size_t i = 0; i < content.size(); i += 3) {
    const std::size_t n = std::min<std::size_t>(3, content.size() - i);
    unsigned block = 0;
    for (std::size_t k = 0; k < 3; ++k)
      block = block << 8 | (k < n ? static_cast<unsigned char>(content[i + k]) : 0U);
    for (std::size_t k = 0; k < 4; ++k) text += k <= n ? kDigits[block >> (18 - 6 * k) & 63U] : '=';
  }
  return text;
}

std::string data_uri(std::string_view type, std::string_view content) {
  return "data:" + std::string(type) + ";base64," + base64(content);
}

std::string sentence(std::string_view clause) {
  std::string text(clause);
  if (text.empty()) return text;
  text.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(text.front())));
  if (text.back() != '.') text += '.';
  return text;
}

std::string figure(const std::string& source, const std::string& alt, const std::string& caption) {
  return "<figure><img src=\"" + source + "\" alt=\"" + html_escape(alt) + "\"><figcaption>" +
         html_escape(caption) + "</figcaption></figure>";
}

std::string png_data_uri(const Image& image) { return data_uri("image/png", png_file(image)); }

std::string svg_plot(const std::vector<Series>& series, const PlotOptions& o) {
  Range xs;
  Range ys;
  for (const Series& s : series) {
    for (const double v : s.x) xs.include(v, o.x_axis);
    for (const double v : s.y) ys.include(v, o.y_axis);
  }
  if (o.band) {
    ys.include(-*o.band, o.y_axis);
    ys.include(*o.band, o.y_axis);
  }
  if (o.mark) xs.include(*o.mark, o.x_axis);
  xs.widen();
  ys.widen();
  if (o.y_axis == Axis::linear && ys.low > 0 && ys.low < 0.5 * ys.high) ys.low = 0;
  const double left = 62;
  std::size_t longest = 0;
  for (const Series& s : series) longest = std::max(longest, s.name.size());
  const bool below = o.legend == Legend::below;
  const double right =
      below ? o.width - 12.0 : o.width - std::max(150.0, 40 + 6.7 * static_cast<double>(longest));
  const double top = 24;
  const double bottom = o.height - 42;
  const double height = o.height + (below ? 6 + 17 * static_cast<double>(series.size()) : 0);
  const Scale x(xs.low, xs.high, o.x_axis, left, right);
  const Scale y(ys.low, ys.high, o.y_axis, bottom, top);
  std::string svg =
      fmt::format(R"(<svg viewBox="0 0 {0} {1}" width="{0}" height="{1}" role="img" aria-label="{2}">)",
                  o.width, height, html_escape(o.title));
  if (o.band) {
    svg += fmt::format(R"(<rect x="{}" y="{:.1f}" width="{}" height="{:.1f}" fill="#009e73" opacity=".15"/>)",
                       left, y(*o.band), right - left, y(-*o.band) - y(*o.band));
  }
  if (o.mark) {
    svg += fmt::format(R"(<line x1="{0:.1f}" x2="{0:.1f}" y1="{1}" y2="{2}" stroke="#009e73" )"
                       R"(stroke-width="9" opacity=".25"/>)",
                       x(*o.mark), top, bottom);
  }
  svg += axes(x, y, o, left, right, top, bottom);
  for (std::size_t i = 0; i < series.size(); ++i) {
    const char* colour = kColours[series[i].colour.value_or(i) % kColours.size()];
    const bool dashed = series[i].dashed || i >= kColours.size();  // colours repeat
    svg += polyline(series[i], x, y, colour, dashed);
    const double line = (below ? o.height + 2 : top + 10) + 17 * static_cast<double>(i);
    const double from = below ? left : right + 12;
    svg += fmt::format(R"(<line x1="{}" x2="{}" y1="{:.1f}" y2="{:.1f}" stroke="{}" stroke-width="3"{}/>)",
                       from, from + 16, line, line, colour, dashed ? R"( stroke-dasharray="6 4")" : "");
    svg +=
        fmt::format(R"(<text x="{}" y="{:.1f}">{}</text>)", from + 22, line + 4, html_escape(series[i].name));
  }
  return svg + "</svg>";
}

std::string svg_plot_for_any_width(const std::vector<Series>& series, PlotOptions options) {
  std::string html = "<div class=\"wide\">" + svg_plot(series, options) + "</div>";
  options.width = 350;
  options.height = 300;
  options.legend = Legend::below;
  return html + "<div class=\"narrow\">" + svg_plot(series, options) + "</div>";
}

HtmlPage& HtmlPage::heading(std::string_view text) {
  body_ += "<h2>" + html_escape(text) + "</h2>\n";
  return *this;
}

HtmlPage& HtmlPage::paragraph(std::string_view text) {
  body_ += "<p>" + html_escape(text) + "</p>\n";
  return *this;
}

HtmlPage& HtmlPage::raw(std::string_view html) {
  body_ += html;
  body_ += '\n';
  return *this;
}

HtmlPage& HtmlPage::table(const std::vector<std::string>& header,
                          const std::vector<std::vector<std::string>>& rows) {
  body_ += "<div class=\"scroll\"><table><tr>";
  for (const auto& cell : header) body_ += "<th>" + html_escape(cell) + "</th>";
  for (const auto& row : rows) {
    body_ += "</tr>\n<tr>";
    for (const auto& cell : row) body_ += "<td>" + html_escape(cell) + "</td>";
  }
  body_ += "</tr></table></div>\n";
  return *this;
}

HtmlPage& HtmlPage::gallery(const std::vector<Picture>& pictures) {
  body_ += "<div class=\"gallery\">";
  for (const auto& [html, caption] : pictures) {
    body_ += "<figure>" + html + "<figcaption>" + html_escape(caption) + "</figcaption></figure>\n";
  }
  body_ += "</div>\n";
  return *this;
}

std::string HtmlPage::str() const {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">"
      "<title>{0}</title><style>{1}</style></head>\n<body><h1>{0}</h1>\n{2}</body></html>\n",
      html_escape(title_), kStyle, body_);
}

}  // namespace emberlock::report
