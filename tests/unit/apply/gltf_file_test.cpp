// SPDX-License-Identifier: Apache-2.0
#include "apply/gltf_file.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include "base/file.h"
#include "tests/support/gltf_writer.h"
#include "tests/support/recording.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;
using test::GltfText;
using testing::ElementsAre;
using testing::FloatNear;
using testing::HasSubstr;

class GltfFileTest : public testing::Test {
 protected:
  Result<GltfScene> read(const std::string& text, const Placement& place = {}) {
    const fs::path file = temp_ / "room.gltf";
    std::ofstream(file, std::ios::binary) << text;
    mesh_ = {};
    return read_gltf(file, place, mesh_);
  }
  void expect_refused(const std::string& text, const std::string& words) {
    const auto scene = read(text);
    ASSERT_FALSE(scene.ok()) << words;
    EXPECT_EQ(scene.error().kind, ErrorKind::bad_input);
    EXPECT_THAT(scene.error().message(), HasSubstr(words));
    EXPECT_THAT(scene.error().message(), HasSubstr("room.gltf"));
  }
  void expect_vertex(std::size_t i, float x, float y, float z) {
    EXPECT_THAT(mesh_.vertices.at(i),
                ElementsAre(FloatNear(x, 1e-5F), FloatNear(y, 1e-5F), FloatNear(z, 1e-5F)));
  }

  test::TempFolder temp_;
  Mesh mesh_;
};

/// Up in the file (y) is up in the world (z); what is towards the viewer there (z) is -y.
TEST_F(GltfFileTest, TrianglesStandWhereTheirNodesDo) {
  GltfText gltf;
  gltf.corners = {0, 0, 0, 1, 0, 0, 0, 2, 3};
  gltf.nodes = R"([{"children": [1], "translation": [0, 10, 0], "scale": [2, 2, 2]},
                   {"mesh": 0, "rotation": [0, 0.70710678, 0, 0.70710678]}])";
  Placement place;
  place.translation = {100, 0, 0};
  const auto scene = read(gltf.text(), place);
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_EQ(mesh_.triangles.size(), 1U);
  expect_vertex(0, 100, 0, 10);
  expect_vertex(1, 100, 2, 10);  // x goes to -z around y, and that is the world's y
  expect_vertex(2, 106, 0, 14);
  EXPECT_TRUE(scene->notes.empty());
}

TEST_F(GltfFileTest, MaterialsHaveTheFactorsOfTheirColours) {
  GltfText gltf;
  gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.25, 0, 1]},
      "emissiveFactor": [1, 0, 0.5], "alphaMode": "BLEND",
      "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": 2}}}])";
  const auto scene = read(gltf.text());
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  const Material& m = mesh_.materials.at(mesh_.material.at(0));
  EXPECT_THAT(m.albedo, ElementsAre(0.5F, 0.25F, 0));
  EXPECT_THAT(m.emitted, ElementsAre(510, 0, 255));
  EXPECT_THAT(scene->notes, ElementsAre(HasSubstr("opaque")));
}

/// A picture of two pixels, white and black, and places on it that are the numbers of POSITION, two and two.
TEST_F(GltfFileTest, TexturesAndNormalsAreTaken) {
  GltfText gltf;
  gltf.corners = {0, 0.5F, 1, 0.25F, 0.75F, 1, 0, 0, -1};
  gltf.attributes = R"("POSITION": 0, "NORMAL": 0, "TEXCOORD_1": 2)";
  gltf.accessors = R"(, {"bufferView": 0, "componentType": 5126, "type": "VEC2", "count": 3})";
  gltf.nodes = R"([{"mesh": 0, "scale": [1, 2, 1]}])";
  const std::string picture =
      test::base64(std::string("P6 2 1 255 ") + "\xff\xff\xff" + std::string(3, '\0'));
  gltf.further =
      R"("materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0, "texCoord": 1}}}],
      "textures": [{"source": 0, "sampler": 0}], "samplers": [{"wrapS": 33071, "wrapT": 33648}],
      "images": [{"uri": "data:image/png;base64,)" +
      picture + R"("}])";
  const auto scene = read(gltf.text());
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  const Material& m = mesh_.materials.at(mesh_.material.at(0));
  ASSERT_EQ(m.texture, 0);
  const Texture& texture = mesh_.textures.at(0);
  EXPECT_EQ(texture.width, 2);
  EXPECT_EQ(texture.across, Wrap::clamp);
  EXPECT_EQ(texture.down, Wrap::mirror);
  EXPECT_THAT(texture.rgb, ElementsAre(255, 255, 255, 0, 0, 0));
  EXPECT_THAT(mesh_.texture_places,
              ElementsAre(ElementsAre(0, 0.5F), ElementsAre(1, 0.25F), ElementsAre(0.75F, 1)));
  // (0, 0.5, 1) on a surface that is stretched upwards leans half as much; z is the world's -y.
  const float length = std::sqrt(0.25F * 0.25F + 1);
  EXPECT_THAT(mesh_.normals.at(0),
              ElementsAre(0, FloatNear(-1 / length, 1e-5F), FloatNear(0.25F / length, 1e-5F)));
}

TEST_F(GltfFileTest, RefusesTexturesThatItCannotShow) {
  GltfText gltf;
  const auto with = [&](const std::string& uri) {
    gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
      "textures": [{"source": 0}], "images": [{"uri": ")" +
                   uri + R"("}])";
    return gltf.text();
  };
  expect_refused(with("nowhere.png"), "nowhere.png");
  expect_refused(with("data:image/png;base64," + test::base64("no picture")), "images[0]");
  expect_refused(with("data:image/png;base64," + test::base64("P6 90000 90000 255 ")), "images[0]");
  gltf.attributes = R"("POSITION": 0, "TEXCOORD_0": 2)";
  gltf.accessors = R"(, {"bufferView": 0, "componentType": 5126, "type": "VEC2", "count": 2})";
  expect_refused(with("data:image/png;base64," + test::base64(std::string("P6 1 1 255 ") + "abc")),
                 "one for each vertex");
}

TEST_F(GltfFileTest, ASecondFileKeepsItsOwnMaterials) {
  GltfText gltf;
  ASSERT_TRUE(read(gltf.text()).ok());
  gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}}])";
  std::ofstream(temp_ / "other.gltf", std::ios::binary) << gltf.text();
  ASSERT_TRUE(read_gltf(temp_ / "other.gltf", {}, mesh_).ok());
  EXPECT_EQ(mesh_.triangles.at(1)[0], 3U);
  EXPECT_EQ(mesh_.materials.at(mesh_.material.at(0)).albedo[0], 1);
  EXPECT_EQ(mesh_.materials.at(mesh_.material.at(1)).albedo[0], 0.5F);
}

TEST_F(GltfFileTest, FlamesAndCamerasAreTaken) {
  GltfText gltf;
  gltf.nodes =
      R"([{"mesh": 0}, {"translation": [1, 2, 3], "scale": [2, 2, 2], "extras": {"emberlock_flame": "fire"}},
                   {"camera": 0, "translation": [0, 5, 0]}])";
  gltf.roots = "[0, 1, 2]";
  gltf.further =
      R"("materials": [{}], "cameras": [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}])";
  const auto scene = read(gltf.text());
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  ASSERT_EQ(scene->flames.size(), 1U);
  EXPECT_EQ(scene->flames[0].result, "fire");
  // Its own z is up, as the world's.
  EXPECT_TRUE(
      (scene->flames[0].world_from_flame * Eigen::Vector3d(0, 0, 1)).isApprox(Eigen::Vector3d(1, -3, 4)));
  ASSERT_EQ(scene->cameras.size(), 1U);
  // It looks along the file's -z, which is the world's y; the picture's down is the world's.
  const Placement& camera = scene->cameras[0].world_from_camera;
  EXPECT_TRUE(camera.translation.isApprox(Eigen::Vector3d(0, 0, 5)));
  EXPECT_TRUE((camera.rotation * Eigen::Vector3d::UnitZ()).isApprox(Eigen::Vector3d::UnitY()));
  EXPECT_TRUE((camera.rotation * Eigen::Vector3d::UnitY()).isApprox(-Eigen::Vector3d::UnitZ()));
}

TEST_F(GltfFileTest, RefusesNodesThatFormNoTree) {
  GltfText gltf;
  gltf.nodes = R"([{"children": [1]}, {"mesh": 0, "children": [0]}])";
  expect_refused(gltf.text(), "reached twice");
  gltf.nodes = R"([{"children": [1, 1]}, {"mesh": 0}])";
  expect_refused(gltf.text(), "reached twice");
  gltf.nodes = R"([{"children": [7]}])";
  expect_refused(gltf.text(), "node 7 isn't there");
  std::string chain = "[";
  for (int i = 1; i < 3000; ++i) chain += R"({"children": [)" + std::to_string(i) + "]},";
  gltf.nodes = chain + R"({"mesh": 0}])";
  expect_refused(gltf.text(), "too deep");
}

TEST_F(GltfFileTest, RefusesWhatIsNotFinite) {
  GltfText gltf;
  gltf.corners[4] = std::numeric_limits<float>::quiet_NaN();
  expect_refused(gltf.text(), "isn't finite");
  gltf = {};
  gltf.nodes = R"([{"mesh": 0, "translation": [1e30, 0, 0]}])";
  expect_refused(gltf.text(), "isn't finite");
  gltf.nodes = R"([{"mesh": 0, "rotation": [0, 0, 0, 0]}])";
  const auto scene = read(gltf.text());
  EXPECT_TRUE(!scene.ok() || std::isfinite(mesh_.vertices.at(1)[0]));
}

TEST_F(GltfFileTest, RefusesBuffersThatAreMissingOrShort) {
  GltfText gltf;
  gltf.uri = "nowhere.bin";
  expect_refused(gltf.text(), "nowhere.bin");
  gltf = {};
  gltf.told_points = 4;
  expect_refused(gltf.text(), "goes beyond its buffer");
  gltf.told_points = std::size_t{1} << 60;
  expect_refused(gltf.text(), "");
  gltf = {};
  gltf.indices = {0, 1, 3};
  expect_refused(gltf.text(), "corner isn't there");
}

TEST_F(GltfFileTest, RefusesABinaryFileThatIsCutShortAnywhere) {
  const auto whole = read_file(fs::path(EMBERLOCK_SOURCE_DIR) / "tests/fuzz/corpus/gltf_file/all.glb");
  ASSERT_TRUE(whole.ok());
  const auto scene = read(*whole);
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_EQ(mesh_.triangles.size(), 1U);
  for (std::size_t size = 0; size < whole->size(); size += 7) expect_refused(whole->substr(0, size), "");
}

TEST_F(GltfFileTest, RefusesWhatItCannotShow) {
  GltfText gltf;
  gltf.further = R"("materials": [{}], "extensionsUsed": ["KHR_draco_mesh_compression"],
                    "extensionsRequired": ["KHR_draco_mesh_compression"])";
  expect_refused(gltf.text(), "KHR_draco_mesh_compression");
  gltf = {};
  gltf.primitive = R"("material": 9)";
  expect_refused(gltf.text(), "material 9 isn't there");
  gltf = {};
  gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorFactor": [2, 0, 0, 1]}}])";
  expect_refused(gltf.text(), "out of range");
  gltf = {};
  gltf.nodes = R"([{"scale": [1, 2, 1], "extras": {"emberlock_flame": "fire"}}])";
  expect_refused(gltf.text(), "stretched");
  for (const char* text : {"", "{", "[]", "{}", "glTF", R"({"asset": {"version": "2.0"}})"})
    expect_refused(text, "");
  expect_refused(std::string(100000, '['), "");
}

/// A mesh of twenty thousand triangles, shown by so many nodes that there would be more than ten million.
TEST_F(GltfFileTest, RefusesMoreTrianglesThanItHolds) {
  GltfText gltf;
  gltf.indices.assign(60000, 0);
  gltf.nodes = "[";
  gltf.roots = "[";
  for (int i = 0; i < 501; ++i) {
    gltf.nodes += std::string(i > 0 ? "," : "") + R"({"mesh": 0})";
    gltf.roots += (i > 0 ? "," : "") + std::to_string(i);
  }
  gltf.nodes += "]";
  gltf.roots += "]";
  expect_refused(gltf.text(), "more than 10000000 triangles");
}

TEST_F(GltfFileTest, PointsAndLinesAreLeftOutAndTold) {
  GltfText gltf;
  gltf.primitive = R"("material": 0, "mode": 1)";
  const auto scene = read(gltf.text());
  ASSERT_TRUE(scene.ok()) << scene.error().message();
  EXPECT_TRUE(mesh_.triangles.empty());
  EXPECT_THAT(scene->notes, ElementsAre(HasSubstr("lines")));
}

/// What is asked for and isn't drawn, each by its name.
TEST_F(GltfFileTest, WhatIsNotDrawnIsNamed) {
  struct Row {
    std::string further, nodes, words;
  };
  const std::string one = R"([{"mesh": 0}])";
  std::vector<Row> rows;
  for (const char* name : {"KHR_materials_pbrSpecularGlossiness", "KHR_materials_transmission",
                           "KHR_materials_unlit", "KHR_materials_volume", "KHR_materials_clearcoat",
                           "KHR_materials_sheen", "KHR_materials_ior", "KHR_materials_specular",
                           "KHR_materials_iridescence", "KHR_materials_variants", "VENDOR_materials_new"}) {
    const std::string used = std::string(R"("extensions": {")") + name + R"(": {}})";
    rows.push_back({R"("materials": [{)" + used + "}]", one, name});
    rows.push_back({std::string(R"("materials": [{}], "extensionsUsed": [")") + name + R"("])", one, name});
  }
  for (const char* name : {"EXT_mesh_gpu_instancing", "MSFT_lod", "KHR_node_visibility"})
    rows.push_back({R"("materials": [{}])",
                    std::string(R"([{"mesh": 0, "extensions": {")") + name + R"(": {}}}])", name});
  rows.push_back({R"("materials": [{"pbrMetallicRoughness": {"metallicFactor": 1, "roughnessFactor": 0.5}}])",
                  one, "metal"});
  rows.push_back({R"("materials": [{"alphaMode": "MASK"}])", one, "opaque"});
  rows.push_back({R"("materials": [{}], "cameras": [{"type": "orthographic", "orthographic":
                  {"xmag": 1, "ymag": 1, "zfar": 9, "znear": 1}}])",
                  R"([{"mesh": 0, "camera": 0}])", "orthographic"});
  for (const Row& row : rows) {
    GltfText gltf;
    gltf.further = row.further;
    gltf.nodes = row.nodes;
    const auto scene = read(gltf.text());
    ASSERT_TRUE(scene.ok()) << row.words << ": " << scene.error().message();
    EXPECT_THAT(scene->notes, ElementsAre(HasSubstr(row.words))) << row.further;
  }
  GltfText gltf;  // what adds nothing to a picture needs no word, and neither do extras
  gltf.further = R"("materials": [{"extensions": {"KHR_materials_emissive_strength": {}},
                   "extras": {"extensions": {"X": 1}}}], "extensionsUsed": ["KHR_xmp", "KHR_mesh_quantization"])";
  EXPECT_TRUE(read(gltf.text()).value().notes.empty());
}

TEST_F(GltfFileTest, MorphWeightsAreNamedWhereTheyAreNotZero) {
  for (const auto& [nodes, named] : {std::pair(R"([{"mesh": 0, "weights": [0.5]}])", true),
                                     {R"([{"mesh": 0, "weights": [0]}])", false},
                                     {R"([{"mesh": 0}])", false}}) {
    GltfText gltf;
    gltf.nodes = nodes;
    gltf.primitive = R"("material": 0, "targets": [{"POSITION": 0}])";
    const auto scene = read(gltf.text());
    ASSERT_TRUE(scene.ok()) << scene.error().message();
    EXPECT_EQ(scene->notes.size(), named ? 1U : 0U) << nodes;
    if (named) {
      EXPECT_THAT(scene->notes[0], HasSubstr("morph weights"));
    }
  }
}

/// Strips and fans of any length are the single triangles of the same corners.
TEST_F(GltfFileTest, StripsAndFansAreTheirTriangles) {
  using Triangle = std::array<std::uint32_t, 3>;
  for (const int mode : {5, 6})
    for (std::size_t n = 0; n < 10; ++n) {
      GltfText gltf;
      gltf.corners.clear();
      gltf.indices.clear();
      std::vector<Triangle> expected;
      for (std::size_t i = 0; i < std::max<std::size_t>(n, 3); ++i)
        gltf.corners.insert(gltf.corners.end(), {static_cast<float>(i), static_cast<float>(i * i), 0});
      for (std::size_t i = 0; i < n; ++i) gltf.indices.push_back(static_cast<std::uint16_t>(i));
      for (std::uint32_t i = 2; i < n; ++i) expected.push_back({mode == 5 ? i - 2 : 0, i - 1, i});
      gltf.primitive = R"("material": 0, "mode": )" + std::to_string(mode);
      const auto scene = read(gltf.text());
      ASSERT_TRUE(scene.ok() || n == 0) << scene.error().message();
      EXPECT_EQ(mesh_.triangles, expected) << mode << ' ' << n;
    }
}

/// One triangle whose corners are sparse, over a buffer or over nothing, is where a plain one is.
TEST_F(GltfFileTest, SparseCornersReplaceTheOthers) {
  const auto text = [](bool over_buffer, int count, int index) {
    GltfText gltf;
    gltf.corners = {0, 0, 0, 1, 0, 0, 0, 0, -1, 5, 6, 7};  // the last one is the sparse value
    gltf.attributes = R"("POSITION": 2)";
    gltf.indices = {0, 1, 2, static_cast<std::uint16_t>(index)};
    gltf.accessors = std::string(R"(, {"componentType": 5126, "type": "VEC3", "count": 3, )") +
                     (over_buffer ? R"("bufferView": 0, )" : "") + R"("sparse": {"count": )" +
                     std::to_string(count) +
                     R"(, "indices": {"bufferView": 1, "byteOffset": 6, "componentType": 5123},
                        "values": {"bufferView": 0, "byteOffset": 36}}})";
    return gltf.text();
  };
  for (const bool over_buffer : {true, false})
    for (std::size_t index = 0; index < 3; ++index) {
      const auto scene = read(text(over_buffer, 1, static_cast<int>(index)));
      ASSERT_TRUE(scene.ok()) << scene.error().message();
      ASSERT_EQ(mesh_.triangles.size(), 1U);
      for (std::size_t i = 0; i < 3; ++i) {
        if (i == index) expect_vertex(i, 5, -7, 6);
        if (i != index && !over_buffer) expect_vertex(i, 0, 0, 0);
        if (i != index && over_buffer) expect_vertex(i, i == 1 ? 1.0F : 0.0F, i == 2 ? 1.0F : 0.0F, 0);
      }
    }
  expect_refused(text(true, 1, 3), "index is out of range");
  expect_refused(text(true, 2, 1), "goes beyond its buffer");
  expect_refused(text(true, 9, 1), "is out of range");
}

/// Corners of integers, normalised or not (KHR_mesh_quantization).
TEST_F(GltfFileTest, QuantisedCornersAreTheirShares) {
  struct Kind {
    int type;
    std::size_t bytes;
    double most;
  };
  for (const Kind kind : {Kind{5120, 1, 127}, {5121, 1, 255}, {5122, 2, 32767}, {5123, 2, 65535}})
    for (const bool normalised : {true, false}) {
      GltfText gltf;
      gltf.corners.assign(6, 0.0F);  // 24 bytes: three corners of four components
      const std::size_t step = 4 * kind.bytes;
      auto* const bytes = reinterpret_cast<unsigned char*>(gltf.corners.data());
      bytes[step] = 100;  // x of the second corner, low byte
      gltf.attributes = R"("POSITION": 2)";
      gltf.accessors = R"(, {"bufferView": 2, "componentType": )" + std::to_string(kind.type) +
                       R"(, "type": "VEC3", "count": 3, "normalized": )" + (normalised ? "true" : "false") +
                       "}";
      std::string text = gltf.text();
      const std::string views = R"("bufferViews": [)";
      const std::size_t end = text.find(']', text.find(views));
      text.insert(end, R"(, {"buffer": 0, "byteLength": 24, "byteStride": )" + std::to_string(step) + "}");
      const auto scene = read(text);
      ASSERT_TRUE(scene.ok()) << scene.error().message();
      expect_vertex(0, 0, 0, 0);
      expect_vertex(1, static_cast<float>(normalised ? 100 / kind.most : 100), 0, 0);
    }
}

TEST_F(GltfFileTest, APictureOfAnotherKindIsNamed) {
  for (const auto& [bytes, kind] :
       std::vector<std::pair<std::string, std::string>>{{std::string("RIFF\4\0\0\0WEBP", 12), "WebP"},
                                                        {"GIF89a", "GIF"},
                                                        {"GIF87a", "GIF"},
                                                        {"BM1234", "BMP"},
                                                        {"DDS |", "DDS"},
                                                        {"\xabKTX 20", "KTX"},
                                                        {"8BPS", "Photoshop"},
                                                        {"#?RADIANCE", "Radiance"},
                                                        {std::string("\0\0\0\x1c", 4) + "ftypavif", "AVIF"},
                                                        {std::string("\0\0\0\x1c", 4) + "ftypheic", "HEIF"},
                                                        {"text", "isn't a picture"}}) {
    GltfText gltf;
    gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
      "textures": [{"source": 0}], "images": [{"uri": "data:image/png;base64,)" +
                   test::base64(bytes) + R"("}])";
    expect_refused(gltf.text(), kind);
  }
}

/// A pipe as a buffer or a picture doesn't keep the reader waiting.
TEST_F(GltfFileTest, PipesAreRefused) {
  ASSERT_EQ(::mkfifo((temp_ / "pipe").c_str(), 0600), 0);
  GltfText gltf;
  gltf.uri = "pipe";
  expect_refused(gltf.text(), "pipe");
  gltf = {};
  gltf.further = R"("materials": [{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}],
      "textures": [{"source": 0}], "images": [{"uri": "pipe"}])";
  expect_refused(gltf.text(), "pipe");
  EXPECT_FALSE(read_gltf(temp_ / "pipe", {}, mesh_).ok());
}

}  // namespace
}  // namespace emberlock::apply
