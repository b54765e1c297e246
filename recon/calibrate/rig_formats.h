// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "recon/calibrate/camera_names.h"
#include "recon/calibrate/rig.h"

namespace emberlock::recon {

// Conversion between rig.json and other programs' files. These have no place for colour, uncertainties and
// (except transforms.json) the spectral response and the box.

/// Imports a rig from rig.json, transforms.json (one camera per frame, named after its picture without
/// extension), OpenCV's YAML, XML or JSON and ROS' camera files (one camera per file, named after the file),
/// a folder of such files, Kalibr's camchain, or a folder with COLMAP's cameras and images, text or binary,
/// also in its sparse/0 (one camera per image, named after the image's folder, else the image without
/// extension; camera_names.h). `notes` gets what isn't used. Errors name file and field: another program's
/// calibration by that program's name; a lens other than Brown-Conrady's with at most five coefficients;
/// cameras that stand over 100 m apart, because their unit isn't the metre.
Result<v1::Rig> import_rig(const std::filesystem::path& path, ImportNotes* notes = nullptr);

/// Writes rig.json, transforms.json, opencv/<camera>.yml and colmap/{cameras,images,points3D}.txt to
/// `folder`, and where a camera's spectral response is known response.json, which transforms.json names. In
/// transforms.json and COLMAP's files pictures are named <camera>.png, and only placed cameras are included.
Status export_rig(const v1::Rig& rig, const std::filesystem::path& folder);

/// Parses COLMAP's text files: cam_from_world, pixel centres at +0.5 like ours. The lines of points may be
/// missing. `where` names the folder.
Result<v1::Rig> parse_colmap(std::string_view cameras, std::string_view images, const std::string& where,
                             ImportNotes* notes = nullptr);
/// Parses COLMAP's cameras.bin and images.bin, likewise.
Result<v1::Rig> parse_colmap_binary(std::string_view cameras, std::string_view images,
                                    const std::string& where, ImportNotes* notes = nullptr);
std::string colmap_cameras(const v1::Rig& rig);
std::string colmap_images(const v1::Rig& rig);

/// Parses OpenCV's FileStorage (YAML, XML or JSON, also with the names of OpenCV 2.4) and ROS' camera files:
/// image_width, image_height, camera_matrix, distortion_coefficients and, if the pose is known, R and T
/// (camera_from_world, metres). There, pixel centres are integers. Errors name a key that states another
/// lens or unit, a skewed matrix, and the program whose calibration it is instead.
Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where, ImportNotes* notes = nullptr);
/// Parses Kalibr's camchain (YAML) of pinhole cameras; the first camera is the world.
Result<v1::Rig> parse_kalibr(std::string_view text, const std::string& where, ImportNotes* notes = nullptr);
/// Whether YAML text is Kalibr's camchain.
bool is_kalibr(std::string_view text);
std::string opencv_yaml(const v1::RigCamera& camera);

Result<v1::Rig> rig_of_transforms(std::string_view json, const std::filesystem::path& source,
                                  ImportNotes* notes = nullptr);
std::string transforms_json(const v1::Rig& rig);

}  // namespace emberlock::recon
