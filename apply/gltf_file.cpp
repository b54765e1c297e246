// SPDX-License-Identifier: Apache-2.0
#include "apply/gltf_file.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <map>
#include <numeric>
#include <optional>
#include <set>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <tiny_gltf.h>

#include "apply/gltf_elements.h"
#include "apply/gltf_parts.h"
#include "apply/unreadable.h"
#include "base/file.h"
#include "base/kind_of_file.h"
#include "base/nesting.h"
#include "session/text.h"

namespace emberlock::apply {
namespace {

namespace fs = std::filesystem;

constexpr int kDeepestNode = 1000;

/// z upwards from y upwards.
Eigen::Matrix4d world_axes() {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m(0, 0) = m(2, 1) = m(3, 3) = 1;
  m(1, 2) = -1;
  return m;
}

Eigen::Matrix4d matrix_of(const Placement& place) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  m.topLeftCorner<3, 3>() = place.scale * place.rotation;
  m.topRightCorner<3, 1>() = place.translation;
  return m;
}

/// Errors: a matrix that isn't a similarity.
Placement placement_in(const Eigen::Matrix4d& m, const std::string& where) {
  const Eigen::Matrix3d linear = m.topLeftCorner<3, 3>();
  const double scale = std::cbrt(std::abs(linear.determinant()));
  if (!(scale > 0) ||
      !((linear.transpose() * linear / (scale * scale) - Eigen::Matrix3d::Identity()).norm() < 1e-3))
    refuse("is stretched or sheared", where, "Scale flames and cameras evenly");
  return {linear / scale, m.topRightCorner<3, 1>(), scale};
}

Eigen::Matrix4d matrix_of(const tinygltf::Node& node, const std::string& where) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Identity();
  if (node.matrix.size() == 16) {
    m = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
  } else {
    if (node.rotation.size() == 4)
      m.topLeftCorner<3, 3>() =
          Eigen::Quaterniond(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2])
              .normalized()
              .toRotationMatrix();
    if (node.scale.size() == 3)
      m.topLeftCorner<3, 3>() *= Eigen::Map<const Eigen::Vector3d>(node.scale.data()).asDiagonal();
    if (node.translation.size() == 3)
      m.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(node.translation.data());
  }
  if (!m.allFinite()) refuse("its place isn't finite", where);
  return m;
}

/// The corners of a primitive's triangles, three and three.
std::vector<std::uint32_t> triangles_of(int mode, std::vector<std::uint32_t> corners) {
  if (mode != TINYGLTF_MODE_TRIANGLE_STRIP && mode != TINYGLTF_MODE_TRIANGLE_FAN) {
    corners.resize(corners.size() / 3 * 3);
    return corners;
  }
  std::vector<std::uint32_t> out;
  for (std::size_t i = 2; i < corners.size(); ++i) {
    const bool strip = mode == TINYGLTF_MODE_TRIANGLE_STRIP;
    out.insert(out.end(), {corners[strip ? i - 2 : 0], corners[i - 1], corners[i]});
  }
  return out;
}

/// Walks a file's nodes and adds what they hold.
class GltfReader {
 public:
  /// `notes`: what is known to be left out.
  GltfReader(const tinygltf::Model& model, const Placement& world_from_file, Mesh& mesh,
             std::set<std::string> notes)
      : model_(model), mesh_(mesh), seen_(model.nodes.size()), notes_(std::move(notes)) {
    for (const Texture& texture : mesh.textures) texels_ += texture.rgb.size() / 3;
    first_material_ = static_cast<std::uint32_t>(mesh.materials.size());
    for (std::size_t i = 0; i < model.materials.size(); ++i) {
      mesh.materials.push_back(material_of(model.materials[i], fmt::format("materials[{}]", i)));
      mesh.materials.back().texture =
          texture_number(model.materials[i].pbrMetallicRoughness.baseColorTexture.index);
      note_left_out(model.materials[i]);
    }
    mesh.materials.emplace_back();  // where none is told
    if (!model.animations.empty()) notes_.insert("animation is left out");
    if (!model.skins.empty()) notes_.insert("skins are left out");
    if (!model.lights.empty())
      notes_.insert("its lights are left out: flames are the light, and a scene file's");
    const Eigen::Matrix4d top = matrix_of(world_from_file) * world_axes();
    if (model.scenes.empty()) refuse("has no scene", "scenes");
    if (model.scenes.size() > 1) notes_.insert("of its scenes, only the default one is shown");
    for (const int node : entry(model.scenes, std::max(0, model.defaultScene), "scene").nodes)
      walk(node, top, 0);
  }
  [[nodiscard]] GltfScene found() && {
    scene_.notes.assign(notes_.begin(), notes_.end());
    return std::move(scene_);
  }

 private:
  /// The mesh's own number of a texture; -1 for none, and where it can't be shown.
  int texture_number(int index) {
    if (index < 0) return -1;
    if (entry(model_.textures, index, "texture").source < 0) {
      notes_.insert("textures that are neither PNG nor JPEG are left out");
      return -1;
    }
    const auto [at, isnew] = textures_.try_emplace(index, static_cast<int>(mesh_.textures.size()));
    if (isnew) mesh_.textures.push_back(texture_of(model_, index, texels_));
    return at->second;
  }

  void note_left_out(const tinygltf::Material& m) {
    if (m.emissiveTexture.index >= 0 || m.normalTexture.index >= 0 || m.occlusionTexture.index >= 0 ||
        m.pbrMetallicRoughness.metallicRoughnessTexture.index >= 0)
      notes_.insert("of textures, the base colour's alone is shown");
    if (m.pbrMetallicRoughness.baseColorTexture.extensions.contains("KHR_texture_transform"))
      notes_.insert("textures are shown without their KHR_texture_transform");
    if (m.pbrMetallicRoughness.metallicFactor > 0 && m.pbrMetallicRoughness.roughnessFactor < 1)
      notes_.insert("metal is shown as matt");
    if (m.alphaMode != "OPAQUE") notes_.insert("transparent materials are shown opaque");
  }

  void note_morphs(const tinygltf::Mesh& shape, const std::vector<double>& weights) {
    const bool targets = std::any_of(shape.primitives.begin(), shape.primitives.end(),
                                     [](const tinygltf::Primitive& p) { return !p.targets.empty(); });
    if (targets && std::any_of(weights.begin(), weights.end(), [](double w) { return w != 0; }))
      notes_.insert("morph weights are left out: shapes are drawn without their morph targets");
  }

  void walk(int index, const Eigen::Matrix4d& world_from_parent, int depth) {
    const tinygltf::Node& node = entry(model_.nodes, index, "node");
    const std::string where = fmt::format("nodes[{}]", index);
    if (seen_[static_cast<std::size_t>(index)])
      refuse("is reached twice", where, "Nodes of a glTF file form trees");
    if (depth > kDeepestNode) refuse("lies too deep", where);
    seen_[static_cast<std::size_t>(index)] = true;
    const Eigen::Matrix4d world_from_node = world_from_parent * matrix_of(node, where);
    if (node.mesh >= 0) {
      const tinygltf::Mesh& shape = entry(model_.meshes, node.mesh, "mesh");
      for (const tinygltf::Primitive& primitive : shape.primitives) add(primitive, world_from_node, where);
      note_morphs(shape, node.weights.empty() ? shape.weights : node.weights);
    }
    if (node.camera >= 0) add_camera(entry(model_.cameras, node.camera, "camera"), world_from_node, where);
    if (node.extras.IsObject() && node.extras.Has("emberlock_flame")) {
      const tinygltf::Value& result = node.extras.Get("emberlock_flame");
      if (!result.IsString()) refuse("emberlock_flame isn't a path", where);
      scene_.flames.push_back(
          {result.Get<std::string>(), placement_in(world_from_node * world_axes().transpose(), where)});
    }
    for (const int child : node.children) walk(child, world_from_node, depth + 1);
  }

  void add_camera(const tinygltf::Camera& camera, const Eigen::Matrix4d& world_from_node,
                  const std::string& where) {
    if (camera.type != "perspective") {
      notes_.insert("orthographic cameras are left out");
      return;
    }
    const double height = camera.perspective.yfov;
    if (!(height > 0 && height < 3.1)) refuse("a camera's yfov is out of range", where);
    const Eigen::Matrix4d forwards = Eigen::Vector4d(1, -1, -1, 1).asDiagonal();  // from OpenGL's axes
    scene_.cameras.push_back({placement_in(world_from_node * forwards, where), Radians(height)});
  }

  void add(const tinygltf::Primitive& primitive, const Eigen::Matrix4d& world_from_node,
           const std::string& where) {
    if (primitive.mode >= TINYGLTF_MODE_POINTS && primitive.mode <= TINYGLTF_MODE_LINE_STRIP) {
      notes_.insert("points and lines are left out");
      return;
    }
    const auto position = primitive.attributes.find("POSITION");
    if (position == primitive.attributes.end()) refuse("a mesh has no POSITION", where);
    const GltfElements places(model_, position->second, TINYGLTF_TYPE_VEC3, where);
    const std::size_t told =
        primitive.indices >= 0 ? entry(model_.accessors, primitive.indices, "accessor").count : places.size();
    const bool single = primitive.mode == TINYGLTF_MODE_TRIANGLES || primitive.mode == -1;
    if (mesh_.triangles.size() + (single ? told / 3 : told) > kMostTriangles ||
        mesh_.vertices.size() + places.size() > 3 * kMostTriangles)
      refuse(fmt::format("has more than {} triangles", kMostTriangles), where, "Simplify the geometry");
    std::vector<std::uint32_t> corners(places.size());
    std::iota(corners.begin(), corners.end(), 0U);
    if (primitive.indices >= 0)
      corners = GltfElements(model_, primitive.indices, TINYGLTF_TYPE_SCALAR, where).indices(where);
    corners = triangles_of(primitive.mode, std::move(corners));
    const auto base = static_cast<std::uint32_t>(mesh_.vertices.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      const Eigen::Vector4d world =
          world_from_node * Eigen::Vector4d(places.at(i, 0), places.at(i, 1), places.at(i, 2), 1);
      if (!(world.cwiseAbs().maxCoeff() < 1e7)) refuse("a vertex isn't finite, or farther than 1e7 m", where);
      mesh_.vertices.push_back(
          {static_cast<float>(world[0]), static_cast<float>(world[1]), static_cast<float>(world[2])});
    }
    if (primitive.attributes.contains("COLOR_0")) notes_.insert("vertices' colours are left out");
    add_normals(primitive, world_from_node.topLeftCorner<3, 3>(), base, where);
    std::uint32_t material = static_cast<std::uint32_t>(model_.materials.size());
    if (primitive.material >= 0) {
      add_texture_places(primitive, entry(model_.materials, primitive.material, "material"), base, where);
      material = static_cast<std::uint32_t>(primitive.material);
    }
    for (std::size_t t = 0; t < corners.size(); t += 3) {
      for (std::size_t c = 0; c < 3; ++c)
        if (corners[t + c] >= places.size()) refuse("a triangle's corner isn't there", where);
      mesh_.triangles.push_back({base + corners[t], base + corners[t + 1], base + corners[t + 2]});
      mesh_.material.push_back(first_material_ + material);
    }
  }

  /// A primitive's attribute for each of its vertices, from `base` on; null where it hasn't got it.
  [[nodiscard]] std::optional<GltfElements> attribute(const tinygltf::Primitive& primitive,
                                                      const std::string& name, int type, std::size_t base,
                                                      const std::string& where) const {
    const auto at = primitive.attributes.find(name);
    if (at == primitive.attributes.end()) return std::nullopt;
    GltfElements elements(model_, at->second, type, where);
    if (elements.size() != mesh_.vertices.size() - base)
      refuse(fmt::format("{} isn't one for each vertex", name), where);
    return elements;
  }

  void add_normals(const tinygltf::Primitive& primitive, const Eigen::Matrix3d& linear, std::size_t base,
                   const std::string& where) {
    const auto from = attribute(primitive, "NORMAL", TINYGLTF_TYPE_VEC3, base, where);
    if (!from) return;
    mesh_.normals.resize(mesh_.vertices.size());
    // Cofactors: the inverse's transpose but for the scale, and there for flat matrices too.
    Eigen::Matrix3d turns;
    for (int a = 0; a < 3; ++a) turns.col(a) = linear.col((a + 1) % 3).cross(linear.col((a + 2) % 3));
    for (std::size_t i = 0; i < from->size(); ++i) {
      const Eigen::Vector3d normal = turns * Eigen::Vector3d(from->at(i, 0), from->at(i, 1), from->at(i, 2));
      const double length = normal.norm();
      if (!std::isfinite(length) || !(length > 0)) continue;
      for (std::size_t a = 0; a < 3; ++a)
        mesh_.normals[base + i][a] = static_cast<float>(normal[static_cast<Eigen::Index>(a)] / length);
    }
  }

  void add_texture_places(const tinygltf::Primitive& primitive, const tinygltf::Material& material,
                          std::size_t base, const std::string& where) {
    const tinygltf::TextureInfo& texture = material.pbrMetallicRoughness.baseColorTexture;
    if (texture.index < 0) return;
    const auto from =
        attribute(primitive, fmt::format("TEXCOORD_{}", texture.texCoord), TINYGLTF_TYPE_VEC2, base, where);
    mesh_.texture_places.resize(mesh_.vertices.size());
    for (std::size_t i = 0; from && i < from->size(); ++i) {
      std::array<float, 2>& to = mesh_.texture_places[base + i];
      for (std::size_t a = 0; a < 2; ++a) to[a] = static_cast<float>(from->at(i, a));
      if (!std::isfinite(to[0]) || !std::isfinite(to[1])) refuse("a place on a texture isn't finite", where);
    }
  }

  const tinygltf::Model& model_;
  Mesh& mesh_;
  std::vector<bool> seen_;
  std::uint32_t first_material_ = 0;
  std::map<int, int> textures_;  // the mesh's number of each that is shown
  std::size_t texels_ = 0;
  GltfScene scene_;
  std::set<std::string> notes_;
};

/// The JSON of a binary file, for what is checked before the parser runs.
std::string_view json_of(std::string_view bytes) {
  constexpr std::size_t kHeader = 20;
  if (!bytes.starts_with("glTF") || bytes.size() < kHeader) return bytes;
  std::uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return bytes.substr(kHeader, length);
}

/// What a glTF file names is read as any other file: nothing but regular ones.
tinygltf::FsCallbacks regular_files() {
  return {[](const std::string& path, void*) { return check_regular_file(path).ok(); },
          [](const std::string& path, void*) { return path; },
          [](std::vector<unsigned char>* out, std::string* error, const std::string& path, void*) {
            const Result<std::string> bytes = read_file(path);
            if (bytes) out->assign(bytes->begin(), bytes->end());
            if (!bytes && error != nullptr) *error += bytes.error().message();
            return bytes.ok();
          },
          nullptr, nullptr};
}

tinygltf::Model model_of(const std::string& bytes, const fs::path& file) {
  tinygltf::TinyGLTF loader;
  loader.SetFsCallbacks(regular_files());
  // Pictures are kept as they are: those that are shown are decoded later, within bounds.
  loader.SetImageLoader(
      [](tinygltf::Image* image, int, std::string*, std::string*, int, int, const unsigned char* content,
         int bytes_there, void*) {
        image->image.assign(content, content + std::max(0, bytes_there));
        return true;
      },
      nullptr);
  tinygltf::Model model;
  std::string error, warning;
  const std::string folder = fs::absolute(file).parent_path().string();
  const auto size = static_cast<unsigned int>(bytes.size());
  const bool done =
      bytes.starts_with("glTF")
          ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                        reinterpret_cast<const unsigned char*>(bytes.data()), size, folder)
          : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, folder);
  std::replace(error.begin(), error.end(), '\n', ' ');
  if (!done) refuse(error.empty() ? "is no glTF file" : "is no glTF file: " + error, {}, "Export it again");
  for (const std::string& extension : model.extensionsRequired)
    if (extension != "KHR_materials_unlit" && !is_heeded(extension))
      refuse("needs the extension " + session::printable(extension), "extensionsRequired",
             "Export without it (no compression)");
  return model;
}

}  // namespace

Result<GltfScene> read_gltf(const fs::path& file, const Placement& world_from_file, Mesh& mesh) {
  EMBERLOCK_ASSIGN_OR_RETURN(const std::string bytes, read_file(file));
  return parse_gltf(bytes, file, world_from_file, mesh);
}

Result<GltfScene> parse_gltf(const std::string& bytes, const fs::path& file, const Placement& world_from_file,
                             Mesh& mesh) try {
  EMBERLOCK_RETURN_IF_ERROR(check_json_nesting(json_of(bytes), file.string()));
  const tinygltf::Model model = model_of(bytes, file);
  return GltfReader(model, world_from_file, mesh, extensions_left_out(json_of(bytes))).found();
} catch (const Unreadable& e) {
  return in_file(e.error, file.string());
} catch (const std::exception& e) {
  return Error{ErrorKind::bad_input, e.what(), file.string()};
}

}  // namespace emberlock::apply
