#include "daemon/engine/recorder.h"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace emberlock {
namespace {

std::uint64_t handed_on(const FrameCounts& counts) { return counts.delivered + counts.damaged; }

void add(v1::Counts& sum, const v1::Counts& counts) {
  sum.set_recorded(sum.recorded() + counts.recorded());
  sum.set_camera_gap(sum.camera_gap() + counts.camera_gap());
  sum.set_transport(sum.transport() + counts.transport());
  sum.set_underrun(sum.underrun() + counts.underrun());
  sum.set_queue(sum.queue() + counts.queue());
  sum.set_disk(sum.disk() + counts.disk());
  sum.set_passed_over(sum.passed_over() + counts.passed_over());
}

std::uint64_t lost(const v1::Counts& counts) {
  return counts.camera_gap() + counts.transport() + counts.underrun() + counts.queue() + counts.disk();
}

std::string words(const v1::Counts& sum, std::size_t cameras) {
  std::string text = fmt::format("{} frames of {} cameras written", sum.recorded(), cameras);
  if (lost(sum) == 0) return text + ", none lost";
  text += fmt::format(", {} lost: ", lost(sum));
  const char* separator = "";
  const auto cause = [&](std::uint64_t frames, const char* by) {
    if (frames > 0) text += fmt::format("{}{} {}", std::exchange(separator, ", "), frames, by);
  };
  cause(sum.camera_gap(), "by cameras");
  cause(sum.transport(), "on the way");
  cause(sum.underrun(), "for want of a driver's buffer");
  cause(sum.queue(), "as the encoder was too slow");
  cause(sum.disk(), "refused by the disk");
  return text;
}

}  // namespace

Explained explain(const CameraBooks& books) {
  const FrameCounts& a = books.before;
  const FrameCounts& b = books.after;
  std::uint64_t missing = books.arrivals.missing();
  const auto of = [&](std::uint64_t claimed) {
    const std::uint64_t part = std::min(claimed, missing);
    missing -= part;
    return part;
  };
  Explained explained;
  explained.transport = of(b.transport - a.transport + b.resend - a.resend);
  explained.underrun = of(b.underrun - a.underrun + b.queue - a.queue);
  explained.passed_over = of(b.passed_over - a.passed_over);
  return explained;
}

std::string disagreement(const CameraBooks& books, const v1::Counts& file) {
  const std::uint64_t driver = handed_on(books.after) - handed_on(books.before);
  const std::uint64_t taken = books.arrivals.delivered();
  if (driver != taken + books.left_out) {
    return fmt::format("the driver handed on {} frames, {} were taken and {} left out", driver, taken,
                       books.left_out);
  }
  const std::uint64_t accounted = file.recorded() + file.queue() + file.disk();
  if (taken != accounted) {
    return fmt::format("{} frames were taken, {} are written or counted as dropped", taken, accounted);
  }
  return {};
}

Result<std::unique_ptr<Recorder>> Recorder::begin(const std::filesystem::path& folder,
                                                  const v1::Manifest& manifest,
                                                  const RecorderOptions& options,
                                                  const std::vector<FrameCounts>& before, TimePoint now) {
  EMBERLOCK_ASSIGN_OR_RETURN(SessionWriter writer, SessionWriter::create(folder, manifest, options.writer));
  return std::unique_ptr<Recorder>(
      new Recorder(std::move(writer), options, folder.filename().string(), manifest.purpose(), before, now));
}

Recorder::Recorder(SessionWriter writer, const RecorderOptions& options, std::string session,
                   std::string purpose, const std::vector<FrameCounts>& before, TimePoint now)
    : writer_(std::move(writer), options.queue),
      session_(std::move(session)),
      purpose_(std::move(purpose)),
      began_(now),
      past_end_(before.size(), false) {
  for (const FrameCounts& counts : before) books_.push_back({.before = counts, .after = {}, .arrivals = {}});
}

void Recorder::take(std::size_t camera, Frame frame) {
  CameraBooks& books = books_[camera];
  const bool past_end = ended_ && frame.stamp.monotonic_time > *ended_;
  if (past_end) past_end_[camera] = true;
  if (past_end || frame.stamp.monotonic_time < began_) {
    ++books.left_out;
    return;
  }
  books.arrivals.add(frame.stamp.frame_id);
  bytes_ += frame.image->bytes().size();
  writer_.push(camera, std::move(frame));
}

v1::RecordingStatus Recorder::status(TimePoint now) const {
  v1::RecordingStatus status;
  status.set_session(session_);
  status.set_purpose(purpose_);
  status.set_state(v1::RecordingStatus::RECORDING);
  const double seconds = std::max((std::min(now, ended_.value_or(now)) - began_).value(), 0.0);
  status.set_seconds(seconds);
  status.set_bytes(bytes_);
  if (seconds > 0) status.set_bytes_per_s(static_cast<double>(bytes_) / seconds);
  for (const CameraBooks& books : books_) {
    v1::Counts& counts = *status.add_cameras();
    counts.set_recorded(books.arrivals.delivered());
    counts.set_camera_gap(books.arrivals.missing());
    add(*status.mutable_lost(), counts);
  }
  status.set_frames(status.lost().recorded());
  return status;
}

v1::RecordingStatus Recorder::finish(const std::vector<FrameCounts>& after, TimePoint now) {
  v1::RecordingStatus status = this->status(now);
  for (std::size_t i = 0; i < books_.size(); ++i) {
    books_[i].after = after[i];
    const Explained explained = explain(books_[i]);
    writer_.count_lost(i, LossCause::transport, explained.transport);
    writer_.count_lost(i, LossCause::underrun, explained.underrun);
    writer_.count_lost(i, LossCause::passed_over, explained.passed_over);
  }
  const Result<v1::Manifest> manifest = writer_.finish();
  if (!manifest.ok()) {
    status.set_state(v1::RecordingStatus::FAILED);
    status.set_verdict(manifest.error().message());
    return status;
  }
  status.clear_cameras();
  status.clear_lost();
  std::string disagreements;
  for (std::size_t i = 0; i < books_.size(); ++i) {
    const v1::CameraStream& stream = manifest->cameras(static_cast<int>(i));
    *status.add_cameras() = stream.counts();
    add(*status.mutable_lost(), stream.counts());
    if (const std::string why = disagreement(books_[i], stream.counts()); !why.empty())
      disagreements += fmt::format("{}{}: {}", disagreements.empty() ? "" : "; ", stream.camera_id(), why);
  }
  status.set_frames(status.lost().recorded());
  status.set_state(disagreements.empty() ? v1::RecordingStatus::COMPLETE : v1::RecordingStatus::FAILED);
  status.set_verdict(disagreements.empty() ? words(status.lost(), books_.size())
                                           : "the counts don't agree: " + disagreements);
  return status;
}

}  // namespace emberlock
