// SPDX-License-Identifier: Apache-2.0
#include "session/rig_file.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "base/file.h"
#include "session/files.h"
#include "session/json_message.h"
#include "session/name.h"

namespace emberlock::session {
namespace {

constexpr std::size_t kMaxRigBytes = std::size_t{64} << 20;
constexpr std::uint32_t kMaxRigSide = 65536;  // pixels

Status check_colour(const v1::Colour& colour, const std::string& where) {
  const v1::SpectralResponse& spectral = colour.spectral();
  for (const auto* list : {&colour.response(), &colour.dark(), &colour.gain(), &colour.vignetting(),
                           &spectral.wavelength_nm(), &spectral.r(), &spectral.g(), &spectral.b()}) {
    if (!std::isfinite(colour.exposure_s()) ||
        !std::all_of(list->begin(), list->end(), [](double v) { return std::isfinite(v); })) {
      return Error{ErrorKind::bad_input, "a number isn't finite", where + ".colour",
                   "Calibrate the colour again, or remove it"};
    }
  }
  return {};
}

}  // namespace

Status check_rig(const v1::Rig& rig, const std::string& where) {
  if (rig.format_version() != kRigFormatVersion) {
    return Error{ErrorKind::bad_input,
                 "format version " + std::to_string(rig.format_version()) + ", this program reads version " +
                     std::to_string(kRigFormatVersion),
                 where + ", field format_version", "Use the Emberlock that calibrated it"};
  }
  if (rig.cameras().empty()) {
    return Error{ErrorKind::bad_input, "no cameras", where + ", field cameras",
                 "Calibrate at least one camera"};
  }
  std::set<std::string> ids;
  for (const v1::RigCamera& camera : rig.cameras()) {
    const std::string field = where + ", camera " + camera.camera_id();
    if (!is_folder_name(camera.camera_id())) {
      return Error{ErrorKind::bad_input, "the camera id can't name a folder", field,
                   "Use letters, digits, space and . _ : - alone, no point in front, at most 200"};
    }
    if (!ids.insert(camera.camera_id()).second)
      return Error{ErrorKind::bad_input, "the camera id is there twice", field,
                   "Give each camera an id of its own"};
    const auto side_fits = [](std::uint32_t side) { return side > 0 && side <= kMaxRigSide; };
    if (!side_fits(camera.width()) || !side_fits(camera.height())) {
      return Error{ErrorKind::bad_input,
                   "pictures of " + std::to_string(camera.width()) + " x " + std::to_string(camera.height()) +
                       " pixels",
                   field + ", fields width and height", "Give the size of the pictures that calibrated it"};
    }
    if (camera.has_calibration()) EMBERLOCK_RETURN_IF_ERROR(check_calibration(camera.calibration(), field));
    if (camera.has_colour()) EMBERLOCK_RETURN_IF_ERROR(check_colour(camera.colour(), field));
  }
  if (rig.has_box()) EMBERLOCK_RETURN_IF_ERROR(check_box(rig.box(), where));
  return {};
}

Result<v1::Rig> parse_rig(std::string_view json, const std::string& where) {
  v1::Rig rig;
  EMBERLOCK_RETURN_IF_ERROR(
      read_json(json, rig, "a rig's calibration", where,
                "Name the rig.json that `emberlock calibrate` wrote, or use a newer Emberlock"));
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, where));
  return rig;
}

Result<v1::Rig> read_rig(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json, read_file(path, kMaxRigBytes));
  return parse_rig(json, path.string());
}

Result<std::string> rig_json(const v1::Rig& rig) {
  return json_of(rig, Defaults::left_out, "the rig", "rig");
}

Status write_rig(const std::filesystem::path& path, const v1::Rig& rig) {
  EMBERLOCK_RETURN_IF_ERROR(check_rig(rig, path.string()));
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string json, rig_json(rig));
  return write_file_atomically(path, json);
}

}  // namespace emberlock::session
