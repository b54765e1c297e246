// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <functional>
#include <iterator>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "cli/commands.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {

namespace fs = std::filesystem;
using test::put_bytes;

/// What is refused before a frame is written leaves nothing, and no folder on the way to it.
TEST(ImportCommand, ARefusalLeavesNothing) {
  const std::vector<std::function<void(const fs::path&)>> folders{
      [](const fs::path&) {},
      [](const fs::path& f) { put_bytes(f / "notes.txt", "no film"); },
      [](const fs::path& f) { put_bytes(f / "a.mp4", "no film"); },
      [](const fs::path& f) { put_bytes(f / "a.mp4", ""); },
      [](const fs::path& f) { (void)::mkfifo((f / "a.mp4").c_str(), 0600); },
      [](const fs::path& f) { put_bytes(f / "transforms.json", "{"); },
      [](const fs::path& f) { put_bytes(f / "transforms.json", R"({"frames": []})"); },
      [](const fs::path& f) { fs::create_directory(f / "camera"); }};
  for (std::size_t i = 0; i < folders.size(); ++i)
    for (const std::vector<std::string>& options :
         {std::vector<std::string>{}, {"--unsynchronised"}, {"--partial", "--unsynchronised"}}) {
      const test::TempFolder temp;
      fs::create_directory(temp / "films");
      folders[i](temp / "films");
      for (const char* out : {"take", "new/folder/take"}) {
        std::vector<std::string> words{"import", (temp / "films").string(), "--out", (temp / out).string()};
        words.insert(words.end(), options.begin(), options.end());
        const auto result = test::run_verb(add_import, words);
        EXPECT_EQ(result.exit_code, 2) << i << result.err;
        EXPECT_EQ(std::distance(fs::directory_iterator(temp.path()), fs::directory_iterator()), 1)
            << i << ' ' << out;
      }
    }
}

}  // namespace
}  // namespace emberlock::cli
