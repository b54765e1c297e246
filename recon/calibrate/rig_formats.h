// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "recon/calibrate/rig.h"

namespace emberlock::recon {

// Conversion between rig.json and other programs' files. These have no place for colour, uncertainties and
// (except transforms.json) the spectral response and the box.

/// Imports a rig from rig.json, transforms.json (one camera per frame, named after its picture without
/// extension), OpenCV's YAML or XML (one camera per file, named after the file), a folder of such files, or a
/// folder with COLMAP's cameras.txt and images.txt (one camera per image, named after the image's folder,
/// else the image without extension). Errors name file and field; a lens other than Brown-Conrady's with at
/// most five coefficients is an error.
Result<v1::Rig> import_rig(const std::filesystem::path& path);

/// Writes rig.json, transforms.json, opencv/<camera>.yml and colmap/{cameras,images,points3D}.txt to
/// `folder`, and where a camera's spectral response is known response.json, which transforms.json names. In
/// transforms.json and COLMAP's files pictures are named <camera>.png, and only placed cameras are included.
Status export_rig(const v1::Rig& rig, const std::filesystem::path& folder);

/// Parses COLMAP's text files: cam_from_world, pixel centres at +0.5 like ours. `where` names the folder.
Result<v1::Rig> parse_colmap(std::string_view cameras, std::string_view images, const std::string& where);
std::string colmap_cameras(const v1::Rig& rig);
std::string colmap_images(const v1::Rig& rig);

/// Parses OpenCV's FileStorage (YAML or XML): image_width, image_height, camera_matrix,
/// distortion_coefficients and, if the pose is known, R and T (camera_from_world, metres). There, pixel
/// centres are integers.
Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where);
std::string opencv_yaml(const v1::RigCamera& camera);

Result<v1::Rig> rig_of_transforms(std::string_view json, const std::filesystem::path& source);
std::string transforms_json(const v1::Rig& rig);

}  // namespace emberlock::recon
