// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/ray_scene.h"

#include <embree3/rtcore.h>

#include <cstring>
#include <limits>
#include <string>
#include <utility>

#include "fusion/surface/mesh_check.h"

namespace veduta {
namespace {

// Embree reads vertices 16 bytes at a time: this many positions must be readable behind the last.
constexpr size_t kPositionsBehind = 2;
constexpr size_t kHierarchyBytes = 80;  // for each triangle, Embree 3.13's default build

RTCDevice Device(void* device) {
  return static_cast<RTCDevice>(device);
}
RTCScene SceneOf(void* scene) {
  return static_cast<RTCScene>(scene);
}

Status Failure(RTCDevice device, const std::string& what) {
  const RTCError error = rtcGetDeviceError(device);
  if (error == RTC_ERROR_NONE) return {};
  return Status::IoError(
      "Embree cannot build " + what +
      (error == RTC_ERROR_OUT_OF_MEMORY ? ": out of memory" : ": error " + std::to_string(error)));
}

// Packets are traced without RTC_INTERSECT_CONTEXT_FLAG_COHERENT: with it rays of one camera are
// twice as fast, but Embree 3.13.5 did not come back from rtcOccluded16 on instances (test
// VertexColor.TheBoardsColourStaysOnTheBoard).
template <typename Ray16>
void Fill(const RayPacket& rays, Ray16* out, int valid[kRayLanes]) {
  for (int i = 0; i < kRayLanes; ++i) valid[i] = rays.live[i] ? -1 : 0;
  std::memcpy(out->org_x, rays.origin[0], sizeof out->org_x);
  std::memcpy(out->org_y, rays.origin[1], sizeof out->org_y);
  std::memcpy(out->org_z, rays.origin[2], sizeof out->org_z);
  std::memcpy(out->dir_x, rays.direction[0], sizeof out->dir_x);
  std::memcpy(out->dir_y, rays.direction[1], sizeof out->dir_y);
  std::memcpy(out->dir_z, rays.direction[2], sizeof out->dir_z);
  std::memcpy(out->tnear, rays.t_near, sizeof out->tnear);
  std::memcpy(out->tfar, rays.t_far, sizeof out->tfar);
  for (int i = 0; i < kRayLanes; ++i) {
    out->time[i] = 0;
    out->mask[i] = ~0u;
    out->id[i] = 0;
    out->flags[i] = 0;
  }
}

}  // namespace

Result<std::shared_ptr<const RayDevice>> RayDevice::Open() {
  std::shared_ptr<RayDevice> opened(new RayDevice());
  // Hierarchies are built by whoever calls: the pool's threads build tiles side by side.
  opened->device_ = rtcNewDevice("set_affinity=0,threads=1");
  if (opened->device_ == nullptr) {
    return Status::IoError("Embree cannot start: error " +
                           std::to_string(rtcGetDeviceError(nullptr)));
  }
  return std::shared_ptr<const RayDevice>(std::move(opened));
}

RayDevice::~RayDevice() {
  if (device_ != nullptr) rtcReleaseDevice(Device(device_));
}

Result<std::shared_ptr<const RayTile>> RayTile::Make(std::shared_ptr<const RayDevice> device,
                                                     TriangleMesh mesh) {
  VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
  std::shared_ptr<RayTile> tile(new RayTile());
  tile->device_ = std::move(device);
  tile->mesh_ = std::move(mesh);
  for (const Eigen::Vector3f& x : tile->mesh_.positions) tile->box_.extend(x);
  std::vector<Eigen::Vector3f>& positions = tile->mesh_.positions;
  const std::vector<std::array<uint32_t, 3>>& triangles = tile->mesh_.triangles;
  positions.reserve(positions.size() + kPositionsBehind);
  const RTCDevice embree = Device(tile->device_->device_);
  const RTCScene scene = rtcNewScene(embree);
  tile->scene_ = scene;
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  if (!triangles.empty()) {
    const RTCGeometry geometry = rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_TRIANGLE);
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                               positions.data(), 0, sizeof(Eigen::Vector3f), positions.size());
    rtcSetSharedGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                               triangles.data(), 0, sizeof triangles[0], triangles.size());
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene, geometry, 0);
    rtcReleaseGeometry(geometry);
  }
  rtcCommitScene(scene);
  VEDUTA_RETURN_IF_ERROR(
      Failure(embree, "a tile of " + std::to_string(triangles.size()) + " triangles"));
  return std::shared_ptr<const RayTile>(std::move(tile));
}

RayTile::~RayTile() {
  if (scene_ != nullptr) rtcReleaseScene(SceneOf(scene_));
}

size_t RayTile::size_bytes() const {
  return sizeof *this + mesh_.positions.capacity() * sizeof(Eigen::Vector3f) +
         mesh_.normals.capacity() * sizeof(Eigen::Vector3f) + mesh_.colors.capacity() * 3 +
         mesh_.triangles.capacity() * (sizeof(std::array<uint32_t, 3>) + kHierarchyBytes);
}

Result<std::shared_ptr<const RayScene>> RayScene::Make(
    std::shared_ptr<const RayDevice> device, std::vector<std::shared_ptr<const RayTile>> tiles) {
  std::shared_ptr<RayScene> joined(new RayScene());
  joined->device_ = std::move(device);
  joined->tiles_ = std::move(tiles);
  const RTCDevice embree = Device(joined->device_->device_);
  const RTCScene scene = rtcNewScene(embree);
  joined->scene_ = scene;
  rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
  for (size_t i = 0; i < joined->tiles_.size(); ++i) {
    const RayTile* const tile = joined->tiles_[i].get();
    if (tile == nullptr || tile->device_ != joined->device_) {
      return Status::InvalidArgument("tile " + std::to_string(i) + " of a scene of rays " +
                                     (tile == nullptr ? "is null" : "belongs to another device"));
    }
    if (tile->mesh_.triangles.empty()) continue;
    const RTCGeometry instance = rtcNewGeometry(embree, RTC_GEOMETRY_TYPE_INSTANCE);
    rtcSetGeometryInstancedScene(instance, SceneOf(tile->scene_));
    rtcCommitGeometry(instance);
    rtcAttachGeometryByID(scene, instance, static_cast<unsigned>(i));
    rtcReleaseGeometry(instance);
  }
  rtcCommitScene(scene);
  VEDUTA_RETURN_IF_ERROR(
      Failure(embree, "a scene of " + std::to_string(joined->tiles_.size()) + " tiles"));
  return std::shared_ptr<const RayScene>(std::move(joined));
}

RayScene::~RayScene() {
  if (scene_ != nullptr) rtcReleaseScene(SceneOf(scene_));
}

void RayScene::Intersect(const RayPacket& rays, RayHits* hits) const {
  RTCRayHit16 packet;
  alignas(64) int valid[kRayLanes];
  Fill(rays, &packet.ray, valid);
  for (int i = 0; i < kRayLanes; ++i) {
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect16(valid, SceneOf(scene_), &context, &packet);
  for (int i = 0; i < kRayLanes; ++i) {
    const bool is_hit = rays.live[i] && packet.hit.geomID[i] != RTC_INVALID_GEOMETRY_ID;
    hits->tile[i] = is_hit ? static_cast<int32_t>(packet.hit.instID[0][i]) : -1;
    hits->triangle[i] = packet.hit.primID[i];
    hits->t[i] = packet.ray.tfar[i];
    hits->u[i] = packet.hit.u[i];
    hits->v[i] = packet.hit.v[i];
  }
}

uint32_t RayScene::Occluded(const RayPacket& rays) const {
  RTCRay16 packet;
  alignas(64) int valid[kRayLanes];
  Fill(rays, &packet, valid);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid, SceneOf(scene_), &context, &packet);
  uint32_t occluded = 0;
  for (int i = 0; i < kRayLanes; ++i) {
    if (rays.live[i] && packet.tfar[i] == -std::numeric_limits<float>::infinity())
      occluded |= 1u << i;
  }
  return occluded;
}

}  // namespace veduta
