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

namespace veduta {
namespace {

constexpr double kDegree = 0.017453292519943295;
constexpr size_t kPointsMax = 12;     // remembered a triangle: those furthest from it
constexpr double kLengthCost = 1e-6;  // of an edge to the fourth beside the quadric: on planes, short edges first

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
using Quadric = Eigen::Matrix4d;  // x^T Q x: sum of squared distances of (x, 1) from planes, by their areas

// What is wrong with a collapse, least first; of equal ones the half-edge that comes first.
struct Candidate {
  double cost;
  int halfedge;
  uint32_t version_from, version_to;  // of its vertices when the cost was computed
  bool operator>(const Candidate& other) const {
    return std::tie(cost, halfedge) > std::tie(other.cost, other.halfedge);
  }
};

using Corners = std::array<Eigen::Vector3d, 3>;

class Collapser final {
 public:
  Collapser(const TriangleMesh& mesh, const SimplificationOptions& options, double distance_max)
      : source_(mesh),
        options_(options),
        square_max_(distance_max * distance_max),
        turn_cosine_min_(std::cos(options.normal_turn_deg_max * kDegree)) {}

  std::vector<std::array<uint32_t, 3>> Run();

 private:
  void Build();
  void LockVertices();
  void Push(HalfedgeHandle halfedge);
  void PushAround(VertexHandle vertex);
  bool IsAllowed(HalfedgeHandle halfedge);
  void Collapse(HalfedgeHandle halfedge);
  std::vector<Eigen::Vector3d> LostPlaces(VertexHandle vertex) const;

  Eigen::Vector3d At(VertexHandle v) const { return source_.positions[v.idx()].cast<double>(); }
  Corners CornersOf(FaceHandle face) const;
  static Eigen::Vector3d NormalOf(const Corners& c) { return (c[1] - c[0]).cross(c[2] - c[0]); }
  static double SquareTo(const Eigen::Vector3d& p, const Corners& c) {
    return (NearestOnTriangle(p, c[0], c[1], c[2]) - p).squaredNorm();
  }

  const TriangleMesh& source_;
  const SimplificationOptions& options_;
  const double square_max_, turn_cosine_min_;
  Mesh mesh_;
  std::vector<std::array<uint32_t, 3>> aside_;  // triangles that no half-edge mesh can hold
  std::vector<Quadric> quadrics_;
  std::vector<uint32_t> versions_;
  std::vector<std::vector<Eigen::Vector3d>> points_;  // places lost that are nearest to each face
  std::priority_queue<Candidate, std::vector<Candidate>, std::greater<>> queue_;
};

Corners Collapser::CornersOf(FaceHandle face) const {
  Corners corners;
  int k = 0;
  for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v) corners[k++] = At(*v);
  return corners;
}

void Collapser::Build() {
  // OpenMesh prints what it refuses; we keep such triangles instead.
  static const bool is_quiet = (omerr().disable(), true);
  static_cast<void>(is_quiet);
  mesh_.reserve(source_.positions.size(), source_.triangles.size() * 3 / 2, source_.triangles.size());
  for (const Eigen::Vector3f& x : source_.positions) {
    mesh_.add_vertex(OpenMesh::Vec3d(double{x.x()}, double{x.y()}, double{x.z()}));
  }
  for (const auto& triangle : source_.triangles) {
    const auto& [a, b, c] = triangle;
    if (a == b || b == c || c == a) continue;
    const FaceHandle face = mesh_.add_face(VertexHandle(static_cast<int>(a)), VertexHandle(static_cast<int>(b)),
                                           VertexHandle(static_cast<int>(c)));
    if (!face.is_valid()) aside_.push_back(triangle);
  }
  points_.resize(mesh_.n_faces());
  versions_.resize(mesh_.n_vertices());
  quadrics_.assign(mesh_.n_vertices(), Quadric::Zero());
  for (const FaceHandle face : mesh_.faces()) {
    const Corners corners = CornersOf(face);
    const Eigen::Vector3d normal = NormalOf(corners);
    const double length = normal.norm();
    if (!(length > 0)) continue;
    const Eigen::Vector3d n = normal / length;
    const Eigen::Vector4d plane(n.x(), n.y(), n.z(), -n.dot(corners[0]));
    const Quadric quadric = 0.5 * length * plane * plane.transpose();
    for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v) quadrics_[v->idx()] += quadric;
  }
}

void Collapser::LockVertices() {
  for (const auto& triangle : aside_) {
    for (const uint32_t v : triangle) mesh_.status(VertexHandle(static_cast<int>(v))).set_locked(true);
  }
  for (const VertexHandle v : mesh_.vertices()) {
    if (mesh_.is_isolated(v) || (options_.keep_border && mesh_.is_boundary(v)) || !mesh_.is_manifold(v)) {
      mesh_.status(v).set_locked(true);
    }
  }
}

void Collapser::Push(HalfedgeHandle halfedge) {
  const VertexHandle from = mesh_.from_vertex_handle(halfedge), to = mesh_.to_vertex_handle(halfedge);
  if (mesh_.status(from).locked()) return;
  if (!source_.colors.empty()) {
    double square = 0;
    for (int c = 0; c < 3; ++c) {
      square += std::pow(double{1} * source_.colors[from.idx()][c] - source_.colors[to.idx()][c], 2);
    }
    if (square > options_.color_step_max * options_.color_step_max) return;
  }
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

// Places of the surface that go with a vertex: itself and the middles of its edges.
std::vector<Eigen::Vector3d> Collapser::LostPlaces(VertexHandle vertex) const {
  std::vector<Eigen::Vector3d> places = {At(vertex)};
  for (auto v = mesh_.cvv_iter(vertex); v.is_valid(); ++v) places.push_back(0.5 * (At(vertex) + At(*v)));
  return places;
}

bool Collapser::IsAllowed(HalfedgeHandle halfedge) {
  if (!mesh_.is_collapse_ok(halfedge)) return false;
  const VertexHandle from = mesh_.from_vertex_handle(halfedge), to = mesh_.to_vertex_handle(halfedge);
  // On a border one slides along it: otherwise the border would be cut.
  if (mesh_.is_boundary(from) && !mesh_.is_boundary(mesh_.edge_handle(halfedge))) return false;
  const FaceHandle left = mesh_.face_handle(halfedge);
  const FaceHandle right = mesh_.face_handle(mesh_.opposite_halfedge_handle(halfedge));
  const Eigen::Vector3d old_place = At(from), new_place = At(to);
  std::vector<Corners> turned;
  for (auto f = mesh_.cvf_iter(from); f.is_valid(); ++f) {
    if (*f == left || *f == right) continue;
    Corners corners = CornersOf(*f);
    const Eigen::Vector3d before = NormalOf(corners);
    for (Eigen::Vector3d& corner : corners) {
      if (corner == old_place) corner = new_place;
    }
    const Eigen::Vector3d after = NormalOf(corners);
    const double longest = std::max((corners[1] - corners[0]).squaredNorm(), (corners[2] - corners[0]).squaredNorm());
    if (after.norm() < 1e-3 * longest) return false;  // a needle
    if (before.dot(after) < turn_cosine_min_ * before.norm() * after.norm()) return false;
    turned.push_back(corners);
  }
  if (turned.empty()) return false;
  const auto is_near = [&](const Eigen::Vector3d& p) {
    return std::any_of(turned.begin(), turned.end(), [&](const Corners& c) { return SquareTo(p, c) <= square_max_; });
  };
  const std::vector<Eigen::Vector3d> lost = LostPlaces(from);
  if (!std::all_of(lost.begin(), lost.end(), is_near)) return false;
  for (auto f = mesh_.cvf_iter(from); f.is_valid(); ++f) {
    const auto& points = points_[f->idx()];
    if (!std::all_of(points.begin(), points.end(), is_near)) return false;
  }
  return true;
}

void Collapser::Collapse(HalfedgeHandle halfedge) {
  const VertexHandle from = mesh_.from_vertex_handle(halfedge), to = mesh_.to_vertex_handle(halfedge);
  std::vector<Eigen::Vector3d> homeless = LostPlaces(from);
  for (auto f = mesh_.cvf_iter(from); f.is_valid(); ++f) {
    auto& points = points_[f->idx()];
    homeless.insert(homeless.end(), points.begin(), points.end());
    points.clear();
  }
  mesh_.collapse(halfedge);
  quadrics_[to.idx()] += quadrics_[from.idx()];
  ++versions_[to.idx()];
  ++versions_[from.idx()];
  std::vector<std::pair<FaceHandle, Corners>> faces;
  for (auto f = mesh_.cvf_iter(to); f.is_valid(); ++f) faces.emplace_back(*f, CornersOf(*f));
  std::vector<std::vector<std::pair<double, size_t>>> given(faces.size());  // distance and place among the homeless
  for (size_t i = 0; i < homeless.size(); ++i) {
    size_t best = 0;
    double least = std::numeric_limits<double>::infinity();
    for (size_t k = 0; k < faces.size(); ++k) {
      const double square = SquareTo(homeless[i], faces[k].second);
      if (square < least) least = square, best = k;
    }
    given[best].emplace_back(least, i);
  }
  for (size_t k = 0; k < faces.size(); ++k) {
    auto& points = points_[faces[k].first.idx()];
    std::sort(given[k].begin(), given[k].end(), [](const auto& a, const auto& b) {
      return std::pair(-a.first, a.second) < std::pair(-b.first, b.second);
    });
    for (const auto& [square, i] : given[k]) {
      if (points.size() < kPointsMax) points.push_back(homeless[i]);
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
    const VertexHandle from = mesh_.from_vertex_handle(halfedge), to = mesh_.to_vertex_handle(halfedge);
    if (versions_[from.idx()] != candidate.version_from || versions_[to.idx()] != candidate.version_to) continue;
    if (IsAllowed(halfedge)) Collapse(halfedge);
  }
  std::vector<std::array<uint32_t, 3>> triangles;
  for (const FaceHandle face : mesh_.faces()) {
    std::array<uint32_t, 3> triangle;
    int k = 0;
    for (auto v = mesh_.cfv_iter(face); v.is_valid(); ++v) triangle[k++] = static_cast<uint32_t>(v->idx());
    triangles.push_back(triangle);
  }
  triangles.insert(triangles.end(), aside_.begin(), aside_.end());
  return triangles;
}

}  // namespace

std::vector<std::array<uint32_t, 3>> CollapseEdges(const TriangleMesh& mesh, const SimplificationOptions& options,
                                                   double distance_max) {
  return Collapser(mesh, options, distance_max).Run();
}

}  // namespace veduta
