// SPDX-License-Identifier: Apache-2.0
#include "session/media/video_scan.h"

extern "C" {
#include <libavutil/parseutils.h>
}

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "session/av.h"
#include "session/media/frame_decoders.h"
#include "session/media/frame_file.h"

namespace emberlock::session {
namespace {

constexpr double kUneven = 0.1;          // of an interval
constexpr double kFarOff = 0.25;         // of a period, accumulated over many frames
constexpr double kRounding = 1.01;       // ticks
constexpr std::int64_t kUnpromised = 3;  // frames: tolerance for rounded durations

struct Packet {
  std::int64_t ticks;
  bool key;
};

double median_interval(const std::vector<std::int64_t>& ticks) {
  std::vector<std::int64_t> intervals;
  for (std::size_t i = 1; i < ticks.size(); ++i) intervals.push_back(ticks[i] - ticks[i - 1]);
  const auto middle = intervals.begin() + static_cast<std::ptrdiff_t>(intervals.size() / 2);
  std::nth_element(intervals.begin(), middle, intervals.end());
  return static_cast<double>(*middle);
}

std::optional<std::int64_t> creation_time(const AVFormatContext& format) {
  const AVDictionaryEntry* entry = av_dict_get(format.metadata, "creation_time", nullptr, 0);
  std::int64_t microseconds = 0;
  if (entry == nullptr || av_parse_time(&microseconds, entry->value, 0) < 0 || microseconds <= 0) return {};
  return microseconds * 1000;
}

Result<std::vector<Packet>> read_packets(const AvInput& input, const std::string& where) {
  std::vector<Packet> packets;
  const AvPtr<AVPacket> packet(av_packet_alloc());
  while (av_read_frame(input.format.get(), packet.get()) >= 0) {
    const bool whole = (packet->flags & (AV_PKT_FLAG_CORRUPT | AV_PKT_FLAG_DISCARD)) == 0 && packet->size > 0;
    if (packet->stream_index == input.stream && whole) {
      const std::int64_t ticks = packet->pts != AV_NOPTS_VALUE ? packet->pts : packet->dts;
      if (ticks == AV_NOPTS_VALUE) {
        return Error{ErrorKind::bad_input, "its frames have no time stamps", where,
                     "Put it into another container, e.g. ffmpeg -i FILE -c copy FILE.mkv"};
      }
      packets.push_back({ticks, (packet->flags & AV_PKT_FLAG_KEY) != 0});
    }
    av_packet_unref(packet.get());
  }
  std::sort(packets.begin(), packets.end(),
            [](const Packet& a, const Packet& b) { return a.ticks < b.ticks; });
  return packets;
}

void judge_evenness(VideoScan& scan) {
  if (scan.frames() < 2) return;
  const double interval = median_interval(scan.ticks);
  scan.irregular = first_irregular(scan.ticks);
  const auto even = static_cast<std::size_t>(scan.irregular.value_or(scan.frames())) - 1;
  const double span = static_cast<double>(scan.ticks[even] - scan.ticks[0]) * scan.tick.value();
  if (even > 0 && span > 0) scan.frame_rate = Hertz(static_cast<double>(even) / span);
  if (!scan.irregular) return;
  const auto i = static_cast<std::size_t>(*scan.irregular);
  scan.irregularity =
      fmt::format("frame {} follows {:.1f} ms after the one before it, most follow after {:.1f} ms", i,
                  1e3 * static_cast<double>(scan.ticks[i] - scan.ticks[i - 1]) * scan.tick.value(),
                  1e3 * interval * scan.tick.value());
}

}  // namespace

bool VideoScan::truncated() const { return frames() < promised; }

std::optional<std::int64_t> first_irregular(const std::vector<std::int64_t>& ticks) {
  if (ticks.size() < 3) return {};
  const double median = median_interval(ticks);
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const auto interval = static_cast<double>(ticks[i] - ticks[i - 1]);
    if (interval <= 0 || std::abs(interval - median) > kUneven * median + kRounding)
      return static_cast<std::int64_t>(i);
  }
  // Slow changes: drift from the mean rate of all frames.
  const double pace =
      static_cast<double>(ticks.back() - ticks.front()) / static_cast<double>(ticks.size() - 1);
  for (std::size_t i = 1; i < ticks.size(); ++i) {
    const double off = static_cast<double>(ticks[i] - ticks[0]) - pace * static_cast<double>(i);
    if (std::abs(off) > kFarOff * pace + 2 * kRounding) return static_cast<std::int64_t>(i);
  }
  return {};
}

Error size_changed(const std::string& film, std::int64_t frame, ImageSize size, ImageSize before) {
  return {ErrorKind::bad_input,
          fmt::format("frame {} has {} x {} pixels, and those before it {} x {}", frame, size.width,
                      size.height, before.width, before.height),
          film, "Cut the video there, or scale all of it to one size"};
}

Result<VideoScan> scan_video(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, FrameFile::open(path, Colours::brightness));
  const VideoClaims claims = file->claims();
  VideoScan scan;
  if (!claims.frames && !claims.frame_rate) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Image picture, file->next());
    scan.size = picture.layout().size;
    scan.ticks = {0};
    scan.keys = {0};
    scan.promised = 1;
    return scan;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const AvInput input, open_av_input(path, Checking::lenient));
  const AVStream& stream = *input.format->streams[input.stream];
  scan.size = {input.decoder->width, input.decoder->height};
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(scan.size.width, scan.size.height, path.string()));
  scan.tick = Seconds(av_q2d(stream.time_base));
  scan.created_ns = creation_time(*input.format);
  EMBERLOCK_ASSIGN_OR_RETURN(const std::vector<Packet> packets, read_packets(input, path.string()));
  if (packets.empty())
    return Error{ErrorKind::bad_input, "the video holds no frames", path.string(), "Copy or record it again"};
  for (const Packet& packet : packets) {
    if (packet.key) scan.keys.push_back(scan.frames());
    scan.ticks.push_back(packet.ticks);
  }
  if (stream.nb_frames > 0) {
    scan.promised = stream.nb_frames;
  } else if (claims.frames && input.format->duration_estimation_method == AVFMT_DURATION_FROM_STREAM) {
    scan.promised = *claims.frames - *claims.frames / 50 - kUnpromised;  // a sound track may be longer
  }
  judge_evenness(scan);
  return scan;
}

}  // namespace emberlock::session
