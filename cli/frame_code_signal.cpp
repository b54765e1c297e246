// SPDX-License-Identifier: Apache-2.0
#include "cli/frame_code_signal.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <iterator>

#include <fmt/format.h>

namespace emberlock::cli {
namespace {

constexpr double kLongestWave = 5e8;  // samples

void append_little_endian(std::string& to, std::uint32_t value, int bytes) {
  for (int i = 0; i < bytes; ++i) to += static_cast<char>(value >> (8 * i) & 0xffU);
}

std::string wave_header(std::uint32_t samples, std::uint32_t sample_rate) {
  constexpr std::uint32_t kSampleBytes = 2;
  std::string header = "RIFF";
  append_little_endian(header, 36 + kSampleBytes * samples, 4);
  header += "WAVEfmt ";
  append_little_endian(header, 16, 4);  // bytes of this part
  append_little_endian(header, 1, 2);   // PCM
  append_little_endian(header, 1, 2);   // channels
  append_little_endian(header, sample_rate, 4);
  append_little_endian(header, kSampleBytes * sample_rate, 4);
  append_little_endian(header, kSampleBytes, 2);
  append_little_endian(header, 8 * kSampleBytes, 2);
  header += "data";
  append_little_endian(header, kSampleBytes * samples, 4);
  return header;
}

}  // namespace

std::string code_text(const std::vector<bool>& pattern, int spacing) {
  std::string text;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    text += pattern[i] ? '1' : '0';
    if ((i + 1) % static_cast<std::size_t>(spacing) == 0 || i + 1 == pattern.size()) text += '\n';
  }
  return text;
}

std::string code_csv(const std::vector<bool>& pattern, Hertz rate, Seconds width) {
  std::string text = "flash,start_s,width_s,lit\n";
  for (std::size_t i = 0; i < pattern.size(); ++i)
    fmt::format_to(std::back_inserter(text), "{},{:.9f},{:.9f},{}\n", i,
                   static_cast<double>(i) / rate.value(), pattern[i] ? width.value() : 0.0,
                   pattern[i] ? 1 : 0);
  return text;
}

Result<std::string> code_wav(const std::vector<bool>& pattern, Hertz rate, Seconds width, Hertz samples) {
  const double each = samples / rate;  // samples of a flash and its pause
  const double all = each * static_cast<double>(pattern.size());
  if (each < 2)
    return Error{ErrorKind::bad_input, "has too few samples for a flash and a pause", "--wav-rate",
                 "give twice the flash rate or more, e.g. 48000"};
  if (all > kLongestWave)
    return Error{ErrorKind::bad_input, "makes a file over 1 GB", "--wav-rate", "give less, e.g. 48000"};
  const auto count = static_cast<std::size_t>(std::llround(all));
  const auto lit = static_cast<std::size_t>(std::clamp(std::round(samples * width), 1.0, each - 1));
  std::string wave = wave_header(static_cast<std::uint32_t>(count),
                                 static_cast<std::uint32_t>(std::lround(samples.value())));
  const std::size_t header = wave.size();
  wave.resize(header + 2 * count, '\0');
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (!pattern[i]) continue;
    const auto begin = static_cast<std::size_t>(std::llround(each * static_cast<double>(i)));
    for (std::size_t s = begin; s < std::min(begin + lit, count); ++s) {
      wave[header + 2 * s] = '\xff';  // 32767
      wave[header + 2 * s + 1] = '\x7f';
    }
  }
  return wave;
}

}  // namespace emberlock::cli
