// SPDX-License-Identifier: Apache-2.0
// A program of somebody else's (program/, beside this) built against what `cmake --install` lays down for
// developers.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>

#include "tests/support/recording.h"
#include "tests/support/shell.h"

namespace emberlock {
namespace {

const std::string kInstall = "cmake --install " EMBERLOCK_BUILD_DIR " --component development --prefix ";

TEST(Library, AProgramOfOthersIsBuiltAgainstTheInstalledTreeAndRuns) {
  const test::TempFolder temp(test::TempFolder::On::disk);
  const std::string prefix = (temp / "prefix").string(), build = (temp / "build").string();
  const Shell install = shell(kInstall + prefix);
  ASSERT_EQ(install.status, 0) << install.output;
  const Shell made = shell("(cmake -G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_PREFIX_PATH=" + prefix +
                           " -S " EMBERLOCK_SOURCE_DIR "/tests/integration/library/program -B " + build +
                           " && cmake --build " + build + ")");
  ASSERT_EQ(made.status, 0) << made.output;
  const Shell ran = shell(build + "/flame_and_dot " + (temp / "session").string());
  EXPECT_EQ(ran.status, 0);
  EXPECT_THAT(ran.output, testing::MatchesRegex("the dot stands 4[12]\\.[0-9] rows below the lamp\n"
                                                "the camera held out is shown within [0-9] grey levels\n"));
}

TEST(Library, WhatThePackageHoldsIsNotForDevelopers) {
  const test::TempFolder temp(test::TempFolder::On::disk);
  const Shell install = shell(kInstall + (temp / "prefix").string());
  ASSERT_EQ(install.status, 0) << install.output;
  EXPECT_FALSE(std::filesystem::exists(temp / "prefix/bin"));
  EXPECT_FALSE(std::filesystem::exists(temp / "prefix/share"));
}

/// CMakeLists.txt and main.cpp of a program that asks for `components`, configured and built.
Shell build_one(const test::TempFolder& temp, const std::string& components, const std::string& links) {
  const std::string prefix = (temp / "prefix").string();
  const Shell install = shell(kInstall + prefix);
  if (install.status != 0) return install;
  test::put_bytes(temp / "CMakeLists.txt",
                  "cmake_minimum_required(VERSION 3.25)\nproject(one LANGUAGES CXX)\n"
                  "find_package(Emberlock REQUIRED COMPONENTS " +
                      components +
                      ")\n"
                      "add_executable(one main.cpp)\ntarget_link_libraries(one PRIVATE " +
                      links + ")\n");
  test::put_bytes(temp / "main.cpp",
                  "#include \"smear_sync/detect/detect.h\"\n"
                  "int main() { return emberlock::smear::detect({}).state == "
                  "emberlock::smear::SmearState::no_lamp ? 0 : 1; }\n");
  const std::string build = (temp / "build").string();
  return shell("(cmake -G Ninja -DCMAKE_PREFIX_PATH=" + prefix + " -S " + temp.path().string() + " -B " +
               build + " && cmake --build " + build + " && " + build + "/one)");
}

TEST(Library, WhoAsksForOnePartNeedsNoLibraryOfTheOthers) {
  const test::TempFolder temp(test::TempFolder::On::disk);
  const Shell made = build_one(temp, "smear", "emberlock::smear");
  EXPECT_EQ(made.status, 0) << made.output;
  EXPECT_THAT(made.output, testing::Not(testing::HasSubstr("OpenCV")));
  EXPECT_THAT(shell("ldd " + (temp / "build/one").string()).output,
              testing::Not(testing::HasSubstr("opencv")));
}

TEST(Library, AnUnknownPartIsRefused) {
  const test::TempFolder temp(test::TempFolder::On::disk);
  const Shell made = build_one(temp, "smear drivers", "emberlock::smear");
  EXPECT_NE(made.status, 0);
  EXPECT_THAT(made.output, testing::HasSubstr("It has no component drivers"));
}

}  // namespace
}  // namespace emberlock
