// SPDX-License-Identifier: Apache-2.0
// Colours the true surface of a synthetic street from its photos, draws it from each photo's camera
// and says how well they agree and how long it took.
// Usage: veduta-bench-surface [--photos N] [--voxel M] [--exposure STOPS] [--out DIR]
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <map>

#include "fusion/surface/model_writer.h"
#include "fusion/surface/renderer.h"
#include "fusion/surface/reprojected_color.h"
#include "fusion/surface/simplification.h"
#include "fusion/surface/tiles_between.h"
#include "fusion/surface/vertex_color.h"
#include "tools/bench/surface/street_surface.h"

namespace veduta {
namespace {

struct Arguments {
  uint32_t photos = 12, threads = 2, width = 512;
  double voxel = 0.05, exposure = 0.5, noise = 2, simplify = 0;
  std::string out;
};

class Stopwatch {
 public:
  double Seconds() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

std::vector<street::StreetCamera> Walk(const Arguments& arguments, const street::Scene& scene) {
  CameraModel model;
  model.width_px = arguments.width;
  model.height_px = arguments.width * 3 / 4;
  model.fx = model.fy = 0.85 * arguments.width;
  model.cx = model.u0 = (model.width_px - 1) / 2.0;
  model.cy = model.v0 = (model.height_px - 1) / 2.0;
  const street::Lane& lane = scene.plan().lanes.front();
  const Eigen::Vector2d along = (lane.to - lane.from).normalized();
  std::vector<street::StreetCamera> cameras;
  for (uint32_t i = 0; i < arguments.photos; ++i) {
    const Eigen::Vector2d at = lane.from + (8 + 1.2 * i) * along;
    const double yaw = 90 + 35 * std::sin(1.3 * i);
    cameras.push_back({"photo" + std::to_string(i + 1), model,
                       street::LookFrom({at.x(), at.y() - 2, 1.65 + 0.1 * (i % 3)}, yaw, 8, 0)});
  }
  return cameras;
}

// The tiles coloured one by one, each by a scene of what lies between it and the photos.
Status ColorTiles(const std::vector<ColorView>& views, const ColoringOptions& options,
                  ThreadPool& pool, std::shared_ptr<const RayDevice> device,
                  std::vector<street::MeshTile>* tiles) {
  std::vector<std::shared_ptr<const RayTile>> all;
  std::vector<Eigen::AlignedBox3d> boxes;
  Stopwatch watch;
  for (const street::MeshTile& tile : *tiles) {
    VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const RayTile> made, RayTile::Make(device, tile.mesh));
    boxes.push_back(made->box().cast<double>());
    all.push_back(std::move(made));
  }
  const double building = watch.Seconds();
  std::vector<const ColorView*> pointers;
  std::vector<Eigen::Vector3d> centers;
  for (const ColorView& view : views) pointers.push_back(&view), centers.push_back(view.center());
  const Eigen::Vector3d reach = Eigen::Vector3d::Constant(ColoringReach(options));
  size_t in_scenes = 0, seen = 0, vertices = 0;
  for (size_t i = 0; i < tiles->size(); ++i) {
    std::vector<std::shared_ptr<const RayTile>> between;
    for (const uint32_t k :
         TilesBetween(boxes, {boxes[i].min() - reach, boxes[i].max() + reach}, centers)) {
      between.push_back(all[k]);
    }
    in_scenes += between.size();
    VEDUTA_ASSIGN_OR_RETURN(const auto scene, RayScene::Make(device, std::move(between)));
    street::MeshTile& tile = (*tiles)[i];
    VEDUTA_ASSIGN_OR_RETURN(VertexColors colors,
                            ColorVertices(tile.mesh, *scene, pointers, options, pool));
    for (const uint8_t count : colors.view_counts) seen += count > 0;
    vertices += colors.colors.size();
    tile.mesh.colors = std::move(colors.colors);
  }
  const double coloring = watch.Seconds();
  std::printf("tiles %zu, in a scene %.1f on average; hierarchies %.3f s\n", tiles->size(),
              static_cast<double>(in_scenes) / static_cast<double>(tiles->size()), building);
  std::printf("coloured %zu vertices (%.1f %% seen) by %zu photos in %.2f s: %.2f us a vertex\n",
              vertices, 100.0 * static_cast<double>(seen) / static_cast<double>(vertices),
              views.size(), coloring, 1e6 * coloring / static_cast<double>(vertices));
  return {};
}

Status Export(const std::vector<street::MeshTile>& tiles,
              const std::vector<street::PhotoView>& photos, const std::string& folder) {
  std::vector<ExportedCamera> cameras;
  std::vector<Rigid3> cams;  // the street's photos stand upright
  for (const street::PhotoView& photo : photos) {
    cameras.push_back({"photo" + std::to_string(photo.view.image.value), photo.view.geometry});
    cams.push_back(photo.view.geometry.cam_from_world);
  }
  Stopwatch watch;
  for (const bool is_glb : {false, true}) {
    const std::string path = folder + (is_glb ? "/street.glb" : "/street.ply");
    VEDUTA_ASSIGN_OR_RETURN(const auto writer,
                            is_glb ? OpenGlb(path, {}, MeanUp(cams)) : OpenPly(path, {}));
    for (const street::MeshTile& tile : tiles)
      VEDUTA_RETURN_IF_ERROR(writer->AddMesh(tile.mesh, tile.keys));
    if (is_glb) VEDUTA_RETURN_IF_ERROR(writer->AddCameras(cameras));
    VEDUTA_ASSIGN_OR_RETURN(const ModelCounts counts, writer->Finish());
    std::printf("%s: %lu vertices, %lu triangles, %.2f s\n", path.c_str(), counts.vertices,
                counts.triangles, watch.Seconds());
  }
  return WriteCameras(folder + "/cameras", cameras, 0.5);
}

Status SimplifyTiles(double distance, std::vector<street::MeshTile>* tiles) {
  Stopwatch watch;
  size_t before = 0, after = 0;
  double greatest = 0;
  for (street::MeshTile& tile : *tiles) {
    SimplificationOptions options;
    options.distance_max = distance;
    VEDUTA_ASSIGN_OR_RETURN(SimplifiedMesh small, Simplify(tile.mesh, options));
    before += tile.mesh.triangles.size();
    after += small.mesh.triangles.size();
    greatest = std::max(greatest, small.distance);
    std::vector<uint64_t> keys;
    for (const uint32_t v : small.source_vertex) keys.push_back(tile.keys[v]);
    tile = {std::move(small.mesh), std::move(keys)};
  }
  std::printf("simplified within %.4f: %zu -> %zu triangles, measured distance %.4f, %.2f s\n",
              distance, before, after, greatest, watch.Seconds());
  return {};
}

using Gains = std::map<ImageId, Eigen::Vector3f>;

// What the street is coloured from.
struct Street {
  std::vector<street::PhotoView> photos;
  TriangleMesh whole;
  std::vector<street::MeshTile> tiles;
};

Result<Street> MakeStreet(const Arguments& arguments) {
  Stopwatch watch;
  street::SceneOptions options;
  options.seed = 7;
  options.length_m = 40;
  VEDUTA_ASSIGN_OR_RETURN(const auto scene, street::BuildScene(options));
  const std::vector<street::StreetCamera> cameras = Walk(arguments, *scene);
  street::RenderOptions render;
  render.noise_sigma = arguments.noise;
  render.exposure_stops = arguments.exposure;
  Street made;
  VEDUTA_ASSIGN_OR_RETURN(made.photos, TakeViews(*scene, cameras, render, arguments.threads));
  made.whole = street::SurfaceOf(*scene, arguments.voxel, [](const Eigen::Vector3d& x) {
    return x.x() > 2 && x.x() < 38 && x.y() > -1 && x.y() < 12 && x.z() < 12;
  });
  made.tiles = street::CutIntoCubes(made.whole, 64 * arguments.voxel);
  std::printf("%zu photos %ux%u, surface of %zu vertices, %zu triangles: %.1f s\n",
              made.photos.size(), arguments.width, arguments.width * 3 / 4,
              made.whole.positions.size(), made.whole.triangles.size(), watch.Seconds());
  return made;
}

Result<Gains> EvenOutExposures(const Street& street) {
  const auto observations = ObserveVertices(street.whole, street.photos, 97);
  Stopwatch watch;
  VEDUTA_ASSIGN_OR_RETURN(Gains gains, SolveExposures(observations, {}, {}));
  std::printf("exposures from %zu observations: %.3f s; gains", observations.size(),
              watch.Seconds());
  for (const auto& [image, gain] : gains) std::printf(" %.2f", gain.y());
  std::printf("\n");
  return gains;
}

Result<std::vector<ColorView>> PrepareViews(const Street& street, const Gains& gains) {
  Stopwatch watch;
  std::vector<ColorView> views;
  for (const street::PhotoView& photo : street.photos) {
    VEDUTA_ASSIGN_OR_RETURN(ColorView view,
                            ColorView::Make(photo.view, gains.at(photo.view.image)));
    views.push_back(std::move(view));
  }
  std::printf("photos prepared in %.3f s\n", watch.Seconds());
  return views;
}

Result<std::shared_ptr<const RayScene>> SceneOfTiles(const std::vector<street::MeshTile>& tiles,
                                                     std::shared_ptr<const RayDevice> device) {
  std::vector<std::shared_ptr<const RayTile>> colored;
  for (const street::MeshTile& tile : tiles) {
    VEDUTA_ASSIGN_OR_RETURN(std::shared_ptr<const RayTile> made, RayTile::Make(device, tile.mesh));
    colored.push_back(std::move(made));
  }
  return RayScene::Make(device, std::move(colored));
}

// Draws the surface from each photo's camera and says how well they agree.
Status CompareWithPhotos(const Arguments& arguments, const Street& street, const Gains& gains,
                         const RayScene& surface, ThreadPool& pool) {
  double drawing = 0, pixels = 0;
  Stopwatch watch;
  for (const street::PhotoView& photo : street.photos) {
    VEDUTA_ASSIGN_OR_RETURN(Picture picture, BlankPicture(photo.view.geometry, {}));
    watch.Seconds();
    VEDUTA_RETURN_IF_ERROR(DrawSurface(surface, photo.view.geometry, {}, pool, &picture));
    drawing += watch.Seconds();
    pixels += static_cast<double>(picture.depth.size());
    const Eigen::Vector3f gain = gains.at(photo.view.image);
    VEDUTA_ASSIGN_OR_RETURN(const ReprojectedColor error,
                            CompareWithPhoto(picture, photo.view, gain));
    std::printf(
        "photo %2u: covered %.1f %%, median error %.0f, exposure evened out %.0f, mean %.2f\n",
        photo.view.image.value, 100 * error.covered_share, error.median_error,
        error.median_error_balanced, error.mean_error_balanced);
    if (arguments.out.empty()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const Picture sheet, SideBySide(picture, photo.view, gain));
    VEDUTA_RETURN_IF_ERROR(
        WritePng(arguments.out + "/photo" + std::to_string(photo.view.image.value) + ".png",
                 sheet.width_px, sheet.height_px, sheet.rgb));
  }
  std::printf("drawing: %.1f million rays a second on %u threads\n", pixels / drawing * 1e-6,
              arguments.threads);
  return {};
}

Status DrawSides(const std::string& folder, const TriangleMesh& whole, const RayScene& surface,
                 ThreadPool& pool) {
  Eigen::AlignedBox3d box;
  for (const Eigen::Vector3f& x : whole.positions) box.extend(x.cast<double>());
  VEDUTA_ASSIGN_OR_RETURN(const auto sides,
                          ThreeSides(box, Eigen::Vector3d::UnitZ(), {0, 1, 0}, 960, 540));
  for (size_t i = 0; i < sides.size(); ++i) {
    RenderOptions look;
    look.back_faces = BackFaces::kCull;
    const ViewGeometry large = ScaledView(sides[i], 2);
    VEDUTA_ASSIGN_OR_RETURN(Picture picture, BlankPicture(large, look));
    VEDUTA_RETURN_IF_ERROR(DrawSurface(surface, large, look, pool, &picture));
    const Picture small = Reduced(picture, 2);
    VEDUTA_RETURN_IF_ERROR(WritePng(folder + "/side" + std::to_string(i + 1) + ".png",
                                    small.width_px, small.height_px, small.rgb));
  }
  return {};
}

Status Run(const Arguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(Street street, MakeStreet(arguments));
  VEDUTA_ASSIGN_OR_RETURN(const Gains gains, EvenOutExposures(street));
  ThreadPool pool(arguments.threads - 1);
  VEDUTA_ASSIGN_OR_RETURN(const auto device, RayDevice::Open());
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ColorView> views, PrepareViews(street, gains));
  ColoringOptions coloring;
  coloring.voxel_size = arguments.voxel;
  VEDUTA_RETURN_IF_ERROR(ColorTiles(views, coloring, pool, device, &street.tiles));
  if (arguments.simplify > 0) {
    VEDUTA_RETURN_IF_ERROR(SimplifyTiles(arguments.simplify, &street.tiles));
  }
  VEDUTA_ASSIGN_OR_RETURN(const auto surface, SceneOfTiles(street.tiles, device));
  VEDUTA_RETURN_IF_ERROR(CompareWithPhotos(arguments, street, gains, *surface, pool));
  if (arguments.out.empty()) return {};
  VEDUTA_RETURN_IF_ERROR(DrawSides(arguments.out, street.whole, *surface, pool));
  return Export(street.tiles, street.photos, arguments.out);
}

}  // namespace
}  // namespace veduta

int main(int argc, char** argv) {
  veduta::Arguments arguments;
  CLI::App app("Colours the true surface of a synthetic street from its photos");
  app.add_option("--photos", arguments.photos, "how many")->check(CLI::Range(1, 24));
  app.add_option("--width", arguments.width, "of a photo, px")->check(CLI::Range(64, 4096));
  app.add_option("--threads", arguments.threads, "threads")->check(CLI::Range(1, 256));
  app.add_option("--voxel", arguments.voxel, "spacing of vertices, m")
      ->check(CLI::Range(0.005, 1.0));
  app.add_option("--exposure", arguments.exposure, "stops either way")->check(CLI::Range(0.0, 4.0));
  app.add_option("--noise", arguments.noise, "sigma of grey levels")->check(CLI::Range(0.0, 64.0));
  app.add_option("--simplify", arguments.simplify, "bound of the distance, m; 0: not at all");
  app.add_option("--out", arguments.out, "folder for pictures and models");
  CLI11_PARSE(app, argc, argv);
  if (!arguments.out.empty()) std::filesystem::create_directories(arguments.out);
  const veduta::Status status = veduta::Run(arguments);
  if (status.ok()) return 0;
  std::fprintf(stderr, "%s\n", status.message().c_str());
  return 1;
}
