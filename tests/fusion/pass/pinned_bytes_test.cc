// SPDX-License-Identifier: Apache-2.0
// Goal: nobody changes what an algorithm of the dense pass makes and forgets to raise its number,
//   by which older databases learn that what they hold is stale.
// Method: every algorithm makes something small from fixed input, in C++; the hash of the bytes is
//   pinned beside the algorithm's number. Input is made here by formulas, not by another stage, so
//   that a change shows at the algorithm that was changed, except along the volume, where each
//   step takes the one before: the first that fails there is the one that changed.
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "fusion/pass/stage_options.h"
#include "fusion/pass/tile_parts.h"
#include "fusion/surface/color_view.h"
#include "fusion/surface/ray_scene.h"
#include "fusion/surface/renderer.h"
#include "tests/fusion/volume/small_volume.h"
#include "tests/fusion/volume/synthetic_maps.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

// The number of the algorithm and the hash of the bytes that it made under this number. Made with
// g++ 12 on x86-64; another compiler or library may round the last bit of a sine otherwise, and
// then only the hash is to be written anew.
struct Pin {
  uint32_t version;
  const char* hash;
};

void ExpectPinned(const char* constant, uint32_t version, const Pin& pin, ContentFeed* feed) {
  const std::string hash = feed->Finish().Hex().substr(0, 16);
  if (version == pin.version) {
    EXPECT_EQ(hash, pin.hash)
        << "what the algorithm makes has changed under the same number, so databases that hold "
           "what it made before would not notice: raise "
        << constant << " to " << version + 1 << " and pin {" << version + 1 << ", \"" << hash
        << "\"} here. Put the pinned hash alone in its place only if no code changed, but the "
           "compiler or a library.";
  } else {
    ADD_FAILURE() << constant << " was raised to " << version << ": pin {" << version << ", \""
                  << hash << "\"} here";
  }
}

void Feed(const DepthMap& map, ContentFeed* feed) {
  *feed << map.width_px << map.height_px;
  for (const float depth : map.depth) *feed << depth;
  for (const uint8_t confidence : map.confidence) *feed << confidence;
}
void Feed(std::span<const uint8_t> bytes, ContentFeed* feed) {
  *feed << HashContent(bytes);
}

// Smooth noise in [0, 1], from a lattice of random values.
double Noise(double x, double y) {
  const double fx = x - std::floor(x), fy = y - std::floor(y);
  const auto at = [&](double i, double j) {
    const auto lattice = [](double v) { return static_cast<uint64_t>(static_cast<int64_t>(v)); };
    return static_cast<double>(MixSeed(lattice(std::floor(x) + i), lattice(std::floor(y) + j)) >>
                               40) *
           0x1.0p-24;
  };
  return (at(0, 0) * (1 - fx) + at(1, 0) * fx) * (1 - fy) +
         (at(0, 1) * (1 - fx) + at(1, 1) * fx) * fy;
}

// A camera at (center_x, 0, 0) that looks along +z at a wall z = 4 with a noise on it.
View WallFrom(uint32_t id, double center_x) {
  View view;
  view.image = ImageId(id);
  view.geometry.width_px = 96, view.geometry.height_px = 72;
  Pinhole& camera = view.geometry.camera;
  camera.fx = camera.fy = 90, camera.cx = 47.5, camera.cy = 35.5;
  view.geometry.cam_from_world.translation.x() = -center_x;
  for (uint32_t y = 0; y < view.geometry.height_px; ++y) {
    for (uint32_t x = 0; x < view.geometry.width_px; ++x) {
      const Eigen::Vector2d ray = view.geometry.camera.Normalize(Eigen::Vector2d(x, y));
      const double u = 6 * (center_x + 4 * ray.x()), v = 6 * 4 * ray.y();
      const double light = (Noise(u, v) + Noise(2.3 * u, 2.3 * v)) / 2;
      view.gray.push_back(static_cast<uint8_t>(std::lround(20 + 200 * light)));
      for (int c = 0; c < 3; ++c)
        view.rgb.push_back(static_cast<uint8_t>(view.gray.back() - 5 * c));
    }
  }
  return view;
}

synthetic::Shapes Ball() {
  synthetic::Shapes shapes;
  shapes.radius = 0.5;
  return shapes;
}

// Views around a ball and their maps, a little noisy.
struct BallMaps {
  std::vector<ViewGeometry> views = synthetic::ViewsAround({0, 0, 0}, 2, 48);
  std::vector<DepthMap> maps;

  BallMaps() {
    for (size_t i = 0; i < views.size(); ++i)
      maps.push_back(synthetic::Render(Ball(), views[i], 0.002, 0.01, i));
  }
};

TEST(StoredBytes, Views) {
  TemporaryFolder folder;
  const View wall = WallFrom(1, 0);
  const std::string path = folder.path() + "/wall.png";
  ASSERT_OK(WritePng(path, 96, 72, wall.rgb));
  std::ifstream file(path, std::ios::binary);
  const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
  const std::vector<uint8_t> bytes(read.begin(), read.end());
  DatabaseOptions options;
  options.create = true;
  options.sync_wal = false;
  const auto database = Database::Open(folder.path() + "/db", options);
  ASSERT_OK(database);
  SceneImage image;
  image.record.id = ImageId(1);
  image.record.photo = HashContent(bytes);
  ASSERT_OK((*database)->WritePhotoAhead(image.record.photo, bytes, Features()));
  CameraModel& camera = image.camera;
  camera.width_px = 96, camera.height_px = 72;
  camera.fx = camera.fy = 90;
  camera.cx = camera.u0 = 47.5, camera.cy = camera.v0 = 35.5;
  camera.k1 = -0.1;
  ViewLoader loader((*database)->GetSnapshot(), 64, 1);
  const auto view = loader.Load(image);
  ASSERT_OK(view);
  ContentFeed feed;
  const ViewGeometry& g = (*view)->geometry;
  feed << g.width_px << g.height_px << g.camera.fx << g.camera.fy << g.camera.cx << g.camera.cy;
  Feed((*view)->gray, &feed);
  Feed((*view)->rgb, &feed);
  ExpectPinned("kViewVersion", kViewVersion, {1, "38eb7713553985b0"}, &feed);
}

TEST(StoredBytes, DepthRange) {
  std::vector<double> depths;
  for (int i = 0; i < 300; ++i) depths.push_back(1 + 0.1 * (i * 37 % 300));
  const auto range = DepthRangeOf(depths, 0.25);
  ASSERT_OK(range);
  ContentFeed feed;
  feed << range->near << range->far;
  ExpectPinned("kDepthRangeVersion", kDepthRangeVersion, {1, "070262f794d95ba5"}, &feed);
}

TEST(StoredBytes, SensorViews) {
  const std::vector<ImageId> track = {ImageId(1), ImageId(2), ImageId(3), ImageId(4)};
  std::map<ImageId, Eigen::Vector3d> centers;
  for (const ImageId id : track) centers[id] = {0.3 * (id.value - 1.0), 0, 0};
  KeyView key{96, 72, centers[ImageId(1)], {}, {}};
  for (uint32_t i = 0; i < 120; ++i) {
    const Eigen::Vector2d x(i * 31 % 96, i * 17 % 72);
    key.features.push_back(x);
    // Fewer points with every further view.
    const size_t seen_by = i % 3 == 0 ? 4 : i % 3 == 1 ? 3 : 2;
    key.points.push_back(
        {x, {(x.x() - 47.5) / 22.5, (x.y() - 35.5) / 22.5, 4}, std::span(track).first(seen_by)});
  }
  const auto views = RankSensorViews(key, centers, SensorViewOptions());
  ASSERT_OK(views);
  ASSERT_GE(views->size(), 2u);
  ContentFeed feed;
  for (const SensorView& v : *views)
    feed << v.image << v.overlap << v.score << v.angle_median_deg << v.point_count;
  ExpectPinned("kSensorViewsVersion", kSensorViewsVersion, {1, "c75d238da1c58f92"}, &feed);
}

TEST(StoredBytes, DepthEstimation) {
  ThreadPool pool(1);
  const std::vector<View> sensors = {WallFrom(2, -0.4), WallFrom(3, 0.4)};
  const auto map = EstimateDepth(WallFrom(1, 0), sensors, {2, 8}, DepthOptions(), nullptr, pool);
  ASSERT_OK(map);
  EXPECT_GT(map->at(48, 36), 3.5f) << "the wall is found at all";
  ContentFeed feed;
  Feed(*map, &feed);
  ExpectPinned("kDepthEstimationVersion", kDepthEstimationVersion, {1, "7251951e331e2ef8"}, &feed);
}

TEST(StoredBytes, DepthCodes) {
  const BallMaps ball;
  const DepthPixels pixels = EncodeDepth(ball.maps[0], {1, 3});
  ContentFeed feed;
  for (const uint16_t code : pixels.codes) feed << code;
  Feed(pixels.confidence, &feed);
  ExpectPinned("kDepthCodesVersion", kDepthCodesVersion, {1, "790b4fef85bae362"}, &feed);
}

TEST(StoredBytes, Consistency) {
  ThreadPool pool(1);
  BallMaps ball;
  // What the sureness of the key map decides must show, too.
  for (size_t i = 0; i < ball.maps[0].confidence.size(); i += 3) {
    if (ball.maps[0].depth[i] > 0) ball.maps[0].confidence[i] = 16;
  }
  std::vector<NeighborDepth> neighbors;
  for (const size_t i : {1, 3, 9}) neighbors.push_back({ball.views[i], &ball.maps[i]});
  const auto map =
      CheckConsistency(ball.maps[0], ball.views[0], neighbors, ConsistencyOptions(), pool);
  ASSERT_OK(map);
  ConsistencyOptions all_sure;
  all_sure.confidence_sure = 0;
  const auto other = CheckConsistency(ball.maps[0], ball.views[0], neighbors, all_sure, pool);
  ASSERT_OK(other);
  EXPECT_FALSE(other->depth == map->depth) << "the input shows what uncertain depth changes";
  ContentFeed feed;
  Feed(*map, &feed);
  ExpectPinned("kConsistencyVersion", kConsistencyVersion, {2, "8dfa306e4b64aa24"}, &feed);
}

// The volume of the ball, step by step.
class PinnedVolume : public testing::Test {
 protected:
  void SetUp() override {
    volume_.grid.voxel_size = 0.05;
    for (size_t i = 0; i < ball_.views.size(); ++i)
      images_.push_back(RangeImage::Make(ball_.maps[i], ball_.views[i]).value());
    volume_.Integrate(images_, 8);
  }
  ThreadPool pool_{1};
  BallMaps ball_;
  std::vector<RangeImage> images_;
  SmallVolume volume_;
};

TEST_F(PinnedVolume, RangeImages) {
  ContentFeed feed;
  for (const RangeImage& image : images_) {
    for (const NamedBlock& named : image.BlocksNearSurface(volume_.grid))
      feed << named.block.x << named.block.y << named.block.z << named.pixel_count;
    for (double at = 0.3; at < 0.7; at += 0.01) {
      const auto vote = image.VoteOn({at, 0.5 * at, -0.3 * at}, volume_.grid);
      feed << (vote ? vote->distance : 0.0) << (vote ? vote->weight : 0u);
    }
  }
  ExpectPinned("kRangeImageVersion", kRangeImageVersion, {2, "3fda59a2cf2736af"}, &feed);
}

TEST_F(PinnedVolume, Histograms) {
  ContentFeed feed;
  for (const auto& [place, histogram] : volume_.histograms) Feed(Serialize(*histogram), &feed);
  ExpectPinned("kHistogramVersion", kHistogramVersion, {1, "ceb7ed7a9e7e14e1"}, &feed);
}

TEST_F(PinnedVolume, Solutions) {
  volume_.Solve(SolverOptions(), pool_);
  ContentFeed feed;
  for (const auto& [place, solution] : volume_.solutions) Feed(Serialize(*solution), &feed);
  ExpectPinned("kSolverVersion", kSolverVersion, {1, "7473652725af70c5"}, &feed);
}

TEST_F(PinnedVolume, Meshes) {
  volume_.Solve(SolverOptions(), pool_);
  const SurfacePiece piece = volume_.Surface(ExtractionOptions());
  ASSERT_GT(piece.triangles.size(), 100u);
  ContentFeed feed;
  Feed(Serialize(piece), &feed);
  ExpectPinned("kExtractionVersion", kExtractionVersion, {1, "9138a4c58f2b897f"}, &feed);
}

TEST(StoredBytes, Exposures) {
  std::vector<ColorObservation> observations;
  for (uint32_t image = 1; image <= 4; ++image) {
    for (uint32_t point = 0; point < 60; ++point) {
      const double light = (60 + 2.0 * point) * (0.8 + 0.1 * image) + (point * image) % 5;
      const auto value = static_cast<uint8_t>(light);
      observations.push_back({ImageId(image),
                              {ImageId(1), point},
                              {value, static_cast<uint8_t>(value / 2 + 10), value}});
    }
  }
  const auto gains = SolveExposures(observations, {}, ExposureOptions());
  ASSERT_OK(gains);
  ContentFeed feed;
  for (const auto& [id, gain] : *gains) feed << id << gain.x() << gain.y() << gain.z();
  ExpectPinned("kExposureVersion", kExposureVersion, {1, "3eeba7890f2dc236"}, &feed);
}

TEST(StoredBytes, Colors) {
  ThreadPool pool(1);
  // The wall z = 4, bulging a little, with its vertices towards the cameras.
  TriangleMesh mesh;
  constexpr uint32_t kSide = 21;
  for (uint32_t y = 0; y < kSide; ++y) {
    for (uint32_t x = 0; x < kSide; ++x) {
      mesh.positions.emplace_back(0.15f * static_cast<float>(x) - 1.5f,
                                  0.15f * static_cast<float>(y) - 1.5f,
                                  4 - 0.01f * static_cast<float>(x * y % 7));
      mesh.normals.emplace_back(0, 0, -1);
    }
  }
  for (uint32_t y = 0; y + 1 < kSide; ++y) {
    for (uint32_t x = 0; x + 1 < kSide; ++x) {
      const uint32_t a = y * kSide + x, b = a + 1, c = a + kSide, d = c + 1;
      mesh.triangles.push_back({a, d, b});
      mesh.triangles.push_back({a, c, d});
    }
  }
  std::vector<ColorView> views;
  for (uint32_t i = 0; i < 3; ++i) {
    auto view = ColorView::Make(WallFrom(i + 1, 0.4 * i - 0.4), Eigen::Vector3f(1, 1.1f, 0.9f));
    ASSERT_OK(view);
    views.push_back(std::move(*view));
  }
  const auto device = RayDevice::Open();
  ASSERT_OK(device);
  const auto tile = RayTile::Make(*device, mesh);
  ASSERT_OK(tile);
  const auto scene = RayScene::Make(*device, {*tile});
  ASSERT_OK(scene);
  ColoringOptions options;
  options.voxel_size = 0.1;
  const std::vector<const ColorView*> used = {&views[0], &views[1], &views[2]};
  const auto colors = ColorVertices(mesh, **scene, used, options, pool);
  ASSERT_OK(colors);
  ContentFeed feed;
  for (const auto& color : colors->colors) feed << color[0] << color[1] << color[2];
  Feed(colors->view_counts, &feed);
  ExpectPinned("kColoringVersion", kColoringVersion, {1, "a73ec0ea70c89271"}, &feed);
}

}  // namespace
}  // namespace veduta
