// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <system_error>

#include "recon/calibrate/transforms.h"
#include "recon/hull/find_box.h"
#include "recon/pipeline/session_scene.h"
#include "recon/preprocess/develop.h"
#include "recon/views/flame_mask.h"
#include "session/media/frame_file.h"
#include "session/reader.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

Error bad(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

Result<Scene> load_transforms(const fs::path& path, const SceneOptions& options) {
  if (options.frame) return bad(path.string(), "has one instant only", "Leave --frame out");
  if (options.rig) return bad(path.string(), "holds its own calibration", "Leave --rig out");
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, read_transforms(path));
  Scene scene;
  EMBERLOCK_ASSIGN_OR_RETURN(scene.response, response_of(transforms));
  scene.preprocessing = {{"all", false, "pictures of a transforms.json are taken as they are"}};
  std::map<std::string, std::vector<std::string>> pictures_with;  // by field that isn't applied
  for (const TransformsFrame& frame : transforms.frames) {
    std::vector<std::string> unapplied;
    auto image = session::read_image(frame.image, &unapplied);
    if (!image) {
      return Error{image.error().kind, image.error().message(), frame.where + ".file_path",
                   "Correct file_path, or bring the picture there"};
    }
    View view;
    view.name = frame.image.filename().string();
    for (const std::string& field : unapplied) pictures_with[field].push_back(view.name);
    Result<Intrinsics> lens = intrinsics_of(frame, image->layout().size);
    if (!lens.ok() && !unapplied.empty()) {
      Error error = lens.error();
      error.remedy += ". The picture's " + unapplied.front();
      return error;
    }
    EMBERLOCK_ASSIGN_OR_RETURN(view.camera.intrinsics, std::move(lens));
    view.camera.camera_from_world = frame.camera_from_world;
    view.image = share(as_filmed(share(std::move(*image))));
    scene.views.push_back(std::move(view));
  }
  for (const auto& [field, names] : pictures_with) {
    const std::string more = names.size() > 1 ? " and " + std::to_string(names.size() - 1) + " more" : "";
    scene.preprocessing.push_back(
        {"orientation", false,
         names.front() + more + ": " + field + ": poses and lens must be those of the stored picture"});
  }
  if (options.box || transforms.box) {
    scene.box = options.box ? *options.box : *transforms.box;
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(scene.box,
                               find_box(scene, flame_masks(scene, {}, {Device::cpu, options.threads})));
  }
  return scene;
}

}  // namespace

Result<Scene> load_scene(const fs::path& input, const SceneOptions& options) {
  std::error_code ec;
  if (!fs::is_directory(input, ec)) return load_transforms(input, options);
  if (session::SessionReader::is_session(input)) return load_session(input, options);
  return bad(input.string(), "is a folder without manifest.json, so no session",
             "Name a session's folder, or the transforms.json itself");
}

std::vector<fs::path> files_of(const fs::path& input, const SceneOptions& options) {
  std::vector<fs::path> files{input};
  if (options.rig) files.push_back(*options.rig);
  std::error_code ec;
  if (!fs::is_regular_file(input, ec)) return files;
  if (const auto transforms = read_transforms(input)) {
    if (transforms->camera_response) files.push_back(*transforms->camera_response);
    for (const TransformsFrame& frame : transforms->frames) files.push_back(frame.image);
  }
  return files;
}

Scene with_views(const Scene& scene, int count) {
  const auto sight = [&](std::size_t i) {
    return Eigen::Vector3d((scene.views[i].camera.center() - scene.box.center).normalized());
  };
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::input) left.push_back(i);
  }
  if (count <= 0 || count >= static_cast<int>(left.size())) return scene;
  std::vector<std::size_t> kept{left.front()};
  left.erase(left.begin());
  while (static_cast<int>(kept.size()) < count) {
    // Opposite views lie on one line and see the same outline, hence the cosine's absolute value.
    const auto nearness = [&](std::size_t i) {
      double largest = 0;
      for (const std::size_t k : kept) largest = std::max(largest, std::abs(sight(i).dot(sight(k))));
      return largest;
    };
    const auto next = std::min_element(
        left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return nearness(a) < nearness(b); });
    kept.push_back(*next);
    left.erase(next);
  }
  Scene fewer = scene;
  fewer.views.clear();
  for (std::size_t i = 0; i < scene.views.size(); ++i) {
    if (scene.views[i].role == ViewRole::held_out || std::find(kept.begin(), kept.end(), i) != kept.end())
      fewer.views.push_back(scene.views[i]);
  }
  return fewer;
}

Status hold_out(Scene& scene, const std::vector<int>& views) {
  for (const int view : views) {
    if (view < 0 || view >= static_cast<int>(scene.views.size())) {
      return bad("--hold-out " + std::to_string(view), "there is no such view",
                 "Views count from 0 to " + std::to_string(scene.views.size() - 1));
    }
    scene.views[static_cast<std::size_t>(view)].role = ViewRole::held_out;
  }
  if (std::none_of(scene.views.begin(), scene.views.end(),
                   [](const View& v) { return v.role == ViewRole::input; })) {
    return bad("--hold-out", "holds every view out, none is left to reconstruct from",
               "Leave at least one view in");
  }
  return {};
}

}  // namespace emberlock::recon
