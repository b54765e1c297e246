// SPDX-License-Identifier: Apache-2.0
#include "cli/stylize_stream.h"

#include <algorithm>
#include <cerrno>
#include <optional>
#include <span>
#include <string>
#include <utility>

#include <Eigen/Core>
#include <fmt/format.h>
#include <poll.h>
#include <unistd.h>

#include "base/file.h"
#include "recon/adjust/picture_error.h"
#include "recon/export/preview.h"
#include "recon/preprocess/radiance.h"
#include "session/index.h"
#include "session/media/frame_decoders.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kWidestPreview = 640;                             // of a preview, in pixels
constexpr auto kApart = std::chrono::milliseconds(50);          // previews, but for the first after a step
constexpr auto kVolumesApart = std::chrono::milliseconds(400);  // which are many times a picture's bytes
constexpr auto kSignOfLife = std::chrono::milliseconds(1000);   // while nothing is done

/// Where a picture's bytes are kept: under a name that is made of them.
Result<fs::path> file_for(const std::string& bytes, const char* where, const fs::path& folder) {
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize size, session::picture_size(bytes, where));
  if (std::max(size.width, size.height) > kMostPixels)
    return Error{ErrorKind::bad_input, fmt::format("has {} x {} pixels", size.width, size.height), where,
                 fmt::format("Give at most {} a side", kMostPixels)};
  const std::uint64_t hash = session::pixel_hash(std::as_bytes(std::span(bytes)));
  return folder / fmt::format("given-{:016x}.{}", hash, bytes.front() == '\x89' ? "png" : "jpg");
}

Status keep_bytes(const fs::path& file, const std::string& bytes) {
  std::error_code ec;
  return fs::exists(file, ec) ? Status() : write_file_atomically(file, bytes);
}

void add_projection(v1::StylizationStatus::View& told, const recon::CameraModel& camera) {
  const recon::Intrinsics& in = camera.intrinsics;
  Eigen::Matrix3d pixel_from_camera;
  pixel_from_camera << in.fx, 0, in.cx, 0, in.fy, in.cy, 0, 0, 1;
  Eigen::Matrix<double, 3, 4, Eigen::RowMajor> camera_from_world;
  camera_from_world << camera.camera_from_world.rotation, camera.camera_from_world.translation;
  const Eigen::Matrix<double, 3, 4, Eigen::RowMajor> whole = pixel_from_camera * camera_from_world;
  told.mutable_pixel_from_world()->Add(whole.data(), whole.data() + whole.size());
}

}  // namespace

Result<apply::Operation> operation_of(const v1::EditRequest& request, const fs::path& folder) {
  std::optional<apply::GivenPictures> given;
  if (!request.picture().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(fs::path picture, file_for(request.picture(), "picture", folder));
    given = {std::move(picture)};
  }
  if (!request.mask().empty()) {
    if (!given)
      return Error{ErrorKind::bad_input, "comes without a picture", "mask", "Send the picture as well"};
    EMBERLOCK_ASSIGN_OR_RETURN(given->mask, file_for(request.mask(), "mask", folder));
  }
  EMBERLOCK_ASSIGN_OR_RETURN(apply::Operation operation,
                             apply::parse_foreign_operation(request.operation(), "step", given));
  if (given) EMBERLOCK_RETURN_IF_ERROR(keep_bytes(given->file, request.picture()));
  if (given && given->mask) EMBERLOCK_RETURN_IF_ERROR(keep_bytes(*given->mask, request.mask()));
  return operation;
}

StylizeStream::StylizeStream(apply::Stylization& stylization, const recon::Scene& captured,
                             const recon::TracePoint& last, int passes_after_a_step, fs::path folder,
                             ProgressStream& stream)
    : stylization_(stylization),
      captured_(captured),
      last_(last),
      passes_after_a_step_(passes_after_a_step),
      folder_(std::move(folder)),
      stream_(stream) {
  while (view_ + 1 < captured.views.size() && captured.views[view_].role != recon::ViewRole::input) ++view_;
}

Status StylizeStream::run(int fd) {
  show();
  while (read(fd, pauses() ? kSignOfLife : std::chrono::milliseconds(0))) {
    if (pauses())
      stream_.progress(1, "waits for a step");
    else
      EMBERLOCK_RETURN_IF_ERROR(pass());
  }
  return {};
}

bool StylizeStream::read(int fd, std::chrono::milliseconds longest) {
  pollfd watched{fd, POLLIN, 0};
  bool taken = false;
  while (!taken && ::poll(&watched, 1, static_cast<int>(longest.count())) > 0) {
    char bytes[65536];
    const ssize_t count = ::read(fd, bytes, sizeof bytes);
    if (count < 0 && (errno == EINTR || errno == EAGAIN)) continue;
    if (count <= 0) return false;
    const Status parsed =
        parser_.add({bytes, static_cast<std::size_t>(count)}, [&](v1::EditRequest&& request) {
          take(request);
          taken = true;
        });
    if (!parsed) return false;
  }
  return true;
}

void StylizeStream::take(const v1::EditRequest& request) {
  const Status done = carry_out(request);
  v1::ChildMessage::Edited edited;
  if (done) {
    *edited.mutable_taken() = status();
  } else {
    v1::ChildMessage::Edited::Refusal& refused = *edited.mutable_refused();
    refused.set_what(done.error().what);
    refused.set_where(done.error().where);
    refused.set_remedy(done.error().remedy);
  }
  stream_.edited(edited);
}

Status StylizeStream::carry_out(const v1::EditRequest& request) {
  const auto& views = captured_.views;
  const auto view = std::find_if(views.begin(), views.end(),
                                 [&](const recon::View& v) { return v.name == request.view(); });
  if (!request.view().empty() && view == views.end())
    return Error{ErrorKind::bad_input, "there is no view \"" + request.view() + "\"", "view",
                 "Give a view's name, such as " + views.front().name};
  if (!request.operation().empty()) {
    EMBERLOCK_ASSIGN_OR_RETURN(apply::Operation operation, operation_of(request, folder_));
    EMBERLOCK_RETURN_IF_ERROR(stylization_.apply(std::move(operation)));
    end_ = stylization_.passes() + passes_after_a_step_;
    edited_ = true;
  }
  if (view != views.end()) {
    view_ = static_cast<std::size_t>(view - views.begin());
    show();
  }
  return {};
}

Status StylizeStream::pass() {
  const Clock::time_point begin = Clock::now();
  EMBERLOCK_RETURN_IF_ERROR(stylization_.pass());
  worked_ = worked_ + Seconds(std::chrono::duration<double>(Clock::now() - begin).count());
  if (edited_ || pauses() || Clock::now() >= due_) show();
  edited_ = false;
  return {};
}

void StylizeStream::show() {
  const v1::StylizationStatus now = status();
  v1::Iteration iteration;
  iteration.set_iteration(static_cast<std::uint32_t>(last_.iteration + now.passes()));
  iteration.set_seconds((last_.time + worked_).value());
  iteration.set_input_rmse(now.passes() > 0 ? now.residual() : recon::all_channels(last_.input_rmse));
  const recon::RadianceImage& edited = *stylization_.scene().views[view_].image;
  const apply::EditedVolume shown = stylization_.shown();
  const bool with_volume = pauses() || Clock::now() >= volume_due_;
  stream_.stylized(now, iteration, recon::shrunk(edited, recon::preview_size(edited.size, kWidestPreview)),
                   stylization_.preview(shown, view_, kWidestPreview), with_volume ? &shown.volume : nullptr);
  stream_.progress(1, pauses() ? std::string("waits for a step") : fmt::format("pass {}", now.passes()));
  due_ = Clock::now() + kApart;
  if (with_volume) volume_due_ = Clock::now() + kVolumesApart;
}

v1::StylizationStatus StylizeStream::status() const {
  v1::StylizationStatus status;
  for (const recon::View& view : captured_.views) {
    v1::StylizationStatus::View& told = *status.add_views();
    told.set_name(view.name);
    told.set_width(static_cast<std::uint32_t>(view.image->size.width));
    told.set_height(static_cast<std::uint32_t>(view.image->size.height));
    told.set_held_out(view.role == recon::ViewRole::held_out);
    add_projection(told, view.camera);
  }
  status.set_view(captured_.views[view_].name);
  status.set_passes(static_cast<std::uint32_t>(stylization_.passes()));
  status.set_residual(stylization_.residual());
  const apply::History history = stylization_.history();
  status.set_steps(static_cast<std::uint32_t>(history.standing.size()));
  status.set_undone(static_cast<std::uint32_t>(history.undone.size()));
  status.set_pauses(pauses());
  return status;
}

}  // namespace emberlock::cli
