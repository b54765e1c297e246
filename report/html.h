// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"

namespace emberlock::report {

/// Text made safe between tags and in attributes.
std::string html_escape(std::string_view text);

/// An image as a PNG file. gray8 and rgb8.
std::string png_file(const Image& image);
/// The same as a `data:` URI, so that a page stands alone.
std::string png_data_uri(const Image& image);

enum class Mark {
  line,    ///< and points where there are few
  points,  ///< alone
};

struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;  ///< points that are not finite are gaps
  bool dashed = false;
  Mark mark = Mark::line;
  std::optional<std::size_t> colour = {};  ///< of the palette; the series' own place otherwise
  std::vector<std::string> notes = {};     ///< shown when a point is pointed at; none, or one a point
};

enum class Axis { linear, logarithmic };

struct PlotOptions {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  Axis x_axis = Axis::linear;
  Axis y_axis = Axis::linear;
  std::optional<double> band = {};  ///< shades -band..band of y: a tolerance
  std::optional<double> mark = {};  ///< an upright line at this x: a choice
  int width = 720;                  ///< pixels
  int height = 320;
};

/// A line plot as inline SVG, colours told apart by colour-blind readers too (Okabe and Ito 2008).
std::string svg_plot(const std::vector<Series>& series, const PlotOptions& options);

/// A self-contained page: no script, no font, no picture from elsewhere.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}
  HtmlPage& heading(std::string_view text);
  HtmlPage& paragraph(std::string_view text);
  /// Inner HTML as it is: plots, figures.
  HtmlPage& raw(std::string_view html);
  HtmlPage& table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// Pictures side by side, each with its caption.
  struct Picture {
    std::string html;  ///< an <svg> or <img>
    std::string caption;
  };
  HtmlPage& gallery(const std::vector<Picture>& pictures);
  [[nodiscard]] std::string str() const;

 private:
  std::string title_;
  std::string body_;
};

}  // namespace emberlock::report
