// SPDX-License-Identifier: Apache-2.0
#include "session/media/sound.h"

extern "C" {
#include <libavutil/samplefmt.h>
}

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <vector>

#include "session/av.h"

namespace emberlock::session {
namespace {

constexpr double kLongest = 4 * 3600;  // seconds: later sound is ignored

/// Sums the squares of samples per millisecond.
class Loudness {
 public:
  void add(double at, double square) {
    if (!(at >= 0 && at < kLongest)) return;
    const auto step = static_cast<std::size_t>(at * 1e3);
    if (step >= sums_.size()) {
      sums_.resize(step + 1);
      counts_.resize(step + 1);
    }
    sums_[step] += square;
    ++counts_[step];
  }
  [[nodiscard]] std::vector<float> levels() const {
    std::vector<float> levels;
    levels.reserve(sums_.size());
    for (std::size_t i = 0; i < sums_.size(); ++i)
      levels.push_back(counts_[i] > 0 ? static_cast<float>(std::sqrt(sums_[i] / counts_[i])) : 0.0F);
    return levels;
  }

 private:
  std::vector<double> sums_;
  std::vector<int> counts_;
};

/// Floating-point samples above this multiple of full scale are invalid.
constexpr double kLoudest = 1e6;

/// Mean square of all channels at sample i, relative to full scale.
template <class Sample>
double mean_square(const AVFrame& frame, int channels, bool planar, int i) {
  double sum = 0;
  for (int c = 0; c < channels; ++c) {
    const std::uint8_t* at =
        planar ? frame.extended_data[c] + sizeof(Sample) * static_cast<std::size_t>(i)
               : frame.extended_data[0] +
                     sizeof(Sample) * (static_cast<std::size_t>(i) * static_cast<std::size_t>(channels) +
                                       static_cast<std::size_t>(c));
    Sample sample{};
    std::memcpy(&sample, at, sizeof(Sample));
    double value = static_cast<double>(sample);
    if constexpr (std::is_same_v<Sample, std::uint8_t>) value = (value - 128) / 128;
    if constexpr (std::is_same_v<Sample, std::int16_t>) value /= 32768;
    if constexpr (std::is_same_v<Sample, std::int32_t>) value /= 2147483648.0;
    if (std::abs(value) <= kLoudest) sum += value * value;
  }
  return sum / channels;
}

double mean_square(const AVFrame& frame, int i) {
  const auto format = static_cast<AVSampleFormat>(frame.format);
  const bool planar = av_sample_fmt_is_planar(format) != 0;
  const int channels = std::max(1, frame.ch_layout.nb_channels);
  switch (av_get_packed_sample_fmt(format)) {
    case AV_SAMPLE_FMT_U8:
      return mean_square<std::uint8_t>(frame, channels, planar, i);
    case AV_SAMPLE_FMT_S16:
      return mean_square<std::int16_t>(frame, channels, planar, i);
    case AV_SAMPLE_FMT_S32:
      return mean_square<std::int32_t>(frame, channels, planar, i);
    case AV_SAMPLE_FMT_FLT:
      return mean_square<float>(frame, channels, planar, i);
    case AV_SAMPLE_FMT_DBL:
      return mean_square<double>(frame, channels, planar, i);
    default:
      return 0;
  }
}

/// `clock` is the end of the last decoded frame.
void take(const AVFrame& frame, double tick, double origin, double& clock, Loudness& loudness) {
  if (frame.sample_rate <= 0) return;
  if (frame.best_effort_timestamp != AV_NOPTS_VALUE)
    clock = static_cast<double>(frame.best_effort_timestamp) * tick;
  for (int i = 0; i < frame.nb_samples; ++i)
    loudness.add(clock + static_cast<double>(i) / frame.sample_rate - origin, mean_square(frame, i));
  clock += static_cast<double>(frame.nb_samples) / frame.sample_rate;
}

}  // namespace

Result<SoundTrack> read_sound(const std::filesystem::path& path) {
  EMBERLOCK_ASSIGN_OR_RETURN(const AvSound sound, open_av_sound(path));
  SoundTrack track;
  if (!sound.input.decoder) return track;
  const AvInput& input = sound.input;
  const double tick = av_q2d(input.format->streams[input.stream]->time_base);
  // Sound may begin before the first frame; count from the earlier of the two.
  const double begin = std::min(0.0, sound.begins.value() - sound.video_begins.value());
  const double origin = sound.video_begins.value() + begin;
  double clock = sound.begins.value();
  const AvPtr<AVPacket> packet(av_packet_alloc());
  const AvPtr<AVFrame> frame(av_frame_alloc());
  Loudness loudness;
  bool more = true;
  while (more) {
    av_packet_unref(packet.get());
    more = av_read_frame(input.format.get(), packet.get()) >= 0;
    if (more && packet->stream_index != input.stream) continue;
    if (avcodec_send_packet(input.decoder.get(), more ? packet.get() : nullptr) < 0) continue;
    while (avcodec_receive_frame(input.decoder.get(), frame.get()) >= 0)
      take(*frame, tick, origin, clock, loudness);
  }
  track.begin = Seconds(begin);
  track.levels = loudness.levels();
  return track;
}

}  // namespace emberlock::session
