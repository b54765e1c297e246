// SPDX-License-Identifier: Apache-2.0
#include "report/viewer_page.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <zlib.h>

#include "report/html.h"

namespace emberlock::report {
namespace {

using nlohmann::json;

constexpr int kBrick = 8;

/// What largest * 2^-e is below 2^15 and not below 2^14 with: all halves are used, and none overflows.
int exponent_for(const std::vector<float>& values) {
  float largest = 0;
  for (const float v : values) largest = std::max(largest, std::abs(v));
  int exponent = 0;
  std::frexp(largest, &exponent);  // largest < 2^exponent
  return largest > 0 ? exponent - 15 : 0;
}

/// Values as the bits that are stored, in words of `Word`.
template <class Word>
std::vector<Word> words_of(const std::vector<float>& values, int exponent) {
  std::vector<Word> words(values.size());
  std::transform(values.begin(), values.end(), words.begin(), [&](float v) {
    if constexpr (sizeof(Word) == sizeof(float)) {
      return std::bit_cast<Word>(v);
    } else {
      return Eigen::numext::bit_cast<Word>(Eigen::half(std::ldexp(v, -exponent)));
    }
  });
  return words;
}

/// Visits bricks, x fastest: act(first key point of the brick on each axis).
template <class Act>
void each_brick(const recon::Grid& g, const Act& act) {
  for (int k = 0; k < g.nz; k += kBrick)
    for (int j = 0; j < g.ny; j += kBrick)
      for (int i = 0; i < g.nx; i += kBrick) act(i, j, k);
}

/// A brick's words, 0 beyond the grid.
template <class Word>
std::vector<Word> brick_at(const recon::Grid& g, const std::vector<Word>& words, std::size_t lanes, int i,
                           int j, int k) {
  std::vector<Word> brick(kBrick * kBrick * kBrick * lanes);
  const auto row = static_cast<std::size_t>(std::min(kBrick, g.nx - i)) * lanes;
  for (int z = 0; z < std::min(kBrick, g.nz - k); ++z)
    for (int y = 0; y < std::min(kBrick, g.ny - j); ++y)
      std::copy_n(words.begin() + static_cast<std::ptrdiff_t>(g.index(i, j + y, k + z) * lanes), row,
                  brick.begin() + static_cast<std::ptrdiff_t>(lanes) * kBrick * (y + kBrick * z));
  return brick;
}

template <class Word>
std::string in_bricks(const recon::Grid& g, const std::vector<Word>& words, std::size_t lanes) {
  std::string mask;
  std::vector<Word> filled;
  std::size_t number = 0;
  each_brick(g, [&](int i, int j, int k) {
    const std::vector<Word> brick = brick_at(g, words, lanes, i, j, k);
    if (number % 8 == 0) mask.push_back('\0');
    if (std::any_of(brick.begin(), brick.end(), [](Word w) { return w != 0; })) {
      mask.back() = static_cast<char>(static_cast<unsigned char>(mask.back()) | 1U << number % 8);
      filled.insert(filled.end(), brick.begin(), brick.end());
    }
    ++number;
  });
  std::string bytes = std::move(mask);
  bytes.reserve(bytes.size() + filled.size() * sizeof(Word));
  for (std::size_t plane = 0; plane < sizeof(Word); ++plane)
    for (const Word word : filled) bytes.push_back(static_cast<char>(word >> 8 * plane & 0xFFU));
  return bytes;
}

std::string deflated(const std::string& bytes) {
  uLongf size = ::compressBound(bytes.size());
  std::string out(size, '\0');
  // Its errors are too little room and too little memory: the former can't be, the latter would have thrown.
  ::compress2(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
              bytes.size(), Z_DEFAULT_COMPRESSION);
  out.resize(size);
  return out;
}

json triple(double x, double y, double z) { return json::array({x, y, z}); }
json triple(const Eigen::Vector3d& v) { return triple(v.x(), v.y(), v.z()); }
json picture_or_null(const std::string& uri) { return uri.empty() ? json() : json(uri); }

json camera_json(const ViewerCamera& c) {
  const recon::Intrinsics& k = c.camera.intrinsics;
  json rotation = json::array();
  for (int row = 0; row < 3; ++row)
    for (int column = 0; column < 3; ++column)
      rotation.push_back(c.camera.camera_from_world.rotation(row, column));
  return {{"name", c.name},
          {"role", c.role == recon::ViewRole::held_out ? "held_out" : "input"},
          {"size", json::array({k.size.width, k.size.height})},
          {"focal", json::array({k.fx, k.fy})},
          {"middle", json::array({k.cx, k.cy})},
          {"rotation", std::move(rotation)},
          {"translation", triple(c.camera.camera_from_world.translation)}};
}

json views_json(const std::vector<ViewerView>& views) {
  json told = json::array();
  for (const ViewerView& v : views)
    told.push_back({{"rmse", v.rmse ? json(*v.rmse) : json()},
                    {"captured", picture_or_null(v.captured)},
                    {"rendered", picture_or_null(v.rendered)}});
  return told;
}

/// Text inside of a <script> or <style>: nothing in it ends the element.
std::string replaced(std::string text, std::string_view what, std::string_view by) {
  for (std::size_t at = 0; (at = text.find(what, at)) != std::string::npos; at += by.size())
    text.replace(at, what.size(), by);
  return text;
}

}  // namespace

Result<PackedGrid> packed(const recon::Grid& grid, const recon::SharedGrid& values, Stored stored) {
  const std::size_t lanes = values.values.size() / grid.size();
  if ((lanes != 1 && lanes != 3) || values.values.size() != lanes * grid.size())
    return Error{ErrorKind::bad_input,
                 fmt::format("has {} values at {} key points", values.values.size(), grid.size()),
                 values.name};
  if (!std::all_of(values.values.begin(), values.values.end(), [](float v) { return std::isfinite(v); }))
    return Error{ErrorKind::bad_input, "has values that aren't finite", values.name,
                 "The file is damaged: reconstruct it again"};
  if (stored == Stored::float32)
    return PackedGrid{in_bricks(grid, words_of<std::uint32_t>(values.values, 0), lanes), 1};
  const int exponent = exponent_for(values.values);
  return PackedGrid{in_bricks(grid, words_of<std::uint16_t>(values.values, exponent), lanes),
                    std::ldexp(1.0, exponent)};
}

Status ViewerPage::add_frame(const recon::SharedVolume& volume, std::vector<ViewerView> views) {
  if (volume.find("emission") == nullptr)
    return Error{ErrorKind::bad_input, "has no emission", "volume",
                 "Name a result of `emberlock reconstruct`"};
  Frame frame{volume.grid, volume.provenance.frame, {}, std::move(views)};
  std::vector<std::string> blocks;
  for (const recon::SharedGrid& grid : volume.grids) {
    const bool tells = std::any_of(grid.values.begin(), grid.values.end(), [](float v) { return v != 0; });
    if (!tells && grid.name != "emission") continue;
    EMBERLOCK_ASSIGN_OR_RETURN(const PackedGrid values, packed(volume.grid, grid, stored_));
    frame.channels.push_back({grid.name, grid.unit, grid.values.size() / volume.grid.size(), values.scale});
    blocks.push_back(base64(deflated(values.bytes)));
  }
  frames_.push_back(std::move(frame));
  std::move(blocks.begin(), blocks.end(), std::back_inserter(blocks_));
  return {};
}

std::string ViewerPage::header() const {
  json told{{"version", 1}, {"title", title_}, {"input", input_}, {"up", triple(up_)}};
  std::size_t block = 0;
  json& frames = told["frames"] = json::array();
  for (const Frame& f : frames_) {
    json channels = json::array();
    for (const Channel& c : f.channels)
      channels.push_back({{"name", c.name},
                          {"unit", c.unit},
                          {"lanes", c.lanes},
                          {"type", stored_ == Stored::half ? "half" : "float32"},
                          {"scale", c.scale},
                          {"block", block++}});
    const float* at = f.grid.origin;
    frames.push_back({{"frame", f.number ? json(*f.number) : json()},
                      {"points", json::array({f.grid.nx, f.grid.ny, f.grid.nz})},
                      {"edge", f.grid.edge},
                      {"origin", triple(static_cast<double>(at[0]), static_cast<double>(at[1]),
                                        static_cast<double>(at[2]))},
                      {"channels", std::move(channels)},
                      {"views", views_json(f.views)}});
  }
  json& cameras = told["cameras"] = json::array();
  for (const ViewerCamera& camera : cameras_) cameras.push_back(camera_json(camera));
  json& trace = told["trace"] = json::array();
  for (const ViewerTrace& point : trace_)
    trace.push_back({{"seconds", point.seconds},
                     {"input", point.input_rmse},
                     {"held_out", point.heldout_rmse ? json(*point.heldout_rmse) : json()}});
  // Names of files may be in any coding.
  return replaced(told.dump(-1, ' ', false, json::error_handler_t::replace), "<", "\\u003c");
}

std::string ViewerPage::html(const ViewerProgram& program) const {
  std::string html =
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src 'none'; script-src "
      "'unsafe-inline'; "
      "style-src 'unsafe-inline'; img-src data: blob:; media-src blob:\">\n<title>" +
      html_escape(title_) + "</title>\n<style>" + replaced(program.style, "</", "<\\/") +
      "</style></head>\n<body><noscript><p>This page shows its volume by a script.</p></noscript>\n"
      "<script type=\"application/json\" id=\"emberlock-result\">" +
      header() + "</script>\n";
  for (const std::string& block : blocks_)
    html += "<script type=\"application/octet-stream\" class=\"emberlock-block\">" + block + "</script>\n";
  return html + "<script>" + replaced(program.script, "</script", "<\\/script") + "</script></body></html>\n";
}

}  // namespace emberlock::report
