// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <filesystem>
#include <fstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "base/file.h"
#include "recon/export/picture.h"
#include "recon/export/report.h"
#include "recon/export/volume_file.h"
#include "session/media/frame_file.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

namespace emberlock::recon {
namespace {
namespace fs = std::filesystem;

class ExportTest : public testing::Test {
 protected:
  const test::TempFolder root_;
};

Volume some_volume() {
  Volume volume;
  volume.grid = {{-0.1F, 0.2F, 1.0F / 3}, 0.2F / 7, 5, 9, 3};
  volume.emission.assign(3 * volume.grid.size(), 0.0F);
  volume.extinction.assign(volume.grid.size(), 0.0F);
  for (std::size_t i = 0; i < volume.grid.size(); i += 3) {
    volume.emission[3 * i + i % 3] = 1e3F * std::sin(static_cast<float>(i));
    volume.extinction[i] = std::exp(-static_cast<float>(i));
  }
  volume.emission.back() = 1e-30F;  // a faint voxel is not an empty one
  return volume;
}

TEST_F(ExportTest, AVolumeIsReadBackToTheSameBits) {
  const Volume written = some_volume();
  ASSERT_TRUE(write_volume(written, root_ / "volume.vdb").ok());
  const auto read = value_of(read_volume(root_ / "volume.vdb"));
  EXPECT_EQ(read.emission, written.emission);
  EXPECT_EQ(read.extinction, written.extinction);
  for (int axis = 0; axis < 3; ++axis) EXPECT_EQ(read.grid.origin[axis], written.grid.origin[axis]);
  EXPECT_EQ(read.grid.edge, written.grid.edge);
  EXPECT_EQ(read.grid.nx, 5);
  EXPECT_EQ(read.grid.ny, 9);
  EXPECT_EQ(read.grid.nz, 3);
}

TEST_F(ExportTest, EqualVolumesAreEqualFilesAndUnequalOnesTellThemselvesApart) {
  Volume volume = some_volume();
  const auto written = [&](const char* name) {
    EXPECT_TRUE(write_volume(volume, root_ / name).ok());
    return read_file(root_ / name).value();
  };
  const std::string first = written("first.vdb");
  EXPECT_EQ(written("again.vdb"), first);
  volume.emission[3] += 1;
  const std::string other = written("other.vdb");
  EXPECT_NE(other.substr(21, 36), first.substr(21, 36)) << "OpenVDB's identifier";
  EXPECT_THAT(first.substr(21, 36), testing::MatchesRegex("[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}"));
}

TEST_F(ExportTest, WithoutExtinctionTheDensityIsEmptyButThere) {
  Volume volume = some_volume();
  volume.extinction.clear();
  ASSERT_TRUE(write_volume(volume, root_ / "volume.vdb").ok());
  const auto read = value_of(read_volume(root_ / "volume.vdb"));
  EXPECT_TRUE(read.extinction.empty());
}

TEST_F(ExportTest, FurtherGridsAreReadBackToTheSameBitsAndLeaveTheVolumeAsItWas) {
  const Volume volume = some_volume();
  std::vector<float> kelvin(volume.grid.size());
  for (std::size_t i = 0; i < kelvin.size(); i += 5) kelvin[i] = 1000.0F + static_cast<float>(i);
  const std::vector<NamedGrid> further = {{"temperature", "K", kelvin},
                                          {"emission_sigma", "", volume.emission}};
  ASSERT_TRUE(write_volume(volume, root_ / "volume.vdb", further).ok());
  EXPECT_EQ(*read_grid(root_ / "volume.vdb", "temperature"), kelvin);
  EXPECT_EQ(*read_grid(root_ / "volume.vdb", "emission_sigma"), volume.emission);
  EXPECT_EQ(read_volume(root_ / "volume.vdb")->emission, volume.emission);
  EXPECT_EQ(read_volume(root_ / "volume.vdb")->extinction, volume.extinction);
  EXPECT_THAT(read_grid(root_ / "volume.vdb", "velocity"), FailsWith("velocity"));
}

TEST_F(ExportTest, ASparseFlameTakesLittleRoom) {
  Volume volume;
  volume.grid = {{0, 0, 0}, 0.01F, 129, 129, 129};
  volume.emission.assign(3 * volume.grid.size(), 0.0F);
  volume.emission[3 * volume.grid.index(64, 64, 64)] = 5;
  ASSERT_TRUE(write_volume(volume, root_ / "volume.vdb").ok());
  EXPECT_LT(fs::file_size(root_ / "volume.vdb"), 20000U) << "25 MB if the zeros were stored";
}

TEST_F(ExportTest, AFileThatIsNoVolumeIsNamed) {
  EXPECT_THAT(read_volume(root_ / "absent.vdb"), FailsWith("absent.vdb"));
  std::ofstream(root_ / "text.vdb") << "no volume";
  EXPECT_FALSE(read_volume(root_ / "text.vdb").ok());
  ASSERT_TRUE(write_volume(some_volume(), root_ / "cut.vdb").ok());
  fs::resize_file(root_ / "cut.vdb", fs::file_size(root_ / "cut.vdb") / 2);
  EXPECT_FALSE(read_volume(root_ / "cut.vdb").ok());
}

TEST_F(ExportTest, AVolumeThatCannotBeWrittenIsAnError) {
  EXPECT_EQ(write_volume(some_volume(), root_ / "no" / "such" / "volume.vdb").error().kind, ErrorKind::io);
}

TEST_F(ExportTest, APictureIsReadBackWithItsColours) {
  Image picture(ImageLayout{{5, 3}, PixelFormat::rgb8, 8});
  for (std::size_t i = 0; i < picture.bytes().size(); ++i)
    picture.bytes()[i] = static_cast<std::byte>(17 * i);
  ASSERT_TRUE(write_png(picture.view(), root_ / "p.png").ok());
  const auto read = value_of(session::read_image(root_ / "p.png"));
  EXPECT_EQ(read, picture);
}

TEST_F(ExportTest, APictureOf16BitsIsRefused) {
  const Image picture(ImageLayout{{5, 3}, PixelFormat::gray16, 12});
  EXPECT_FALSE(write_png(picture.view(), root_ / "p.png").ok());
  EXPECT_FALSE(fs::exists(root_ / "p.png"));
}

Report some_report() {
  Report report;
  report.solver = "default";
  report.voxels = {3, 4, 5};
  report.input_rmse = {1, 2, 3};
  report.heldout_rmse = ChannelRmse{4, 5, 6};
  report.views = {{"a", ViewRole::input, {1, 2, 3}}, {"b", ViewRole::held_out, {4, 5, 6}}};
  report.hull_time = Seconds(0.25);
  report.trace = {{Seconds(0.5), 7, {9, 9, 9}, {8, 8, 8}}};
  report.effects = {{"extinction", true, 3.5, Seconds(0.125), "found", Seconds(0.5)}};
  return report;
}

TEST_F(ExportTest, TheReportCarriesWhatOthersRead) {
  const auto json = nlohmann::json::parse(to_json(some_report()));
  EXPECT_EQ(json["voxels"], (nlohmann::json{3, 4, 5}));
  EXPECT_EQ(json["heldout_rmse"], (nlohmann::json{4, 5, 6}));
  EXPECT_EQ(json["seconds"]["hull"], 0.25);
  for (const char* key : {"effects", "hull", "solve", "total"})
    EXPECT_TRUE(json["seconds"].contains(key)) << key;
  EXPECT_EQ(json["trace"][0]["iteration"], 7);
  EXPECT_EQ(json["trace"][0]["heldout_rmse"][0], 8);
  EXPECT_EQ(json["effects"][0]["name"], "extinction");
  EXPECT_EQ(json["effects"][0]["predicted_change"], 3.5);
  EXPECT_EQ(json["effects"][0]["seconds"], 0.125);
  EXPECT_EQ(json["effects"][0]["cost"], 0.5);
  EXPECT_EQ(json["views"][1]["role"], "held_out");
  EXPECT_EQ(json["views"][1]["index"], 1);
}

TEST_F(ExportTest, WithNothingHeldOutTheHeldOutErrorIsNull) {
  Report report = some_report();
  report.heldout_rmse.reset();
  const auto json = nlohmann::json::parse(to_json(report));
  EXPECT_TRUE(json["heldout_rmse"].is_null());
  EXPECT_TRUE(json["trace"][0]["heldout_rmse"].is_null());
}

TEST_F(ExportTest, ANameThatIsNoUtf8StillGivesAReport) {
  Report report = some_report();
  report.views[0].name = "\xff.png";
  EXPECT_TRUE(nlohmann::json::accept(to_json(report)));
}

}  // namespace
}  // namespace emberlock::recon
