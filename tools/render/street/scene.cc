// SPDX-License-Identifier: Apache-2.0
#include "tools/render/street/scene.h"

#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <fstream>
#include <limits>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "tools/render/street/facade.h"
#include "tools/render/street/furniture.h"

namespace veduta::street {
namespace {

constexpr size_t kRayTablesMax = 4;
constexpr float kNearM = 0.02f;

void AddBlock(const Plan& plan, size_t index, uint64_t seed, const SceneOptions& options,
              QuadMesh& mesh) {
  const Block& block = plan.blocks[index];
  for (int side = 0; side < 4; ++side) {
    if ((block.sides >> side & 1) == 0) continue;
    const BlockEdge edge = EdgeOf(block, side);
    const WallFrame frame = {{edge.from.x(), edge.from.y(), 0},
                             {edge.along.x(), edge.along.y(), 0}};
    const uint64_t own = MixSeed(seed, side);
    std::vector<TwinHouses> twins;
    for (const TwinPlace& place : plan.twins) {
      if (place.block != index || place.side != side) continue;
      const uint64_t pair = MixSeed(MixSeed(options.seed, 3), place.pair);
      twins.push_back({place.from_m, place.length_m, pair});
    }
    AddHouseRow(frame, edge.length_m, options.repeated_windows ? options.seed : own,
                options.repeated_windows, twins, mesh);
    AddPavement(frame, edge.length_m, MixSeed(own, 1), mesh);
  }
}

QuadMesh MakeMesh(const SceneOptions& options, const Plan& plan) {
  QuadMesh mesh;
  AddGround(plan.low, plan.high, MixSeed(options.seed, 1), mesh);
  const uint64_t blocks = MixSeed(options.seed, 2);
  for (size_t i = 0; i < plan.blocks.size(); ++i)
    AddBlock(plan, i, MixSeed(blocks, i), options, mesh);
  return mesh;
}

}  // namespace

struct Scene::Parts {
  ~Parts() {
    if (scene != nullptr) rtcReleaseScene(scene);
    if (device != nullptr) rtcReleaseDevice(device);
  }

  SceneOptions options;
  Plan plan;
  QuadMesh mesh;
  RTCDevice device = nullptr;
  RTCScene scene = nullptr;

  std::mutex mutex;
  std::vector<std::shared_ptr<const RayTable>> tables;  // oldest first
};

Scene::Scene(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}
Scene::~Scene() = default;
const SceneOptions& Scene::options() const {
  return parts_->options;
}
const Plan& Scene::plan() const {
  return parts_->plan;
}
const QuadMesh& Scene::mesh() const {
  return parts_->mesh;
}

void Scene::Trace(const float origin[3], const float direction[3][kLanes],
                  const Surface* surface[kLanes]) const {
  RTCRayHit16 packet;
  alignas(64) int valid[kLanes];
  for (int i = 0; i < kLanes; ++i) {
    valid[i] = -1;
    packet.ray.org_x[i] = origin[0];
    packet.ray.org_y[i] = origin[1];
    packet.ray.org_z[i] = origin[2];
    packet.ray.tnear[i] = kNearM;
    packet.ray.tfar[i] = std::numeric_limits<float>::infinity();
    packet.ray.time[i] = 0;
    packet.ray.mask[i] = ~0u;
    packet.ray.id[i] = 0;
    packet.ray.flags[i] = 0;
    packet.hit.geomID[i] = RTC_INVALID_GEOMETRY_ID;
    packet.hit.instID[0][i] = RTC_INVALID_GEOMETRY_ID;
  }
  std::memcpy(packet.ray.dir_x, direction[0], sizeof packet.ray.dir_x);
  std::memcpy(packet.ray.dir_y, direction[1], sizeof packet.ray.dir_y);
  std::memcpy(packet.ray.dir_z, direction[2], sizeof packet.ray.dir_z);
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  context.flags = RTC_INTERSECT_CONTEXT_FLAG_COHERENT;
  rtcIntersect16(valid, parts_->scene, &context, &packet);
  const Surface* const surfaces = parts_->mesh.surfaces().data();
  const uint32_t* const of_quad = parts_->mesh.surface_of_quad().data();
  for (int i = 0; i < kLanes; ++i) {
    surface[i] = packet.hit.geomID[i] == RTC_INVALID_GEOMETRY_ID
                     ? nullptr
                     : surfaces + of_quad[packet.hit.primID[i]];
  }
}

Result<std::shared_ptr<const RayTable>> Scene::Rays(const CameraModel& camera) const {
  const std::lock_guard lock(parts_->mutex);
  for (const auto& table : parts_->tables) {
    if (table->camera == camera) return table;
  }
  VEDUTA_ASSIGN_OR_RETURN(RayTable made, MakeRayTable(camera));
  if (parts_->tables.size() == kRayTablesMax) parts_->tables.erase(parts_->tables.begin());
  parts_->tables.push_back(std::make_shared<const RayTable>(std::move(made)));
  return parts_->tables.back();
}

Result<std::unique_ptr<Scene>> BuildScene(const SceneOptions& options) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  auto parts = std::make_unique<Scene::Parts>();
  parts->options = options;
  parts->plan = MakePlan(options);
  parts->mesh = MakeMesh(options, parts->plan);
  const std::string config = "set_affinity=0,threads=" + std::to_string(options.build_threads);
  parts->device = rtcNewDevice(config.c_str());
  if (parts->device == nullptr) {
    return Status::IoError("Embree cannot start: error " +
                           std::to_string(rtcGetDeviceError(nullptr)));
  }
  parts->scene = rtcNewScene(parts->device);
  RTCGeometry geometry = rtcNewGeometry(parts->device, RTC_GEOMETRY_TYPE_QUAD);
  const size_t quads = parts->mesh.quad_count();
  void* const vertices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                 RTC_FORMAT_FLOAT3, 3 * sizeof(float), quads * 4);
  void* const indices = rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0,
                                                RTC_FORMAT_UINT4, 4 * sizeof(uint32_t), quads);
  if (vertices != nullptr && indices != nullptr) {
    std::memcpy(vertices, parts->mesh.vertices().data(),
                parts->mesh.vertices().size() * sizeof(float));
    for (uint32_t i = 0; i < quads * 4; ++i) static_cast<uint32_t*>(indices)[i] = i;
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(parts->scene, geometry);
  }
  rtcReleaseGeometry(geometry);
  rtcCommitScene(parts->scene);
  if (const RTCError error = rtcGetDeviceError(parts->device); error != RTC_ERROR_NONE) {
    return Status::IoError("Embree cannot build a scene of " + std::to_string(quads) +
                           " quads: error " + std::to_string(error));
  }
  return std::unique_ptr<Scene>(new Scene(std::move(parts)));
}

Status WriteMesh(const Scene& scene, const std::string& path) {
  std::ofstream file(path, std::ios::binary);
  const QuadMesh& mesh = scene.mesh();
  file << "ply\nformat binary_little_endian 1.0\ncomment metres, z up\nelement vertex "
       << mesh.quad_count() * 4
       << "\nproperty float x\nproperty float y\nproperty float z\nelement face "
       << mesh.quad_count()
       << "\nproperty list uchar int vertex_indices\nproperty uchar red\nproperty uchar "
          "green\nproperty uchar blue\n"
       << "end_header\n";
  file.write(reinterpret_cast<const char*>(mesh.vertices().data()),
             static_cast<std::streamsize>(mesh.vertices().size() * sizeof(float)));
  for (uint32_t i = 0; i < mesh.quad_count(); ++i) {
    char face[20];
    face[0] = 4;
    for (uint32_t k = 0; k < 4; ++k) {
      const uint32_t index = 4 * i + k;
      std::memcpy(face + 1 + 4 * k, &index, 4);
    }
    const Surface& surface = mesh.surfaces()[mesh.surface_of_quad()[i]];
    for (int c = 0; c < 3; ++c) {
      face[17 + c] = static_cast<char>(
          static_cast<uint8_t>(255 * std::sqrt(std::clamp(surface.tint[c], 0.f, 1.f))));
    }
    file.write(face, sizeof face);
  }
  file.close();
  if (!file) return Status::IoError("cannot write " + path);
  return {};
}

}  // namespace veduta::street
