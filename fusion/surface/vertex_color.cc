// SPDX-License-Identifier: Apache-2.0
#include "fusion/surface/vertex_color.h"

#include <algorithm>
#include <cmath>

#include "fusion/surface/color_fill.h"
#include "fusion/surface/mesh_check.h"
#include "fusion/surface/robust_color.h"
#include "storage/base/angle.h"
#include "storage/base/denormals_off.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kClippedWeight = 0.1;
constexpr double kPixelsPerVoxelMax =
    2;  // finer photos say no more about a voxel: they must not outvote others
constexpr double kAroundVoxelsMax = 4;  // how far aside clear sight is looked for
constexpr double kBehindVoxelsMax = 6;  // how far behind that a surface must follow
constexpr size_t kChunk = 256;          // vertices of one task

struct Segment {
  Eigen::Vector3f from, to;
};

// A vertex in a photo that faces it.
struct Sight {
  uint32_t vertex;
  Eigen::Vector3d start;  // off the surface
  Eigen::Vector2d px;
  double voxel_px;  // pixels a voxel
  double cosine;
  double weight;
  bool is_clear = true;
};

// What a chunk's vertices have been told so far.
struct Heard {
  std::vector<std::vector<ColorSample>> samples;
  std::vector<uint8_t> is_clear;  // a photo sees it with nothing near that could spoil the colour
};

class Colorer final {
 public:
  Colorer(const TriangleMesh& mesh, const RayScene& scene, const ColoringOptions& options)
      : mesh_(mesh),
        scene_(scene),
        options_(options),
        cosine_min_(std::cos(options.incidence_deg_max * kRadPerDeg)) {}

  // The samples of vertices [first, last) from a view.
  void Gather(const ColorView& view, size_t first, size_t last, Heard* heard) const;

 private:
  std::vector<Sight> Facing(const ColorView& view, size_t first, size_t last) const;
  void RemoveHidden(const ColorView& view, std::vector<Sight>* sights) const;
  void WeighByClearSight(const ColorView& view, std::vector<Sight>* sights) const;
  std::vector<uint8_t> Blocked(const std::vector<Segment>& segments) const;

  const TriangleMesh& mesh_;
  const RayScene& scene_;
  const ColoringOptions& options_;
  const double cosine_min_;
};

// What the photo's frame and the vertices' normals say, without a ray.
std::vector<Sight> Colorer::Facing(const ColorView& view, size_t first, size_t last) const {
  const ViewGeometry& g = view.geometry();
  const double right = g.width_px - 1.0, bottom = g.height_px - 1.0;
  std::vector<Sight> sights;
  for (size_t v = first; v < last; ++v) {
    const Eigen::Vector3d x = mesh_.positions[v].cast<double>(),
                          normal = mesh_.normals[v].cast<double>();
    const Eigen::Vector3d to_view = view.center() - x;
    const double distance = to_view.norm();
    if (!(distance > 0)) continue;
    const double cosine = normal.dot(to_view) / distance;
    if (cosine <= cosine_min_) continue;
    const Eigen::Vector3d in_cam = g.cam_from_world * x;
    if (in_cam.z() <= 0) continue;
    if (in_cam.z() > options_.voxels_per_pixel_max * options_.voxel_size * g.camera.fx) continue;
    const Eigen::Vector2d px = g.camera.Project(in_cam);
    const double to_border =
        std::min(std::min(px.x(), right - px.x()), std::min(px.y(), bottom - px.y()));
    if (!(to_border >= 0)) continue;
    const double margin = options_.border_margin_px;
    const double fade = to_border < margin ? to_border / margin : 1;
    const double voxel_px = options_.voxel_size * g.camera.focal_px() / in_cam.z();
    const double resolution = std::min(voxel_px, kPixelsPerVoxelMax);
    const double weight = cosine * resolution * resolution * fade;
    if (!(weight > 0)) continue;
    sights.push_back({static_cast<uint32_t>(v),
                      x + options_.offset_voxels * options_.voxel_size * normal, px, voxel_px,
                      cosine, weight});
  }
  return sights;
}

std::vector<uint8_t> Colorer::Blocked(const std::vector<Segment>& segments) const {
  std::vector<uint8_t> blocked(segments.size());
  RayPacket rays;
  for (size_t first = 0; first < segments.size(); first += kRayLanes) {
    const size_t count = std::min<size_t>(kRayLanes, segments.size() - first);
    for (size_t i = 0; i < kRayLanes; ++i) {
      const Segment& segment = segments[first + std::min(i, count - 1)];
      for (int c = 0; c < 3; ++c) {
        rays.origin[c][i] = segment.from[c];
        rays.direction[c][i] = segment.to[c] - segment.from[c];
      }
      rays.t_near[i] = 0;
      rays.t_far[i] = 1;
      rays.live[i] = i < count;
    }
    const uint32_t occluded = scene_.Occluded(rays);
    for (size_t i = 0; i < count; ++i) blocked[first + i] = occluded >> i & 1;
  }
  return blocked;
}

void Colorer::RemoveHidden(const ColorView& view, std::vector<Sight>* sights) const {
  std::vector<Segment> segments;
  const Eigen::Vector3f center = view.center().cast<float>();
  for (const Sight& sight : *sights) segments.push_back({sight.start.cast<float>(), center});
  const std::vector<uint8_t> blocked = Blocked(segments);
  size_t kept = 0;
  for (size_t i = 0; i < sights->size(); ++i) {
    if (!blocked[i]) (*sights)[kept++] = (*sights)[i];
  }
  sights->resize(kept);
}

// Near the outline of something in front, or of the surface itself before something further away,
// photo and surface disagree by a pixel or two, and what is averaged over a voxel holds both. So
// four places around the vertex, on its tangent plane, must be in sight of the photo, and must have
// surface behind them.
void Colorer::WeighByClearSight(const ColorView& view, std::vector<Sight>* sights) const {
  const Eigen::Matrix3d axes =
      view.geometry().cam_from_world.rotation.toRotationMatrix();  // rows: right, down, forward
  const double voxel = options_.voxel_size, aside_max = kAroundVoxelsMax * voxel;
  std::vector<Segment> to_view, behind;
  for (const Sight& sight : *sights) {
    const Eigen::Vector3d normal = mesh_.normals[sight.vertex].cast<double>();
    const Eigen::Vector3d away = (sight.start - view.center()).normalized();
    const double fall =
        std::min(normal.dot(away), -0.5 * cosine_min_);  // negative: the vertex faces the view
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector3d axis = (k % 2 == 0 ? 1 : -1) * axes.row(k / 2).transpose();
      Eigen::Vector3d aside =
          axis - normal.dot(axis) / fall * away;  // one step in the photo, along the tangent plane
      const double margin_px = options_.silhouette_margin_px + std::max(sight.voxel_px, 1.0);
      aside *= std::min(margin_px * voxel / sight.voxel_px, aside_max / aside.norm());
      const Eigen::Vector3d place = sight.start + aside;
      const double depth =
          std::min((options_.offset_voxels + 2) / std::max(sight.cosine, 1e-3), kBehindVoxelsMax) *
          voxel;
      to_view.push_back({place.cast<float>(), view.center().cast<float>()});
      behind.push_back({place.cast<float>(), (place + depth * away).cast<float>()});
    }
  }
  const std::vector<uint8_t> hidden = Blocked(to_view), backed = Blocked(behind);
  for (size_t i = 0; i < sights->size(); ++i) {
    double clear = 1;
    for (size_t k = 4 * i; k < 4 * i + 4; ++k) clear += !hidden[k] && backed[k];
    (*sights)[i].weight *= clear * clear / 25;
    (*sights)[i].is_clear = clear == 5;
  }
}

void Colorer::Gather(const ColorView& view, size_t first, size_t last, Heard* heard) const {
  std::vector<Sight> sights = Facing(view, first, last);
  if (sights.empty()) return;
  RemoveHidden(view, &sights);
  if (options_.silhouette_margin_px > 0) WeighByClearSight(view, &sights);
  for (const Sight& sight : sights) {
    const ColorView::Sample sample = view.At(sight.px, sight.voxel_px);
    if (sample.is_filled) continue;
    const double weight = sight.weight * (sample.is_clipped ? kClippedWeight : 1);
    if (!(static_cast<float>(weight) > 0)) continue;
    heard->samples[sight.vertex - first].push_back(
        {sample.light, static_cast<float>(weight), view.image().value});
    heard->is_clear[sight.vertex - first] |= sight.is_clear;
  }
}

// Fills in what no photo sees. Colours spread from the vertices that are seen clearly, also across
// those that are seen near an outline, because unseen surface begins behind outlines; where no
// clearly seen vertex is connected, they spread from any seen one. Returns who has a colour now.
std::vector<uint8_t> FillUnseen(const TriangleMesh& mesh, uint32_t rings_max,
                                const std::vector<uint8_t>& view_counts,
                                std::vector<uint8_t> is_clear,
                                std::vector<Eigen::Vector3f>* light) {
  std::vector<Eigen::Vector3f> filled = *light;
  FillColors(mesh, rings_max, &filled, &is_clear);
  std::vector<uint8_t> is_known(light->size());
  for (size_t v = 0; v < light->size(); ++v) {
    is_known[v] = view_counts[v] > 0 || is_clear[v];
    if (view_counts[v] == 0) (*light)[v] = filled[v];
  }
  FillColors(mesh, rings_max, light, &is_known);
  return is_known;
}

}  // namespace

Status ColoringOptions::Check() const {
  return OptionBounds()
      .FiniteAbove("voxel_size", voxel_size, 0)
      .Between("offset_voxels", offset_voxels, 0, 10)
      .Inside("incidence_deg_max", incidence_deg_max, 0, 90)
      .AboveUpTo("voxels_per_pixel_max", voxels_per_pixel_max, 0, 1000)
      .Between("border_margin_px", border_margin_px, 0, 1000)
      .Between("silhouette_margin_px", silhouette_margin_px, 0, 20)
      .Between("outlier_deviations", outlier_deviations, 1, 100)
      .Between("outlier_tolerance", outlier_tolerance, 0, 1)
      .Between("views_per_vertex_max", views_per_vertex_max, 1, 255)
      .status();
}

double ColoringReach(const ColoringOptions& options) {
  return options.voxel_size *
         (options.offset_voxels +
          (options.silhouette_margin_px > 0 ? kAroundVoxelsMax + kBehindVoxelsMax : 0));
}

Result<VertexColors> ColorVertices(const TriangleMesh& mesh, const RayScene& scene,
                                   std::span<const ColorView* const> views,
                                   const ColoringOptions& options, ThreadPool& pool) {
  VEDUTA_RETURN_IF_ERROR(options.Check());
  VEDUTA_RETURN_IF_ERROR(CheckMesh(mesh));
  const size_t count = mesh.positions.size();
  if (mesh.normals.size() != count)
    return Status::InvalidArgument("a mesh to be coloured has no normals");
  if (std::find(views.begin(), views.end(), nullptr) != views.end()) {
    return Status::InvalidArgument("a view to colour by is null");
  }
  std::vector<Eigen::Vector3f> light(count, Eigen::Vector3f::Zero());
  std::vector<uint8_t> is_clear(count);
  VertexColors result;
  result.view_counts.resize(count);
  const Colorer colorer(mesh, scene, options);
  pool.ParallelFor((count + kChunk - 1) / kChunk, [&](size_t chunk) {
    const DenormalsOff denormals_off;
    const size_t first = chunk * kChunk, last = std::min(first + kChunk, count);
    Heard heard = {std::vector<std::vector<ColorSample>>(last - first),
                   std::vector<uint8_t>(last - first)};
    for (const ColorView* const view : views) colorer.Gather(*view, first, last, &heard);
    for (size_t v = first; v < last; ++v) {
      const RobustColor color = RobustMean(heard.samples[v - first], options.views_per_vertex_max,
                                           static_cast<float>(options.outlier_deviations),
                                           static_cast<float>(options.outlier_tolerance));
      light[v] = color.light;
      result.view_counts[v] = static_cast<uint8_t>(color.count);
      is_clear[v] = heard.is_clear[v - first];
    }
  });
  const std::vector<uint8_t> is_known =
      FillUnseen(mesh, options.fill_rings_max, result.view_counts, is_clear, &light);
  result.colors.resize(count, {128, 128, 128});
  for (size_t v = 0; v < count; ++v) {
    if (!is_known[v]) continue;
    for (int c = 0; c < 3; ++c) result.colors[v][c] = SrgbFromLight(light[v][c]);
  }
  return result;
}

}  // namespace veduta
