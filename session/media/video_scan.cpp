// SPDX-License-Identifier: Apache-2.0
#include "session/media/video_scan.h"

extern "C" {
#include <libavutil/parseutils.h>
#include <libavutil/pixdesc.h>
}

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <optional>
#include <string_view>

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
  std::int64_t pts, dts;
  bool key;
};

/// A video's packets in the order of decoding.
struct Packets {
  std::vector<Packet> shown{};  ///< those that give a frame
  std::int64_t there = 0;       ///< whole ones, with those that an edit list hides
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

Packets read_packets(const AvInput& input) {
  Packets packets;
  const AvPtr<AVPacket> packet(av_packet_alloc());
  while (av_read_frame(input.format.get(), packet.get()) >= 0) {
    if (packet->stream_index == input.stream && (packet->flags & AV_PKT_FLAG_CORRUPT) == 0) {
      ++packets.there;
      if ((packet->flags & AV_PKT_FLAG_DISCARD) == 0 && packet->size > 0)
        packets.shown.push_back({packet->pts, packet->dts, (packet->flags & AV_PKT_FLAG_KEY) != 0});
    }
    av_packet_unref(packet.get());
  }
  return packets;
}

/// The number of packets that the container states, and of those that are there; 0 and 0: it states none.
struct PacketCount {
  std::int64_t stated = 0, there = 0;
};

PacketCount count_packets(const AvInput& input, const VideoClaims& claims, const Packets& packets) {
  const AVStream& stream = *input.format->streams[input.stream];
  const std::string_view container = input.format->iformat->name;
  if (container == "avi" && stream.nb_frames > 0) {
    // AVI counts empty chunks too, which stand for a repeated frame. Each has its tick.
    std::vector<std::int64_t> decoding;
    for (const Packet& packet : packets.shown) {
      if (packet.dts != AV_NOPTS_VALUE) decoding.push_back(packet.dts);
    }
    if (decoding.empty()) return {};
    std::sort(decoding.begin(), decoding.end());
    const auto step =
        decoding.size() < 2 ? 1 : std::max<std::int64_t>(1, std::llround(median_interval(decoding)));
    return {stream.nb_frames / step, decoding.back() / step + 1};
  }
  if (stream.nb_frames > 0) {
    // An edit list may leave packets out.
    const std::int64_t indexed = avformat_index_get_entries_count(&stream);
    const bool edited = container.starts_with("mov,") && indexed > 0;
    return {edited ? std::min<std::int64_t>(stream.nb_frames, indexed) : stream.nb_frames, packets.there};
  }
  if (!claims.frames || input.format->duration_estimation_method != AVFMT_DURATION_FROM_STREAM) return {};
  return {*claims.frames - *claims.frames / 50 - kUnpromised, packets.there};  // a sound track may be longer
}

/// Takes the time stamps of the packets, if they are those of the decoder's first frames. The decoder leaves
/// out frames at the start that refer to frames before the file.
bool take_packet_stamps(const Packets& packets, FrameFile& file, VideoScan& scan) {
  constexpr int kLongestReorder = 16;  // frames: the largest delay that H.264 and H.265 allow
  std::vector<Packet> sorted = packets.shown;
  const auto unstamped = [](const Packet& packet) { return packet.pts == AV_NOPTS_VALUE; };
  if (std::any_of(sorted.begin(), sorted.end(), unstamped)) return false;
  std::sort(sorted.begin(), sorted.end(), [](const Packet& a, const Packet& b) { return a.pts < b.pts; });
  auto next = sorted.begin();
  for (int i = 0; i <= kLongestReorder && file.skip(1).ok(); ++i, ++next) {
    const auto stamp = file.ticks();
    if (!stamp) return false;
    const auto is_it = [&](const Packet& packet) { return packet.pts == *stamp; };
    if (i == 0) next = sorted.erase(sorted.begin(), std::find_if(sorted.begin(), sorted.end(), is_it));
    if (next == sorted.end() || !is_it(*next)) return false;
  }
  for (const Packet& packet : sorted) {
    if (packet.key) scan.keys.push_back(scan.frames());
    scan.ticks.push_back(packet.pts);
  }
  return true;
}

/// Removes stamps that belong to another frame: most around them agree on another time. In program streams a
/// stamp belongs to the first picture that begins in a packet, and writers and readers differ on where one
/// begins. A step of all later stamps stays.
void drop_misplaced(std::vector<std::optional<std::int64_t>>& stamps) {
  constexpr std::size_t kAround = 3;
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (stamps[i]) known.push_back(i);
  }
  const bool sparse = 2 * known.size() < stamps.size();
  if (known.size() < 3 || !sparse) return;
  const auto middle = [](std::vector<double> values) {
    const auto at = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), at, values.end());
    return *at;
  };
  std::vector<double> paces;
  for (std::size_t k = 1; k < known.size(); ++k)
    paces.push_back(static_cast<double>(*stamps[known[k]] - *stamps[known[k - 1]]) /
                    static_cast<double>(known[k] - known[k - 1]));
  const double pace = middle(paces);
  std::vector<double> begins;  // the first frame's time by each stamp
  begins.reserve(known.size());
  for (const std::size_t i : known)
    begins.push_back(static_cast<double>(*stamps[i]) - pace * static_cast<double>(i));
  for (std::size_t k = 0; k < known.size(); ++k) {
    const std::size_t from =
        std::min(k - std::min(k, kAround), known.size() - std::min(known.size(), 2 * kAround + 1));
    const std::size_t to = std::min(known.size(), from + 2 * kAround + 1);
    const double others = middle({begins.begin() + static_cast<std::ptrdiff_t>(from),
                                  begins.begin() + static_cast<std::ptrdiff_t>(to)});
    if (std::abs(begins[k] - others) > kFarOff * pace + kRounding) stamps[known[k]].reset();
  }
}

/// Fills the gaps between stamps evenly, and goes on beyond them at their mean pace.
std::vector<std::int64_t> fill_stamps(const std::vector<std::optional<std::int64_t>>& stamps) {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (stamps[i]) known.push_back(i);
  }
  const auto at = [&](std::size_t i) { return static_cast<double>(*stamps[i]); };
  const auto pace = [&](std::size_t a, std::size_t b) {
    return (at(b) - at(a)) / (static_cast<double>(b) - static_cast<double>(a));
  };
  std::vector<std::int64_t> filled;
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    const auto after = std::upper_bound(known.begin(), known.end(), i);
    const bool between = after != known.begin() && after != known.end();
    const std::size_t from = after == known.begin() ? known.front() : *(after - 1);
    const double step = between ? pace(from, *after) : pace(known.front(), known.back());
    filled.push_back(*stamps[from] +
                     std::llround(step * (static_cast<double>(i) - static_cast<double>(from))));
  }
  return filled;
}

/// Decodes the whole film for the stamps of its frames. A film without stamps for display (AVI) has those of
/// decoding, which are as even.
Status take_decoded_stamps(const Packets& packets, const std::filesystem::path& path, VideoScan& scan) {
  scan.counted = true;
  std::vector<std::optional<std::int64_t>> stamps;
  EMBERLOCK_ASSIGN_OR_RETURN(const std::unique_ptr<FrameFile> file,
                             open_video(path, Colours::brightness, Stamps::stored));
  Status read;
  while ((read = file->skip(1)).ok()) stamps.push_back(file->ticks());
  // Reading finds the damage where it is: the frames behind it count.
  if (read.error().kind != ErrorKind::out_of_data)
    stamps.resize(std::max(stamps.size(), packets.shown.size()));
  if (std::count_if(stamps.begin(), stamps.end(), [](const auto& s) { return s.has_value(); }) < 2) {
    std::vector<std::int64_t> decoding;
    for (const Packet& packet : packets.shown) {
      if (packet.dts != AV_NOPTS_VALUE) decoding.push_back(packet.dts);
    }
    std::sort(decoding.begin(), decoding.end());
    for (std::size_t i = 0; i < std::min(decoding.size(), stamps.size()); ++i) stamps[i] = decoding[i];
  }
  drop_misplaced(stamps);
  const auto known = std::count_if(stamps.begin(), stamps.end(), [](const auto& s) { return s.has_value(); });
  if (known < std::min<std::ptrdiff_t>(2, std::ssize(stamps)) || stamps.empty()) {
    return Error{ErrorKind::bad_input, "its frames have no time stamps", path.string(),
                 "Put it into another container, e.g. ffmpeg -i FILE -c copy FILE.mkv"};
  }
  scan.ticks = stamps.size() == 1 ? std::vector{*stamps.front()} : fill_stamps(stamps);
  for (std::size_t i = 0; i < std::min(packets.shown.size(), stamps.size()); ++i) {
    if (packets.shown[i].key) scan.keys.push_back(static_cast<std::int64_t>(i));
  }
  return {};
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

bool format_has_alpha(AVPixelFormat format) {
  const AVPixFmtDescriptor* d = av_pix_fmt_desc_get(format);
  return d != nullptr && (d->flags & AV_PIX_FMT_FLAG_ALPHA) != 0;
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

Error orientation_changed(const std::filesystem::path& picture) {
  return {ErrorKind::bad_input, "has another EXIF orientation than the camera's first picture",
          picture.string(), "Store all pictures of a camera in one orientation, or leave this one out"};
}

Result<VideoScan> scan_video(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const auto file, FrameFile::open(path, Colours::brightness));
  VideoScan scan;
  scan.unapplied = file->unapplied();
  if (const std::int64_t pictures = file->pictures(); pictures > 0) {
    EMBERLOCK_ASSIGN_OR_RETURN(const Image picture, file->next());
    scan.size = picture.layout().size;
    scan.counted = true;
    scan.promised = pictures;
    scan.ticks.resize(static_cast<std::size_t>(pictures));
    std::iota(scan.ticks.begin(), scan.ticks.end(), 0);
    scan.keys = scan.ticks;
    return scan;
  }
  EMBERLOCK_ASSIGN_OR_RETURN(const AvInput input, open_av_input(path, Checking::lenient));
  scan.size = {input.decoder->width, input.decoder->height};
  EMBERLOCK_RETURN_IF_ERROR(check_image_size(scan.size.width, scan.size.height, path.string()));
  if (format_has_alpha(input.decoder->pix_fmt)) {
    EMBERLOCK_ASSIGN_OR_RETURN(const auto film, FrameFile::open(path));
    EMBERLOCK_RETURN_IF_ERROR(film->next());
  }
  scan.tick = Seconds(av_q2d(input.format->streams[input.stream]->time_base));
  scan.created_ns = creation_time(*input.format);
  scan.display = display_of(*input.format->streams[input.stream]);
  scan.sound = av_find_best_stream(input.format.get(), AVMEDIA_TYPE_AUDIO, -1, -1, nullptr, 0) >= 0;
  const Packets packets = read_packets(input);
  if (packets.shown.empty())
    return Error{ErrorKind::bad_input, "the video holds no frames", path.string(), "Copy or record it again"};
  if (!take_packet_stamps(packets, *file, scan))
    EMBERLOCK_RETURN_IF_ERROR(take_decoded_stamps(packets, path, scan));
  const PacketCount count = count_packets(input, file->claims(), packets);
  if (count.stated > 0) scan.promised = scan.frames() + std::max<std::int64_t>(0, count.stated - count.there);
  judge_evenness(scan);
  return scan;
}

}  // namespace emberlock::session
