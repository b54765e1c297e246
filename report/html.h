// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/image.h"

namespace emberlock::report {

/// Escapes text for use between tags and in attributes.
std::string html_escape(std::string_view text);

/// A clause as a sentence: it begins with an upper-case letter and ends with one full stop. Nothing of
/// nothing.
std::string sentence(std::string_view clause);

/// An image as a PNG file; gray8 or rgb8.
std::string png_file(const Image& image);
/// The same as a `data:` URI, so that a page needs no other file.
std::string png_data_uri(const Image& image);
/// A picture from a data URI with its caption, which is escaped.
std::string figure(const std::string& source, const std::string& alt, const std::string& caption);
/// RFC 4648, with padding.
std::string base64(std::string_view content);
/// A file's content as a `data:` URI; `type` such as "image/jpeg".
std::string data_uri(std::string_view type, std::string_view content);

enum class Mark {
  line,    ///< with points if they are few
  points,  ///< without a line
};

struct Series {
  std::string name;
  std::vector<double> x;
  std::vector<double> y;  ///< values that aren't finite are gaps
  bool dashed = false;
  Mark mark = Mark::line;
  std::optional<std::size_t> colour = {};  ///< of the palette; default: the index of the series
  std::vector<std::string> notes = {};     ///< tooltips of the points; empty, or one per point
};

enum class Axis { linear, logarithmic };

/// Where the names of the series stand.
enum class Legend { right, below };

struct PlotOptions {
  std::string title = {};
  std::string x_label = {};
  std::string y_label = {};
  Axis x_axis = Axis::linear;
  Axis y_axis = Axis::linear;
  std::optional<double> band = {};  ///< shades -band..band of y: a tolerance
  std::optional<double> mark = {};  ///< vertical line at this x: a choice
  int width = 720;                  ///< pixels
  int height = 320;                 ///< without a legend below
  Legend legend = Legend::right;
};

/// A line plot as inline SVG, in colours that colour-blind readers can distinguish (Okabe and Ito 2008).
std::string svg_plot(const std::vector<Series>& series, const PlotOptions& options);
/// The same for a desktop and for a phone, of which the page shows the one that fits.
std::string svg_plot_for_any_width(const std::vector<Series>& series, PlotOptions options);

/// A page without external scripts, fonts or pictures.
class HtmlPage {
 public:
  explicit HtmlPage(std::string title) : title_(std::move(title)) {}
  HtmlPage& heading(std::string_view text);
  HtmlPage& paragraph(std::string_view text);
  /// Inserts HTML unescaped: plots, figures.
  HtmlPage& raw(std::string_view html);
  HtmlPage& table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows);
  /// Pictures side by side, each with a caption.
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
