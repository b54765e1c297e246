// SPDX-License-Identifier: Apache-2.0
#include "base/file.h"

#include <fstream>
#include <map>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>

#include "base/kind_of_file.h"
#include "base/sha256.h"
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

/// Opening a pipe waits for a writer: each of these must be refused before.
TEST_F(FileTest, OnlyRegularFilesAreOpened) {
  put(root_ / "file", "x");
  ASSERT_EQ(::mkfifo((root_ / "pipe").c_str(), 0600), 0);
  fs::create_symlink("pipe", root_ / "link to a pipe");
  fs::create_symlink("file", root_ / "link to a file");
  const UniqueFd socket(::socket(AF_UNIX, SOCK_STREAM, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  (root_ / "socket").string().copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  for (const fs::path& path : {root_ / "file", root_ / "link to a file"}) {
    EXPECT_TRUE(check_regular_file(path).ok()) << path;
    EXPECT_TRUE(read_file(path).ok()) << path;
    EXPECT_TRUE(hash_file(path).ok()) << path;
  }
  for (const fs::path& path : {root_ / "pipe", root_ / "link to a pipe", root_ / "socket", root_,
                               fs::path("/dev/zero"), root_ / "absent"}) {
    EXPECT_EQ(check_regular_file(path).error().kind, ErrorKind::bad_input) << path;
    EXPECT_THAT(read_file(path).error().message(), HasSubstr(path.string()));
    EXPECT_FALSE(open_regular_file(path).ok()) << path;
    EXPECT_FALSE(hash_file(path).ok()) << path;
  }
}

TEST_F(FileTest, AnExtensionIsReadInAnyLetters) {
  for (const auto& [name, extension] : std::map<fs::path, std::string>{
           {"a.GLB", ".glb"}, {"a.Json", ".json"}, {"a.b.VDB", ".vdb"}, {"A", ""}, {".EXR", ""}, {"a.", "."}})
    EXPECT_EQ(lower_extension(name), extension) << name;
}

TEST_F(FileTest, WritingIntoAnAbsentFolderSaysSo) {
  const auto s = write_file_atomically(root_ / "no" / "such" / "file", "x");
  ASSERT_FALSE(s.ok());
  EXPECT_EQ(s.error().kind, ErrorKind::io);
}

}  // namespace
}  // namespace emberlock
