// SPDX-License-Identifier: Apache-2.0
// Files for other programs, read by OpenVDB, by NanoVDB and by what VTK says of its format.
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <sstream>
#include <string>
#include <type_traits>
#include <vector>

#include <gmock/gmock.h>
#include <nanovdb/util/IO.h>
#include <pugixml.hpp>

#include "base/file.h"
#include "recon/export/nanovdb_file.h"
#include "recon/export/vdb_identity.h"
#include "recon/export/volume_file.h"
#include "recon/export/vti_file.h"
#include "tests/support/key_points.h"
#include "tests/support/recording.h"
#include "tests/support/results.h"

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#include <openvdb/openvdb.h>
#pragma GCC diagnostic pop

namespace emberlock::recon {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// Colours, an extinction and temperatures at some key points, up to the grid's faces; values of every size.
SharedVolume some_flame() {
  SharedVolume flame;
  flame.grid = {{-0.1F, 0.2F, 1.0F / 3}, 0.2F / 7, 5, 9, 3};
  const std::size_t points = flame.grid.size();
  std::vector<float> emission(3 * points);
  std::vector<float> density(points);
  std::vector<float> kelvin(points);
  for (std::size_t p = 0; p < points; p += 3) {
    for (std::size_t c = 0; c < 3; ++c)
      emission[3 * p + c] = 900.0F + 100.0F * std::sin(static_cast<float>(p + 7 * c));
    density[p] = std::exp(-static_cast<float>(p));
    kelvin[p] = 1500.0F + static_cast<float>(p);
  }
  emission.back() = 1e-30F;  // a faint point is not an empty one
  density.front() = std::numeric_limits<float>::denorm_min();
  flame.grids = {{"density", "1/m", "", density},
                 {"emission", "grey levels (0..255) per metre", "light", emission},
                 {"temperature", "K", "", kelvin}};
  flame.provenance = {"Emberlock 1.2.3", "take <2> & \"more\"", "-y", 42};
  flame.provenance.lighting.light = {Light::Source::distant, {1, 0.5, -1}, {200, 190, 180}, {3, 2, 1}};
  return flame;
}

class SharedFiles : public testing::Test {
 protected:
  const SharedVolume flame_ = some_flame();
  const test::TempFolder folder_;
};

/// Whether a place is that of a key point.
template <class Place>
void expect_at(const Place& place, const Grid& grid, int i, int j, int k) {
  const Eigen::Vector3d expected = place_of(grid, i, j, k);
  for (int a = 0; a < 3; ++a) EXPECT_NEAR(place[a], expected[a], 1e-15);
}

openvdb::GridBase::Ptr opened(const fs::path& path, const std::string& name) {
  openvdb::initialize();
  openvdb::io::File file(path.string());
  file.open();
  return file.hasGrid(name) ? file.readGrid(name) : nullptr;
}

std::string word(const openvdb::MetaMap& from, const char* key) {
  const auto found = from.getMetadata<openvdb::StringMetadata>(key);
  return found ? found->value() : "";
}

/// The values at all key points; none of another type.
std::vector<float> values_in(const openvdb::GridBase::Ptr& from, const Grid& grid) {
  std::vector<float> values;
  const auto scalar = openvdb::gridPtrCast<openvdb::FloatGrid>(from);
  const auto vector = openvdb::gridPtrCast<openvdb::Vec3SGrid>(from);
  each_point(grid, [&](int i, int j, int k) {
    if (scalar) values.push_back(scalar->tree().getValue({i, j, k}));
    for (int c = 0; vector && c < 3; ++c) values.push_back(vector->tree().getValue({i, j, k})[c]);
  });
  return values;
}

TEST_F(SharedFiles, OpenVdbReadsTheSameBitsAtTheirPlaces) {
  const fs::path path = folder_ / "flame.vdb";
  ASSERT_TRUE(write_vdb(flame_, path, VdbSamples::at_index).ok());
  for (const SharedGrid& grid : flame_.grids) {
    SCOPED_TRACE(grid.name);
    const openvdb::GridBase::Ptr read = opened(path, grid.name);
    ASSERT_TRUE(read);
    EXPECT_EQ(values_in(read, flame_.grid), grid.values);
    const bool scalar = read->isType<openvdb::FloatGrid>();
    EXPECT_EQ(read->getGridClass(), scalar ? openvdb::GRID_FOG_VOLUME : openvdb::GRID_UNKNOWN);
    each_point(flame_.grid, [&](int i, int j, int k) {
      expect_at(read->transform().indexToWorld(openvdb::Coord(i, j, k)), flame_.grid, i, j, k);
    });
    EXPECT_EQ(word(*read, "unit"), grid.unit);
    EXPECT_EQ(word(*read, "meaning"), grid.meaning);
    EXPECT_EQ(word(*read, "creator"), "Emberlock 1.2.3");
    EXPECT_EQ(word(*read, "emberlock_input"), flame_.provenance.input);
    EXPECT_EQ(word(*read, "emberlock_up"), "-y");
    EXPECT_EQ(read->metaValue<std::int64_t>("emberlock_frame"), 42);
  }
}

TEST_F(SharedFiles, AnExportIsAVolumeOfOursToo) {
  const fs::path path = folder_ / "flame.vdb";
  ASSERT_TRUE(write_vdb(flame_, path, VdbSamples::at_index).ok());
  const auto volume = value_of(read_volume(path));
  EXPECT_EQ(volume.extinction, flame_.grids[0].values);
  EXPECT_EQ(volume.emission, flame_.grids[1].values);
  const auto shared = value_of(read_shared_volume(path));
  EXPECT_TRUE(same_place(shared.grid, flame_.grid));
  ASSERT_EQ(shared.grids.size(), 3U);
  EXPECT_EQ(shared.find("temperature")->values, flame_.grids[2].values);
  EXPECT_EQ(shared.find("temperature")->unit, "K");
  const auto lighting = value_of(read_lighting(path));
  EXPECT_EQ(lighting.light.source, Light::Source::distant);
  EXPECT_EQ(lighting.light.place, flame_.provenance.lighting.light.place);
  EXPECT_EQ(lighting.light.strength, flame_.provenance.lighting.light.strength);
  // Values that lie elsewhere than OpenVDB says are none.
  ASSERT_TRUE(write_vdb(flame_, path, VdbSamples::half_an_edge_later).ok());
  EXPECT_FALSE(read_volume(path).ok());
}

/// A volume of ours whose file has other metadata.
void write_with(const openvdb::MetaMap& about, const fs::path& path) {
  ASSERT_TRUE(write_vdb(some_flame(), path, VdbSamples::at_index).ok());
  openvdb::io::File from(path.string());
  from.open();
  const openvdb::GridPtrVecPtr grids = from.getGrids();
  from.close();
  openvdb::io::File(path.string()).write(*grids, about);
  std::ofstream(path, std::ios::binary | std::ios::app) << "emberlock: end of volume";
  identify_by_content(path);  // as the volumes of its version are
}

TEST_F(SharedFiles, LightThatAFileTellsInAnotherWayIsRefused) {
  const fs::path path = folder_ / "flame.vdb";
  using openvdb::DoubleMetadata;
  using openvdb::StringMetadata;
  const StringMetadata single("single");
  const DoubleMetadata half(0.5);
  openvdb::MetaMap about;
  about.insertMeta("emberlock_scattering", single);
  about.insertMeta("emberlock_albedo", half);
  about.insertMeta("emberlock_asymmetry", half);
  write_with(about, path);
  ASSERT_TRUE(read_lighting(path).ok()) << read_lighting(path).error().message();
  const StringMetadata sideways("sideways");
  const openvdb::Int32Metadata whole(1);
  for (const auto& [key, value] :
       {std::pair<const char*, const openvdb::Metadata*>("emberlock_scattering", &sideways),
        {"emberlock_scattering", &whole},
        {"emberlock_albedo", nullptr},
        {"emberlock_albedo", &single},
        {"emberlock_asymmetry", &whole},
        {"emberlock_light", &half},
        {"emberlock_light", &single}}) {
    openvdb::MetaMap other(about);
    other.removeMeta(key);
    if (value != nullptr) other.insertMeta(key, *value);
    write_with(other, path);
    EXPECT_THAT(read_lighting(path), FailsWith(key)) << key;
  }
  openvdb::MetaMap lit;
  lit.insertMeta("emberlock_light", StringMetadata("even"));
  lit.insertMeta("emberlock_light_place", half);
  write_with(lit, path);
  EXPECT_THAT(read_lighting(path), FailsWith("emberlock_light_place"));
}

TEST_F(SharedFiles, BeforeBlender5AKeyPointIsHalfAnEdgeBehindItsIndex) {
  const fs::path path = folder_ / "flame.vdb";
  ASSERT_TRUE(write_vdb(flame_, path, VdbSamples::half_an_edge_later).ok());
  for (const SharedGrid& grid : flame_.grids) {
    const openvdb::GridBase::Ptr read = opened(path, grid.name);
    ASSERT_TRUE(read) << grid.name;
    expect_at(read->transform().indexToWorld(openvdb::Vec3d(1.5, 2.5, 0.5)), flame_.grid, 1, 2, 0);
  }
  // Its share of the light a voxel is e^-3 / 35, e^-6 / 35, e^-9 / 35 and so on.
  const auto density = openvdb::gridPtrCast<openvdb::FloatGrid>(opened(path, "density"));
  EXPECT_EQ(density->tree().getValue({1, 1, 0}), flame_.grids[0].values[6]);
  EXPECT_EQ(density->tree().getValue({4, 1, 0}), 0) << "a trace that Blender 3.4 would lose light by";
  const auto colours = openvdb::gridPtrCast<openvdb::Vec3SGrid>(opened(path, "emission"));
  const openvdb::CoordBBox box = colours->evalActiveVoxelBoundingBox();
  EXPECT_EQ(box, openvdb::CoordBBox({-1, -1, -1}, {5, 9, 3})) << "zeros around, beyond which it is cut off";
  EXPECT_EQ(colours->tree().getValue(box.min()), openvdb::Vec3s(0));
}

TEST_F(SharedFiles, WithoutExtinctionTheDensityIsThereAndEmpty) {
  SharedVolume bare = flame_;
  bare.grids.erase(bare.grids.begin());
  ASSERT_TRUE(write_vdb(bare, folder_ / "flame.vdb", VdbSamples::at_index).ok());
  const openvdb::GridBase::Ptr density = opened(folder_ / "flame.vdb", "density");
  ASSERT_TRUE(density);
  EXPECT_EQ(density->activeVoxelCount(), 0U);
}

template <class Value>
void expect_nano_grid(const nanovdb::GridHandle<>& handle, const SharedGrid& expected, const Grid& grid) {
  const auto* read = handle.grid<Value>();
  ASSERT_NE(read, nullptr) << expected.name;
  EXPECT_STREQ(read->gridName(), expected.name.c_str());
  EXPECT_EQ(read->isFogVolume(), (std::is_same_v<Value, float>));
  const auto accessor = read->getAccessor();
  std::vector<float> values;
  each_point(grid, [&](int i, int j, int k) {
    const nanovdb::Coord at(i, j, k);
    const Value value = accessor.getValue(at);
    EXPECT_EQ(accessor.isActive(at), value != Value(0.0F));
    const float* first = reinterpret_cast<const float*>(&value);
    values.insert(values.end(), first, first + sizeof(Value) / sizeof(float));
    expect_at(read->indexToWorld(nanovdb::Vec3d(i, j, k)), grid, i, j, k);
  });
  EXPECT_EQ(values, expected.values);
}

TEST_F(SharedFiles, NanoVdbReadsTheSameBitsAtTheirPlaces) {
  SharedVolume flame = flame_;
  flame.grids.push_back({"empty", "1", "", std::vector<float>(flame.grid.size())});
  ASSERT_TRUE(write_nanovdb(flame, folder_ / "flame.nvdb").ok());
  const auto grids =
      nanovdb::io::readGrids<nanovdb::HostBuffer, std::vector>((folder_ / "flame.nvdb").string());
  ASSERT_EQ(grids.size(), 4U);
  expect_nano_grid<float>(grids[0], flame.grids[0], flame.grid);
  expect_nano_grid<nanovdb::Vec3f>(grids[1], flame.grids[1], flame.grid);
  expect_nano_grid<float>(grids[2], flame.grids[2], flame.grid);
  expect_nano_grid<float>(grids[3], flame.grids[3], flame.grid);
}

/// A .vti with raw values behind "_", read by its XML.
struct VtiFile {
  std::string bytes;
  pugi::xml_document head;

  explicit VtiFile(const fs::path& path) : bytes(*read_file(path)) {
    const std::size_t mark = bytes.find('_', bytes.find("<AppendedData"));
    values = mark + 1;
    EXPECT_TRUE(head.load_string((bytes.substr(0, mark) + "</AppendedData></VTKFile>").c_str()));
  }
  [[nodiscard]] pugi::xml_node image() const { return head.child("VTKFile").child("ImageData"); }
  [[nodiscard]] pugi::xml_node array(const std::string& name) const {
    return image().child("Piece").child("PointData").find_child_by_attribute("Name", name.c_str());
  }
  [[nodiscard]] std::vector<float> values_of(const std::string& name) const {
    const std::size_t at = values + array(name).attribute("offset").as_ullong();
    std::uint64_t size = 0;
    std::memcpy(&size, &bytes.at(at), sizeof(size));
    std::vector<float> read(size / sizeof(float));
    std::memcpy(read.data(), &bytes.at(at + sizeof(size)), size);
    return read;
  }
  /// A text of the field data.
  [[nodiscard]] std::string text(const char* name) const {
    std::istringstream numbers(
        image().child("FieldData").find_child_by_attribute("Name", name).text().as_string());
    std::string found;
    for (int c = 0; numbers >> c && c != 0;) found += static_cast<char>(c);
    return found;
  }
  std::size_t values = 0;
};

TEST_F(SharedFiles, VtkReadsTheSameBitsAtTheirPlaces) {
  SharedVolume flame = flame_;
  add_flame(flame, brightest(flame));
  add_told(flame);
  ASSERT_TRUE(write_vti(flame, folder_ / "flame.vti").ok());
  const VtiFile file(folder_ / "flame.vti");
  const pugi::xml_node image = file.image();
  EXPECT_STREQ(image.attribute("WholeExtent").value(), "0 4 0 8 0 2");
  EXPECT_STREQ(image.child("Piece").attribute("Extent").value(), "0 4 0 8 0 2");
  std::istringstream origin(image.attribute("Origin").value());
  std::istringstream spacing(image.attribute("Spacing").value());
  for (const float expected : flame.grid.origin) {
    double at = 0;
    double edge = 0;
    ASSERT_TRUE(origin >> at && spacing >> edge);
    EXPECT_EQ(at, static_cast<double>(expected));
    EXPECT_EQ(edge, static_cast<double>(flame.grid.edge));
  }
  for (const SharedGrid& grid : flame.grids) {
    EXPECT_EQ(file.values_of(grid.name), grid.values) << grid.name;
    EXPECT_EQ(file.array(grid.name).child("InformationKey").text().get(), grid.unit);
  }
  EXPECT_STREQ(file.array("emission").attribute("ComponentName2").value(), "blue");
  EXPECT_STREQ(image.child("Piece").child("PointData").attribute("Scalars").value(), "flame");
  EXPECT_EQ(file.text("program"), "Emberlock 1.2.3");
  EXPECT_THAT(file.text("light"), HasSubstr("distant, from the direction 1, 0.5, -1"));
  EXPECT_EQ(file.text("scattering"), "");
  EXPECT_EQ(file.text("input"), flame.provenance.input);
  EXPECT_THAT(file.text("meaning of flame"), HasSubstr("grey levels per metre"));
  EXPECT_TRUE(file.bytes.ends_with("</AppendedData>\n</VTKFile>\n"));
}

TEST_F(SharedFiles, TheFlameIsTheLuminanceAsAShareOfTheBrightest) {
  SharedVolume flame;
  flame.grid = {{0, 0, 0}, 0.01F, 2, 2, 2};
  flame.grids = {{"emission", "", "", std::vector<float>(24)},
                 {"temperature", "K", "", std::vector<float>(8)}};
  EXPECT_EQ(brightest(flame), 0);
  flame.grids[0].values[3] = 1000;          // red
  flame.grids[0].values[3 * 2 + 1] = 1000;  // green
  for (std::size_t c = 0; c < 3; ++c) flame.grids[0].values[3 * 5 + c] = 500;
  flame.grids[1].values[5] = 1700;
  EXPECT_NEAR(brightest(flame), 715.2, 1e-3);
  add_flame(flame, 1000);
  const std::vector<float>& share = flame.find(kFlame)->values;
  EXPECT_NEAR(share[1], 0.2126, 1e-6);
  EXPECT_NEAR(share[2], 0.7152, 1e-6);
  EXPECT_NEAR(share[5], 0.5, 1e-6) << "grey is its own luminance";
  add_told(flame);
  EXPECT_EQ(flame.find("temperature_told")->values, (std::vector<float>{0, 0, 0, 0, 0, 1, 0, 0}));
}

TEST_F(SharedFiles, WhatCannotBeWrittenIsAnErrorThatNamesTheFile) {
  const auto at_index = [](const SharedVolume& v, const fs::path& p) {
    return write_vdb(v, p, VdbSamples::at_index);
  };
  const auto later = [](const SharedVolume& v, const fs::path& p) {
    return write_vdb(v, p, VdbSamples::half_an_edge_later);
  };
  using Write = std::function<Status(const SharedVolume&, const fs::path&)>;
  for (const Write& write : {Write(at_index), Write(later), Write(write_nanovdb), Write(write_vti)}) {
    for (const char* path : {"/dev/full", "/nowhere/flame"}) {  // a full disk, no folder
      const Status status = write(flame_, path);
      ASSERT_FALSE(status.ok()) << path;
      EXPECT_EQ(status.error().kind, ErrorKind::io);
      EXPECT_THAT(status, FailsWith(path));
    }
  }
}

}  // namespace
}  // namespace emberlock::recon
