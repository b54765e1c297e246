// SPDX-License-Identifier: Apache-2.0
// A run.json is read, by which an interrupted evaluation continues. The corpus and every cut and flipped byte
// of it are parsed: each is an error that names its file, or a run that is written and read again unchanged.
#include <cstddef>
#include <filesystem>
#include <random>
#include <string>

#include <gtest/gtest.h>

#include "base/file.h"
#include "paper/run_file.h"

namespace emberlock::paper {
namespace {

/// Whether `text` is a run.
bool check_run(const std::string& text) {
  const auto run = parse_run(text, "fuzz", "fuzz/run.json");
  if (!run) {
    EXPECT_NE(run.error().where, "") << text;
    return false;
  }
  const std::string json = run_json(*run, "fuzz");
  const auto again = parse_run(json, "fuzz", "fuzz/run.json");
  EXPECT_TRUE(again) << json;
  if (again) EXPECT_EQ(run_json(*again, "fuzz"), json);
  EXPECT_NE(folder_name(*run), "");
  return true;
}

TEST(RunCorpus, IsReadAndDamagedFilesAreRefusedOrReadAgain) {
  std::mt19937 random(1);
  int files = 0;
  for (const auto& entry : std::filesystem::directory_iterator(EMBERLOCK_SOURCE_DIR "/paper/tests/corpus")) {
    ++files;
    const std::string text = read_file(entry.path()).value();
    EXPECT_TRUE(check_run(text)) << entry.path();
    for (std::size_t at = 0; at < text.size(); ++at) {
      check_run(text.substr(0, at));
      std::string damaged = text;
      damaged[at] = static_cast<char>(random());
      check_run(damaged);
    }
  }
  EXPECT_GT(files, 0);
}

}  // namespace
}  // namespace emberlock::paper
