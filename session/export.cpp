// SPDX-License-Identifier: Apache-2.0
#include "session/export.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <memory>
#include <numeric>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>

#include "base/file.h"
#include "base/output_folder.h"
#include "session/reader.h"
#include "session/video_writer.h"

namespace emberlock::session {
namespace fs = std::filesystem;
namespace {

constexpr double kLongestGap = 60;  // seconds: the longest time for which a video repeats one frame

/// Takes the frames of one camera, in order.
class CameraExport {
 public:
  virtual ~CameraExport() = default;
  virtual Status add(const Frame& frame) = 0;
  virtual Status close() = 0;
};

Status write_png(const fs::path& path, const Image& image) {
  const ImageLayout& layout = image.layout();
  const bool wide = bytes_per_sample(layout.format) == 2;
  const bool color = channels(layout.format) == 3;
  const int type = CV_MAKETYPE(wide ? CV_16U : CV_8U, channels(layout.format));
  cv::Mat mat(layout.size.height, layout.size.width, type);
  std::copy(image.bytes().begin(), image.bytes().end(), reinterpret_cast<std::byte*>(mat.data));
  if (color) {  // OpenCV's order is B, G, R
    const auto swap = [&]<class Sample>(Sample* at) {
      for (Sample* const end = at + mat.total() * 3; at != end; at += 3) std::swap(at[0], at[2]);
    };
    wide ? swap(reinterpret_cast<std::uint16_t*>(mat.data)) : swap(mat.data);
  }
  std::vector<unsigned char> bytes;
  if (!cv::imencode(".png", mat, bytes, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
    return Error{ErrorKind::io, "cannot encode the image", path.string()};
  }
  std::ofstream out(path, std::ios::binary);
  out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) return Error{ErrorKind::io, "cannot write", path.string(), "Check the disk's space"};
  return {};
}

class PngExport final : public CameraExport {
 public:
  explicit PngExport(fs::path folder) : folder_(std::move(folder)), stamps_(folder_ / "frames.csv") {
    stamps_ << "file,frame_id,device_ns,system_ns,monotonic_ns,damaged\n";
  }
  Status add(const Frame& frame) override {
    const std::string name = fmt::format("{:06}.png", count_++);
    const FrameStamp& s = frame.stamp;
    stamps_ << fmt::format("{},{},{},{},{},{}\n", name, s.frame_id, s.device_time.ns, s.system_time.ns,
                           s.monotonic_time.ns, s.status == FrameStatus::damaged ? 1 : 0);
    return write_png(folder_ / name, *frame.image);
  }
  Status close() override {
    stamps_.close();
    if (!stamps_)
      return Error{ErrorKind::io, "cannot write", (folder_ / "frames.csv").string(),
                   "Check the disk's space"};
    return {};
  }

 private:
  fs::path folder_;
  std::ofstream stamps_;
  std::uint64_t count_ = 0;
};

/// Timing of a camera's frames: where frames follow each other and where some are missing.
struct Pace {
  Hertz rate;
  /// How many frames of the video this frame takes; 1 if it directly follows the one before. Cameras number
  /// the frames that were lost too; where the numbers begin again, the clock tells.
  [[nodiscard]] std::int64_t steps(const FrameStamp& before, const FrameStamp& now) const {
    if (now.frame_id == before.frame_id + 1) return 1;
    const double longest = kLongestGap * rate.value();
    const double seconds = std::clamp((now.monotonic_time - before.monotonic_time).value(), 0.0, kLongestGap);
    const double frames = now.frame_id > before.frame_id ? static_cast<double>(now.frame_id - before.frame_id)
                                                         : seconds * rate.value();
    return std::max<std::int64_t>(1, std::llround(std::min(frames, longest)));
  }
};

/// The rate of frames that follow each other, by one of their clocks: of the intervals near the median one,
/// as coarse stamps are right on average only. 0: it doesn't tell.
template <class TimeOf>
double rate_by(const std::vector<FrameStamp>& stamps, TimeOf time_of) {
  constexpr double kNear = 0.25;
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stamps.size(); ++i) {
    const double apart = (time_of(stamps[i]) - time_of(stamps[i - 1])).value();
    if (stamps[i].frame_id == stamps[i - 1].frame_id + 1 && apart > 0) intervals.push_back(apart);
  }
  if (intervals.empty()) return 0;
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  const double median = *middle;
  std::erase_if(intervals, [&](double apart) { return std::abs(apart / median - 1) > kNear; });
  return static_cast<double>(intervals.size()) / std::accumulate(intervals.begin(), intervals.end(), 0.0);
}

/// The camera's own rate: by its clock, or as it claims if that is the same within what clocks differ by (so
/// that 23.976 stays 23.976). How fast frames arrived says something of the machine too, and comes last.
Pace pace_of(const std::vector<FrameStamp>& stamps, double claimed) {
  constexpr double kClocksDiffer = 0.005;
  constexpr double kSlowest = 0.1;
  constexpr double kFastest = 10'000;
  double rate = rate_by(stamps, [](const FrameStamp& s) { return s.device_time; });
  if (claimed > 0 && (rate == 0 || std::abs(rate / claimed - 1) < kClocksDiffer)) rate = claimed;
  if (rate == 0) rate = rate_by(stamps, [](const FrameStamp& s) { return s.monotonic_time; });
  if (rate == 0) rate = 25;
  return {Hertz(std::clamp(rate, kSlowest, kFastest))};
}

class VideoExport final : public CameraExport {
 public:
  VideoExport(std::unique_ptr<VideoWriter> video, Pace pace, ExportedCamera& report)
      : video_(std::move(video)), pace_(pace), report_(report) {}
  Status add(const Frame& frame) override {
    if (last_) {
      for (std::int64_t i = pace_.steps(*last_, frame.stamp); i > 1; --i) {
        EMBERLOCK_RETURN_IF_ERROR(video_->repeat());
        ++report_.repeated;
      }
    }
    last_ = frame.stamp;
    return video_->show(*frame.image);
  }
  Status close() override { return video_->close(); }

 private:
  std::unique_ptr<VideoWriter> video_;
  Pace pace_;
  ExportedCamera& report_;
  std::optional<FrameStamp> last_;
};

/// Exports one camera of a session to `target`.
class Exporter {
 public:
  Exporter(SessionReader& reader, std::size_t camera, fs::path target)
      : reader_(reader), camera_(camera), target_(std::move(target)) {
    report_.camera_id = stream().camera_id();
  }
  Result<ExportedCamera> run(ExportFormat format, std::string& codec, const Observer& observer) {
    EMBERLOCK_ASSIGN_OR_RETURN(const auto out,
                               format == ExportFormat::png ? open_images() : open_video(codec));
    const std::vector<FrameStamp>& stamps = reader_.stamps(camera_);
    std::optional<std::uint64_t> last;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      EMBERLOCK_RETURN_IF_ERROR(observe(observer, static_cast<double>(i) / static_cast<double>(stamps.size()),
                                        "exporting " + report_.camera_id));
      const auto frame = reader_.read(camera_, i);
      if (!frame) {
        ++report_.unreadable;
        continue;
      }
      if (last && frame->stamp.frame_id != *last + 1) ++report_.gaps;
      last = frame->stamp.frame_id;
      EMBERLOCK_RETURN_IF_ERROR(out->add(*frame));
      ++report_.frames;
    }
    EMBERLOCK_RETURN_IF_ERROR(out->close());
    return report_;
  }

 private:
  [[nodiscard]] const v1::CameraStream& stream() const {
    return reader_.manifest().cameras(static_cast<int>(camera_));
  }
  Result<std::unique_ptr<CameraExport>> open_images() {
    report_.file = report_.camera_id;
    std::error_code ec;
    fs::create_directory(target_ / report_.file, ec);
    if (ec)
      return Error{ErrorKind::io, "cannot create the folder: " + ec.message(),
                   (target_ / report_.file).string()};
    return std::unique_ptr<CameraExport>(std::make_unique<PngExport>(target_ / report_.file));
  }
  Result<std::unique_ptr<CameraExport>> open_video(std::string& codec) {
    report_.file = report_.camera_id + ".mp4";
    const Pace pace = pace_of(reader_.stamps(camera_), stream().frame_rate_hz());
    report_.frame_rate = pace.rate;
    EMBERLOCK_ASSIGN_OR_RETURN(
        auto video, VideoWriter::create(target_ / report_.file, reader_.layout(camera_), pace.rate));
    codec = video->codec();
    return std::unique_ptr<CameraExport>(std::make_unique<VideoExport>(std::move(video), pace, report_));
  }

  SessionReader& reader_;
  std::size_t camera_;
  fs::path target_;
  ExportedCamera report_;
};

}  // namespace

Result<ExportReport> export_session(const fs::path& folder, const fs::path& target, ExportFormat format,
                                    const Observer& observer) {
  EMBERLOCK_ASSIGN_OR_RETURN(SessionReader reader, SessionReader::open(folder));
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder out, OutputFolder::create({target, kExport, {folder}}));
  ExportReport report;
  const auto cameras = static_cast<double>(reader.camera_count());
  for (std::size_t i = 0; i < reader.camera_count(); ++i) {
    const auto at = static_cast<double>(i);
    EMBERLOCK_ASSIGN_OR_RETURN(
        ExportedCamera camera,
        Exporter(reader, i, out.path())
            .run(format, report.codec, part_of(observer, at / cameras, (at + 1) / cameras)));
    report.cameras.push_back(std::move(camera));
  }
  EMBERLOCK_RETURN_IF_ERROR(
      write_file_atomically(out.path() / "export.txt", "Exported from " + folder.string() + "\n"));
  EMBERLOCK_RETURN_IF_ERROR(out.commit());
  static_cast<void>(observe(observer, 1, "exported"));
  return report;
}

}  // namespace emberlock::session
