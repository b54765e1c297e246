// SPDX-License-Identifier: Apache-2.0
// What `emberlock strobe --frame-code` prints and writes, read by the code's own reader.
#include "cli/frame_code_signal.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "base/file.h"
#include "cli/commands.h"
#include "smear_sync/clocks/frame_code.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
using testing::HasSubstr;

/// The flash at which cameras begin that film `flashes` from the `from`th on, at one flash a frame.
double number_of(const std::vector<bool>& flashes, int from, const smear::FrameCode& code = {}) {
  std::vector<smear::CodeFrame> frames;
  for (int i = 0; i < code.spacing + 40; ++i) {
    const auto flash = static_cast<std::size_t>(from + i) % flashes.size();
    frames.push_back({i, flashes[flash] ? smear::FlashSeen::yes : smear::FlashSeen::no});
  }
  smear::DecodeOptions options;
  options.code = code;
  options.first_phase = 0.5;
  const auto numbers = smear::number_frames(frames, options);
  if (!numbers.ok() || numbers->runs.size() != 1) return -1;
  return numbers->runs.front().start;
}

/// A frame is lit by the flash before its read phase, here by half a period.
void expect_numbered(const std::vector<bool>& flashes, const smear::FrameCode& code = {}) {
  ASSERT_EQ(flashes.size(), static_cast<std::size_t>(code.flashes()));
  for (const int from : {0, code.spacing / 2, code.flashes() / 3, code.flashes() - 20})
    EXPECT_NEAR(number_of(flashes, from, code), from + 0.5, 1e-6) << from;
}

std::vector<bool> bits(const std::string& text) {
  std::vector<bool> flashes;
  for (const char c : text)
    if (c == '0' || c == '1') flashes.push_back(c == '1');
  return flashes;
}

TEST(FrameCodeSignal, ThePrintedCodeIsReadBack) {
  const auto run = test::run_verb(add_strobe, {"strobe", "--frame-code"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  expect_numbered(bits(run.out));
  EXPECT_EQ(run.out.find('\n'), 120U) << "a word and its pause on each line";
  EXPECT_THAT(run.err, HasSubstr("3720 flashes"));
  const auto small =
      test::run_verb(add_strobe, {"strobe", "--frame-code", "--code-words", "8", "--code-spacing", "60"});
  expect_numbered(bits(small.out), {.words = 8, .spacing = 60});
}

TEST(FrameCodeSignal, TheTableIsReadBackWithItsTimes) {
  const test::TempFolder folder;
  const std::string file = (folder / "code.csv").string();
  const auto run =
      test::run_verb(add_strobe, {"strobe", "--frame-code", "--rate", "24", "--width", "50", "--csv", file});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::istringstream lines(read_file(file).value());
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, "flash,start_s,width_s,lit");
  std::vector<bool> flashes;
  while (std::getline(lines, line)) {
    unsigned flash = 0;
    double start = 0;
    double width = 0;
    int lit = 0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%u,%lf,%lf,%d", &flash, &start, &width, &lit), 4) << line;
    EXPECT_EQ(flash, flashes.size());
    EXPECT_NEAR(start, flash / 24.0, 1e-9);
    EXPECT_NEAR(width, lit == 1 ? 50e-6 : 0, 1e-12);
    flashes.push_back(lit == 1);
  }
  expect_numbered(flashes);
}

std::uint32_t little_endian(const std::string& bytes, std::size_t at, int count) {
  std::uint32_t value = 0;
  for (int i = count - 1; i >= 0; --i)
    value = value << 8 | static_cast<unsigned char>(bytes[at + static_cast<std::size_t>(i)]);
  return value;
}

TEST(FrameCodeSignal, TheSoundFileIsReadBack) {
  const test::TempFolder folder;
  const std::string file = (folder / "code.wav").string();
  const auto run =
      test::run_verb(add_strobe, {"strobe", "--frame-code", "--wav", file, "--wav-rate", "8000"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::string wave = read_file(file).value();
  ASSERT_EQ(wave.substr(0, 4) + wave.substr(8, 8) + wave.substr(36, 4), "RIFFWAVEfmt data");
  EXPECT_EQ(little_endian(wave, 22, 2), 1U) << "channels";
  EXPECT_EQ(little_endian(wave, 24, 4), 8000U);
  EXPECT_EQ(little_endian(wave, 34, 2), 16U) << "bits";
  ASSERT_EQ(little_endian(wave, 40, 4), wave.size() - 44);
  EXPECT_EQ(little_endian(wave, 4, 4), wave.size() - 8);
  std::vector<bool> flashes(3720);
  EXPECT_EQ((wave.size() - 44) / 2, 1229752U) << "3720 flashes at 24.2 Hz";
  for (std::size_t s = 0; 2 * s + 44 < wave.size(); ++s) {
    const std::uint32_t level = little_endian(wave, 44 + 2 * s, 2);
    if (level == 0) continue;
    ASSERT_EQ(level, 32767U);
    const double flash = static_cast<double>(s) * 24.2 / 8000;
    ASSERT_NEAR(flash, std::round(flash), 0.5 * 24.2 / 8000 + 1e-9);
    flashes.at(static_cast<std::size_t>(std::lround(flash))) = true;
  }
  expect_numbered(flashes);
}

TEST(FrameCodeSignal, WhatCannotBePlayedIsRefused) {
  EXPECT_FALSE(code_wav({true, false}, Hertz(24.2), microseconds(20), Hertz(30)).ok());
  EXPECT_FALSE(code_wav(std::vector<bool>(4000, true), Hertz(1), microseconds(20), Hertz(1e7)).ok());
  for (const std::vector<std::string>& words :
       std::vector<std::vector<std::string>>{{"strobe", "--csv", "x"},
                                             {"strobe", "--frame-code", "--code", "101"},
                                             {"strobe", "--frame-code", "--code-spacing", "31"},
                                             {"strobe", "--frame-code", "--csv", "/nowhere/at/all.csv"}})
    EXPECT_NE(test::run_verb(add_strobe, words).exit_code, 0) << words.back();
}

}  // namespace
}  // namespace emberlock::cli
