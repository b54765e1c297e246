// SPDX-License-Identifier: Apache-2.0
// The films to learn with, apart from what the tutorial does with them.
#include "rig/sample/sample.h"

#include <filesystem>
#include <string>
#include <string_view>

#include <gtest/gtest.h>

#include "base/file.h"
#include "tests/support/recording.h"

namespace emberlock::rig {
namespace {

SampleOptions smallest() { return {.cameras = 3, .image = {160, 120}, .flame_frames = 2}; }

TEST(Sample, IsTheSameForASeedAndAnotherForAnother) {
  const test::TempFolder folder;
  const auto made = [&](const std::string& name, std::uint64_t seed) {
    SampleOptions options = smallest();
    options.seed = seed;
    const auto sample = make_sample(options, folder / name);
    EXPECT_TRUE(sample.ok()) << sample.error().message();
    return folder / name;
  };
  const auto first = made("first", 1);
  const auto again = made("again", 1);
  const auto other = made("other", 2);
  for (const char* file : {"truth.json", "films/camera-2.mp4", "board/camera-1/00.png"}) {
    EXPECT_EQ(read_file(first / file).value(), read_file(again / file).value()) << file;
    EXPECT_NE(read_file(first / file).value(), read_file(other / file).value()) << file;
  }
}

TEST(Sample, RefusesWhatItCannotFilm) {
  const test::TempFolder folder;
  const auto refuses = [&](auto change) {
    SampleOptions options = smallest();
    change(options);
    const auto sample = make_sample(options, folder / "sample");
    return !sample.ok() && sample.error().kind == ErrorKind::bad_input && !sample.error().remedy.empty();
  };
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.cameras = 2; }));
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.cameras = 11; }));
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.image = {158, 120}; }));
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.image = {161, 120}; }));
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.image = {640, 722}; }));
  EXPECT_TRUE(refuses([](SampleOptions& o) { o.flame_frames = 0; }));
  EXPECT_FALSE(std::filesystem::exists(folder / "sample"));
}

TEST(Sample, EndsWhenAskedTo) {
  const test::TempFolder folder;
  const auto ended = make_sample(smallest(), folder / "sample",
                                 [](double fraction, std::string_view) { return fraction < 0.5; });
  ASSERT_FALSE(ended.ok());
  EXPECT_EQ(ended.error().kind, ErrorKind::refused);
}

}  // namespace
}  // namespace emberlock::rig
