// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "cli/commands.h"
#include "evaluate/error_law.h"
#include "recon/calibrate/rig.h"
#include "tests/support/temp_folder.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using nlohmann::json;
using testing::HasSubstr;
using testing::Not;

class DesignVerb : public testing::Test {
 protected:
  void SetUp() override {
    law_ = write("law.json", R"({"law": {"reach": 6, "spread": 0.1, "strength": {"views": 500, "pixels": 3e4,
                                "noise": 2, "exposure": 900, "sync": 5000, "rest": 3}}})");
  }

  [[nodiscard]] std::string write(const char* name, const std::string& text) const {
    std::ofstream(root_ / name) << text;
    return (root_ / name).string();
  }
  [[nodiscard]] test::VerbRun run(std::vector<std::string> more) const {
    std::vector<std::string> words{"design", "--law", law_, "--disk", root_.string()};
    words.insert(words.end(), more.begin(), more.end());
    return test::run_verb(add_design, words);
  }
  void expect_refused(std::vector<std::string> more, const std::string& words) const {
    const test::VerbRun result = run(std::move(more));
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, HasSubstr(words));
    EXPECT_EQ(result.out, "");
  }
  /// rig.json of cameras on half a circle, which look at (1, 0, 0).
  [[nodiscard]] std::string half_ring() const {
    v1::Rig rig = recon::empty_rig();
    const recon::Intrinsics lens{{320, 240}, 280, 280, 160, 120, {}};
    for (int i = 0; i < 6; ++i) {
      const double a = 0.3 * i;
      *rig.add_cameras() = recon::rig_camera_of(
          "cam" + std::to_string(i),
          recon::look_at(lens, Eigen::Vector3d(1 + std::cos(a), std::sin(a), 0), {1, 0, 0}));
    }
    EXPECT_TRUE(session::write_rig(root_ / "rig.json", rig).ok());
    return (root_ / "rig.json").string();
  }
  const test::TempFolder root_;
  std::string law_;
};

TEST_F(DesignVerb, SaysWhereCamerasStandAndWritesBothFiles) {
  const test::VerbRun result =
      run({"--flame", "0.16,2,1800", "--target-error", "60", "--out", (root_ / "out").string(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(result.out);
  EXPECT_TRUE(report["reached"].get<bool>());
  EXPECT_LE(report["chosen"]["error"].get<double>(), 60);
  EXPECT_EQ(report["cameras"].size(), report["chosen"]["cameras"].get<std::size_t>());
  EXPECT_GE(report["recording"]["disks"].get<int>(), report["recording"]["hosts"].get<int>());
  EXPECT_GT(report["machines"][0]["minutes"].get<double>(), 0);
  EXPECT_EQ(json::parse(*read_file(root_ / "out" / "report.json")), report);
  const std::string page = *read_file(root_ / "out" / "report.html");
  EXPECT_THAT(page, HasSubstr("What the next step buys"));
  EXPECT_THAT(page, Not(HasSubstr("nan")));
  const test::VerbRun again =
      test::run_verb(add_design, {"design", "--flame", "0.16,2,1800", "--rig", half_ring(), "--law",
                                  (root_ / "out" / "report.json").string()});
  EXPECT_EQ(again.exit_code, 0) << "a report holds its law: " << again.err;
}

TEST_F(DesignVerb, AnImpossibleTargetNamesTheBestAndWhy) {
  const test::VerbRun result =
      run({"--flame", "0.16,2,1800", "--target-error", "0.01", "--most-cameras", "3"});
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("--target-error"));
  EXPECT_THAT(result.err, HasSubstr("views "));
}

TEST_F(DesignVerb, RanksPlacesForOneMoreCamera) {
  const test::VerbRun result = run({"--flame", "0.3,1,1800", "--rig", half_ring(), "--json"});
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const json report = json::parse(result.out);
  ASSERT_EQ(report["next_cameras"].size(), 5);
  double before = 1e9;
  for (const json& place : report["next_cameras"]) {
    EXPECT_LE(place["gain"].get<double>(), before);
    EXPECT_GE(place["gain"].get<double>(), 0);
    before = place["gain"].get<double>();
    const Eigen::Vector3d at(place["position_m"][0], place["position_m"][1], place["position_m"][2]);
    EXPECT_NEAR((at - Eigen::Vector3d(1, 0, 0)).norm(), 1, 1e-6) << "as far away as the others";
  }
  EXPECT_EQ(run({"--flame", "0.3,1,1800", "--rig", half_ring(), "--json"}).out, result.out);
}

TEST_F(DesignVerb, RefusesWhatItCannotRead) {
  for (const char* flame : {"large", "0.16,2", "0.16,2,1800,4", "nan,2,1800", "0.16,2,1e99", ""})
    expect_refused({"--flame", flame, "--target-error", "5"}, "--flame");
  expect_refused({"--flame", "0,2,1800", "--target-error", "5"}, "--flame, size");
  expect_refused({"--flame", "0.16,2,20", "--target-error", "5"}, "--flame, temperature");
  expect_refused({"--flame", "0.16,2,1800"}, "--target-error");
  expect_refused({"--flame", "0.16,2,1800", "--target-error", "-1"}, "--target-error");
  expect_refused({"--flame", "0.16,2,1800", "--target-error", "5", "--lens", "180"}, "--lens");
  expect_refused({"--flame", "0.16,2,1800", "--rig", write("empty.json", "{}")}, "empty.json");
}

TEST_F(DesignVerb, RefusesOtherProgramsMachines) {
  const auto with = [&](const std::string& text) {
    return std::vector<std::string>{"--flame", "0.16,2,1800", "--target-error",
                                    "60",      "--machine",   write("other.json", text)};
  };
  for (const char* text : {"", "[]", "{}", R"({"machine": 3})", R"({"machine": [3]})", R"({"machine": []})",
                           R"({"machine": [{"what": "CPU: a frame, effects found out", "here": -1}]})",
                           R"({"machine": [{"what": "CPU: a frame, effects found out", "here": null}]})"})
    expect_refused(with(text), "other.json");
  expect_refused({"--flame", "0.16,2,1800", "--target-error", "60", "--machine", "/nowhere/at/all.json"},
                 "/nowhere/at/all.json");
}

TEST_F(DesignVerb, RefusesLawsThatAreNone) {
  for (const char* text : {"", "{}", R"({"law": 1})", R"({"law": {"reach": 0, "spread": 0}})",
                           R"({"law": {"reach": 2, "spread": 0.1, "strength": {"views": -4}}})"}) {
    const test::VerbRun result = test::run_verb(
        add_design,
        {"design", "--flame", "0.16,2,1800", "--target-error", "5", "--law", write("l.json", text)});
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr("l.json"));
  }
}

}  // namespace
}  // namespace emberlock::cli
