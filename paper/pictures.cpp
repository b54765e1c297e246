// SPDX-License-Identifier: Apache-2.0
#include "paper/pictures.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include <fmt/format.h>

#include "recon/views/flame_mask.h"
#include "report/flame_pictures.h"
#include "report/inferno.h"

namespace emberlock::paper {
namespace {

using report::crop;
using report::enlarged;
using report::html_escape;
using report::HtmlPage;
using report::inferno;
using report::png_data_uri;
using report::Rgb;
using report::side_by_side;
using report::with_margin;

constexpr int kPictureWidth = 200;
constexpr int kErrorGain = 4;
constexpr int kColdest = 1000, kHottest = 2100;  // K
constexpr int kWorst = 200;                      // K, of an error's colour

const RunPicture* find(const std::vector<RunPicture>& pictures, std::string_view begin) {
  for (const RunPicture& p : pictures)
    if (p.name.starts_with(begin)) return &p;
  return nullptr;
}

const FilmedCase* filmed(const PaperEvaluation& evaluation, const MethodRun& run) {
  for (const FilmedCase& f : evaluation.filmed)
    if (f.protocol == run.protocol && f.of == run.of) return &f;
  return nullptr;
}

const std::uint8_t* row_of(const Image& image, int y) { return image.view().row_as<std::uint8_t>(y); }

/// Where a picture shows something, with a margin.
recon::PixelBox lit_box(const Image& image) {
  recon::PixelBox box{image.layout().size.width, image.layout().size.height, 0, 0};
  for (int y = 0; y < image.layout().size.height; ++y) {
    const auto* row = row_of(image, y);
    for (int x = 0; x < image.layout().size.width; ++x) {
      if (std::max({row[3 * x], row[3 * x + 1], row[3 * x + 2]}) < 3) continue;
      box = {std::min(box.x0, x), std::min(box.y0, y), std::max(box.x1, x + 1), std::max(box.y1, y + 1)};
    }
  }
  return box.empty() ? box : with_margin(box, 6, image.layout().size);
}

Image error_of(const Image& a, const Image& b) {
  Image out(ImageLayout{a.layout().size, PixelFormat::rgb8, 8});
  for (int y = 0; y < a.layout().size.height; ++y)
    for (int i = 0; i < 3 * a.layout().size.width; ++i)
      out.row_as<std::uint8_t>(y)[i] =
          static_cast<std::uint8_t>(std::min(255, kErrorGain * std::abs(row_of(a, y)[i] - row_of(b, y)[i])));
  return out;
}

HtmlPage::Picture shown(const Image& image, const std::string& caption, int width = kPictureWidth) {
  return {fmt::format("<img alt=\"{}\" width=\"{}\" src=\"{}\">", html_escape(caption), width,
                      png_data_uri(image)),
          caption};
}

void add_pair(std::vector<HtmlPage::Picture>& out, const Image& truth, const Image& image,
              const std::string& caption) {
  if (truth.layout().size != image.layout().size) return;
  const recon::PixelBox box = lit_box(truth);
  out.push_back(shown(side_by_side({crop(image, box), crop(error_of(truth, image), box)}),
                      fmt::format("{}; its error, times {}", caption, kErrorGain), 2 * kPictureWidth));
}

std::string name_of(const MethodRun& run) {
  return run.device == "cpu" ? run.method : run.method + ", " + run.device;
}

Image coloured(const TemperatureSlice& slice, const std::vector<float>& kelvin, int low, int high) {
  Image out(ImageLayout{slice.size, PixelFormat::rgb8, 8});
  for (int y = 0; y < slice.size.height; ++y)
    for (int x = 0; x < slice.size.width; ++x) {
      const auto at = static_cast<std::size_t>(y) * static_cast<std::size_t>(slice.size.width) +
                      static_cast<std::size_t>(x);
      if (!(slice.truth[at] > 0) || !(slice.found[at] > 0)) continue;
      const double share = std::clamp((static_cast<double>(kelvin[at]) - low) / (high - low), 0.0, 1.0);
      const Rgb& colour = inferno()[static_cast<std::size_t>(std::lround(255 * share))];
      std::copy(colour.begin(), colour.end(), out.row_as<std::uint8_t>(y) + 3 * static_cast<std::size_t>(x));
    }
  return out;
}

}  // namespace

std::vector<HtmlPage::Picture> method_pictures(const PaperEvaluation& evaluation, const Protocol& protocol) {
  std::vector<HtmlPage::Picture> out;
  std::string last;
  for (const MethodRun& run : evaluation.runs) {
    if (run.protocol != protocol.name || !run.failed.empty() || run.device != "cpu") continue;
    const FilmedCase* truth = filmed(evaluation, run);
    const RunPicture* image = find(run.pictures, "test-");
    if (truth == nullptr || image == nullptr) continue;
    const RunPicture* same = find(truth->pictures, image->name);
    if (same == nullptr) continue;
    if (run.of != last) {
      const recon::PixelBox box = lit_box(same->image);
      out.push_back(shown(crop(same->image, box), run.of + ": the truth, test view"));
      last = run.of;
    }
    add_pair(out, same->image, image->image, name_of(run));
  }
  return out;
}

std::vector<HtmlPage::Picture> pass_pictures(const PaperEvaluation& evaluation, const Protocol& protocol) {
  std::vector<HtmlPage::Picture> out;
  for (const MethodRun& run : evaluation.runs) {
    const FilmedCase* truth = filmed(evaluation, run);
    if (run.protocol != protocol.name || truth == nullptr) continue;
    const RunPicture* test = find(truth->pictures, "test-");
    for (const RunPicture& p : run.pictures)
      if (test != nullptr && p.name.starts_with("after-"))
        add_pair(out, test->image, p.image, fmt::format("{}, {} iterations", name_of(run), p.name.substr(6)));
  }
  return out;
}

std::vector<HtmlPage::Picture> slice_pictures(const PaperEvaluation& evaluation, const Protocol& protocol) {
  // Cases rise by cameras; the paper shows 16.
  std::string of;
  for (const Case& one : protocol.cases)
    if (of.empty() || one.cameras.size() <= 17) of = one.name;
  std::vector<HtmlPage::Picture> out;
  for (const MethodRun& run : evaluation.runs) {
    if (run.protocol != protocol.name || run.of != of || !run.slice || run.device != "cpu") continue;
    const TemperatureSlice& slice = *run.slice;
    std::vector<float> off(slice.found.size());
    for (std::size_t i = 0; i < off.size(); ++i) off[i] = std::abs(slice.found[i] - slice.truth[i]);
    const Image found = coloured(slice, slice.found, kColdest, kHottest);
    const recon::PixelBox box = lit_box(found);
    const ImageSize most{2 * kPictureWidth, 2 * kPictureWidth};
    const auto large = [&](const Image& image) { return enlarged(crop(image, box), most); };
    const std::string range = fmt::format("{} (dark) to {} K (bright)", kColdest, kHottest);
    out.push_back(shown(large(found), fmt::format("{}, {}: {}", run.of, name_of(run), range)));
    out.push_back(
        shown(large(coloured(slice, slice.truth, kColdest, kHottest)), "the truth there, " + range));
    out.push_back(shown(large(coloured(slice, off, 0, kWorst)), fmt::format("off by 0 to {} K", kWorst)));
  }
  return out;
}

}  // namespace emberlock::paper
