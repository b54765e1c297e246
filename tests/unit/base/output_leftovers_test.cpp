// SPDX-License-Identifier: Apache-2.0
// What stands beside an output folder's target, and what keeps a finished result from getting its name.
#include "base/output_leftovers.h"

#include <atomic>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <sched.h>
#include <sys/file.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "base/output_folder.h"
#include "tests/support/temp_folder.h"
#include "tests/support/wait.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;

void put(const fs::path& path, std::string_view text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

class OutputLeftovers : public testing::Test {
 protected:
  [[nodiscard]] OutputRequest request() const { return {out_, {"render"}}; }
  [[nodiscard]] Status make(std::string_view text) const {
    EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request()));
    put(folder.path() / "report.json", text);
    return folder.commit();
  }
  [[nodiscard]] static std::string report_in(const fs::path& folder) {
    const auto text = read_file(folder / "report.json");
    return text ? *text : text.error().message();
  }
  test::TempFolder folder_;
  const fs::path& root_ = folder_.path();
  const fs::path out_ = root_ / "out";
};

TEST_F(OutputLeftovers, KilledBetweenBothRenamesTheEarlierResultComesBackThoughItsNameIsAnEmptyFolders) {
  ASSERT_TRUE(make("first").ok());
  const fs::path first = root_ / "first";
  fs::rename(out_, first);
  ASSERT_TRUE(make("second").ok());
  fs::rename(out_, root_ / ".out.emberlock-00000001");
  fs::rename(first, earlier_of(out_));
  fs::create_directory(out_);
  ASSERT_TRUE(OutputFolder::check(request()).ok());
  EXPECT_EQ(report_in(out_), "first");
  EXPECT_FALSE(is_there(earlier_of(out_)));
}

TEST_F(OutputLeftovers, WhatHasTheNameThatAnEarlierResultNeedsIsSaidBeforeTheWork) {
  ASSERT_TRUE(make("first").ok());
  put(earlier_of(out_) / "notes.txt", "mine");
  const Status refused = OutputFolder::check(request());
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
  EXPECT_EQ(refused.error().where, earlier_of(out_).string());
  EXPECT_TRUE(fs::exists(earlier_of(out_) / "notes.txt"));
}

/// Access modes of this process's file descriptors on `path`.
std::vector<int> open_modes(const fs::path& path) {
  std::vector<int> modes;
  for (const auto& fd : fs::directory_iterator("/proc/self/fd")) {
    std::error_code ec;
    if (fs::read_symlink(fd.path(), ec) == path && !ec)
      modes.push_back(::fcntl(std::stoi(fd.path().filename()), F_GETFL) & O_ACCMODE);
  }
  return modes;
}

TEST_F(OutputLeftovers, TheListIsLockedByAFileOpenForWritingWhichNfsAsksFor) {
  auto folder = OutputFolder::create(request());
  ASSERT_TRUE(folder.ok());
  EXPECT_THAT(open_modes(fs::canonical(folder->path()) / kResultList), testing::ElementsAre(O_RDWR));
  EXPECT_FALSE(lock_list(folder->path())) << "somebody fills it";
}

TEST_F(OutputLeftovers, WhoFindsTheFolderLockedWaitsAndSaysSoInTheEnd) {
  auto held = lock_folder(root_);
  ASSERT_TRUE(held.ok());
  const auto refused = lock_folder(root_, Seconds(0.1));
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().where, root_.string());
  EXPECT_FALSE(refused.error().remedy.empty());

  std::atomic<bool> released = false;
  std::thread other([&] {
    EXPECT_TRUE(test::wait_until([&] { return open_modes(fs::canonical(root_)).size() == 2; }));
    released = true;
    const UniqueFd let_go = std::move(held).value();
  });
  EXPECT_TRUE(lock_folder(root_, Seconds(60)).ok());
  EXPECT_TRUE(released);
  other.join();
}

#if EMBERLOCK_MAY_MOUNT  // else these tests aren't built, which CMake says
constexpr int kNotAllowed = 77;

/// The exit status of a child that runs `act` where it may mount what it likes: 0 if no expectation failed.
template <class Act>
int among_own_mounts(const Act& act) {
  const pid_t child = ::fork();
  if (child == 0) {
    if (::unshare(::geteuid() == 0 ? CLONE_NEWNS : CLONE_NEWUSER | CLONE_NEWNS) != 0 ||
        ::mount(nullptr, "/", nullptr, MS_REC | MS_PRIVATE, nullptr) != 0)
      ::_exit(kNotAllowed);
    act();
    std::fflush(nullptr);
    ::_exit(testing::Test::HasFailure() ? 1 : 0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

TEST_F(OutputLeftovers, AMountedTargetIsRefusedBeforeTheWork) {
  const int status = among_own_mounts([&] {
    for (const char* kind : {"disk", "folder"}) {
      fs::create_directories(out_);
      fs::create_directories(root_ / "data");
      ASSERT_EQ(kind == std::string("disk")
                    ? ::mount("none", out_.c_str(), "tmpfs", 0, nullptr)
                    : ::mount((root_ / "data").c_str(), out_.c_str(), nullptr, MS_BIND, nullptr),
                0);
      const Status refused = OutputFolder::check(request());
      ASSERT_FALSE(refused.ok()) << kind;
      EXPECT_EQ(refused.error().kind, ErrorKind::bad_input);
      EXPECT_EQ(refused.error().where, out_.string());
      EXPECT_TRUE(OutputFolder::check({out_ / "result", {"render"}}).ok());
      ::umount(out_.c_str());
    }
  });
  EXPECT_EQ(status, 0);
}

TEST_F(OutputLeftovers, AFinishedResultThatCannotGetItsNameStaysBesideIt) {
  const int status = among_own_mounts([&] {
    for (const std::string earlier : {"", "first"}) {
      ASSERT_TRUE(earlier.empty() || make(earlier).ok());
      auto folder = OutputFolder::create(request());
      ASSERT_TRUE(folder.ok());
      put(folder->path() / "report.json", "second");
      fs::create_directories(out_);  // and now it's mounted
      ASSERT_EQ(::mount(out_.c_str(), out_.c_str(), nullptr, MS_BIND, nullptr), 0);
      const Status failed = folder->commit();
      ASSERT_FALSE(failed.ok());
      EXPECT_EQ(report_in(root_ / "out.new"), "second") << failed.error().message();
      EXPECT_THAT(failed.error().what, testing::HasSubstr((root_ / "out.new").string()));
      EXPECT_TRUE(fs::exists(root_ / "out.new" / kResultList));
      EXPECT_TRUE(earlier.empty() || report_in(out_) == earlier);
      ::umount(out_.c_str());
      fs::remove_all(out_);
      fs::remove_all(root_ / "out.new");
    }
  });
  EXPECT_EQ(status, 0);
}
#endif

}  // namespace
}  // namespace emberlock
