// SPDX-License-Identifier: Apache-2.0
#include "apply/surfaces.h"

#include <limits>
#include <utility>

#include <Eigen/Geometry>
#include <embree3/rtcore.h>

namespace emberlock::apply {
namespace {

RTCRay ray_from(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double from, double to) {
  RTCRay ray = {};
  ray.org_x = static_cast<float>(origin[0]);
  ray.org_y = static_cast<float>(origin[1]);
  ray.org_z = static_cast<float>(origin[2]);
  ray.dir_x = static_cast<float>(direction[0]);
  ray.dir_y = static_cast<float>(direction[1]);
  ray.dir_z = static_cast<float>(direction[2]);
  ray.tnear = static_cast<float>(from);
  ray.tfar = static_cast<float>(to);
  ray.mask = ~0U;
  return ray;
}

Eigen::Vector3d vector_from(const std::array<float, 3>& v) {
  return {static_cast<double>(v[0]), static_cast<double>(v[1]), static_cast<double>(v[2])};
}

/// A place in a triangle, by its barycentric coordinates.
class Within {
 public:
  Within(const Mesh& mesh, std::uint32_t triangle, float u, float v)
      : mesh_(mesh),
        material_(mesh.materials[mesh.material[triangle]]),
        corners_(mesh.triangles[triangle]),
        weight_{1 - u - v, u, v} {}

  /// On the side of that of the triangle.
  [[nodiscard]] Eigen::Vector3d normal(const Eigen::Vector3d& flat) const {
    if (mesh_.normals.empty()) return flat;
    const Eigen::Vector3d smooth = vector_from(between(mesh_.normals));
    const double length = smooth.norm();
    if (!(length > 0)) return flat;
    return smooth / (smooth.dot(flat) < 0 ? -length : length);
  }
  [[nodiscard]] Eigen::Vector3d albedo() const {
    const Eigen::Vector3d factor = vector_from(material_.albedo);
    if (material_.texture < 0) return factor;
    const std::array<float, 2> at = between(mesh_.texture_places);
    const Texture& texture = mesh_.textures[static_cast<std::size_t>(material_.texture)];
    return factor.cwiseProduct(vector_from(texture.at(at[0], at[1])));
  }
  [[nodiscard]] Eigen::Vector3d emitted() const { return vector_from(material_.emitted); }

 private:
  template <std::size_t kLanes>
  [[nodiscard]] std::array<float, kLanes> between(
      const std::vector<std::array<float, kLanes>>& values) const {
    std::array<float, kLanes> sum{};
    for (std::size_t c = 0; c < 3; ++c)
      for (std::size_t lane = 0; lane < kLanes; ++lane) sum[lane] += weight_[c] * values[corners_[c]][lane];
    return sum;
  }

  const Mesh& mesh_;
  const Material& material_;
  const std::array<std::uint32_t, 3>& corners_;
  std::array<float, 3> weight_;
};

}  // namespace

struct Surfaces::Embree {
  explicit Embree(Mesh m) : mesh(std::move(m)) {
    // Embree reads whole vectors: 16 bytes from the last vertex on must be there.
    mesh.vertices.push_back({0, 0, 0});
    if (!mesh.normals.empty()) mesh.normals.resize(mesh.vertices.size());
    if (!mesh.texture_places.empty() || !mesh.textures.empty())
      mesh.texture_places.resize(mesh.vertices.size());
  }
  Embree(Embree&&) = delete;
  Embree& operator=(Embree&&) = delete;
  ~Embree() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  Mesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;
};

Surfaces::Surfaces(std::unique_ptr<Embree> embree) : embree_(std::move(embree)) {}
Surfaces::Surfaces(Surfaces&&) noexcept = default;
Surfaces& Surfaces::operator=(Surfaces&&) noexcept = default;
Surfaces::~Surfaces() = default;

bool Surfaces::empty() const { return embree_->mesh.triangles.empty(); }

Result<Surfaces> Surfaces::build(Mesh mesh) {
  auto all = std::make_unique<Embree>(std::move(mesh));
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

std::optional<Surfaces::Hit> Surfaces::first(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction,
                                             double nearest) const {
  if (empty()) return std::nullopt;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRayHit query = {};
  query.ray = ray_from(origin, direction, nearest, std::numeric_limits<double>::infinity());
  query.hit.geomID = query.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
  rtcIntersect1(embree_->scene, &context, &query);
  if (query.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
  Eigen::Vector3d normal =
      Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).cast<double>().normalized();
  if (normal.dot(direction) > 0) normal = -normal;
  const Within within(embree_->mesh, query.hit.primID, query.hit.u, query.hit.v);
  return Hit{static_cast<double>(query.ray.tfar), within.normal(normal), within.albedo(), within.emitted()};
}

bool Surfaces::blocked(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double from,
                       double to) const {
  if (empty()) return false;
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  RTCRay ray = ray_from(origin, direction, from, to);
  rtcOccluded1(embree_->scene, &context, &ray);
  return ray.tfar < 0;
}

}  // namespace emberlock::apply
