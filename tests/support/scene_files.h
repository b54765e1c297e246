// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <fstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/result.h"
#include "recon/calibrate/pose.h"
#include "recon/export/picture.h"
#include "recon/preprocess/radiance.h"
#include "recon/views/view.h"

namespace emberlock::test {

/// A scene as FOLDER/transforms.json with its box, and view0.png and so on of 8 bits.
inline Status write_scene(const recon::Scene& scene, const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const auto& c = scene.box.center;
  const auto& s = scene.box.size;
  nlohmann::json document = {{"box", {{"center", {c.x(), c.y(), c.z()}}, {"size", {s.x(), s.y(), s.z()}}}},
                             {"frames", nlohmann::json::array()}};
  for (std::size_t v = 0; v < scene.views.size(); ++v) {
    const recon::View& view = scene.views[v];
    const recon::Intrinsics& lens = view.camera.intrinsics;
    const std::string name = fmt::format("view{}.png", v);
    EMBERLOCK_RETURN_IF_ERROR(recon::write_png(recon::to_rgb8(*view.image).view(), folder / name));
    const Eigen::Matrix4d m = recon::opengl_world_from_camera(view.camera.camera_from_world);
    nlohmann::json matrix = nlohmann::json::array();
    for (int r = 0; r < 4; ++r) matrix.push_back({m(r, 0), m(r, 1), m(r, 2), m(r, 3)});
    document["frames"].push_back({{"file_path", name},
                                  {"transform_matrix", matrix},
                                  {"w", lens.size.width},
                                  {"h", lens.size.height},
                                  {"fl_x", lens.fx},
                                  {"fl_y", lens.fy},
                                  {"cx", lens.cx},
                                  {"cy", lens.cy}});
  }
  const std::filesystem::path file = folder / "transforms.json";
  if (!(std::ofstream(file) << document.dump(1) << '\n'))
    return Error{ErrorKind::io, "can't be written", file.string()};
  return {};
}

}  // namespace emberlock::test
