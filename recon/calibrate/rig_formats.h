// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

#include "recon/calibrate/rig.h"

namespace emberlock::recon {

// Others' files for what rig.json holds. Colour, uncertainties and, but for transforms.json, the box have no
// place in them.

/// A rig from rig.json, transforms.json (a camera a frame, by its picture's name without extension), OpenCV's
/// YAML or XML (one camera a file, by the file's name), a folder of such files, or a folder with COLMAP's
/// cameras.txt and images.txt (a camera an image, by the image's folder, else its name without extension).
/// Errors name file and field; a lens that isn't Brown-Conrady's with five coefficients at most is one.
Result<v1::Rig> import_rig(const std::filesystem::path& path);

/// Writes rig.json, transforms.json, opencv/<camera>.yml and colmap/{cameras,images,points3D}.txt into
/// `folder`. transforms.json and COLMAP's name pictures <camera>.png, and have placed cameras alone.
Status export_rig(const v1::Rig& rig, const std::filesystem::path& folder);

/// COLMAP's text files: cam_from_world, pixel centres at +0.5 as ours. `where` names the folder.
Result<v1::Rig> parse_colmap(std::string_view cameras, std::string_view images, const std::string& where);
std::string colmap_cameras(const v1::Rig& rig);
std::string colmap_images(const v1::Rig& rig);

/// OpenCV's FileStorage (YAML or XML): image_width, image_height, camera_matrix, distortion_coefficients and,
/// where the pose is known, R and T (camera_from_world, metres). Pixel centres are whole numbers there.
Result<v1::RigCamera> parse_opencv(std::string_view text, const std::string& camera_id,
                                   const std::string& where);
std::string opencv_yaml(const v1::RigCamera& camera);

Result<v1::Rig> rig_of_transforms(std::string_view json, const std::filesystem::path& source);
std::string transforms_json(const v1::Rig& rig);

}  // namespace emberlock::recon
