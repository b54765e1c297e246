// SPDX-License-Identifier: Apache-2.0
#include <cstdint>
#include <cstring>
#include <memory>
#include <new>
#include <optional>
#include <string>
#include <utility>

#include <google/protobuf/io/zero_copy_stream_impl.h>
#include <google/protobuf/util/delimited_message_util.h>
#include <unistd.h>

#include "apply/live_flame.h"
#include "cli/ar_scene.h"
#include "cli/commands.h"
#include "cli/progress_stream.h"
#include "emberlock/v1/child.pb.h"
#include "recon/export/picture.h"
#include "recon/export/preview.h"

namespace emberlock::cli {
namespace {

constexpr const char* kInput = "stdin";

/// What the daemon tells, one message after the other.
class ArInputs {
 public:
  /// Nothing at the end.
  Result<std::optional<v1::ArInput>> next() {
    v1::ArInput input;
    bool ended = false;
    if (google::protobuf::util::ParseDelimitedFromZeroCopyStream(&input, &stream_, &ended))
      return std::optional(std::move(input));
    if (ended) return std::optional<v1::ArInput>();
    return Error{ErrorKind::bad_input, "bytes that are no message", kInput, "emberlockd starts this program"};
  }

 private:
  google::protobuf::io::FileInputStream stream_{STDIN_FILENO, 1 << 18};
};

Error unexpected(std::string what) {
  return {ErrorKind::bad_input, std::move(what), kInput, "emberlockd starts this program"};
}

Result<ImageSize> size_told(std::uint32_t width, std::uint32_t height) {
  constexpr std::uint32_t kMost = 1U << 15;
  if (width == 0 || height == 0 || width > kMost || height > kMost) return unexpected("no size of pictures");
  return ImageSize{static_cast<int>(width), static_cast<int>(height)};
}

Result<apply::LiveScene> scene_of(const v1::ArInput::Scene& told) {
  apply::LiveScene scene;
  const v1::ArRequest& asked = told.request();
  EMBERLOCK_ASSIGN_OR_RETURN(scene.marker, apply::parse_marker(asked.marker()));
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize filmed, size_told(told.width(), told.height()));
  EMBERLOCK_ASSIGN_OR_RETURN(const ImageSize frames, size_told(told.frame_width(), told.frame_height()));
  EMBERLOCK_ASSIGN_OR_RETURN(const recon::Intrinsics lens,
                             lens_alone(told.lens(), filmed, asked.camera_id(), "its calibration"));
  scene.lens = recon::resized({lens, {}}, frames).intrinsics;
  EMBERLOCK_ASSIGN_OR_RETURN(scene.flame, upright_on(scene.marker, told.result(), {}));
  apply::PlacedResult& placed = scene.flame.placed;
  placed.world_from_flame.scale = asked.scale();
  placed.brightness = asked.brightness();
  placed.rate = Hertz(asked.frames_hz());
  placed.frames = apply::PlacedResult::Frames::loop;
  if (asked.linear()) scene.curve = apply::Transfer::Curve::linear;
  return scene;
}

v1::ArStatus::Pose word_of(apply::TrackedPose::From from) {
  switch (from) {
    case apply::TrackedPose::From::marker:
      return v1::ArStatus::FOUND;
    case apply::TrackedPose::From::prediction:
      return v1::ArStatus::HELD;
    case apply::TrackedPose::From::nothing:
      break;
  }
  return v1::ArStatus::LOST;
}

Result<v1::ArPicture> frame_with_flame(const v1::ArInput::Frame& told, ImageSize size,
                                       apply::LiveFlame& flame, recon::Pool& pool) {
  Image frame(ImageLayout{size, PixelFormat::rgb8, 8});
  if (frame.bytes().size() != told.rgb().size()) return unexpected("a frame with other bytes than pixels");
  std::memcpy(frame.bytes().data(), told.rgb().data(), told.rgb().size());
  const Seconds time(static_cast<double>(told.monotonic_ns()) * 1e-9);
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::LiveFlame::Seen seen, flame.draw(time, frame, pool));
  v1::ArPicture picture;
  EMBERLOCK_ASSIGN_OR_RETURN(*picture.mutable_jpeg(), recon::to_jpeg(frame.view()));
  picture.set_pose(word_of(seen.pose.from));
  picture.set_without(static_cast<std::uint32_t>(seen.without));
  picture.set_residual_px(seen.pose.rms);
  picture.set_seen_instead(seen.instead);
  return picture;
}

/// Until its input ends, or nobody reads any more.
Status draw_live(ProgressStream& stream) try {
  ArInputs inputs;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<v1::ArInput> first, inputs.next());
  if (!first || !first->has_scene()) return unexpected("no scene comes first");
  EMBERLOCK_ASSIGN_OR_RETURN(const apply::LiveScene scene, scene_of(first->scene()));
  recon::Pool pool(first->scene().threads());
  EMBERLOCK_ASSIGN_OR_RETURN(apply::LiveFlame flame, apply::LiveFlame::load(scene, pool));
  stream.progress(1, "the flame is read");
  while (!stream.broken()) {
    EMBERLOCK_ASSIGN_OR_RETURN(const std::optional<v1::ArInput> input, inputs.next());
    if (!input) break;
    if (!input->has_frame()) return unexpected("something else than a frame");
    EMBERLOCK_ASSIGN_OR_RETURN(v1::ArPicture picture,
                               frame_with_flame(input->frame(), scene.lens.size, flame, pool));
    stream.ar_picture(std::move(picture));
  }
  return {};
} catch (const std::bad_alloc&) {
  return Error{ErrorKind::bad_input, "not enough memory", "the flame", "Choose a smaller result"};
}

void run_ar_live(int fd) {
  auto stream = ProgressStream::open(fd);
  if (!stream) fail(stream.error());
  if (const Status done = draw_live(*stream); !done.ok()) {
    stream->failed(done.error());
    fail(done.error());
  }
}

}  // namespace

void add_ar_live(const Verb& app) {
  auto fd = std::make_shared<int>(-1);
  const Verb verb = app.add_verb("ar-live", "Draws a flame into the frames on its stdin").hide();
  verb.add_option("--progress-fd", *fd, "Where pictures go: an open descriptor").require();
  verb.set_action([fd] { run_ar_live(*fd); });
}

}  // namespace emberlock::cli
