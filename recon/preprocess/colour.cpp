// SPDX-License-Identifier: Apache-2.0
#include "recon/preprocess/colour.h"

#include <algorithm>
#include <cmath>

#include "recon/calibrate/rig.h"

namespace emberlock::recon {
namespace {

constexpr double kLeastLight = 0.02;  // of the middle's: a lens has more

template <class List>
bool all_finite(const List& list) {
  return std::all_of(list.begin(), list.end(), [](double v) { return std::isfinite(v); });
}

Error bad_field(const std::string& where, const char* field, std::string what) {
  return {ErrorKind::bad_input, std::move(what), where + ".colour." + field,
          "Calibrate the colours again, or take the field out"};
}

Status read_three(const google::protobuf::RepeatedField<double>& from, std::array<double, 3>& to,
                  const std::string& where, const char* field) {
  if (from.empty()) return {};
  if (from.size() != 3 || !all_finite(from)) return bad_field(where, field, "is not three finite numbers");
  std::copy(from.begin(), from.end(), to.begin());
  return {};
}

Status check_response(const std::vector<double>& response, const std::string& where) {
  if (response.empty()) return {};
  if (response.size() < 2 || !all_finite(response))
    return bad_field(where, "response", "is not two or more finite numbers");
  if (std::abs(response.front()) > 1e-9 || std::abs(response.back() - 1) > 1e-9)
    return bad_field(where, "response", "doesn't lead from 0 to 1");
  if (std::adjacent_find(response.begin(), response.end(), std::greater_equal<>()) != response.end())
    return bad_field(where, "response", "doesn't rise everywhere");
  return {};
}

Status read_flat(const v1::FlatField& message, FlatField& flat, const std::string& where) {
  constexpr std::uint32_t kMostCells = 4096;  // per side
  const std::uint32_t columns = message.columns();
  const std::uint32_t rows = message.rows();
  if (columns == 0 && rows == 0 && message.light().empty()) return {};
  if (columns == 0 || rows == 0 || columns > kMostCells || rows > kMostCells ||
      static_cast<std::uint64_t>(message.light_size()) != std::uint64_t{3} * columns * rows)
    return bad_field(where, "flat", "doesn't have three numbers for each of its columns and rows");
  if (!std::all_of(message.light().begin(), message.light().end(),
                   [](float v) { return v >= static_cast<float>(kLeastLight) && std::isfinite(v); }))
    return bad_field(where, "flat", "leaves a part of the picture without light");
  flat = {
      static_cast<int>(columns), static_cast<int>(rows), {message.light().begin(), message.light().end()}};
  return {};
}

Status read_spectral(const v1::Colour& message, Colour& colour, const std::string& where) {
  constexpr double kLongestExposure = 3600;  // s
  if (!(message.exposure_s() >= 0 && message.exposure_s() <= kLongestExposure))
    return bad_field(where, "exposure_s", "isn't within 0 to 3600 s");
  colour.exposure = Seconds(message.exposure_s());
  if (!message.has_spectral()) return {};
  EMBERLOCK_ASSIGN_OR_RETURN(CameraResponse response,
                             camera_response_of(message.spectral(), where + ".colour.spectral"));
  colour.spectral = std::make_shared<const CameraResponse>(std::move(response));
  return {};
}

}  // namespace

CellsOfLight cells_of(const FlatField& flat) {
  return {flat.columns, flat.rows, flat.light.empty() ? nullptr : flat.light.data()};
}

std::array<double, 3> light_at(const FlatField& flat, double x, double y) {
  std::array<double, 3> out = {};
  cells_of(flat).at(x, y, out.data());
  return out;
}

bool changes_nothing(const Colour& colour) {
  const std::array<double, 3> none = {};
  return colour.response.empty() && colour.dark == none && colour.gain == std::array<double, 3>{1, 1, 1} &&
         colour.vignetting == none && colour.flat.light.empty() && colour.hot_pixels.empty();
}

double exposure_of(const Colour& colour, double sample) {
  if (colour.response.empty()) return sample;
  const double place = std::clamp(sample, 0.0, 1.0) * static_cast<double>(colour.response.size() - 1);
  const auto below = std::min(static_cast<std::size_t>(place), colour.response.size() - 2);
  const double part = place - static_cast<double>(below);
  return (1 - part) * colour.response[below] + part * colour.response[below + 1];
}

double radius_squared(ImageSize size, double x, double y) {
  return radius_squared(size.width, size.height, x, y);
}

Result<Colour> read_colour(const v1::Colour& message, ImageSize size, const std::string& where) {
  Colour colour;
  colour.response.assign(message.response().begin(), message.response().end());
  EMBERLOCK_RETURN_IF_ERROR(check_response(colour.response, where));
  EMBERLOCK_RETURN_IF_ERROR(read_three(message.dark(), colour.dark, where, "dark"));
  EMBERLOCK_RETURN_IF_ERROR(read_three(message.gain(), colour.gain, where, "gain"));
  EMBERLOCK_RETURN_IF_ERROR(read_three(message.vignetting(), colour.vignetting, where, "vignetting"));
  EMBERLOCK_RETURN_IF_ERROR(read_flat(message.flat(), colour.flat, where));
  if (*std::min_element(colour.gain.begin(), colour.gain.end()) <= 0)
    return bad_field(where, "gain", "is not above 0");
  constexpr int kRadii = 64;
  for (int i = 0; i <= kRadii; ++i)
    if (falloff(colour.vignetting, static_cast<double>(i) / kRadii) < kLeastLight)
      return bad_field(where, "vignetting", "leaves a part of the picture without light");
  const auto pixels = static_cast<std::uint64_t>(size.width) * static_cast<std::uint64_t>(size.height);
  for (const std::uint32_t pixel : message.hot()) {
    if (pixel >= pixels) return bad_field(where, "hot", "names a pixel outside the picture");
    colour.hot_pixels.push_back(pixel);
  }
  std::sort(colour.hot_pixels.begin(), colour.hot_pixels.end());
  EMBERLOCK_RETURN_IF_ERROR(read_spectral(message, colour, where));
  return colour;
}

v1::Colour to_message(const Colour& colour) {
  v1::Colour message;
  for (const double v : colour.response) message.add_response(v);
  for (const double v : colour.dark) message.add_dark(v);
  for (const double v : colour.gain) message.add_gain(v);
  for (const double v : colour.vignetting) message.add_vignetting(v);
  for (const std::uint32_t pixel : colour.hot_pixels) message.add_hot(pixel);
  if (!colour.flat.light.empty()) {
    message.mutable_flat()->set_columns(static_cast<std::uint32_t>(colour.flat.columns));
    message.mutable_flat()->set_rows(static_cast<std::uint32_t>(colour.flat.rows));
    message.mutable_flat()->mutable_light()->Assign(colour.flat.light.begin(), colour.flat.light.end());
  }
  if (colour.spectral) *message.mutable_spectral() = message_of(*colour.spectral);
  if (colour.exposure.value() != 0) message.set_exposure_s(colour.exposure.value());
  return message;
}

}  // namespace emberlock::recon
