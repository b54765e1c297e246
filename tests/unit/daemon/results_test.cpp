// SPDX-License-Identifier: Apache-2.0
#include "daemon/ar/results.h"

#include <fstream>

#include <gtest/gtest.h>

#include "tests/support/recording.h"

namespace emberlock::daemon {
namespace {
namespace fs = std::filesystem;

class ResultsTest : public testing::Test {
 protected:
  void put(const std::string& folder) const {
    fs::create_directories(temp_ / folder);
    std::ofstream(temp_ / folder / "volume.vdb") << "a volume";
  }
  [[nodiscard]] Result<fs::path> find(const std::string& session, const std::string& result) const {
    return find_result(temp_.path(), session, result);
  }
  test::TempFolder temp_;
};

TEST_F(ResultsTest, ThoseOfReconstructionsAreListedByFrame) {
  put("candle/frame-100");
  put("candle/frame-9");
  put("candle/middle-frame");
  put("candle/kept by hand");
  put("candle/frame-007");
  put(".hidden/frame-1");
  fs::create_directories(temp_ / "candle/frame-3");  // without a volume
  fs::create_directories(temp_ / "empty");
  const v1::ListResultsResponse all = list_results(temp_.path());
  ASSERT_EQ(all.results_size(), 1);
  EXPECT_EQ(all.results(0).session(), "candle");
  EXPECT_TRUE(all.results(0).middle_frame());
  EXPECT_EQ(std::vector<std::uint64_t>(all.results(0).frames().begin(), all.results(0).frames().end()),
            (std::vector<std::uint64_t>{9, 100}));
  EXPECT_EQ(list_results(temp_ / "nowhere").results_size(), 0);
}

TEST_F(ResultsTest, TheNewestSessionIsFirst) {
  put("old/frame-1");
  put("new/frame-1");
  fs::last_write_time(temp_ / "old/frame-1", fs::file_time_type::clock::now() - std::chrono::hours(1));
  EXPECT_EQ(list_results(temp_.path()).results(0).session(), "new");
}

TEST_F(ResultsTest, WhatIsListedIsFoundAndNothingElse) {
  put("candle/frame-9");
  put("candle/elsewhere");
  put("elsewhere");
  fs::create_directory_symlink(temp_ / "elsewhere", temp_ / "candle/frame-5");
  fs::create_directory_symlink(temp_ / "candle", temp_ / "linked");
  EXPECT_EQ(find("candle", "frame-9").value(), temp_ / "candle/frame-9");
  EXPECT_EQ(find("candle", "").value(), temp_ / "candle");
  for (const auto& [session, result] :
       std::initializer_list<std::pair<const char*, const char*>>{{"candle", "frame-5"},
                                                                  {"candle", "middle-frame"},
                                                                  {"candle", "elsewhere"},
                                                                  {"candle", "frame-09"},
                                                                  {"candle", "../elsewhere"},
                                                                  {"candle", "frame-9/../../elsewhere"},
                                                                  {"candle/..", "frame-9"},
                                                                  {"..", ""},
                                                                  {"", ""},
                                                                  {"/", "etc"},
                                                                  {"linked", "frame-9"},
                                                                  {"other", "frame-9"}})
    EXPECT_EQ(find(session, result).error().kind, ErrorKind::bad_input) << session << " " << result;
}

}  // namespace
}  // namespace emberlock::daemon
