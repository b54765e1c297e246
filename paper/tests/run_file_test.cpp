// SPDX-License-Identifier: Apache-2.0
#include "paper/run_file.h"

#include <fstream>

#include <gmock/gmock.h>

#include "tests/support/recording.h"

namespace emberlock::paper {
namespace {
using testing::HasSubstr;

MethodRun some_run() {
  MethodRun run;
  run.protocol = "nine-views";
  run.of = "nine-of-ten";
  run.method = "the paper's";
  run.device = "cuda:1";
  run.time = Seconds(1.0 / 3);
  run.iterations = 12;
  run.errors = {{1, 2, 3}, {4.5, 5, 1.0 / 7}, {1, 1, 1}, {0.25, 0.5, 0.75}};
  run.temperature = TemperatureErrors{10.5, 30, -2, 0.9};
  run.points = {{5, Seconds(0.1), run.errors}};
  run.slice = TemperatureSlice{{2, 1}, {0, 1500}, {1400, 1490}};
  Image picture(ImageLayout{{3, 2}, PixelFormat::rgb8, 8});
  picture.row_as<std::uint8_t>(1)[4] = 200;
  run.pictures = {{"test-3", picture}};
  return run;
}

TEST(RunFile, ARunIsTheSameAgain) {
  const test::TempFolder temp;
  const MethodRun run = some_run();
  ASSERT_TRUE(write_run(run, "full", temp / folder_name(run)).ok());
  const auto again = read_run(temp / folder_name(run), "full");
  ASSERT_TRUE(again.ok()) << again.error().message();
  EXPECT_EQ(run_json(*again, "full"), run_json(run, "full"));
  EXPECT_EQ(again->time.value(), run.time.value());
  EXPECT_EQ(again->pictures[0].image, run.pictures[0].image);
  EXPECT_EQ(again->slice->found, run.slice->found);
}

TEST(RunFile, AFoldersNameHasNothingThatShellsRead) {
  EXPECT_EQ(folder_name(some_run()), "nine-views.nine-of-ten.the-paper-s.cuda-1");
}

TEST(RunFile, OtherSettingsAreRefused) {
  const auto other = parse_run(run_json(some_run(), "64 cells"), "192 cells", "x/run.json");
  ASSERT_FALSE(other.ok());
  EXPECT_EQ(other.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(other.error().message(), HasSubstr("other settings (64 cells)"));
  EXPECT_THAT(other.error().message(), HasSubstr("x/run.json"));
}

TEST(RunFile, WhatIsNoRunIsRefused) {
  for (const std::string text :
       {"", "{}", "[1]", R"({"format": "emberlock evaluation run", "version": 2})"}) {
    const auto run = parse_run(text, "", "here");
    ASSERT_FALSE(run.ok()) << text;
    EXPECT_EQ(run.error().kind, ErrorKind::bad_input);
  }
  std::string json = run_json(some_run(), "");
  json.replace(json.find("test-3"), 6, "../../");
  EXPECT_THAT(parse_run(json, "", "here").error().message(), HasSubstr("name is a path"));
}

TEST(RunFile, ASliceOfAnotherSizeIsRefused) {
  std::string json = run_json(some_run(), "");
  json.replace(json.find("\"width\": 2"), 10, "\"width\": 7");
  EXPECT_THAT(parse_run(json, "", "here").error().message(), HasSubstr("slice"));
}

TEST(RunFile, AFolderWithoutItsPictureIsRefused) {
  const test::TempFolder temp;
  ASSERT_TRUE(write_run(some_run(), "", temp / "run").ok());
  std::filesystem::remove(temp / "run" / "test-3.png");
  EXPECT_FALSE(read_run(temp / "run", "").ok());
}

}  // namespace
}  // namespace emberlock::paper
