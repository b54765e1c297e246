// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <unistd.h>

#include "base/file.h"
#include "cli/commands.h"
#include "recon/export/volume_file.h"
#include "report/sequence_report.h"
#include "tests/support/recording.h"
#include "tests/support/verb.h"

namespace emberlock::cli {
namespace {
namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::Not;

/// Frames 3, 4 and 12 of a sequence, each one grey point, the second the brightest.
class ExportCommandTest : public testing::Test {
 protected:
  void SetUp() override {
    write("sequence/frame-3", 100, false);
    write("sequence/frame-4", 400, false);
    write("sequence/frame-12", 200, false);
    write("hot", 300, true);
    write("empty", 0, false);
    std::ofstream(folder_ / "sequence" / "frame-4" / "report.json") << R"({"input": "take2", "up": "-y"})";
  }
  void write(const std::string& name, float light, bool with_temperature) const {
    recon::Volume volume;
    volume.grid = {{0, 0, 0}, 0.01F, 3, 3, 3};
    volume.emission.assign(3 * volume.grid.size(), 0.0F);
    for (std::size_t c = 0; c < 3; ++c) volume.emission[std::size_t{3} * 13 + c] = light;
    std::vector<float> kelvin(volume.grid.size());
    kelvin[13] = 1700;
    std::vector<recon::NamedGrid> further;
    if (with_temperature) further.push_back({"temperature", "K", kelvin});
    fs::create_directories(folder_ / name);
    ASSERT_TRUE(recon::write_volume(volume, folder_ / name / "volume.vdb", further).ok());
  }
  [[nodiscard]] test::VerbRun run(const std::string& result, std::vector<std::string> words = {}) const {
    words.insert(words.begin(), {"export", (folder_ / result).string(), "--out", out_.string()});
    return test::run_verb(add_export, std::move(words));
  }
  [[nodiscard]] std::vector<std::string> made() const {
    std::vector<std::string> names;
    for (const auto& entry : fs::directory_iterator(out_)) names.push_back(entry.path().filename().string());
    return names;
  }
  void expect_refused(const test::VerbRun& result, const std::string& why) const {
    EXPECT_EQ(result.exit_code, 2) << why;
    EXPECT_THAT(result.err, HasSubstr(why));
    EXPECT_FALSE(fs::exists(out_));
  }
  const test::TempFolder folder_;
  const fs::path out_ = folder_ / "out";
};

TEST_F(ExportCommandTest, ASequenceIsNumberedAndItsFlameIsOfOneScale) {
  const auto result = run("sequence");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(made(), testing::UnorderedElementsAre("emberlock-files.json", "flame_0003.vdb",
                                                    "flame_0004.vdb", "flame_0012.vdb"));
  for (const auto& [name, share] :
       {std::pair("flame_0003.vdb", 0.25F), {"flame_0004.vdb", 1.0F}, {"flame_0012.vdb", 0.5F}}) {
    const auto flame = recon::read_grid(out_ / name, "flame");
    ASSERT_TRUE(flame.ok()) << flame.error().message();
    EXPECT_FLOAT_EQ((*flame)[13], share) << name;
  }
  EXPECT_THAT(result.out, HasSubstr("1 stands for a luminance of 400"));
}

TEST_F(ExportCommandTest, MissingFramesOfASequenceAreNamed) {
  EXPECT_THAT(run("sequence").err, HasSubstr("warning          frames 5..11 are missing\n"));
  EXPECT_THAT(run("sequence", {"--frames", "4:6"}).err, HasSubstr("frames 5, 6 are missing"));
  EXPECT_THAT(run("sequence", {"--frames", "3:5"}).err, HasSubstr("frame 5 is missing"));
  EXPECT_THAT(run("sequence", {"--frames", "3:4"}).err, Not(HasSubstr("missing")));
  EXPECT_THAT(run("sequence/frame-4").err, Not(HasSubstr("missing")));
  fs::rename(folder_ / "sequence/frame-3", folder_ / "sequence/frame-8");  // each fourth
  EXPECT_THAT(run("sequence").err, Not(HasSubstr("missing")));
  write("sequence/frame-24", 100, false);
  EXPECT_THAT(run("sequence").err, HasSubstr("frames 16, 20 are missing"));
}

TEST_F(ExportCommandTest, WhichFramesASequenceHasIsToldByIt) {
  report::SequenceTold told;
  for (const std::uint64_t frame : {2, 3, 4, 8, 9, 10, 12, 14}) told.frames.push_back({.frame = frame});
  told.frames.back().error = "no light";
  fs::create_directory(folder_ / "sequence/sequence");
  std::ofstream(folder_ / "sequence/sequence/frames.json") << report::sequence_json(told);
  EXPECT_THAT(run("sequence").err, HasSubstr("frames 2, 8..10, 14 are missing"));
}

TEST_F(ExportCommandTest, OneOfASequenceKeepsItsNumber) {
  const auto some = run("sequence", {"--frames", "4:11", "--format", "vti"});
  ASSERT_EQ(some.exit_code, 0) << some.err;
  EXPECT_THAT(made(), testing::UnorderedElementsAre("emberlock-files.json", "flame_0004.vti"));
  EXPECT_THAT(*read_file(out_ / "flame_0004.vti"), HasSubstr(R"(format="ascii">4<)"));
  fs::create_symlink("frame-4/volume.vdb", folder_ / "sequence" / "volume_0004.vdb");
  ASSERT_EQ(run("sequence/volume_0004.vdb").exit_code, 0);
  EXPECT_THAT(made(), testing::UnorderedElementsAre("emberlock-files.json", "flame_0004.vdb"));
}

TEST_F(ExportCommandTest, EachFormatHasItsFile) {
  for (const auto& [format, file] : {std::pair("vdb", "flame.vdb"),
                                     {"blender4", "flame.vdb"},
                                     {"nvdb", "flame.nvdb"},
                                     {"vti", "flame.vti"}}) {
    const auto result = run("hot", {"--format", format});
    ASSERT_EQ(result.exit_code, 0) << result.err;
    EXPECT_THAT(made(), testing::UnorderedElementsAre("emberlock-files.json", file));
    EXPECT_THAT(result.out, HasSubstr("temperature (K)"));
    EXPECT_THAT(result.out, HasSubstr(file));
  }
}

TEST_F(ExportCommandTest, GridsAreThoseAskedFor) {
  ASSERT_EQ(run("hot", {"--grids", "temperature,flame"}).exit_code, 0);
  const auto shared = recon::read_shared_volume(out_ / "flame.vdb");
  ASSERT_TRUE(shared.ok()) << shared.error().message();
  EXPECT_EQ(shared->find("emission"), nullptr);
  EXPECT_EQ(shared->find("temperature")->values[13], 1700);
  EXPECT_NE(shared->find("density"), nullptr) << "Blender takes a box without it for dense";
}

TEST_F(ExportCommandTest, FilesTellWhatTheMediumScatters) {
  const recon::Lighting lighting{{recon::Scattering::Order::single, 0.4, 0.6}, {}};
  const auto volume = recon::read_volume(folder_ / "hot" / "volume.vdb");
  ASSERT_TRUE(recon::write_volume(*volume, folder_ / "hot" / "volume.vdb", {}, lighting).ok());
  ASSERT_EQ(run("hot").exit_code, 0);
  const auto told = recon::read_lighting(out_ / "flame.vdb");
  ASSERT_TRUE(told.ok()) << told.error().message();
  EXPECT_EQ(told->scattering.albedo, 0.4);
  ASSERT_EQ(run("hot", {"--format", "vti"}).exit_code, 0);
  EXPECT_THAT(*read_file(out_ / "flame.vti"), HasSubstr(R"(Name="scattering")"));
}

TEST_F(ExportCommandTest, RefusesWhatIsNoResult) {
  fs::create_directory(folder_ / "pictures");
  expect_refused(run("pictures"), "has no volume.vdb");
  expect_refused(run("nothing"), "isn't there");
  std::ofstream(folder_ / "text.vdb") << "no volume";
  expect_refused(run("text.vdb"), "text.vdb: isn't an OpenVDB file");
  expect_refused(run("empty"), "is empty");
  expect_refused(run("sequence/frame-4", {"--grids", "temperature"}), "--quantity temperature");
  expect_refused(run("hot", {"--grids", "heat"}), "has no heat, only density, emission, temperature, flame");
  expect_refused(run("hot", {"--format", "obj"}), "obj not in");
  expect_refused(run("hot", {"--frames", "0:1"}), "changes nothing here");
  expect_refused(run("sequence", {"--frames", "5:9"}), "The sequence has 3 to 12");
  expect_refused(run("sequence", {"--frames", "9"}), "FIRST:LAST");
}

TEST_F(ExportCommandTest, AFrameThatCannotBeReadLeavesNothingBehind) {
  fs::resize_file(folder_ / "sequence" / "frame-12" / "volume.vdb", 1000);
  expect_refused(run("sequence"), "frame-12/volume.vdb");
}

TEST_F(ExportCommandTest, WhereNothingCanBeWrittenItSaysSo) {
  const auto result =
      test::run_verb(add_export, {"export", (folder_ / "hot").string(), "--out", "/proc/flame"});
  EXPECT_NE(result.exit_code, 0);
  EXPECT_THAT(result.err, HasSubstr("/proc/flame"));
}

}  // namespace
}  // namespace emberlock::cli
