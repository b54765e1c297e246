// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <vector>

#include "base/quantity.h"
#include "session/av.h"

namespace emberlock::test {

/// The video as it is, and beside it a sound track of one channel that begins so much after it, as Matroska.
/// Throws what goes wrong.
inline void add_sound(const std::filesystem::path& video, const std::filesystem::path& out,
                      const std::vector<std::int16_t>& samples, int rate, Seconds begin) {
  const auto expect = [](int code, const char* what) {
    if (code < 0) throw std::runtime_error(std::string(what) + ": " + session::av_message(code));
  };
  session::quiet_libav();
  AVFormatContext* opened = nullptr;
  expect(avformat_open_input(&opened, video.c_str(), nullptr, nullptr), "no video");
  const std::unique_ptr<AVFormatContext, session::AvCloseInput> input(opened);
  expect(avformat_find_stream_info(opened, nullptr), "no streams");
  AVFormatContext* made = nullptr;
  expect(avformat_alloc_output_context2(&made, nullptr, "matroska", out.c_str()), "no container");
  const std::unique_ptr<AVFormatContext, session::AvFreeOutput> output(made);
  AVStream* picture = avformat_new_stream(made, nullptr);
  expect(avcodec_parameters_copy(picture->codecpar, opened->streams[0]->codecpar), "no parameters");
  picture->codecpar->codec_tag = 0;
  picture->avg_frame_rate = opened->streams[0]->avg_frame_rate;
  AVStream* sound = avformat_new_stream(made, nullptr);
  sound->codecpar->codec_type = AVMEDIA_TYPE_AUDIO;
  sound->codecpar->codec_id = AV_CODEC_ID_PCM_S16LE;
  sound->codecpar->sample_rate = rate;
  av_channel_layout_default(&sound->codecpar->ch_layout, 1);
  sound->time_base = {1, rate};
  expect(avio_open(&made->pb, out.c_str(), AVIO_FLAG_WRITE), "cannot create the file");
  expect(avformat_write_header(made, nullptr), "cannot write");
  const session::AvPtr<AVPacket> packet(av_packet_alloc());
  while (av_read_frame(opened, packet.get()) >= 0) {
    av_packet_rescale_ts(packet.get(), opened->streams[0]->time_base, picture->time_base);
    packet->stream_index = 0;
    expect(av_interleaved_write_frame(made, packet.get()), "cannot write");
  }
  constexpr std::size_t kPacket = 1024;
  for (std::size_t first = 0; first < samples.size(); first += kPacket) {
    const std::size_t count = std::min(kPacket, samples.size() - first);
    expect(av_new_packet(packet.get(), static_cast<int>(2 * count)), "no packet");
    std::memcpy(packet->data, samples.data() + first, 2 * count);
    packet->pts = packet->dts = static_cast<std::int64_t>(first) + std::llround(begin.value() * rate);
    packet->stream_index = 1;
    av_packet_rescale_ts(packet.get(), {1, rate}, sound->time_base);
    expect(av_interleaved_write_frame(made, packet.get()), "cannot write");
  }
  expect(av_write_trailer(made), "cannot write");
  avio_closep(&made->pb);
}

/// Quiet noise, with claps at instants after the first sample.
inline std::vector<std::int16_t> claps(const std::vector<double>& at, double seconds, int rate) {
  std::vector<std::int16_t> samples;
  std::uint32_t noise = 1;
  for (int i = 0; i < static_cast<int>(seconds * rate); ++i) {
    noise = noise * 1664525U + 1013904223U;
    const double hiss = static_cast<double>(noise >> 16) / 32768 - 1;
    double level = 0.005;
    for (const double clap : at) {
      const double after = static_cast<double>(i) / rate - clap;
      if (after >= 0 && after < 0.2) level += 0.6 / (1 + 300 * after);
    }
    samples.push_back(static_cast<std::int16_t>(20000 * hiss * level));
  }
  return samples;
}

}  // namespace emberlock::test
