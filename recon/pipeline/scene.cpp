// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/scene.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <system_error>

#include "recon/calibrate/transforms.h"
#include "recon/pipeline/session_scene.h"
#include "recon/pipeline/transforms_scene.h"
#include "session/reader.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

Error bad(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

}  // namespace

Result<Scene> load_scene(const fs::path& input, const SceneOptions& options) {
  std::error_code ec;
  if (!fs::is_directory(input, ec)) return load_transforms(input, options);
  if (session::SessionReader::is_session(input)) {
    EMBERLOCK_ASSIGN_OR_RETURN(Scene scene, load_session(input, options));
    EMBERLOCK_RETURN_IF_ERROR(choose_views(scene, options));
    return scene;
  }
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
    for (const TransformsFrame& frame : transforms->frames) {
      // Frames that aren't chosen may lack theirs.
      if (fs::exists(frame.image, ec)) files.push_back(frame.image);
      if (frame.mask && fs::exists(*frame.mask, ec)) files.push_back(*frame.mask);
    }
  }
  return files;
}

std::vector<std::size_t> spread_views(const Scene& scene, int count) {
  const auto sight = [&](std::size_t i) {
    return Eigen::Vector3d((scene.views[i].camera.center() - scene.box.center).normalized());
  };
  std::vector<std::size_t> kept;
  std::vector<std::size_t> left;
  for (std::size_t i = 0; i < scene.views.size(); ++i)
    (scene.views[i].role == ViewRole::input ? left : kept).push_back(i);
  const std::size_t held_out = kept.size();
  if (count <= 0 || count >= static_cast<int>(left.size())) count = static_cast<int>(left.size());
  while (static_cast<int>(kept.size() - held_out) < count) {
    // Opposite views lie on one line and see the same outline, hence the cosine's absolute value.
    const auto nearness = [&](std::size_t i) {
      double largest = 0;
      for (std::size_t k = held_out; k < kept.size(); ++k)
        largest = std::max(largest, std::abs(sight(i).dot(sight(kept[k]))));
      return largest;
    };
    const auto next = std::min_element(
        left.begin(), left.end(), [&](std::size_t a, std::size_t b) { return nearness(a) < nearness(b); });
    kept.push_back(*next);
    left.erase(next);
  }
  std::sort(kept.begin(), kept.end());
  return kept;
}

Scene with_views(const Scene& scene, int count) {
  Scene fewer = scene;
  fewer.views.clear();
  for (const std::size_t i : spread_views(scene, count)) fewer.views.push_back(scene.views[i]);
  return fewer;
}

Status choose_views(Scene& scene, const SceneOptions& options) {
  EMBERLOCK_RETURN_IF_ERROR(hold_out(scene, options.held_out));
  const auto inputs = std::count_if(scene.views.begin(), scene.views.end(),
                                    [](const View& v) { return v.role == ViewRole::input; });
  if (options.views > inputs)
    return bad("--views", "there are " + std::to_string(inputs) + " input views", "Give that number at most");
  if (options.views > 0) scene = with_views(scene, options.views);
  return {};
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
