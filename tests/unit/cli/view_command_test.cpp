// SPDX-License-Identifier: Apache-2.0
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>

#include <gmock/gmock.h>

#include "base/file.h"
#include "cli/commands.h"
#include "cli/viewer_file.h"
#include "recon/export/volume_file.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;

/// A result's folder, and a browser that notes what it was told to open.
class ViewCommandTest : public testing::Test {
 protected:
  void SetUp() override {
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

  const test::TempFolder root_;
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

/// A volume of one bright key point.
void write_point(const fs::path& folder) {
  recon::Volume volume;
  volume.grid = {{0, 0, 0}, 0.01F, 5, 6, 7};
  volume.emission.resize(3 * volume.grid.size());
  volume.emission[3 * volume.grid.index(2, 2, 2)] = 100;
  fs::create_directories(folder);
  ASSERT_TRUE(recon::write_volume(volume, folder / "volume.vdb").ok());
}

class ViewVolumeTest : public ViewCommandTest {
 protected:
  void SetUp() override {
    ViewCommandTest::SetUp();
    if (!viewer_program().ok()) GTEST_SKIP() << "the viewer isn't built: that needs node and npm";
    write_point(root_ / "result");
  }
};

TEST_F(ViewVolumeTest, OfAVolumeItMakesThePageAndOpensIt) {
  const fs::path page = root_ / "result" / "view.html";
  for (const fs::path& what : {root_ / "result", root_ / "result" / "volume.vdb"}) {
    const test::VerbRun run = view(what);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_EQ(run.out, page.string() + "\n");
    EXPECT_THAT(run.err, HasSubstr("no cameras are shown"));
    EXPECT_EQ(read_file(root_ / "opened").value(), page.string());
    EXPECT_THAT(read_file(page).value(), HasSubstr(R"("points":[5,6,7])"));
    fs::remove(page);
  }
}

TEST_F(ViewVolumeTest, IntoAFileItOpensNothing) {
  const fs::path page = root_ / "page.html";
  const test::VerbRun run =
      test::run_verb(add_view, {"view", (root_ / "result").string(), "--float32", "--out", page.string()});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(read_file(page).value(), HasSubstr(R"("type":"float32")"));
  EXPECT_FALSE(fs::exists(root_ / "opened"));
  EXPECT_FALSE(fs::exists(root_ / "result" / "view.html"));
}

TEST_F(ViewVolumeTest, ASequenceIsInOnePageInItsOrder) {
  write_point(root_ / "all" / "frame-10");
  write_point(root_ / "all" / "frame-9");
  const test::VerbRun run = view(root_ / "all");
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::string html = read_file(root_ / "all" / "view.html").value();
  EXPECT_LT(html.find(R"("frame":9)"), html.find(R"("frame":10)"));
}

TEST_F(ViewVolumeTest, TheReportIsOpenedWhereItIsAskedFor) {
  const auto report = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"view", (root_ / "result").string(), "--report"};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_verb(add_view, words);
  };
  EXPECT_EQ(report({}).out, (root_ / "result" / "report.html").string() + "\n");
  EXPECT_EQ(report({"--out", (root_ / "x.html").string()}).exit_code, 2);
}

TEST_F(ViewVolumeTest, DamagedFilesAreErrorsThatNameThem) {
  const std::string whole = read_file(root_ / "result" / "volume.vdb").value();
  std::ofstream(root_ / "result" / "volume.vdb", std::ios::trunc) << whole.substr(0, whole.size() / 2);
  const test::VerbRun cut = view(root_ / "result");
  EXPECT_EQ(cut.exit_code, 2);
  EXPECT_THAT(cut.err, HasSubstr("volume.vdb"));
  write_point(root_ / "result");
  for (const char* told :
       {"[", R"({"trace": 3, "views": [7], "up": 5, "input": 1})",
        R"({"trace": [{"seconds": "x"}, 4], "views": {"role": []}, "input": "/nowhere"})"}) {
    std::ofstream(root_ / "result" / "report.json", std::ios::trunc) << told;
    const test::VerbRun run = view(root_ / "result");
    EXPECT_EQ(run.exit_code, 0) << run.err;
    EXPECT_THAT(run.err, HasSubstr("no cameras are shown"));
  }
}

}  // namespace
}  // namespace emberlock::cli
