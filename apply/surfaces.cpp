// SPDX-License-Identifier: Apache-2.0
#include "apply/surfaces.h"

#include <utility>

#include <embree3/rtcore.h>

namespace emberlock::apply {
namespace {

RTCRay ray_from(const Vec3& origin, const Vec3& direction, float from, float to) {
  RTCRay ray = {};
  ray.org_x = origin.x;
  ray.org_y = origin.y;
  ray.org_z = origin.z;
  ray.dir_x = direction.x;
  ray.dir_y = direction.y;
  ray.dir_z = direction.z;
  ray.tnear = from;
  ray.tfar = to;
  ray.mask = ~0U;
  return ray;
}

Vec3 vec3_of(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

TriangleHit EmbreeTriangles::first(const Vec3& origin, const Vec3& direction, float nearest) const {
  TriangleHit hit;
  if (scene == nullptr) return hit;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = {};
  query.ray = ray_from(origin, direction, nearest, hit.distance);
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return hit;
  return {query.ray.tfar, query.hit.primID, query.hit.u, query.hit.v};
}

bool EmbreeTriangles::blocked(const Vec3& origin, const Vec3& direction, float from, float to) const {
  if (scene == nullptr) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = ray_from(origin, direction, from, to);
  rtcOccluded1(scene, &context, &ray);
  return ray.tfar < 0;
}

/// The mesh, its tables, and Embree's.
struct Surfaces::Parts {
  explicit Parts(Mesh m) : mesh(std::move(m)) {
    // Embree reads whole vectors: 16 bytes from the last vertex on must be there.
    mesh.vertices.push_back({0, 0, 0});
    if (!mesh.normals.empty()) mesh.normals.resize(mesh.vertices.size());
    if (!mesh.texture_places.empty() || !mesh.textures.empty())
      mesh.texture_places.resize(mesh.vertices.size());
    for (const Material& m_of : mesh.materials)
      materials.push_back({vec3_of(m_of.albedo), vec3_of(m_of.emitted), m_of.texture});
    for (Texture& t : mesh.textures) {
      textures.push_back({texels.size() / 3, t.width, t.height, t.across, t.down});
      texels.insert(texels.end(), t.rgb.begin(), t.rgb.end());
      t.rgb = {};
    }
    find_glowing();
  }
  void find_glowing() {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const Vec3& emitted = materials[mesh.material[t]].emitted;
      if (!(sum(emitted) > 0)) continue;
      const auto corner = [&](std::size_t c) { return vec3_of(mesh.vertices[mesh.triangles[t][c]]); };
      const GlowingTriangle one{corner(0), corner(1) - corner(0), corner(2) - corner(0), emitted};
      if (length(cross(one.along, one.aside)) > 0) glowing.push_back(one);
    }
  }
  Parts(Parts&&) = delete;
  Parts& operator=(Parts&&) = delete;
  ~Parts() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  Mesh mesh;
  std::vector<MaterialRow> materials;
  std::vector<TextureRow> textures;
  std::vector<std::uint8_t> texels;
  std::vector<GlowingTriangle> glowing;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

Surfaces::Surfaces(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Surfaces::Surfaces(Surfaces&&) noexcept = default;
Surfaces& Surfaces::operator=(Surfaces&&) noexcept = default;
Surfaces::~Surfaces() = default;

bool Surfaces::empty() const { return parts_->mesh.triangles.empty(); }
const Mesh& Surfaces::mesh() const { return parts_->mesh; }
EmbreeTriangles Surfaces::triangles() const { return {parts_->scene}; }
const std::vector<MaterialRow>& Surfaces::materials() const { return parts_->materials; }
const std::vector<TextureRow>& Surfaces::textures() const { return parts_->textures; }
const std::vector<std::uint8_t>& Surfaces::texels() const { return parts_->texels; }
const std::vector<GlowingTriangle>& Surfaces::glowing() const { return parts_->glowing; }

SurfaceTable Surfaces::table() const {
  const Mesh& m = parts_->mesh;
  SurfaceTable table;
  table.vertices = m.vertices.front().data();
  if (!m.triangles.empty()) table.triangles = m.triangles.front().data();
  table.material = m.material.data();
  if (!m.normals.empty()) table.normals = m.normals.front().data();
  if (!m.texture_places.empty()) table.texture_places = m.texture_places.front().data();
  table.materials = parts_->materials.data();
  table.textures = parts_->textures.data();
  table.texels = parts_->texels.data();
  table.linear = linear_levels().data();
  return table;
}

Result<Surfaces> Surfaces::build(Mesh mesh) {
  auto all = std::make_unique<Parts>(std::move(mesh));
  if (all->mesh.triangles.empty()) return Surfaces(std::move(all));
  all->device = rtcNewDevice(nullptr);
  if (all->device == nullptr) return Error{ErrorKind::device, "Embree can't be started", "geometry"};
  all->scene = rtcNewScene(all->device);
  rtcSetSceneFlags(all->scene, RTC_SCENE_FLAG_ROBUST);  // no ray slips between two triangles
  RTCGeometry triangles = rtcNewGeometry(all->device, RTC_GEOMETRY_TYPE_TRIANGLE);
  rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                             all->mesh.vertices.data(), 0, sizeof all->mesh.vertices[0],
                             all->mesh.vertices.size() - 1);
  rtcSetSharedGeometryBuffer(triangles, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                             all->mesh.triangles.data(), 0, sizeof all->mesh.triangles[0],
                             all->mesh.triangles.size());
  rtcCommitGeometry(triangles);
  rtcAttachGeometry(all->scene, triangles);
  rtcReleaseGeometry(triangles);
  rtcCommitScene(all->scene);
  if (const RTCError error = rtcGetDeviceError(all->device); error != RTC_ERROR_NONE)
    return Error{ErrorKind::device,
                 error == RTC_ERROR_OUT_OF_MEMORY ? "not enough memory for its triangles" : "Embree failed",
                 "geometry", "Simplify the geometry"};
  return Surfaces(std::move(all));
}

}  // namespace emberlock::apply
