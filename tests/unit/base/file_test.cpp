// SPDX-License-Identifier: Apache-2.0
#include "base/file.h"

#include <fstream>

#include <gmock/gmock.h>

#include "tests/support/temp_folder.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

class FileTest : public testing::Test {
 protected:
  static void put(const fs::path& p, std::string_view text) { std::ofstream(p) << text; }
  test::TempFolder folder_;
  const fs::path& root_ = folder_.path();
};

TEST_F(FileTest, WhatWasWrittenIsRead) {
  const std::string content("two\0bytes", 9);
  ASSERT_TRUE(write_file_atomically(root_ / "a", content).ok());
  EXPECT_EQ(read_file(root_ / "a").value(), content);
  EXPECT_EQ(std::distance(fs::directory_iterator(root_), {}), 1) << "no partial file stays behind";
}

TEST_F(FileTest, AbsentFileIsNamed) {
  const auto r = read_file(root_ / "absent.json");
  ASSERT_FALSE(r.ok());
  EXPECT_EQ(r.error().kind, ErrorKind::bad_input);
  EXPECT_THAT(r.error().message(), HasSubstr("absent.json"));
}

TEST_F(FileTest, DirectoryAndOversizedFileAreRefused) {
  EXPECT_FALSE(read_file(root_).ok());
  put(root_ / "big", "0123456789");
  EXPECT_TRUE(read_file(root_ / "big", 10).ok());
  EXPECT_FALSE(read_file(root_ / "big", 9).ok());
}

TEST_F(FileTest, WritingIntoAnAbsentFolderSaysSo) {
  const auto s = write_file_atomically(root_ / "no" / "such" / "file", "x");
  ASSERT_FALSE(s.ok());
  EXPECT_EQ(s.error().kind, ErrorKind::io);
}

}  // namespace
}  // namespace emberlock
