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

}  // namespace

struct Surfaces::Embree {
  explicit Embree(Mesh m) : mesh(std::move(m)) {
    // Embree reads whole vectors: 16 bytes from the last vertex on must be there.
    mesh.vertices.push_back({0, 0, 0});
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
  const Eigen::Vector3d normal =
      Eigen::Vector3f(query.hit.Ng_x, query.hit.Ng_y, query.hit.Ng_z).cast<double>().normalized();
  const Mesh& mesh = embree_->mesh;
  return Hit{static_cast<double>(query.ray.tfar),
             normal.dot(direction) > 0 ? Eigen::Vector3d(-normal) : normal,
             &mesh.materials[mesh.material[query.hit.primID]]};
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
