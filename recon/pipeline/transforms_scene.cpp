// SPDX-License-Identifier: Apache-2.0
#include "recon/pipeline/transforms_scene.h"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <set>
#include <string>
#include <system_error>
#include <utility>

#include <Eigen/LU>
#include <fmt/format.h>

#include "recon/calibrate/transforms.h"
#include "recon/hull/find_box.h"
#include "recon/preprocess/develop.h"
#include "recon/views/flame_mask.h"
#include "session/media/frame_file.h"

namespace emberlock::recon {
namespace fs = std::filesystem;
namespace {

using FrameList = std::vector<TransformsFrame>;

Error bad_transforms(std::string where, std::string what, std::string remedy) {
  return {ErrorKind::bad_input, std::move(what), std::move(where), std::move(remedy)};
}

/// The frames of one instant: of the `number`-th, in order of time, where the file has several.
Result<FrameList> frames_of_instant(const Transforms& transforms, std::optional<std::size_t> number) {
  std::set<double> times;
  for (const TransformsFrame& frame : transforms.frames)
    if (frame.time) times.insert(*frame.time);
  if (times.size() > 1)
    for (const TransformsFrame& frame : transforms.frames)
      if (!frame.time)
        return bad_transforms(frame.where + ".time", "is missing, although other frames have different times",
                              "Give every frame its time, or none");
  if (times.size() <= 1) {
    if (number) return bad_transforms(transforms.where, "has one instant only", "Leave --frame out");
    return transforms.frames;
  }
  if (!number || *number >= times.size())
    return bad_transforms(
        transforms.where + ": frames[].time",
        fmt::format("the frames are of {} instants, time {:g} to {:g}, and a volume shows one", times.size(),
                    *times.begin(), *times.rbegin()),
        fmt::format("Choose an instant with --frame 0 to {}", times.size() - 1));
  const double time = *std::next(times.begin(), static_cast<std::ptrdiff_t>(*number));
  FrameList frames;
  std::copy_if(transforms.frames.begin(), transforms.frames.end(), std::back_inserter(frames),
               [&](const TransformsFrame& frame) { return frame.time == time; });
  return frames;
}

/// The point that is nearest to all lines of sight; the middle of the cameras where they are parallel.
Eigen::Vector3d looked_at(const FrameList& frames) {
  Eigen::Matrix3d across = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  for (const TransformsFrame& frame : frames) {
    const CameraModel camera{{}, frame.camera_from_world};
    const Eigen::Vector3d forward = frame.camera_from_world.rotation.row(2);
    const Eigen::Matrix3d off = Eigen::Matrix3d::Identity() - forward * forward.transpose();
    across += off;
    sum += off * camera.center();
    middle += camera.center() / static_cast<double>(frames.size());
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(across);
  return solver.isInvertible() ? Eigen::Vector3d(solver.solve(sum)) : middle;
}

/// A frame that is read, and its role.
struct ChosenFrame {
  TransformsFrame frame;
  ViewRole role = ViewRole::input;
};

/// Of more frames than a volume takes, those that the options choose, before any picture is read; else all.
Result<std::vector<ChosenFrame>> choose_frames(const Transforms& transforms, FrameList frames,
                                               const SceneOptions& options) {
  std::vector<ChosenFrame> chosen;
  if (frames.size() <= kMaxViews) {
    for (TransformsFrame& frame : frames) chosen.push_back({std::move(frame)});
    return chosen;
  }
  if (options.views == 0)
    return bad_transforms(
        transforms.where + ": frames",
        fmt::format("{} frames are more than the {} that one volume takes", frames.size(), kMaxViews),
        fmt::format("Choose some of them with --views N, 1 to {}, or remove frames", kMaxViews));
  Scene cameras;
  const std::optional<Box>& box = options.box ? options.box : transforms.box;
  cameras.box.center = box ? box->center : looked_at(frames);
  for (const TransformsFrame& frame : frames)
    cameras.views.push_back({frame.image.filename().string(), {{}, frame.camera_from_world}, {}});
  EMBERLOCK_RETURN_IF_ERROR(hold_out(cameras, options.held_out));
  for (const std::size_t i : spread_views(cameras, options.views))
    chosen.push_back({std::move(frames[i]), cameras.views[i].role});
  if (chosen.size() > kMaxViews)
    return bad_transforms("--views",
                          fmt::format("with the held-out ones, {} views are more than the {} that one volume "
                                      "takes",
                                      chosen.size(), kMaxViews),
                          "Give a smaller number");
  return chosen;
}

/// One error for all pictures and masks that are missing.
Status check_files(const std::vector<ChosenFrame>& chosen) {
  std::vector<std::string> missing;
  std::string where;
  const auto look_for = [&](const fs::path& file, const TransformsFrame& frame, const char* key) {
    std::error_code ec;
    if (fs::exists(file, ec)) return;
    if (missing.empty()) where = frame.where + key;
    missing.push_back(file.string());
  };
  for (const auto& [frame, role] : chosen) {
    look_for(frame.image, frame, ".file_path");
    if (frame.mask) look_for(*frame.mask, frame, ".mask_path");
  }
  if (missing.empty()) return {};
  constexpr std::size_t kNamed = 8;
  const std::size_t more = missing.size() > kNamed ? missing.size() - kNamed : 0;
  missing.resize(missing.size() - more);
  return bad_transforms(
      where,
      fmt::format("{} {} missing: {}{}", missing.size() + more, missing.size() == 1 ? "file is" : "files are",
                  fmt::join(missing, ", "), more > 0 ? fmt::format(" and {} more", more) : ""),
      "Correct the paths, which start from the json's folder, or bring the files there");
}

Result<Image> read_picture(const fs::path& file, const TransformsFrame& frame, const char* key) {
  auto image = session::read_image(file);
  if (image) return image;
  return Error{image.error().kind, image.error().message(), frame.where + key,
               std::string("Correct ") + (key + 1) + ", or bring the picture there"};
}

/// instant-ngp takes white pixels for transparent ones; they may be saturated flame as well.
Status check_white(const Image& image, const TransformsFrame& frame) {
  const ImageView view = image.view();
  const int count = channels(view.layout.format);
  std::size_t white = 0;
  for (int y = 0; y < view.height(); ++y)
    for (int x = 0; x < view.width(); ++x) {
      bool all = true;
      for (int c = 0; c < count; ++c) all = all && view.sample(x, y, c) == view.layout.white();
      white += all ? 1 : 0;
    }
  if (white == 0) return {};
  return bad_transforms(frame.where + ": white_transparent",
                        fmt::format("{} pixels of {} are white, so background or saturated flame", white,
                                    frame.image.filename().string()),
                        "Store the transparency as alpha, or remove white_transparent");
}

/// Blackens the pixels where the frame's mask is 0, and returns the marks for View::bounds.
Result<SharedBounds> apply_mask(Image& image, const TransformsFrame& frame) {
  EMBERLOCK_ASSIGN_OR_RETURN(const Image mask, read_picture(*frame.mask, frame, ".mask_path"));
  const auto [width, height] = image.layout().size;
  const ImageView view = mask.view();
  const auto refuse = [&](std::string what, std::string remedy) {
    return bad_transforms(frame.where + ".mask_path", std::move(what), std::move(remedy));
  };
  if (mask.layout().size != image.layout().size)
    return refuse(fmt::format("the mask {} has {} x {} pixels, the picture {} x {}", frame.mask->string(),
                              view.width(), view.height(), width, height),
                  "Give the mask the picture's size");
  const int count = channels(mask.layout().format);
  const auto pixel_bytes = static_cast<std::size_t>(bytes_per_pixel(image.layout().format));
  std::vector<std::uint8_t> marks(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
  std::size_t left = 0;
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      bool any = false;
      for (int c = 0; c < count; ++c) any = any || view.sample(x, y, c) != 0;
      if (any) continue;
      std::memset(image.row_as<std::byte>(y) + static_cast<std::size_t>(x) * pixel_bytes, 0, pixel_bytes);
      marks[static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x)] =
          kLeftOutMarks;
      ++left;
    }
  if (left == marks.size())
    return refuse(fmt::format("the mask {} is 0 everywhere and leaves no pixel", frame.mask->string()),
                  "Give it values above 0 where the picture counts, or remove the frame");
  if (left == 0) return SharedBounds{};
  return share(std::move(marks));
}

Result<View> read_view(const ChosenFrame& chosen, bool white_is_transparent) {
  const TransformsFrame& frame = chosen.frame;
  EMBERLOCK_ASSIGN_OR_RETURN(Image image, read_picture(frame.image, frame, ".file_path"));
  if (white_is_transparent) EMBERLOCK_RETURN_IF_ERROR(check_white(image, frame));
  View view;
  view.name = frame.image.filename().string();
  view.role = chosen.role;
  EMBERLOCK_ASSIGN_OR_RETURN(view.camera.intrinsics, intrinsics_of(frame, image.layout().size));
  view.camera.camera_from_world = frame.camera_from_world;
  if (frame.mask) {
    EMBERLOCK_ASSIGN_OR_RETURN(view.bounds, apply_mask(image, frame));
  }
  view.image = share(as_filmed(share(std::move(image))));
  return view;
}

}  // namespace

Result<Scene> load_transforms(const fs::path& path, const SceneOptions& options) {
  if (options.rig) return bad_transforms(path.string(), "holds its own calibration", "Leave --rig out");
  EMBERLOCK_ASSIGN_OR_RETURN(const Transforms transforms, read_transforms(path));
  EMBERLOCK_ASSIGN_OR_RETURN(FrameList frames, frames_of_instant(transforms, options.frame));
  const bool is_chosen = frames.size() > kMaxViews;
  EMBERLOCK_ASSIGN_OR_RETURN(const auto chosen, choose_frames(transforms, std::move(frames), options));
  EMBERLOCK_RETURN_IF_ERROR(check_files(chosen));
  Scene scene;
  EMBERLOCK_ASSIGN_OR_RETURN(scene.response, response_of(transforms));
  scene.preprocessing = {{"all", false, "pictures of a transforms.json are taken as they are"}};
  std::size_t masked = 0;
  for (const ChosenFrame& frame : chosen) {
    EMBERLOCK_ASSIGN_OR_RETURN(View view, read_view(frame, transforms.white_is_transparent));
    masked += view.bounds ? 1 : 0;
    scene.views.push_back(std::move(view));
  }
  if (masked > 0)
    scene.preprocessing.push_back(
        {"masks", true,
         fmt::format("{} of {} pictures have pixels that are left out", masked, chosen.size())});
  if (std::string warning = passed_over_warning(transforms); !warning.empty())
    scene.warnings.push_back(std::move(warning));
  if (options.box || transforms.box) {
    scene.box = options.box ? *options.box : *transforms.box;
  } else {
    EMBERLOCK_ASSIGN_OR_RETURN(scene.box,
                               find_box(scene, flame_masks(scene, {}, {Device::cpu, options.threads})));
  }
  if (is_chosen) return scene;
  EMBERLOCK_RETURN_IF_ERROR(choose_views(scene, options));
  return scene;
}

}  // namespace emberlock::recon
