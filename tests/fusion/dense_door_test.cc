// SPDX-License-Identifier: Apache-2.0
// Goal: the dense half of the door does what its requests say, and refuses by name what it cannot.
// Method: a street of a few photos in a real database; passes over all reconstructions and over
//   one; pictures from outside and from a photo; requests that break one rule each.
#include "fusion/dense_door.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <string>
#include <utility>

#include "storage/records/photo_record.h"
#include "tests/engine/street_fixture.h"
#include "tests/storage/damage.h"

namespace veduta {
namespace {

std::vector<uint8_t> FileBytesOf(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class DenseDoorTest : public testing::Test {
 protected:
  void SetUp() override {
    city_.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
    request_.device = "cpp";
    request_.options.depth_side_px = 96;
    render_.path = folder_.path() + "/out.png";
    render_.side_px = 128;
  }

  Result<std::vector<DensifyReport>> Densify() {
    return DensifyAll(writer_, *city_.parts().pool, one_pass_, request_, {});
  }
  Result<RenderReport> Render() {
    return RenderToFile(city_.parts().database->GetSnapshot(), *city_.parts().pool, render_);
  }

  City city_;
  Writer& writer_ = *city_.parts().writer;
  Claimable one_pass_;
  TemporaryFolder folder_;
  DensifyRequest request_;
  RenderRequest render_;
};

TEST(DenseDoor, PassesOverAPhotoThatCannotBeRead) {
  City city;
  city.Add({{20.0, 90}, {20.7, 90}, {21.4, 90}, {22.1, 90}});
  const auto image = city.Ask().snapshot().GetImage(ImageId(2));
  ASSERT_OK(image);
  city.Close();
  for (const Family family : {Family::kPhotos, Family::kFeatures}) {
    WithRocksdb(
        city.path(),
        [&](rocksdb::DB& db, rocksdb::ColumnFamilyHandle* handle) {
          ASSERT_TRUE(db.Put({}, handle, HashKey(image->photo), "damaged").ok());
        },
        family);
  }
  city.Open();
  DensifyRequest request;
  request.device = "cpp";
  request.options.depth_side_px = 96;
  const auto reports = city.engine().Densify(request);
  ASSERT_OK(reports);
  ASSERT_EQ(reports->front().without_depth.size(), 1u);
  EXPECT_EQ(reports->front().without_depth.front().name, image->name);
  EXPECT_EQ(reports->front().depths.computed, 3u);
  EXPECT_GT(reports->front().triangles, 0u);
}

TEST_F(DenseDoorTest, DensifiesAllOrOneAndOnePassAtATime) {
  size_t told = 0;
  request_.progress = [&](std::string_view, size_t, size_t) { ++told; };
  const auto all = Densify();
  ASSERT_OK(all);
  ASSERT_EQ(all->size(), 1u);
  EXPECT_EQ(all->front().reconstruction, ReconstructionId(1));
  EXPECT_EQ(all->front().device, "C++");
  EXPECT_EQ(all->front().depth_side_px, 96u);
  EXPECT_EQ(all->front().depths.computed, 4u);
  EXPECT_GT(all->front().triangles, 0u);
  EXPECT_GT(told, 10u);
  request_.reconstruction = ReconstructionId(1);
  const auto one = Densify();
  ASSERT_OK(one);
  EXPECT_EQ(one->front().depths.kept, 4u);
  request_.reconstruction = ReconstructionId(8);
  EXPECT_EQ(Densify().status().code(), StatusCode::kNotFound);
  request_.options.neighbor_count = 0;
  EXPECT_EQ(Densify().status().code(), StatusCode::kInvalidArgument);
  request_ = {};
  request_.device = "a device that nobody sells";
  EXPECT_EQ(Densify().status().code(), StatusCode::kNotFound);
  request_.device = "cpp";
  const auto another = one_pass_.TryClaim();
  ASSERT_TRUE(another);
  EXPECT_EQ(Densify().status().code(), StatusCode::kBusy);
}

// No lock is held while a callback runs.
TEST_F(DenseDoorTest, CallbacksMayUseTheEngine) {
  Engine& engine = city_.engine();
  bool has_written = false, has_reported = false;
  request_.progress = [&](std::string_view, size_t, size_t) {
    if (std::exchange(has_written, true)) return;
    EXPECT_OK(engine.AddCamera("from progress", StreetCameraModel(), "a test"));
    EXPECT_OK(engine.Settle());
    EXPECT_EQ(engine.Densify({}).status().code(), StatusCode::kBusy);
    EXPECT_EQ(engine.Remove({}).status().code(), StatusCode::kBusy);
  };
  request_.report = [&](const DensifyReport&) {
    has_reported = true;
    EXPECT_OK(engine.AddCamera("from report", StreetCameraModel(), "a test"));
    EXPECT_EQ(engine.Remove({}).status().code(), StatusCode::kBusy);
  };
  ASSERT_OK(engine.Densify(request_));
  EXPECT_TRUE(has_written && has_reported);
  EXPECT_EQ(engine.Ask().Cameras()->size(), 3u);
  EXPECT_OK(engine.Remove({})) << "nobody has the claim any more";
}

TEST_F(DenseDoorTest, RequestsAreCheckedAndNamed) {
  request_.options.voxel_size = 0;
  EXPECT_EQ(Densify().status().message(),
            "DensifyRequest.options.voxel_size is 0, but must be finite and more than 0");
  EXPECT_EQ(request_.Check().message(),
            "options.voxel_size is 0, but must be finite and more than 0");
  EXPECT_EQ(city_.Ask().door().Verify({.count_max = 0}).status().message(),
            "VerifyRequest.count_max is 0, but must be 1 or more");
  EXPECT_TRUE(city_.Ask().door().Verify({.count_max = 1})->empty());
}

TEST_F(DenseDoorTest, WithoutReconstructionsSaysWhatToDo) {
  City empty;
  const Status status =
      DensifyAll(*empty.parts().writer, *empty.parts().pool, one_pass_, request_, {}).status();
  EXPECT_EQ(status.code(), StatusCode::kNotFound);
  EXPECT_NE(status.message().find("add photos first"), std::string::npos);
}

TEST_F(DenseDoorTest, WhatIsMergedAwayMeanwhileIsSwept) {
  request_.progress = [&](std::string_view stage, size_t done, size_t) {
    if (stage != "volume" || done != 1) return;
    Writer::Turn turn = writer_.Take();
    auto record = turn.database().GetSnapshot()->GetReconstruction(ReconstructionId(1));
    ASSERT_OK(record);
    record->merged_into = ReconstructionId(9);
    const auto transaction = turn.database().BeginTransaction();
    transaction->PutReconstruction(*record);
    ASSERT_OK(transaction->Commit());
  };
  const auto reports = Densify();
  ASSERT_OK(reports);
  EXPECT_EQ(reports->front().merged_into, ReconstructionId(9));
  size_t left = 0;
  ASSERT_OK(writer_.GetSnapshot()->dense().ScanAll([&](uint8_t, auto, auto) { ++left; }));
  EXPECT_EQ(left, 0u);
}

TEST_F(DenseDoorTest, DrawsFromOutsideAndFromAPhoto) {
  EXPECT_OK(Render()) << "the points, where there is no surface yet";
  ASSERT_OK(Densify());
  for (const char* side : {"front", "left", "right"}) {
    for (const char* shading : {"color", "clay", "normal"}) {
      render_.side = side, render_.shading = shading;
      EXPECT_OK(Render());
    }
  }
  std::filesystem::remove(render_.path);
  render_.from = TakePhoto({20.7, 90}).name;
  render_.compare = true;
  const auto report = Render();
  ASSERT_OK(report);
  EXPECT_GT(report->covered_share, 0.3);
  EXPECT_LT(report->error_median_balanced, 60);
  EXPECT_TRUE(std::filesystem::exists(render_.path));
  render_.from = "#2";
  EXPECT_OK(Render()) << "the same photo by its number";
  render_.from = "nobody.jpg";
  EXPECT_EQ(Render().status().code(), StatusCode::kNotFound);
}

// Photos that a camera has as they lie in their files hang in the world the other way round.
TEST_F(DenseDoorTest, FromOutsideUpIsThatOfThePhotosUpright) {
  ASSERT_OK(Render());
  const std::vector<uint8_t> upright = FileBytesOf(render_.path);
  Database& database = *city_.parts().database;
  const auto snapshot = database.GetSnapshot();
  const auto transaction = database.BeginTransaction();
  const Rigid3 half_turn{Eigen::Quaterniond(0, 0, 0, 1), Eigen::Vector3d::Zero()};
  for (uint32_t id = 1; id <= 4; ++id) {
    auto image = snapshot->GetImage(ImageId(id));
    auto pose = snapshot->FindPose(ImageId(id));
    ASSERT_OK(image);
    ASSERT_OK(pose);
    image->orientation = 3;  // the first row is at the bottom
    (*pose)->cam_from_world = half_turn * (*pose)->cam_from_world;
    transaction->PutImage(*image);
    transaction->PutPose(**pose);
  }
  ASSERT_OK(transaction->Commit());
  std::filesystem::remove(render_.path);
  ASSERT_OK(Render());
  EXPECT_EQ(FileBytesOf(render_.path), upright);
}

TEST_F(DenseDoorTest, RefusesByName) {
  const auto expect_refused = [&](const char* field, const std::function<void()>& spoil) {
    const RenderRequest sound = render_;
    spoil();
    const Status status = render_.Check();
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << field;
    EXPECT_EQ(status.message().find(field), 0u) << status.message();
    EXPECT_EQ(Render().status().code(), StatusCode::kInvalidArgument) << field;
    render_ = sound;
  };
  ASSERT_OK(render_.Check());
  expect_refused("path", [&] { render_.path = ""; });
  expect_refused("side", [&] { render_.side = "back"; });
  expect_refused("shading", [&] { render_.shading = "pink"; });
  expect_refused("compare", [&] { render_.compare = true; });
  expect_refused("reconstruction",
                 [&] { render_.from = "x", render_.reconstruction = ReconstructionId(1); });
  expect_refused("side_px", [&] { render_.side_px = 15; });
}

TEST(ListDevices, SaysWhichOneWorksOrWhyNone) {
  const auto none = ListDevicesFor("cpp");
  ASSERT_OK(none);
  EXPECT_FALSE(none->chosen.has_value());
  EXPECT_NE(none->why_none, "");
  const auto by_default = ListDevicesFor("");
  ASSERT_OK(by_default);
  EXPECT_EQ(by_default->chosen.has_value(), !by_default->devices.empty());
  EXPECT_EQ(by_default->why_none.empty(), by_default->chosen.has_value());
  EXPECT_EQ(ListDevicesFor("a device that nobody sells").status().code(), StatusCode::kNotFound);
}

}  // namespace
}  // namespace veduta
