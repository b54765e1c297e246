// SPDX-License-Identifier: Apache-2.0
#include "base/output_folder.h"

#include <array>
#include <chrono>
#include <fstream>
#include <map>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sys/ptrace.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "base/file.h"
#include "tests/support/temp_folder.h"

namespace emberlock {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

constexpr OutputVerb kVerb{"render"};
constexpr std::array<std::string_view, 1> kBesideIt{"render"};
constexpr OutputVerb kLabels{"label", kBesideIt};

using Files = std::map<std::string, std::string>;  // contents by path

void write(const fs::path& path, std::string_view text) {
  fs::create_directories(path.parent_path());
  std::ofstream(path) << text;
}

/// Everything below a folder but the list; symlinks by what they name.
Files files_in(const fs::path& folder) {
  Files files;
  if (!fs::exists(folder)) return files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder).string();
    if (name == kResultList) continue;
    if (entry.is_symlink()) {
      files[name] = "-> " + fs::read_symlink(entry.path()).string();
    } else if (entry.is_regular_file()) {
      files[name] = *read_file(entry.path());
    } else if (entry.is_directory() && fs::is_empty(entry.path())) {
      files[name + "/"] = "";
    }
  }
  return files;
}

/// A run of a verb: fills its folder and commits.
Status make(const OutputRequest& request, const Files& files) {
  EMBERLOCK_ASSIGN_OR_RETURN(OutputFolder folder, OutputFolder::create(request));
  for (const auto& [name, text] : files) write(folder.path() / name, text);
  return folder.commit();
}

const Files kFirst{{"report.json", "first"}, {"views/0.png", "a"}, {"views/1.png", "b"}};
const Files kSecond{{"report.json", "second"}, {"views/0.png", "c"}};

class OutputFolderTest : public testing::Test {
 protected:
  [[nodiscard]] OutputRequest request() const { return {out_, kVerb}; }
  void make_first() const {
    const Status made = make(request(), kFirst);
    ASSERT_TRUE(made.ok()) << made.error().message();
  }
  [[nodiscard]] std::size_t beside() const {  // nothing hidden is left
    return static_cast<std::size_t>(std::distance(fs::directory_iterator(root_), {}));
  }
  /// The second run is refused, by create() as by check(), and nothing changed.
  void expect_refused(const OutputRequest& asked, const std::string& words) const {
    const Files before = files_in(root_);
    for (const Status& status : {OutputFolder::check(asked), make(asked, kSecond)}) {
      ASSERT_FALSE(status.ok()) << words;
      EXPECT_EQ(status.error().kind, ErrorKind::bad_input);
      EXPECT_THAT(status.error().message(), HasSubstr(words));
      EXPECT_THAT(status.error().remedy, Not(testing::IsEmpty()));
    }
    EXPECT_EQ(files_in(root_), before);
  }
  test::TempFolder folder_;  // in memory, as there is much to flush
  const fs::path& root_ = folder_.path();
  const fs::path out_ = root_ / "out";
};

TEST_F(OutputFolderTest, AppearsWhenItIsCommittedAndNotBefore) {
  auto folder = OutputFolder::create(request());
  ASSERT_TRUE(folder.ok());
  write(folder->path() / "report.json", "first");
  EXPECT_FALSE(fs::exists(out_));
  ASSERT_TRUE(folder->commit().ok());
  EXPECT_EQ(files_in(out_), (Files{{"report.json", "first"}}));
  EXPECT_EQ(beside(), 1U);
}

/// A copy has other times: files are compared by what they hold.
TEST_F(OutputFolderTest, ACopyIsAnEarlierResultAsTheOriginalIs) {
  make_first();
  for (const auto& [name, text] : kFirst) {
    const fs::path file = out_ / name;
    fs::last_write_time(file, fs::last_write_time(file) + std::chrono::hours(1));
    EXPECT_TRUE(OutputFolder::check(request()).ok()) << name;
  }
  for (const auto& [name, text] : kFirst) {
    std::string other = text;
    other.back() = 'z';
    write(out_ / name, other);
    expect_refused(request(), name + ": was changed since Emberlock made it");
    write(out_ / name, text);
  }
  const Status made = make(request(), kSecond);
  ASSERT_TRUE(made.ok()) << made.error().message();
  EXPECT_EQ(files_in(out_), kSecond);
}

/// As earlier versions wrote it.
TEST_F(OutputFolderTest, AListWithoutHashesComparesTimes) {
  make_first();
  std::string list = *read_file(out_ / kResultList);
  for (std::size_t at = list.find(",\n   \"sha256\""); at != std::string::npos;
       at = list.find(",\n   \"sha256\""))
    list.erase(at, list.find('\n', at + 2) - at);
  ASSERT_EQ(list.find("sha256"), std::string::npos);
  write(out_ / kResultList, list);
  EXPECT_TRUE(OutputFolder::check(request()).ok());
  fs::last_write_time(out_ / "report.json", fs::file_time_type::clock::now() + std::chrono::hours(1));
  expect_refused(request(), "has another size or time than in the list");
}

TEST_F(OutputFolderTest, AbandonedItLeavesNothing) {
  {
    auto folder = OutputFolder::create(request());
    ASSERT_TRUE(folder.ok());
    write(folder->path() / "half", "x");
  }
  EXPECT_TRUE(OutputFolder::check(request()).ok());
  EXPECT_TRUE(OutputFolder::check({root_ / "a" / "b" / "c", kVerb}).ok());
  EXPECT_FALSE(OutputFolder::check({root_ / "a" / "b", kVerb, {root_}}).ok());
  EXPECT_TRUE(fs::is_empty(root_)) << "nor the parents that it made";
  ASSERT_TRUE(make({root_ / "a" / "b" / "c", kVerb}, kFirst).ok());
  EXPECT_EQ(files_in(root_ / "a" / "b" / "c"), kFirst);
}

TEST_F(OutputFolderTest, AnEmptyFolderIsFilledWithItsModeKept) {
  const fs::perms asked = fs::perms::owner_all | fs::perms::group_read | fs::perms::set_gid;
  fs::create_directories(out_);
  fs::permissions(out_, asked);
  make_first();
  EXPECT_EQ(files_in(out_), kFirst);
  EXPECT_EQ(fs::status(out_).permissions(), asked);
  fs::permissions(out_, fs::perms::owner_all);
  ASSERT_TRUE(make(request(), kSecond).ok());
  EXPECT_EQ(fs::status(out_).permissions(), fs::perms::owner_all);
}

TEST_F(OutputFolderTest, OfAnEarlierResultOnlyItsOwnFilesGo) {
  make_first();
  write(out_ / "notes.txt", "mine");
  write(out_ / "views" / "best.txt", "mine too");
  fs::create_directories(out_ / "empty");
  fs::create_symlink("/etc", out_ / "etc");
  for (const Replace how : {Replace::at_once, Replace::in_two_steps}) {
    OutputRequest again = request();
    again.replace = how;
    const Status made = make(again, kSecond);
    ASSERT_TRUE(made.ok()) << made.error().message();
    Files expected = kSecond;
    expected.insert(
        {{"notes.txt", "mine"}, {"views/best.txt", "mine too"}, {"empty/", ""}, {"etc", "-> /etc"}});
    EXPECT_EQ(files_in(out_), expected);
    EXPECT_EQ(beside(), 1U);
  }
}

TEST_F(OutputFolderTest, AFolderWithoutAListIsNotTouched) {
  write(out_ / "report.json", "by a former version, or by anybody");
  expect_refused(request(), kResultList);
  write(out_ / kResultList, R"({"format": "somebody's", "version": 1, "files": []})");
  expect_refused(request(), kResultList);
  write(out_ / kResultList, std::string(100'000, '['));
  expect_refused(request(), kResultList);
  write(out_ / kResultList,
        R"({"format": "emberlock result", "version": 1, "files": [{"path": "../out/report.json",)"
        R"( "verb": "render", "bytes": 1, "modified_ns": 1}]})");
  expect_refused(request(), kResultList);
  fs::remove_all(out_);
  write(out_, "a file");
  expect_refused(request(), "no folder");
}

TEST_F(OutputFolderTest, AListBehindASymlinkIsNone) {
  make_first();
  fs::rename(out_ / kResultList, root_ / "list");
  fs::create_symlink(root_ / "list", out_ / kResultList);
  expect_refused(request(), kResultList);
}

TEST_F(OutputFolderTest, WhatWasChangedSinceIsNotReplaced) {
  make_first();
  write(out_ / "report.json", "first, and what I think of it");
  expect_refused(request(), "report.json");
  fs::remove(out_ / "report.json");
  fs::create_symlink(root_ / "elsewhere", out_ / "report.json");
  expect_refused(request(), "report.json");
  fs::remove(out_ / "report.json");
  EXPECT_TRUE(make(request(), kSecond).ok()) << "what the user removed isn't missed";
}

TEST_F(OutputFolderTest, AFolderThatBecameASymlinkIsNotFollowed) {
  make_first();
  fs::rename(out_ / "views", root_ / "album");
  fs::create_symlink(root_ / "album", out_ / "views");
  expect_refused(request(), "views");
  EXPECT_EQ(files_in(root_ / "album").size(), 2U);
}

TEST_F(OutputFolderTest, AnotherVerbsResultIsNotReplaced) {
  make_first();
  OutputRequest other = request();
  other.verb = {"sweep"};
  expect_refused(other, "`emberlock render`");
}

TEST_F(OutputFolderTest, AVerbThatLiesBesideKeepsTheOthersFilesAndMayWriteThemAnew) {
  make_first();
  OutputRequest labels = request();
  labels.verb = kLabels;
  ASSERT_TRUE(make(labels, {{"report.json", "labelled"}, {"labels.txt", "l"}}).ok());
  Files expected = kFirst;
  expected["report.json"] = "labelled";
  expected["labels.txt"] = "l";
  EXPECT_EQ(files_in(out_), expected);
  ASSERT_TRUE(make(labels, {{"labels.txt", "m"}}).ok());
  expected.erase("report.json");
  expected["labels.txt"] = "m";
  EXPECT_EQ(files_in(out_), expected) << "its own files go, the other verb's stay";
  expect_refused(request(), "`emberlock label`");
}

TEST_F(OutputFolderTest, ANewNameThatSomebodyElseHasLeavesBothWhole) {
  make_first();
  write(out_ / "views" / "2.png", "my own");
  Files expected = kFirst;
  expected["views/2.png"] = "my own";
  for (const char* name : {"out.new", "out.new-2"}) {
    const Status made = make(request(), {{"report.json", "second"}, {"views/2.png", "c"}});
    ASSERT_FALSE(made.ok());
    EXPECT_THAT(made.error().message(), HasSubstr("views/2.png"));
    EXPECT_THAT(made.error().message(), HasSubstr(name));
    EXPECT_EQ(files_in(out_), expected);
    EXPECT_EQ(files_in(root_ / name), (Files{{"report.json", "second"}, {"views/2.png", "c"}}));
  }
}

TEST_F(OutputFolderTest, WhatComesWhileItIsFilledIsKept) {
  make_first();
  auto folder = OutputFolder::create(request());
  ASSERT_TRUE(folder.ok());
  write(folder->path() / "report.json", "second");
  write(out_ / "notes.txt", "mine");
  ASSERT_TRUE(folder->commit().ok());
  EXPECT_EQ(files_in(out_), (Files{{"report.json", "second"}, {"notes.txt", "mine"}}));

  auto late = OutputFolder::create({root_ / "fresh", kVerb});
  ASSERT_TRUE(late.ok());
  write(late->path() / "report.json", "third");
  write(root_ / "fresh" / "photo.jpg", "mine");
  const Status refused = late->commit();
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(files_in(root_ / "fresh"), (Files{{"photo.jpg", "mine"}}));
  EXPECT_EQ(files_in(root_ / "fresh.new"), (Files{{"report.json", "third"}}));
}

TEST_F(OutputFolderTest, AnInputInTheOutputIsRefusedWhateverItsPathLooksLike) {
  make_first();
  write(out_ / "pictures" / "0.png", "input");
  fs::create_directory_symlink(out_, root_ / "link");
  fs::create_directory_symlink(out_ / "pictures", root_ / "album");
  for (const fs::path& input :
       {out_ / "pictures" / "0.png", out_ / "pictures", root_ / "link" / "pictures" / "0.png",
        root_ / "album" / "0.png", out_ / ".." / "out" / "pictures", fs::relative(out_ / "pictures")}) {
    for (const fs::path& target : {out_, root_ / "link", out_ / "", fs::relative(out_)}) {
      OutputRequest asked{target, kVerb, {input}};
      expect_refused(asked, "lies in the folder that is to be written");
    }
  }
  expect_refused({out_, kVerb, {out_}}, "lies in the folder");
}

TEST_F(OutputFolderTest, AnOutputInAnInputFolderIsRefusedAndBesideAnInputFileIsNot) {
  write(root_ / "project" / "transforms.json", "{}");
  fs::create_directory_symlink(root_ / "project", root_ / "link");
  expect_refused({root_ / "project" / "result", kVerb, {root_ / "link"}}, "lies in a folder that is read");
  expect_refused({root_ / "link" / "a" / "b", kVerb, {root_ / "project"}}, "lies in a folder that is read");
  EXPECT_TRUE(
      make({root_ / "project" / "result", kVerb, {root_ / "project" / "transforms.json"}}, kFirst).ok());
}

TEST_F(OutputFolderTest, AFileThatIsWrittenAnewMayBeRead) {
  make_first();
  OutputRequest labels{out_, kLabels, {}, {out_ / "report.json"}};
  EXPECT_TRUE(make(labels, {{"report.json", "labelled"}}).ok());
  write(out_ / "own.json", "x");
  labels.updated = {out_ / "own.json"};
  expect_refused(labels, "lies in the folder that is to be written");
}

TEST_F(OutputFolderTest, WhatAKilledRunLeftIsClearedAwayByTheNextAndNothingElse) {
  make_first();
  const pid_t child = ::fork();
  if (child == 0) {
    auto folder = OutputFolder::create(request());
    if (folder.ok()) write(folder->path() / "half", "x");
    ::_exit(0);  // without destructors, as when killed
  }
  int status = 0;
  ASSERT_EQ(::waitpid(child, &status, 0), child);
  EXPECT_EQ(beside(), 2U);
  write(root_ / ".out.emberlock-mine" / "x", "not by Emberlock");
  auto alive = OutputFolder::create(request());
  ASSERT_TRUE(alive.ok());
  ASSERT_TRUE(make(request(), kSecond).ok());
  EXPECT_TRUE(fs::exists(alive->path())) << "another run fills it";
  EXPECT_TRUE(fs::exists(root_ / ".out.emberlock-mine" / "x"));
  EXPECT_EQ(beside(), 3U);
}

/// Runs `act` in a child that is killed before its system call number `last`; false once it ends by itself.
template <class Act>
bool killed_at_call(int last, const Act& act) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::ptrace(PTRACE_TRACEME, 0, nullptr, nullptr);
    ::raise(SIGSTOP);
    act();
    ::_exit(0);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ::ptrace(PTRACE_SETOPTIONS, child, nullptr, PTRACE_O_TRACESYSGOOD | PTRACE_O_EXITKILL);
  for (int stops = 0; stops < 2 * last;) {  // one stop as a call begins, one as it ends
    ::ptrace(PTRACE_SYSCALL, child, nullptr, nullptr);
    if (::waitpid(child, &status, 0) != child || WIFEXITED(status) || WIFSIGNALED(status)) return false;
    if (WIFSTOPPED(status) && WSTOPSIG(status) == (SIGTRAP | 0x80)) ++stops;
  }
  ::kill(child, SIGKILL);
  ::waitpid(child, &status, 0);
  return true;
}

using OutputFolderSlow = OutputFolderTest;

TEST_F(OutputFolderSlow, KilledAtAnySystemCallOneResultStandsWholeAndNothingForeignIsLost) {
  const Files foreign{{"notes.txt", "mine"}, {"views/best.txt", "mine too"}, {"empty/", ""}};
  Files first = kFirst;
  first.insert(foreign.begin(), foreign.end());
  Files second = kSecond;
  second.insert(foreign.begin(), foreign.end());
  for (const Replace how : {Replace::at_once, Replace::in_two_steps}) {
    OutputRequest asked = request();
    asked.replace = how;
    int old_stood = 0;
    int new_stood = 0;
    for (int call = 1;; ++call) {
      fs::remove_all(root_);
      make_first();
      write(out_ / "notes.txt", "mine");
      write(out_ / "views" / "best.txt", "mine too");
      fs::create_directories(out_ / "empty");
      const bool killed = killed_at_call(call, [&] { static_cast<void>(make(asked, kSecond)); });
      // Without exchange the earlier result may stand under its other name.
      const fs::path stands =
          how == Replace::in_two_steps && !fs::exists(out_) ? root_ / "out.emberlock-earlier" : out_;
      const Files found = files_in(stands);
      ASSERT_TRUE(found == first || found == second) << "killed before call " << call;
      ++(found == first ? old_stood : new_stood);
      const Status next = make(asked, kSecond);
      ASSERT_TRUE(next.ok()) << "killed before call " << call << ": " << next.error().message();
      ASSERT_EQ(files_in(out_), second) << "killed before call " << call;
      ASSERT_EQ(beside(), 1U) << "killed before call " << call;
      if (!killed) break;
    }
    EXPECT_GT(old_stood, 50);
    EXPECT_GT(new_stood, 5);
  }
}

TEST_F(OutputFolderTest, RemovesOursAndNeverThroughASymlink) {
  write(root_ / "album" / "a.png", "mine");
  write(out_ / "a.png", "ours");
  write(out_ / "deep" / "b.png", "ours");
  fs::create_directory_symlink(root_ / "album", out_ / "album");
  const auto pngs = [](const std::string& path, const struct stat&) { return path.ends_with(".png"); };
  EXPECT_FALSE(remove_ours(out_, pngs));
  EXPECT_EQ(files_in(out_), (Files{{"album", "-> " + (root_ / "album").string()}}));
  EXPECT_EQ(files_in(root_ / "album").size(), 1U);
  fs::remove(out_ / "album");
  EXPECT_TRUE(remove_ours(out_, pngs));
  EXPECT_FALSE(fs::exists(out_));
}

}  // namespace
}  // namespace emberlock
