// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

#include "recon/calibrate/calibration_fields.h"
#include "recon/calibrate/chain_poses.h"
#include "recon/calibrate/pose.h"
#include "recon/calibrate/rig_formats.h"

// https://github.com/ethz-asl/kalibr/wiki/yaml-formats
namespace emberlock::recon {
namespace {

constexpr double kKalibrPixelShift = 0.5;  // Kalibr counts pixels from the centre of the first one

Error bad_kalibr(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// `count` numbers of a key.
Result<std::vector<double>> kalibr_numbers(const YAML::Node& camera, const char* key, std::size_t count,
                                           const std::string& where) {
  const YAML::Node node = camera[key];
  if (!node || !node.IsSequence() || node.size() != count)
    return bad_kalibr(where + "." + key, fmt::format("is no list of {} numbers", count),
                      "Name the camchain that Kalibr wrote");
  return node.as<std::vector<double>>();
}

Result<Intrinsics> kalibr_lens(const YAML::Node& camera, const std::string& where) {
  const auto projection = camera["camera_model"].as<std::string>("");
  const auto distortion = camera["distortion_model"].as<std::string>("none");
  if (projection != "pinhole" || (distortion != "radtan" && distortion != "none")) {
    return bad_kalibr(where,
                      fmt::format("the lens model \"{}-{}\" isn't modelled{}", projection, distortion,
                                  distortion == "equidistant" ? ": it is a fisheye" : ""),
                      "Calibrate with Kalibr's pinhole-radtan, or undistort the pictures");
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const auto p, kalibr_numbers(camera, "intrinsics", 4, where));
  EMBERLOCK_ASSIGN_OR_RETURN(const auto size, kalibr_numbers(camera, "resolution", 2, where));
  std::vector<double> k(4);
  if (distortion != "none") {
    EMBERLOCK_ASSIGN_OR_RETURN(k, kalibr_numbers(camera, "distortion_coeffs", 4, where));
  }
  if (!(size[0] >= 1 && size[1] >= 1 && size[0] <= 65536 && size[1] <= 65536))
    return bad_kalibr(where + ".resolution", "is out of range", "Give width and height in pixels");
  return Intrinsics{{static_cast<int>(size[0]), static_cast<int>(size[1])},
                    p[0],
                    p[1],
                    p[2] + kKalibrPixelShift,
                    p[3] + kKalibrPixelShift,
                    {k[0], k[1], k[2], k[3], 0}};
}

/// Refuses a rolling shutter, and gathers the keys that aren't known, each once.
Status check_kalibr_keys(const YAML::Node& camera, const std::string& where, std::set<std::string>& unknown) {
  for (const auto& entry : camera) {
    const auto key = entry.first.as<std::string>();
    const auto* known = std::find_if(kKalibrFields.begin(), kKalibrFields.end(),
                                     [&](const KalibrField& field) { return key == field.key; });
    if (known == kKalibrFields.end()) unknown.insert(key);
    if (known == kKalibrFields.end() || known->use != FieldUse::refused || entry.second.as<double>() == 0)
      continue;
    return bad_kalibr(fmt::format("{}.{}", where, key), "a rolling shutter isn't modelled",
                      "Calibrate with a global shutter, or with pictures of boards that stand still");
  }
  return {};
}

/// The pose of a camera in the one before it.
Result<Rigid3> kalibr_step(const YAML::Node& camera, const std::string& where) {
  const YAML::Node rows = camera["T_cn_cnm1"];
  if (!rows || !rows.IsSequence() || rows.size() != 4)
    return bad_kalibr(where + ".T_cn_cnm1", "is no 4 x 4 matrix", "Calibrate all cameras in one camchain");
  Rigid3 step;
  for (std::size_t r = 0; r < 3; ++r) {
    const auto row = rows[r].as<std::vector<double>>();
    if (row.size() != 4)
      return bad_kalibr(where + ".T_cn_cnm1", "is no 4 x 4 matrix", "Name the camchain that Kalibr wrote");
    const auto at = static_cast<Eigen::Index>(r);
    for (std::size_t c = 0; c < 3; ++c) step.rotation(at, static_cast<Eigen::Index>(c)) = row[c];
    step.translation[at] = row[3];
  }
  const auto rotation = nearest_rotation(step.rotation);
  if (!rotation) return bad_kalibr(where + ".T_cn_cnm1", rotation.error().what, rotation.error().remedy);
  step.rotation = *rotation;
  return step;
}

Result<v1::Rig> rig_of_kalibr(const YAML::Node& file, const std::string& where, ImportNotes* notes) {
  v1::Rig rig = empty_rig();
  std::set<std::string> unknown;
  CameraModel camera;
  for (std::size_t n = 0;; ++n) {
    const std::string id = "cam" + std::to_string(n);
    const std::string camera_at = fmt::format("{}: {}", where, id);
    const YAML::Node node = file[id];
    if (!node || !node.IsMap()) break;
    EMBERLOCK_RETURN_IF_ERROR(check_kalibr_keys(node, camera_at, unknown));
    EMBERLOCK_ASSIGN_OR_RETURN(camera.intrinsics, kalibr_lens(node, camera_at));
    if (n > 0) {
      EMBERLOCK_ASSIGN_OR_RETURN(const Rigid3 step, kalibr_step(node, camera_at));
      camera.camera_from_world = chained(step, camera.camera_from_world);
    }
    *rig.add_cameras() = rig_camera_of(id, camera);
  }
  EMBERLOCK_RETURN_IF_ERROR(session::check_rig(rig, where));
  if (notes != nullptr && !unknown.empty())
    notes->push_back(fmt::format("{}: these keys aren't used: {}", where, fmt::join(unknown, ", ")));
  return rig;
}

}  // namespace

bool is_kalibr(std::string_view text) {
  return text.find("cam0:") != std::string_view::npos && text.find("camera_model") != std::string_view::npos;
}

Result<v1::Rig> parse_kalibr(std::string_view text, const std::string& where, ImportNotes* notes) {
  try {
    return rig_of_kalibr(YAML::Load(std::string(text)), where, notes);
  } catch (const YAML::Exception& e) {
    return bad_kalibr(fmt::format("{}, line {}", where, e.mark.line + 1), "no camchain of Kalibr's: " + e.msg,
                      "Name the camchain that Kalibr wrote");
  }
}

}  // namespace emberlock::recon
