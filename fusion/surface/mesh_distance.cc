// SPDX-License-Identifier: Apache-2.0
// The distance between surfaces, by Embree's search for the nearest triangle.
#include <embree3/rtcore.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "fusion/surface/mesh_check.h"
#include "fusion/surface/nearest_point.h"
#include "fusion/surface/simplification.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr uint32_t kDivisionsMax = 64;  // of an edge

struct Search {
  const TriangleMesh* mesh;
  Eigen::Vector3d place;
  double square = std::numeric_limits<double>::infinity();
};

bool VisitTriangle(RTCPointQueryFunctionArguments* arguments) {
  Search& search = *static_cast<Search*>(arguments->userPtr);
  const auto& [a, b, c] = search.mesh->triangles[arguments->primID];
  const auto& at = search.mesh->positions;
  const Eigen::Vector3d nearest = NearestOnTriangle(search.place, at[a].cast<double>(),
                                                    at[b].cast<double>(), at[c].cast<double>());
  const double square = (nearest - search.place).squaredNorm();
  if (square >= search.square) return false;
  search.square = square;
  // A hair more than the distance, for boxes are compared in floats.
  arguments->query->radius = static_cast<float>(std::sqrt(square) * (1 + 1e-5)) + 1e-30f;
  return true;
}

class NearestSurface final {
 public:
  static Result<std::unique_ptr<NearestSurface>> Build(const TriangleMesh& mesh) {
    std::unique_ptr<NearestSurface> made(new NearestSurface());
    made->mesh_ = &mesh;
    made->device_ = rtcNewDevice("set_affinity=0,threads=1");
    if (made->device_ == nullptr) return Status::IoError("Embree cannot start");
    made->scene_ = rtcNewScene(made->device_);
    const RTCGeometry geometry = rtcNewGeometry(made->device_, RTC_GEOMETRY_TYPE_TRIANGLE);
    void* const positions =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3,
                                sizeof(Eigen::Vector3f), mesh.positions.size());
    void* const triangles =
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                sizeof(mesh.triangles[0]), mesh.triangles.size());
    if (positions != nullptr && triangles != nullptr) {
      std::copy(mesh.positions.begin(), mesh.positions.end(),
                static_cast<Eigen::Vector3f*>(positions));
      std::copy(mesh.triangles.begin(), mesh.triangles.end(),
                static_cast<std::array<uint32_t, 3>*>(triangles));
      rtcCommitGeometry(geometry);
      rtcAttachGeometry(made->scene_, geometry);
    }
    rtcReleaseGeometry(geometry);
    rtcCommitScene(made->scene_);
    if (const RTCError error = rtcGetDeviceError(made->device_); error != RTC_ERROR_NONE) {
      return Status::IoError("Embree cannot index a mesh of " +
                             std::to_string(mesh.triangles.size()) + " triangles: error " +
                             std::to_string(error));
    }
    return made;
  }
  ~NearestSurface() {
    if (scene_ != nullptr) rtcReleaseScene(scene_);
    if (device_ != nullptr) rtcReleaseDevice(device_);
  }
  NearestSurface(const NearestSurface&) = delete;
  NearestSurface& operator=(const NearestSurface&) = delete;

  // Quick for places that lie near each other, because the distance of the last one bounds that of
  // the next.
  double Distance(const Eigen::Vector3d& place) {
    const double bound = (last_distance_ + (place - last_place_).norm()) * (1 + 1e-5) + 1e-30;
    last_distance_ = Within(place, bound);
    if (std::isinf(last_distance_)) last_distance_ = Within(place, last_distance_);  // rounding
    last_place_ = place;
    return last_distance_;
  }

 private:
  double Within(const Eigen::Vector3d& place, double radius) const {
    Search search = {mesh_, place};
    RTCPointQuery query;
    query.x = static_cast<float>(place.x());
    query.y = static_cast<float>(place.y());
    query.z = static_cast<float>(place.z());
    query.radius = static_cast<float>(radius);
    query.time = 0;
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(scene_, &query, &context, VisitTriangle, &search);
    return std::sqrt(search.square);
  }

  NearestSurface() = default;
  const TriangleMesh* mesh_ = nullptr;
  RTCDevice device_ = nullptr;
  RTCScene scene_ = nullptr;
  Eigen::Vector3d last_place_ = Eigen::Vector3d::Zero();
  double last_distance_ = std::numeric_limits<double>::infinity();
};

}  // namespace

Result<double> DistanceTo(const TriangleMesh& from, const TriangleMesh& to, double spacing) {
  VEDUTA_RETURN_IF_ERROR(CheckMesh(from));
  VEDUTA_RETURN_IF_ERROR(CheckMesh(to));
  if (!(spacing > 0))
    return Status::InvalidArgument("spacing " + std::to_string(spacing) + " is not positive");
  if (from.triangles.empty()) return 0.0;
  if (to.triangles.empty()) return std::numeric_limits<double>::infinity();
  VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<NearestSurface> surface, NearestSurface::Build(to));
  double distance = 0;
  std::vector<uint8_t> is_tried(from.positions.size());  // vertices are many triangles' corners
  for (const auto& [i, j, k] : from.triangles) {
    const Eigen::Vector3d a = from.positions[i].cast<double>(),
                          b = from.positions[j].cast<double>();
    const Eigen::Vector3d c = from.positions[k].cast<double>();
    const double longest = std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()});
    // At least halves, so that middles of edges are among the samples; the middle of the triangle
    // in addition.
    const double wanted = std::max(2.0, std::ceil(longest / spacing));
    const auto n = static_cast<uint32_t>(std::min<double>(wanted, kDivisionsMax));
    for (uint32_t u = 0; u <= n; ++u) {
      for (uint32_t v = 0; u + v <= n; ++v) {
        if (u == n || v == n || u + v == 0) {
          const uint32_t corner = u == n ? j : v == n ? k : i;
          if (std::exchange(is_tried[corner], uint8_t{1})) continue;
        }
        const Eigen::Vector3d place = a + (b - a) * u / n + (c - a) * v / n;
        distance = std::max(distance, surface->Distance(place));
      }
    }
    distance = std::max(distance, surface->Distance((a + b + c) / 3));
  }
  return distance;
}

}  // namespace veduta
