// SPDX-License-Identifier: Apache-2.0
#include "daemon/engine/recorder.h"

#include <algorithm>
#include <system_error>
#include <utility>

#include <fmt/format.h>

namespace emberlock::daemon {

std::uint64_t lost(const v1::Counts& counts) {
  return counts.camera_gap() + counts.transport() + counts.underrun() + counts.queue() + counts.disk();
}

namespace {

void add(v1::Counts& sum, const v1::Counts& counts) {
  sum.set_recorded(sum.recorded() + counts.recorded());
  sum.set_camera_gap(sum.camera_gap() + counts.camera_gap());
  sum.set_transport(sum.transport() + counts.transport());
  sum.set_underrun(sum.underrun() + counts.underrun());
  sum.set_queue(sum.queue() + counts.queue());
  sum.set_disk(sum.disk() + counts.disk());
  sum.set_passed_over(sum.passed_over() + counts.passed_over());
}

std::string words(const v1::Counts& sum, std::size_t cameras, bool slow_disk) {
  std::string text = fmt::format("{} frames of {} cameras recorded", sum.recorded(), cameras);
  if (lost(sum) == 0) return text + ", none lost";
  text += fmt::format(", {} lost: ", lost(sum));
  const char* separator = "";
  const auto cause = [&](std::uint64_t frames, const char* by) {
    if (frames > 0) text += fmt::format("{}{} {}", std::exchange(separator, ", "), frames, by);
  };
  cause(sum.camera_gap(), "by cameras");
  cause(sum.transport(), "on the way");
  cause(sum.underrun(), "for want of a driver's buffer");
  cause(sum.queue(), slow_disk ? "as the disk was too slow" : "as the processor was too slow to encode them");
  cause(sum.disk(), "refused by the disk");
  return text;
}

/// Below the floor not one frame would be kept, and an empty session would stay.
Status check_space(const std::filesystem::path& folder, const session::WriterOptions& options) {
  std::error_code unknown;  // then the writer tells, with its first frame
  const auto space = std::filesystem::space(folder, unknown);
  if (unknown || space.available >= options.min_free_bytes) return {};
  return Error{ErrorKind::io,
               fmt::format("{} MiB free, fewer than the floor of {} MiB", space.available >> 20,
                           options.min_free_bytes >> 20),
               folder.string(), "Free space, or record to another disk"};
}

}  // namespace

v1::Counts explain(const CameraBooks& books) {
  const drivers::FrameCounts& driver = books.driver;
  std::uint64_t missing = books.arrivals.missing();
  const auto of = [&](std::uint64_t claimed) {
    const std::uint64_t part = std::min(claimed, missing);
    missing -= part;
    return part;
  };
  v1::Counts explained;
  explained.set_transport(of(driver.transport + driver.resend));
  explained.set_underrun(of(driver.underrun + driver.queue));
  explained.set_passed_over(of(driver.passed_over));
  return explained;
}

std::string disagreement(const CameraBooks& books, const v1::Counts& file) {
  const std::uint64_t driver = books.driver.delivered + books.driver.damaged;
  const std::uint64_t taken = books.arrivals.delivered();
  if (driver != taken + books.left_out) {
    return fmt::format("the driver handed on {} frames, {} were taken and {} left out", driver, taken,
                       books.left_out);
  }
  if (books.dropped != file.queue()) {
    return fmt::format("{} frames found no room in the queue, {} are counted", books.dropped, file.queue());
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
                                                  const std::vector<drivers::FrameCounts>& before,
                                                  TimePoint now) {
  EMBERLOCK_RETURN_IF_ERROR(check_space(folder.parent_path(), options.writer));
  EMBERLOCK_ASSIGN_OR_RETURN(session::SessionWriter writer,
                             session::SessionWriter::create(folder, manifest, options.writer));
  return std::unique_ptr<Recorder>(
      new Recorder(std::move(writer), options, folder.filename().string(), manifest.purpose(), before, now));
}

Recorder::Recorder(session::SessionWriter writer, const RecorderOptions& options, std::string session,
                   std::string purpose, const std::vector<drivers::FrameCounts>& before, TimePoint now)
    : writer_(std::move(writer), options.queue),
      session_(std::move(session)),
      purpose_(std::move(purpose)),
      began_(now),
      before_(before),
      past_end_(before.size(), false),
      books_(before.size()) {}

void Recorder::take(std::size_t camera, const Frame& frame) {
  const TimePoint filmed = frame.stamp.monotonic_time;
  {
    const std::lock_guard lock(mutex_);
    newest_ = std::max(newest_.value_or(filmed), filmed);
    const bool past_end = ended_ && filmed > *ended_;
    if (past_end) past_end_[camera] = true;
    if (past_end || filmed < began_) {
      ++books_[camera].left_out;
      return;
    }
    books_[camera].arrivals.add(frame.stamp.frame_id);
  }
  if (writer_.push(camera, frame)) return;
  const std::lock_guard lock(mutex_);
  ++books_[camera].dropped;
}

void Recorder::end(TimePoint at) {
  const std::lock_guard lock(mutex_);
  ended_ = at;
}

bool Recorder::has_all(std::size_t camera) const {
  const std::lock_guard lock(mutex_);
  return past_end_[camera];
}

std::optional<TimePoint> Recorder::newest_frame() const {
  const std::lock_guard lock(mutex_);
  return newest_;
}

std::uint64_t Recorder::no_room() const {
  const std::lock_guard lock(mutex_);
  std::uint64_t frames = 0;
  for (const CameraBooks& books : books_) frames += books.dropped;
  return frames;
}

RecordedNow Recorder::now() const {
  RecordedNow now;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const session::CameraProgress camera = writer_.progress(i);
    now.safe.push_back(camera.safe);
    now.load.queue_fill = std::max(now.load.queue_fill, camera.queue_fill);
    now.load.at_risk = std::max(now.load.at_risk, camera.at_risk);
    now.load.lost += camera.counts.queue() + camera.counts.disk();
  }
  return now;
}

void Recorder::show_progress(v1::RecordingStatus& status) const {
  v1::FrameProgress& all = *status.mutable_progress();
  status.clear_cameras();
  status.clear_lost();
  status.clear_camera_progress();
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < before_.size(); ++i) {
    const session::CameraProgress now = writer_.progress(i);
    *status.add_cameras() = now.counts;
    add(*status.mutable_lost(), now.counts);
    v1::FrameProgress& one = *status.add_camera_progress();
    one.set_arrived(now.arrived);
    one.set_queued(now.queued);
    one.set_written(now.written);
    one.set_safe(now.safe);
    one.set_at_risk_s(now.at_risk.value());
    all.set_arrived(all.arrived() + now.arrived);
    all.set_queued(all.queued() + now.queued);
    all.set_written(all.written() + now.written);
    all.set_safe(all.safe() + now.safe);
    all.set_at_risk_s(std::max(all.at_risk_s(), now.at_risk.value()));
    status.set_queue_fill(std::max(status.queue_fill(), now.queue_fill));
    bytes += now.bytes;
  }
  status.set_bytes(bytes);
  status.set_frames(status.lost().recorded());
}

v1::RecordingStatus Recorder::status(TimePoint now) const {
  v1::RecordingStatus status;
  status.set_session(session_);
  status.set_purpose(purpose_);
  status.set_state(v1::RecordingStatus::RECORDING);
  TimePoint end = now;
  {
    const std::lock_guard lock(mutex_);
    end = std::min(now, ended_.value_or(now));
  }
  const double seconds = std::max((end - began_).value(), 0.0);
  status.set_seconds(seconds);
  show_progress(status);
  if (seconds > 0) status.set_bytes_per_s(static_cast<double>(status.bytes()) / seconds);
  return status;
}

v1::RecordingStatus Recorder::finish(const std::vector<drivers::FrameCounts>& after, TimePoint now,
                                     const Progress& progress) {
  v1::RecordingStatus status = this->status(now);
  // No more frames come. The lock isn't held while the disk is waited for.
  std::vector<CameraBooks> all_books;
  {
    const std::lock_guard lock(mutex_);
    all_books = books_;
  }
  for (std::size_t i = 0; i < all_books.size(); ++i) {
    all_books[i].driver = after[i] - before_[i];
    const v1::Counts explained = explain(all_books[i]);
    writer_.count_lost(i, session::LossCause::transport, explained.transport());
    writer_.count_lost(i, session::LossCause::underrun, explained.underrun());
    writer_.count_lost(i, session::LossCause::passed_over, explained.passed_over());
  }
  const session::WriterLoad load = writer_.load();
  const Result<v1::Manifest> manifest = writer_.finish(progress);
  status.clear_progress();
  status.clear_queue_fill();
  show_progress(status);  // what is safe by now, whatever came of the rest
  if (!manifest.ok()) {
    status.set_state(v1::RecordingStatus::FAILED);
    status.set_verdict(fmt::format("{} of {} frames are safe, the recording isn't finished: {}",
                                   status.progress().safe(), status.progress().arrived(),
                                   manifest.error().message()));
    return status;
  }
  status.clear_cameras();
  status.clear_lost();
  std::string disagreements;
  for (std::size_t i = 0; i < all_books.size(); ++i) {
    const v1::CameraStream& stream = manifest->cameras(static_cast<int>(i));
    *status.add_cameras() = stream.counts();
    add(*status.mutable_lost(), stream.counts());
    if (const std::string why = disagreement(all_books[i], stream.counts()); !why.empty())
      disagreements += fmt::format("{}{}: {}", disagreements.empty() ? "" : "; ", stream.camera_id(), why);
  }
  status.set_frames(status.lost().recorded());
  status.set_state(disagreements.empty() ? v1::RecordingStatus::COMPLETE : v1::RecordingStatus::FAILED);
  status.set_verdict(disagreements.empty() ? words(status.lost(), all_books.size(), load.waits_for_disk())
                                           : "the counts don't agree: " + disagreements);
  return status;
}

}  // namespace emberlock::daemon
