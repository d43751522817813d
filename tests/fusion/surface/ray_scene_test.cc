// SPDX-License-Identifier: Apache-2.0
// Goal: rays hit what they should, whether the surface is one tile or many, and bad meshes are
//   refused by name.
// Method: random triangles and rays against Cramer's rule on every triangle; hulls against
//   sampled points; a cache that counts its loads.
#include "fusion/surface/ray_scene.h"

#include <limits>

#include "fusion/surface/ray_tile_cache.h"
#include "fusion/surface/tiles_between.h"
#include "storage/base/denormals_off.h"
#include "storage/base/thread_pool.h"
#include "tests/fusion/surface/sample_surfaces.h"

namespace veduta {
namespace {

struct Brute {
  double t = std::numeric_limits<double>::infinity();
  bool is_sure = true;  // no triangle's edge so near that rounding decides
};

Brute MeetAll(const TriangleMesh& mesh, const Eigen::Vector3d& origin,
              const Eigen::Vector3d& direction, double far) {
  Brute best;
  for (const auto& [i, j, k] : mesh.triangles) {
    const Eigen::Vector3d a = mesh.positions[i].cast<double>(),
                          b = mesh.positions[j].cast<double>();
    const Eigen::Vector3d c = mesh.positions[k].cast<double>(), middle = (a + b + c) / 3;
    const double t = MeetTriangle(origin, direction, a, b, c);
    const auto scaled = [&](double s) {
      const double at = MeetTriangle(origin, direction, middle + s * (a - middle),
                                     middle + s * (b - middle), middle + s * (c - middle));
      return at >= 0 && at <= far;
    };
    if (scaled(1.0001) != scaled(0.9999) || std::abs(t - far) < 1e-5) best.is_sure = false;
    if (t >= 0 && t <= far) best.t = std::min(best.t, t);
  }
  return best;
}

RayPacket RandomRays(SeededRandom& random, float far) {
  RayPacket rays;
  for (int i = 0; i < kRayLanes; ++i) {
    for (int c = 0; c < 3; ++c) {
      rays.origin[c][i] = static_cast<float>(4 * random.Unit() - 2);
      rays.direction[c][i] = static_cast<float>(2 * random.Unit() - 1) - rays.origin[c][i];
    }
    rays.t_near[i] = 0;
    rays.t_far[i] = far;
    rays.live[i] = random.Below(8) != 0;
  }
  return rays;
}

TEST(RayScene, AgreesWithEveryTriangleTried) {
  const DenormalsOff denormals_off;
  const TriangleMesh mesh = Soup(120, 0.25, 3);
  std::vector<TriangleMesh> parts;
  for (Tile& tile : CutIntoTiles(mesh, 0.5)) parts.push_back(std::move(tile.mesh));
  ASSERT_GT(parts.size(), 9u);
  parts.insert(parts.begin() + 2, TriangleMesh());  // a tile without anything moves no index
  const auto whole = SceneOf({mesh}), tiled = SceneOf(parts);
  SeededRandom random(11);
  int hit = 0, missed = 0;
  for (int round = 0; round < 120; ++round) {
    const float far = round % 2 == 0 ? 1.0f : 100.0f;
    const RayPacket rays = RandomRays(random, far);
    RayHits one, many;
    whole->Intersect(rays, &one);
    tiled->Intersect(rays, &many);
    const uint32_t occluded = whole->Occluded(rays);
    EXPECT_EQ(occluded, tiled->Occluded(rays));
    for (int i = 0; i < kRayLanes; ++i) {
      const auto column = [&](const float v[3][kRayLanes]) {
        return Eigen::Vector3d(v[0][i], v[1][i], v[2][i]);
      };
      if (!rays.live[i]) {
        EXPECT_EQ(one.tile[i], -1);
        EXPECT_EQ(occluded >> i & 1, 0u);
        continue;
      }
      const Brute brute = MeetAll(mesh, column(rays.origin), column(rays.direction), far);
      if (!brute.is_sure) continue;
      const bool is_hit = std::isfinite(brute.t);
      is_hit ? ++hit : ++missed;
      ASSERT_EQ(one.tile[i] == 0, is_hit);
      ASSERT_EQ(occluded >> i & 1, is_hit ? 1u : 0u);
      if (!is_hit) continue;
      EXPECT_NEAR(one.t[i], brute.t, 1e-4);
      EXPECT_EQ(one.t[i], many.t[i]);
      // The barycentric coordinates name the point, in the tile's own triangle.
      const TriangleMesh& part = tiled->tiles()[many.tile[i]]->mesh();
      const auto& [a, b, c] = part.triangles[many.triangle[i]];
      const Eigen::Vector3f at = (1 - many.u[i] - many.v[i]) * part.positions[a] +
                                 many.u[i] * part.positions[b] + many.v[i] * part.positions[c];
      const Eigen::Vector3d along = column(rays.origin) + brute.t * column(rays.direction);
      EXPECT_LT((at.cast<double>() - along).norm(), 1e-4);
    }
  }
  EXPECT_GT(hit, 300);
  EXPECT_GT(missed, 200);
}

TEST(RayScene, NothingIsNeverHit) {
  SeededRandom random(1);
  const RayPacket rays = RandomRays(random, 100);
  for (const auto& scene : {SceneOf({}), SceneOf({TriangleMesh()})}) {
    RayHits hits;
    scene->Intersect(rays, &hits);
    for (const int32_t tile : hits.tile) EXPECT_EQ(tile, -1);
    EXPECT_EQ(scene->Occluded(rays), 0u);
  }
}

TEST(RayScene, RefusesBrokenMeshes) {
  const auto message = [](TriangleMesh mesh) {
    const auto tile = RayTile::Make(SampleDevice(), std::move(mesh));
    EXPECT_FALSE(tile.ok());
    EXPECT_EQ(tile.status().code(), StatusCode::kInvalidArgument);
    return tile.status().message();
  };
  TriangleMesh mesh = FlatSheet(2, 2, 1);
  mesh.positions[3].y() = std::numeric_limits<float>::quiet_NaN();
  EXPECT_NE(message(mesh).find("position 3"), std::string::npos);
  mesh = FlatSheet(2, 2, 1);
  mesh.triangles[5][1] = 9;
  EXPECT_NE(message(mesh).find("triangle 5 names vertex 9"), std::string::npos);
  mesh = FlatSheet(2, 2, 1);
  mesh.normals.pop_back();
  EXPECT_NE(message(mesh).find("8 normals for 9"), std::string::npos);
  mesh = FlatSheet(2, 2, 1);
  mesh.normals[8].x() = std::numeric_limits<float>::infinity();
  EXPECT_NE(message(mesh).find("normal 8"), std::string::npos);
  mesh = FlatSheet(2, 2, 1);
  mesh.colors.resize(4);
  EXPECT_NE(message(mesh).find("4 colours"), std::string::npos);

  const auto other = RayDevice::Open().value();
  const auto tile = RayTile::Make(other, FlatSheet(1, 1, 1)).value();
  EXPECT_EQ(RayScene::Make(SampleDevice(), {tile}).status().code(), StatusCode::kInvalidArgument);
  EXPECT_EQ(RayScene::Make(SampleDevice(), {nullptr}).status().code(),
            StatusCode::kInvalidArgument);
}

TEST(TilesBetween, FindsWhatMeetsTheHull) {
  SeededRandom random(7);
  const auto point = [&](double size) -> Eigen::Vector3d {
    return Eigen::Vector3d{random.Unit() - 0.5, random.Unit() - 0.5, random.Unit() - 0.5} * size;
  };
  int meets = 0, misses = 0;
  for (int round = 0; round < 400; ++round) {
    const Eigen::Vector3d center = point(6), low = point(6), box_low = point(6);
    const Eigen::AlignedBox3d target(low, low + Eigen::Vector3d::Constant(1));
    const Eigen::AlignedBox3d box(box_low, box_low + Eigen::Vector3d::Constant(1.2));
    const bool answer = MeetsHull(box, center, target);
    answer ? ++meets : ++misses;
    // Points of the hull in the box prove that it meets; a box somewhat larger must not be needed
    // for them.
    bool is_sampled = false;
    for (int k = 0; k < 3000 && !is_sampled; ++k) {
      const Eigen::Vector3d in_target =
          low + Eigen::Vector3d{random.Unit(), random.Unit(), random.Unit()};
      is_sampled = box.contains(center + random.Unit() * (in_target - center));
    }
    EXPECT_TRUE(answer || !is_sampled);
    if (answer && !is_sampled) {  // then the overlap is thin: a smaller box must miss
      EXPECT_FALSE(MeetsHull(
          {box_low + Eigen::Vector3d::Constant(0.25), box_low + Eigen::Vector3d::Constant(0.95)},
          center, target));
    }
  }
  EXPECT_GT(meets, 20);
  EXPECT_GT(misses, 100);
  const std::vector<Eigen::AlignedBox3d> boxes = {
      {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(1, 1, 1)},
      Eigen::AlignedBox3d(),
      {Eigen::Vector3d(0, 0, 2), Eigen::Vector3d(1, 1, 3)},
      {Eigen::Vector3d(0, 5, 2), Eigen::Vector3d(1, 6, 3)}};
  const std::vector<Eigen::Vector3d> centers = {{0.5, 0.5, 9}};
  EXPECT_EQ(TilesBetween(boxes, boxes[0], centers), (std::vector<uint32_t>{0, 2}));
}

TEST(TilesBetween, PhotosThatSeeAPointOfABoxMaySeeIt) {
  SeededRandom random(3);
  const ViewGeometry view =
      LookAt({0, 0, 5}, {0, 1, 0}, Eigen::Vector3d::UnitY(), 320, 200, 50).value();
  int seen = 0, spared = 0;
  for (int round = 0; round < 500; ++round) {
    const Eigen::Vector3d low =
        16 * Eigen::Vector3d{random.Unit() - 0.5, random.Unit() - 0.5, random.Unit() - 0.5};
    const Eigen::AlignedBox3d box(low, low + Eigen::Vector3d::Constant(1));
    bool is_seen = false;
    for (int k = 0; k < 200; ++k) {
      const Eigen::Vector3d in_cam =
          view.cam_from_world *
          (low + Eigen::Vector3d{random.Unit(), random.Unit(), random.Unit()});
      if (in_cam.z() <= 0) continue;
      const Eigen::Vector2d px = view.camera.Project(in_cam);
      is_seen |= px.x() >= -0.5 && px.y() >= -0.5 && px.x() <= 319.5 && px.y() <= 199.5;
    }
    const bool may_see = MaySee(view, box);
    ASSERT_TRUE(may_see || !is_seen);
    seen += is_seen;
    spared += !may_see;
  }
  EXPECT_GT(seen, 20);
  EXPECT_GT(spared, 300);
  EXPECT_FALSE(MaySee(view, {}));
}

TEST(RayTileCache, GivesTheSameTilesOnThreads) {
  const auto load = [](uint64_t tile) -> Result<TriangleMesh> {
    return FlatSheet(20, 20, static_cast<double>(tile + 1));
  };
  RayTileCache cache(SampleDevice(), load,
                     5 * RayTile::Make(SampleDevice(), FlatSheet(20, 20, 1)).value()->size_bytes());
  ThreadPool pool(3);
  std::vector<uint8_t> is_right(400);
  pool.ParallelFor(is_right.size(), [&](size_t i) {
    const uint64_t tile = i * 7 % 9;
    const auto got = cache.Get(tile);
    is_right[i] = got.ok() && got.value()->box().max().x() == static_cast<float>(20 * (tile + 1));
    if (i % 50 == 0) cache.Drop(tile);
  });
  EXPECT_EQ(std::count(is_right.begin(), is_right.end(), 1), 400);
  EXPECT_GE(cache.load_count(), 9u);
}

TEST(RayTileCache, KeepsTheLastOnesWithinItsBytes) {
  const auto load = [](uint64_t tile) -> Result<TriangleMesh> {
    if (tile == 99) return Status::NotFound("no tile 99");
    return FlatSheet(10, 10, static_cast<double>(tile + 1));
  };
  const size_t one = RayTile::Make(SampleDevice(), FlatSheet(10, 10, 1)).value()->size_bytes();
  RayTileCache cache(SampleDevice(), load, 3 * one + one / 2);
  for (const uint64_t tile : {0, 1, 2, 0, 3}) ASSERT_TRUE(cache.Get(tile).ok());
  EXPECT_EQ(cache.load_count(), 4u);
  EXPECT_EQ(cache.size_bytes(), 3 * one);
  ASSERT_TRUE(cache.Get(0).ok());  // used again before 3 came: still there
  EXPECT_EQ(cache.load_count(), 4u);
  const auto kept = cache.Get(1).value();  // that one had to go
  EXPECT_EQ(cache.load_count(), 5u);
  EXPECT_EQ(kept->box().max().x(), 20);
  cache.Drop(0);
  EXPECT_EQ(cache.size_bytes(), 2 * one);
  EXPECT_EQ(cache.Get(99).status().code(), StatusCode::kNotFound);
  RayTileCache small(SampleDevice(), load, 1);
  EXPECT_TRUE(small.Get(1).ok());
  EXPECT_EQ(small.size_bytes(), one);
}

}  // namespace
}  // namespace veduta
