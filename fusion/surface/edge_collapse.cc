// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/edge_collapse.h"

#include <Eigen/Geometry>
#include <OpenMesh/Core/Mesh/TriMesh_ArrayKernelT.hh>
#include <algorithm>
#include <cmath>
#include <queue>
#include <tuple>
#include <utility>

#include "fusion/surface/nearest_point.h"
#include "storage/base/angle.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr size_t kLostMax = 12;   // places that a triangle remembers: those furthest from it
constexpr double kNeedle = 1e-3;  // twice the area by the longer edge squared
constexpr double kLengthCost =
    1e-6;  // of an edge to the fourth beside the quadric: on planes, short edges first

struct Traits : public OpenMesh::DefaultTraits {
  using Point = OpenMesh::Vec3d;
  using Normal = OpenMesh::Vec3d;
  VertexAttributes(OpenMesh::Attributes::Status);
  EdgeAttributes(OpenMesh::Attributes::Status);
  FaceAttributes(OpenMesh::Attributes::Status);
  HalfedgeAttributes(OpenMesh::Attributes::PrevHalfedge);
};
using Mesh = OpenMesh::TriMesh_ArrayKernelT<Traits>;
using OpenMesh::FaceHandle;
using OpenMesh::HalfedgeHandle;
using OpenMesh::VertexHandle;
using Quadric =
    Eigen::Matrix4d;  // x^T Q x: sum of squared distances of (x, 1) from planes, by their areas

// What is wrong with a collapse, least first; of equal ones the half-edge that comes first.
struct Candidate {
  double cost;
  int halfedge;
  uint32_t version_from, version_to;  // of its vertices when the cost was computed
  bool operator>(const Candidate& other) const {
    return std::tie(cost, halfedge) > std::tie(other.cost, other.halfedge);
  }
};

// A place of the surface and its colour (sRGB).
struct Place {
  Eigen::Vector3d x, color;
};
using Corners = std::array<Place, 3>;

class Collapser final {
 public:
  Collapser(const TriangleMesh& mesh, const SimplificationOptions& options, double distance_max)
      : source_(mesh),
        options_(options),
        square_max_(distance_max * distance_max),
        color_square_max_(options.color_error_max * options.color_error_max),
        turn_cosine_min_(std::cos(options.normal_turn_deg_max * kRadPerDeg)) {}

  std::vector<std::array<uint32_t, 3>> Run();

 private:
  void Build();
  void LockVertices();
  void Push(HalfedgeHandle halfedge);
  void PushAround(VertexHandle vertex);
  bool IsAllowed(HalfedgeHandle halfedge);
  void Collapse(HalfedgeHandle halfedge);
  bool Turn(HalfedgeHandle halfedge);
  void GatherLost(VertexHandle vertex);

  Eigen::Vector3d At(VertexHandle v) const { return source_.positions[v.idx()].cast<double>(); }
  Place PlaceOf(VertexHandle v) const;
  Corners CornersOf(FaceHandle face) const;
  static Eigen::Vector3d NormalOf(const Corners& c) {
    return (c[1].x - c[0].x).cross(c[2].x - c[0].x);
  }
  double Error(const Place& place, const Corners& corners) const;

  const TriangleMesh& source_;
  const SimplificationOptions& options_;
  const double square_max_, color_square_max_, turn_cosine_min_;
  Mesh mesh_;
  std::vector<std::array<uint32_t, 3>> aside_;  // triangles that no half-edge mesh can hold
  std::vector<Quadric> quadrics_;
  std::vector<uint32_t> versions_;
  std::vector<std::vector<Place>> lost_;  // places of the old surface that are nearest to each face
  std::vector<Place> places_;             // scratch
  std::vector<Corners> turned_;           // scratch
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

Place Collapser::PlaceOf(VertexHandle v) const {
  if (source_.colors.empty()) return {At(v), Eigen::Vector3d::Zero()};
  const auto& color = source_.colors[v.idx()];
  return {At(v), {double{1} * color[0], double{1} * color[1], double{1} * color[2]}};
}

Corners Collapser::CornersOf(FaceHandle face) const {
  Corners corners;
  int k = 0;
  for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v) corners[k++] = PlaceOf(*v);
  return corners;
}

// How far the place is from the triangle, as a share of the bounds, squared: in space, or in colour
// where it is nearest.
double Collapser::Error(const Place& place, const Corners& c) const {
  const Eigen::Vector3d nearest = NearestOnTriangle(place.x, c[0].x, c[1].x, c[2].x);
  const double distance = (nearest - place.x).squaredNorm() / square_max_;
  if (distance > 1 || source_.colors.empty()) return distance;
  const Eigen::Vector3d normal = NormalOf(c), from = nearest - c[0].x;
  const double v = from.cross(c[2].x - c[0].x).dot(normal),
               w = (c[1].x - c[0].x).cross(from).dot(normal);
  const double whole = std::max(normal.squaredNorm(), 1e-300);
  const Eigen::Vector3d color =
      c[0].color + v / whole * (c[1].color - c[0].color) + w / whole * (c[2].color - c[0].color);
  return std::max(distance, (color - place.color).squaredNorm() / color_square_max_);
}

void Collapser::Build() {
  // OpenMesh prints what it refuses; we keep such triangles instead.
  static const bool is_quiet = (omerr().disable(), true);
  static_cast<void>(is_quiet);
  mesh_.reserve(source_.positions.size(), source_.triangles.size() * 3 / 2,
                source_.triangles.size());
  for (const Eigen::Vector3f& x : source_.positions) {
    mesh_.add_vertex(OpenMesh::Vec3d(double{x.x()}, double{x.y()}, double{x.z()}));
  }
  for (const auto& triangle : source_.triangles) {
    const auto& [a, b, c] = triangle;
    if (a == b || b == c || c == a) continue;
    const FaceHandle face =
        mesh_.add_face(VertexHandle(static_cast<int>(a)), VertexHandle(static_cast<int>(b)),
                       VertexHandle(static_cast<int>(c)));
    if (!face.is_valid()) aside_.push_back(triangle);
  }
  lost_.resize(mesh_.n_faces());
  versions_.resize(mesh_.n_vertices());
  quadrics_.assign(mesh_.n_vertices(), Quadric::Zero());
  for (const FaceHandle face : mesh_.faces()) {
    const Corners corners = CornersOf(face);
    const Eigen::Vector3d normal = NormalOf(corners);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector3d n = normal / length;
    const Eigen::Vector4d plane(n.x(), n.y(), n.z(), -n.dot(corners[0].x));
    const Quadric quadric = 0.5 * length * plane * plane.transpose();
    for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v) quadrics_[v->idx()] += quadric;
  }
}

void Collapser::LockVertices() {
  for (const auto& triangle : aside_) {
    for (const uint32_t v : triangle)
      mesh_.status(VertexHandle(static_cast<int>(v))).set_locked(true);
  }
  for (const VertexHandle v : mesh_.vertices()) {
    if (mesh_.is_isolated(v) || (options_.keep_border && mesh_.is_boundary(v)) ||
        !mesh_.is_manifold(v)) {
      mesh_.status(v).set_locked(true);
    }
  }
}

void Collapser::Push(HalfedgeHandle halfedge) {
  const VertexHandle from = mesh_.from_vertex_handle(halfedge),
                     to = mesh_.to_vertex_handle(halfedge);
  if (mesh_.status(from).locked()) return;
  const Quadric quadric = quadrics_[from.idx()] + quadrics_[to.idx()];
  const Eigen::Vector4d place = At(to).homogeneous();
  const double square = (At(from) - At(to)).squaredNorm();
  const double cost = std::max(0.0, place.dot(quadric * place)) + kLengthCost * square * square;
  queue_.push({cost, halfedge.idx(), versions_[from.idx()], versions_[to.idx()]});
}

void Collapser::PushAround(VertexHandle vertex) {
  for (auto h = mesh_.voh_iter(vertex); h.is_valid(); ++h) {
    Push(*h);
    Push(mesh_.opposite_halfedge_handle(*h));
  }
}

// What of the surface goes with a vertex: itself, the middles of its edges, and what its faces
// remember.
void Collapser::GatherLost(VertexHandle vertex) {
  const Place middle = PlaceOf(vertex);
  places_.assign(1, middle);
  for (auto v = mesh_.cvv_iter(vertex); v.is_valid(); ++v) {
    const Place other = PlaceOf(*v);
    places_.push_back({0.5 * (middle.x + other.x), 0.5 * (middle.color + other.color)});
  }
  for (auto f = mesh_.cvf_iter(vertex); f.is_valid(); ++f) {
    const auto& lost = lost_[f->idx()];
    places_.insert(places_.end(), lost.begin(), lost.end());
  }
}

// The faces around the half-edge's beginning as they would be; false where one folds over or
// becomes a needle.
bool Collapser::Turn(HalfedgeHandle halfedge) {
  const VertexHandle from = mesh_.from_vertex_handle(halfedge);
  const Place new_place = PlaceOf(mesh_.to_vertex_handle(halfedge));
  const FaceHandle left = mesh_.face_handle(halfedge);
  const FaceHandle right = mesh_.face_handle(mesh_.opposite_halfedge_handle(halfedge));
  turned_.clear();
  for (auto f = mesh_.cvf_iter(from); f.is_valid(); ++f) {
    if (*f == left || *f == right) continue;
    Corners corners = CornersOf(*f);
    const Eigen::Vector3d before = NormalOf(corners);
    int k = 0;
    for (auto v = mesh_.cfv_iter(*f); v.is_valid(); ++v, ++k) {
      if (*v == from) corners[k] = new_place;
    }
    const Eigen::Vector3d after = NormalOf(corners);
    const double longest = std::max((corners[1].x - corners[0].x).squaredNorm(),
                                    (corners[2].x - corners[0].x).squaredNorm());
    if (after.norm() < kNeedle * longest) return false;
    if (before.dot(after) < turn_cosine_min_ * before.norm() * after.norm()) return false;
    turned_.push_back(corners);
  }
  return !turned_.empty();
}

bool Collapser::IsAllowed(HalfedgeHandle halfedge) {
  if (!mesh_.is_collapse_ok(halfedge)) return false;
  const VertexHandle from = mesh_.from_vertex_handle(halfedge);
  // A border vertex may only slide along the border, which would be cut otherwise.
  if (mesh_.is_boundary(from) && !mesh_.is_boundary(mesh_.edge_handle(halfedge))) return false;
  if (!Turn(halfedge)) return false;
  GatherLost(from);
  return std::all_of(places_.begin(), places_.end(), [&](const Place& place) {
    return std::any_of(turned_.begin(), turned_.end(),
                       [&](const Corners& c) { return Error(place, c) <= 1; });
  });
}

void Collapser::Collapse(HalfedgeHandle halfedge) {
  const VertexHandle from = mesh_.from_vertex_handle(halfedge),
                     to = mesh_.to_vertex_handle(halfedge);
  GatherLost(from);
  for (auto f = mesh_.cvf_iter(from); f.is_valid(); ++f) lost_[f->idx()].clear();
  mesh_.collapse(halfedge);
  quadrics_[to.idx()] += quadrics_[from.idx()];
  ++versions_[to.idx()];
  ++versions_[from.idx()];
  std::vector<std::pair<FaceHandle, Corners>> faces;
  for (auto f = mesh_.cvf_iter(to); f.is_valid(); ++f) faces.emplace_back(*f, CornersOf(*f));
  std::vector<std::vector<std::pair<double, size_t>>> given(
      faces.size());  // error and index of the place
  for (size_t i = 0; i < places_.size(); ++i) {
    size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < faces.size(); ++k) {
      const double error = Error(places_[i], faces[k].second);
      if (error < least) least = error, best = k;
    }
    given[best].emplace_back(least, i);
  }
  for (size_t k = 0; k < faces.size(); ++k) {
    auto& lost = lost_[faces[k].first.idx()];
    std::sort(given[k].begin(), given[k].end(), [](const auto& a, const auto& b) {
      return std::pair(-a.first, a.second) < std::pair(-b.first, b.second);
    });
    for (const auto& [error, i] : given[k]) {
      if (lost.size() < kLostMax) lost.push_back(places_[i]);
    }
  }
  PushAround(to);
}

std::vector<std::array<uint32_t, 3>> Collapser::Run() {
  Build();
  LockVertices();
  for (const HalfedgeHandle h : mesh_.halfedges()) Push(h);
  while (!queue_.empty()) {
    const Candidate candidate = queue_.top();
    queue_.pop();
    const HalfedgeHandle halfedge(candidate.halfedge);
    if (mesh_.status(mesh_.edge_handle(halfedge)).deleted()) continue;
    const VertexHandle from = mesh_.from_vertex_handle(halfedge),
                       to = mesh_.to_vertex_handle(halfedge);
    if (versions_[from.idx()] != candidate.version_from ||
        versions_[to.idx()] != candidate.version_to)
      continue;
    if (IsAllowed(halfedge)) Collapse(halfedge);
  }
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const FaceHandle face : mesh_.faces()) {
    std::array<uint32_t, 3> triangle;
    int k = 0;
    for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v)
      triangle[k++] = static_cast<uint32_t>(v->idx());
    triangles.push_back(triangle);
  }
  triangles.insert(triangles.end(), aside_.begin(), aside_.end());
  return triangles;
}

}  // namespace

std::vector<std::array<uint32_t, 3>> CollapseEdges(const TriangleMesh& mesh,
                                                   const SimplificationOptions& options,
                                                   double distance_max) {
  return Collapser(mesh, options, distance_max).Run();
}

}  // namespace veduta
