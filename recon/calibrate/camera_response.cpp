// SPDX-License-Identifier: Apache-2.0
#include "recon/calibrate/camera_response.h"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

#include "base/file.h"
#include "base/nesting.h"

namespace emberlock::recon {
namespace {

using nlohmann::json;

constexpr std::string_view kAbsoluteUnit = "levels (0..255) per W / (sr m2)";
constexpr std::string_view kRelativeUnit = "relative";
constexpr std::array<const char*, 3> kChannels = {"r", "g", "b"};
constexpr double kLeastNm = 100;
constexpr double kMostNm = 20000;
constexpr std::size_t kMostPoints = 100000;
constexpr std::size_t kLargestResponse = std::size_t{16} << 20;
constexpr double kPiece = 2;  // nm

constexpr double kFirstCie = 380;
constexpr double kCieStep = 5;
constexpr std::array kCie1931 = std::to_array<std::array<double, 3>>({
#include "recon/calibrate/cie_1931.inc"
});

/// XYZ to linear sRGB, IEC 61966-2-1.
constexpr std::array<std::array<double, 3>, 3> kSrgbOfXyz = {
    {{3.2406, -1.5372, -0.4986}, {-0.9689, 1.8758, 0.0415}, {0.0557, -0.2040, 1.0570}}};

CameraResponse of_observer(const std::array<std::array<double, 3>, 3>& matrix) {
  CameraResponse out;
  for (std::size_t i = 0; i < kCie1931.size(); ++i) {
    out.wavelength_nm.push_back(kFirstCie + kCieStep * static_cast<double>(i));
    for (std::size_t c = 0; c < 3; ++c) {
      double level = 0;
      for (std::size_t k = 0; k < 3; ++k) level += matrix[c][k] * kCie1931[i][k];
      out.level[c].push_back(level);
    }
  }
  return out;
}

Error bad_response(const std::string& where, std::string_view field, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), where + ": " + std::string(field), std::move(remedy)};
}

Result<std::vector<double>> numbers_of(const json& object, const char* key, const std::string& where) {
  const auto it = object.find(key);
  if (it == object.end()) return bad_response(where, key, "is missing", "Give a list of numbers");
  if (!it->is_array() || it->size() > kMostPoints)
    return bad_response(where, key, "is no list of up to 100000 numbers", "Give a list of numbers");
  std::vector<double> out;
  out.reserve(it->size());
  for (const json& value : *it) {
    if (!value.is_number())
      return bad_response(where, key, "holds " + std::string(value.type_name()) + ", not only numbers",
                          "Give a list of numbers");
    out.push_back(value.get<double>());
  }
  return out;
}

}  // namespace

double integral(const CameraResponse& response, std::size_t channel,
                const std::function<double(double nm)>& f) {
  const std::vector<double>& x = response.wavelength_nm;
  const std::vector<double>& y = response.level[channel];
  double sum = 0;
  for (std::size_t i = 0; i + 1 < x.size(); ++i) {
    if (y[i] == 0 && y[i + 1] == 0) continue;
    const int pieces = std::max(1, static_cast<int>(std::ceil((x[i + 1] - x[i]) / kPiece)));
    const double width = (x[i + 1] - x[i]) / pieces;
    const auto at = [&](double nm) {
      return (y[i] + (y[i + 1] - y[i]) * ((nm - x[i]) / (x[i + 1] - x[i]))) * f(nm);
    };
    double left = at(x[i]);
    for (int p = 0; p < pieces; ++p) {
      const double from = x[i] + p * width;
      const double right = at(from + width);
      sum += width / 6 * (left + 4 * at(from + width / 2) + right);
      left = right;
    }
  }
  return sum;
}

bool is_dead(const CameraResponse& response, std::size_t channel) {
  const std::vector<double>& level = response.level[channel];
  return std::all_of(level.begin(), level.end(), [](double v) { return v == 0; });
}

const CameraResponse& standard_response() {
  static const CameraResponse response = of_observer(kSrgbOfXyz);
  return response;
}

const CameraResponse& cie_1931_observer() {
  static const CameraResponse response = of_observer({{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}});
  return response;
}

Status check_camera_response(const CameraResponse& response, const std::string& where) {
  const std::vector<double>& nm = response.wavelength_nm;
  if (nm.size() < 2)
    return bad_response(where, "wavelength_nm", "a response of zero width: it has fewer than two wavelengths",
                        "Give the wavelengths between which the camera sees");
  for (std::size_t i = 0; i < nm.size(); ++i) {
    if (!(nm[i] >= kLeastNm && nm[i] <= kMostNm))
      return bad_response(where, "wavelength_nm",
                          "number " + std::to_string(i) + " isn't within 100 to 20000 nm", "Give nanometres");
    if (i > 0 && !(nm[i] > nm[i - 1]))
      return bad_response(where, "wavelength_nm",
                          "number " + std::to_string(i) + " doesn't exceed the one before",
                          "Give rising wavelengths, each once");
  }
  bool any = false;
  for (std::size_t c = 0; c < 3; ++c) {
    const std::vector<double>& level = response.level[c];
    if (level.size() != nm.size())
      return bad_response(where, kChannels[c],
                          "has " + std::to_string(level.size()) + " numbers for " +
                              std::to_string(nm.size()) + " wavelengths",
                          "Give one for each wavelength");
    if (!std::all_of(level.begin(), level.end(),
                     [](double v) { return std::isfinite(v) && std::abs(v) < 1e30; }))
      return bad_response(where, kChannels[c], "holds a number that isn't finite, or above 1e30",
                          "Give finite numbers");
    any = any || !is_dead(response, c);
  }
  if (!any) return bad_response(where, "r, g, b", "no channel answers to light", "Give at least one channel");
  return {};
}

Result<CameraResponse> parse_camera_response(std::string_view text, const std::string& where) {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(text, where));
  json object;
  try {
    object = json::parse(text);
  } catch (const json::exception& e) {
    return Error{ErrorKind::bad_input, std::string("malformed JSON: ") + e.what(), where,
                 "Correct the syntax"};
  }
  if (!object.is_object())
    return Error{ErrorKind::bad_input, "is no JSON object", where, "Give unit, wavelength_nm, r, g and b"};
  CameraResponse response;
  for (const auto& [key, value] : object.items()) {
    const bool known = key == "unit" || key == "wavelength_nm" || key == "comment" ||
                       std::find(kChannels.begin(), kChannels.end(), key) != kChannels.end();
    if (!known) return bad_response(where, key, "unknown key", "Remove it, or correct its spelling");
  }
  const auto unit = object.find("unit");
  if (unit == object.end() || !unit->is_string() || (*unit != kAbsoluteUnit && *unit != kRelativeUnit))
    return bad_response(where, "unit", "isn't one that is known",
                        "Give \"" + std::string(kAbsoluteUnit) + "\" or \"relative\"");
  response.absolute = *unit == kAbsoluteUnit;
  EMBERLOCK_ASSIGN_OR_RETURN(response.wavelength_nm, numbers_of(object, "wavelength_nm", where));
  for (std::size_t c = 0; c < 3; ++c) {
    EMBERLOCK_ASSIGN_OR_RETURN(response.level[c], numbers_of(object, kChannels[c], where));
  }
  EMBERLOCK_RETURN_IF_ERROR(check_camera_response(response, where));
  return response;
}

Result<CameraResponse> read_camera_response(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string text, read_file(path, kLargestResponse));
  return parse_camera_response(text, path.string());
}

std::string to_json(const CameraResponse& response) {
  json object;
  object["unit"] = response.absolute ? kAbsoluteUnit : kRelativeUnit;
  object["wavelength_nm"] = response.wavelength_nm;
  for (std::size_t c = 0; c < 3; ++c) object[kChannels[c]] = response.level[c];
  return object.dump(1) + "\n";
}

}  // namespace emberlock::recon
