// SPDX-License-Identifier: Apache-2.0
// Goal: a stored photo becomes a view of the size asked for whose camera fits its pixels, without
//   the border where an undistorted image looks past the photo; damage is named.
// Method: a photo with bright dots at known places, with and without a lens, in a real database;
//   the dots are looked for where the view's camera projects them.
#include "fusion/pass/view_loader.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>

#include "engine/camera/filled_photo.h"
#include "engine/camera/projection.h"
#include "fusion/surface/renderer.h"
#include "tests/storage/samples.h"

namespace veduta {
namespace {

constexpr uint32_t kWidth = 160, kHeight = 120;

CameraModel Camera(double k1) {
  CameraModel camera;
  camera.width_px = kWidth, camera.height_px = kHeight;
  camera.fx = camera.fy = 150;
  camera.cx = camera.u0 = 79.5, camera.cy = camera.v0 = 59.5;
  camera.k1 = k1;
  return camera;
}

class ViewLoaderTest : public testing::Test {
 protected:
  void SetUp() override {
    DatabaseOptions options;
    options.create = true;
    options.sync_wal = false;
    auto opened = Database::Open(folder_.path() + "/db", options);
    ASSERT_OK(opened);
    database_ = std::move(*opened);
  }

  // A dark photo with a bright square of 9 px around each place.
  SceneImage Store(const std::vector<Eigen::Vector2d>& dots, const CameraModel& camera) {
    std::vector<uint8_t> rgb(kWidth * kHeight * 3, 20);
    for (const Eigen::Vector2d& dot : dots) {
      for (int k = 0; k < 81; ++k) {
        const long x = std::lround(dot.x()) + k % 9 - 4, y = std::lround(dot.y()) + k / 9 - 4;
        for (int c = 0; c < 3; ++c) rgb[3 * static_cast<size_t>(y * kWidth + x) + c] = 240;
      }
    }
    const std::string path = folder_.path() + "/photo.png";
    EXPECT_OK(WritePng(path, kWidth, kHeight, rgb));
    std::ifstream file(path, std::ios::binary);
    const std::vector<char> read{std::istreambuf_iterator<char>(file), {}};
    return Store(std::vector<uint8_t>(read.begin(), read.end()), camera);
  }
  SceneImage Store(const std::vector<uint8_t>& bytes, const CameraModel& camera) {
    SceneImage image;
    image.record.id = ImageId(++last_image_);
    image.record.name = "photo.png";
    image.record.photo = HashContent(bytes);
    image.camera = camera;
    EXPECT_OK(database_->WritePhotoAhead(image.record.photo, bytes, Features()));
    return image;
  }

  TemporaryFolder folder_;
  std::unique_ptr<Database> database_;
  uint32_t last_image_ = 0;
};

TEST_F(ViewLoaderTest, AsksForTheMemoryThatItTakes) {
  const SceneImage first = Store(std::vector<Eigen::Vector2d>(), Camera(0)),
                   second = Store(std::vector<Eigen::Vector2d>(), Camera(0.15));
  MemoryBudget budget(1 << 30);
  UndistortCache tables(1 << 20);
  std::vector<uint64_t> asked;
  const TakeMemory take = [&](uint64_t bytes) {
    asked.push_back(bytes);
    return budget.Take(bytes);
  };
  ViewLoader loader(database_->GetSnapshot(), 0, 1, {DecoderInProcess(), &tables, take});
  ASSERT_OK(loader.Load(first));
  ASSERT_OK(loader.Load(first)) << "which is kept";
  ASSERT_OK(loader.Load(second));
  ASSERT_EQ(asked.size(), 2u);
  for (const uint64_t bytes : asked) EXPECT_GE(bytes, 20u * kWidth * kHeight);
  EXPECT_EQ(tables.stats().build_count, 1u) << "the tables that it was given";
  EXPECT_TRUE(budget.TryTake(1 << 30)) << "all of it was given back";
}

uint8_t GrayAt(const View& view, const Eigen::Vector2d& px) {
  return view.gray[static_cast<size_t>(std::lround(px.y())) * view.geometry.width_px +
                   static_cast<size_t>(std::lround(px.x()))];
}

TEST_F(ViewLoaderTest, CamerasFitThePixelsAtEverySize) {
  for (const double k1 : {0.0, -0.15, 0.15}) {
    // Places in the undistorted image, and where the lens puts them.
    const std::vector<Eigen::Vector2d> places = {{79, 59}, {40, 30}, {115, 85}, {50, 80}};
    const CameraModel camera = Camera(k1);
    std::vector<Eigen::Vector2d> dots;
    for (const Eigen::Vector2d& place : places)
      dots.push_back(k1 == 0 ? place : DistortPixel(camera, place));
    const SceneImage image = Store(dots, camera);
    for (const uint32_t side : {0u, 80u, 1000u}) {
      ViewLoader loader(database_->GetSnapshot(), side, 2);
      const auto view = loader.Load(image);
      ASSERT_OK(view);
      const ViewGeometry& geometry = (*view)->geometry;
      EXPECT_EQ(geometry.width_px, ViewGeometryOf(image, side).width_px);
      EXPECT_LE(geometry.width_px, side == 80 ? 80u : kWidth) << "never larger";
      EXPECT_EQ((*view)->rgb.size(), 3 * (*view)->gray.size());
      for (const Eigen::Vector2d& place : places) {
        const Eigen::Vector3d ray((place.x() - camera.cx) / camera.fx,
                                  (place.y() - camera.cy) / camera.fy, 1);
        EXPECT_GT(GrayAt(**view, geometry.camera.Project(ray)), 180) << k1 << " " << side;
      }
      EXPECT_EQ(loader.Load(image)->get(), view->get()) << "kept";
    }
  }
}

TEST_F(ViewLoaderTest, ABorderThatLooksPastThePhotoIsCutOff) {
  const SceneImage straight = Store(std::vector<Eigen::Vector2d>(), Camera(0)),
                   curved = Store(std::vector<Eigen::Vector2d>(), Camera(0.15));
  EXPECT_EQ(ViewGeometryOf(straight, 0).width_px, kWidth);
  const ViewGeometry cut = ViewGeometryOf(curved, 0);
  EXPECT_LT(cut.width_px, kWidth);
  ViewLoader loader(database_->GetSnapshot(), 0, 2);
  const auto view = loader.Load(curved);
  ASSERT_OK(view);
  for (const uint8_t gray : (*view)->gray) EXPECT_GT(gray, 10) << "black came in from outside";
}

TEST_F(ViewLoaderTest, SaysWhatIsFilled) {
  const PixelArea area{60, 40, 30, 20};
  const cv::Mat picture(kHeight, kWidth, CV_8UC3, cv::Scalar(20, 20, 20));
  const auto photo = FillPhoto(picture.clone(), PhotoExamination(), {&area, 1});
  ASSERT_OK(photo);
  for (const double k1 : {0.0, -0.15, 0.15}) {
    const SceneImage image = Store(*photo, Camera(k1));
    for (const uint32_t side : {0u, 80u}) {
      ViewLoader loader(database_->GetSnapshot(), side, 2);
      const auto view = loader.Load(image);
      ASSERT_OK(view);
      ASSERT_EQ((*view)->filled.size(), (*view)->gray.size());
      size_t filled = 0;
      for (size_t i = 0; i < (*view)->gray.size(); ++i) {
        const bool is_grey = (*view)->gray[i] > 60;  // it shows the filling, not the dark photo
        EXPECT_TRUE(!is_grey || (*view)->filled[i] != 0) << i;
        filled += (*view)->filled[i] != 0;
      }
      EXPECT_LT(filled, (*view)->gray.size() / 15) << k1 << " " << side;
    }
  }
  const SceneImage plain = Store(std::vector<Eigen::Vector2d>(), Camera(0));
  const auto view = ViewLoader(database_->GetSnapshot(), 0, 1).Load(plain);
  ASSERT_OK(view);
  EXPECT_TRUE((*view)->filled.empty());
}

TEST_F(ViewLoaderTest, NamesAPhotoThatCannotBeDecoded) {
  const SceneImage image = Store(std::vector<uint8_t>{1, 2, 3}, Camera(0));
  ViewLoader loader(database_->GetSnapshot(), 0, 2);
  const Status status = loader.Load(image).status();
  EXPECT_EQ(status.code(), StatusCode::kCorruption);
  EXPECT_NE(status.message().find("photo.png"), std::string::npos);
}

}  // namespace
}  // namespace veduta
