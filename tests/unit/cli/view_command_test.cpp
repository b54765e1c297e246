// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>
#include <unistd.h>

#include "base/file.h"
#include "cli/commands.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// A result's folder, and a browser that notes what it was told to open.
class ViewCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    root_ = fs::temp_directory_path() / ("emberlock_view_test." + std::to_string(::getpid()));
    fs::create_directories(root_ / "result");
    std::ofstream(root_ / "result" / "report.html") << "<p>";
    set_browser("0");
    ::setenv("PATH", (root_.string() + ":" + path_).c_str(), 1);
    ::unsetenv("WAYLAND_DISPLAY");
    ::setenv("DISPLAY", ":77", 1);
  }
  void TearDown() override {
    ::setenv("PATH", path_.c_str(), 1);
    ::unsetenv("DISPLAY");
    fs::remove_all(root_);
  }
  void set_browser(const std::string& exit_code) const {
    const fs::path browser = root_ / "xdg-open";
    std::ofstream(browser) << "#!/bin/sh\nprintf %s \"$1\" > '" << (root_ / "opened").string() << "'\nexit "
                           << exit_code << "\n";
    fs::permissions(browser, fs::perms::owner_all);
  }
  [[nodiscard]] test::VerbRun view(const fs::path& what) const {
    return test::run_verb(add_view, {"view", what.string()});
  }

  fs::path root_;
  std::string path_ = std::getenv("PATH");  // NOLINT(concurrency-mt-unsafe): one thread
};

TEST_F(ViewCommandTest, OpensThePageInTheBrowser) {
  const fs::path page = root_ / "result" / "report.html";
  for (const fs::path& what : {root_ / "result", page}) {
    const test::VerbRun run = view(what);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, page.string() + "\n");
    EXPECT_EQ(read_file(root_ / "opened").value(), page.string());
    fs::remove(root_ / "opened");
  }
}

TEST_F(ViewCommandTest, WithoutADisplayItOnlySaysWhereThePageIs) {
  ::unsetenv("DISPLAY");
  const test::VerbRun run = view(root_ / "result");
  EXPECT_EQ(run.exit_code, 0);
  EXPECT_EQ(run.out, (root_ / "result" / "report.html").string() + "\n");
  EXPECT_FALSE(fs::exists(root_ / "opened"));
}

TEST_F(ViewCommandTest, ABrowserThatFailsAndAFolderWithoutAPageAreErrors) {
  set_browser("3");
  const test::VerbRun failed = view(root_ / "result");
  EXPECT_EQ(failed.exit_code, 1);
  EXPECT_THAT(failed.err, HasSubstr("Open this file in one"));
  EXPECT_EQ(view(root_).exit_code, 2);
  EXPECT_EQ(view(root_ / "nothing").exit_code, 2);
}

}  // namespace
}  // namespace emberlock::cli
