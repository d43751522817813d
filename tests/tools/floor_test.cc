// SPDX-License-Identifier: Apache-2.0
// Goal: rendered calibration photos show what their truth says, and are the same bytes on any
//   number of threads.
// Method: the photo's grey values at places where truth and pattern say ink or paper; small
//   sessions compared file by file; what cannot be rendered is refused before anything is
//   written.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <string>

#include "engine/camera/projection.h"
#include "tools/render/floor/session.h"

namespace veduta::floor {
namespace {

namespace fs = std::filesystem;

SessionOptions SmallSession() {
  SessionOptions options;
  options.model = {400, 300, 360, 360, 196, 152, -0.15, 0.03, 200, 148};
  options.floor.marker_count = 24;
  options.floor.flooring = Flooring::kTile;
  options.floor.bend_mm = 5;
  options.photos = 3;
  return options;
}

std::map<std::string, std::string> FilesOf(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (!entry.is_regular_file()) continue;
    std::ifstream file(entry.path(), std::ios::binary);
    files[fs::relative(entry.path(), folder).string()] =
        std::string(std::istreambuf_iterator<char>(file), {});
  }
  return files;
}

fs::path NewFolder(const std::string& name) {
  const fs::path folder =
      fs::path(::testing::TempDir()) / ("veduta_floor_" + std::to_string(getpid()) + name);
  fs::remove_all(folder);
  return folder;
}

TEST(FloorPhoto, ShowsTheCornerWhereTheTruthSays) {
  SessionOptions options = SmallSession();
  options.photo.noise_sigma = 0;
  options.photo.blur_sigma_px = 0;
  options.photo.unevenness = 0;
  const Floor floor = Floor::Build(options.floor).value();
  int seen = 0;
  for (const FloorCamera& camera : SessionCameras(options, floor.extent_m()).value()) {
    const cv::Mat photo = RenderFloorPhoto(floor, camera, options.photo).value();
    for (const MarkerTruth& truth : TrueMarkers(floor, camera)) {
      if (!truth.is_whole || truth.diameter_px < 40) continue;
      // Going round the corner at three tenths of the radius, ink and paper change places four
      // times.
      const double radius_px = 0.15 * truth.diameter_px * std::cos(truth.tilt_deg * M_PI / 180);
      int changes = 0;
      bool was_dark = false;
      for (int i = 0; i <= 72; ++i) {
        const double angle = i * M_PI / 36;
        const int u = static_cast<int>(std::lround(truth.px.x() + radius_px * std::cos(angle)));
        const int v = static_cast<int>(std::lround(truth.px.y() + radius_px * std::sin(angle)));
        const bool is_dark = photo.at<uint8_t>(v, u) < 140;
        if (i > 0 && is_dark != was_dark) ++changes;
        was_dark = is_dark;
      }
      EXPECT_EQ(changes, 4) << truth.id << " at " << truth.px.transpose();
      ++seen;
    }
  }
  EXPECT_GE(seen, 6);
}

TEST(FloorPhoto, CoversAreKnownToTheTruth) {
  SessionOptions options = SmallSession();
  const Floor bare = Floor::Build(options.floor).value();
  Cover cover;
  cover.center_m = bare.markers()[3].center_m.head<2>();
  cover.half_m = {0.05, 0.05};
  options.floor.covers = {cover};
  const Floor floor = Floor::Build(options.floor).value();
  const Rigid3 pose = LookDown(cover.center_m, 0.6, 10, 30, 0);
  const auto truths = TrueMarkers(floor, {"", options.model, pose});
  const auto hidden =
      std::find_if(truths.begin(), truths.end(), [](const auto& t) { return t.id == 3; });
  ASSERT_NE(hidden, truths.end());
  EXPECT_EQ(hidden->cover, 1);
  EXPECT_NEAR(hidden->tilt_deg, 10, 0.5);
  const Eigen::Vector2d principal(options.model.cx, options.model.cy);
  EXPECT_LT((hidden->px - DistortPixel(options.model, principal)).norm(), 3)
      << "what is looked at is in the middle";
}

TEST(FloorSession, SameBytesOnAnyNumberOfThreads) {
  const fs::path one = NewFolder("one"), two = NewFolder("two");
  SessionOptions options = SmallSession();
  options.motion_px_max = 2;
  ASSERT_TRUE(RenderSession(options, one.string(), nullptr).ok());
  options.threads = 2;
  ASSERT_TRUE(RenderSession(options, two.string(), nullptr).ok());
  const auto files = FilesOf(one);
  EXPECT_EQ(files.size(), 3u * 3 + 3);
  EXPECT_EQ(files, FilesOf(two));
  EXPECT_EQ(RenderSession(options, two.string(), nullptr).code(), StatusCode::kAlreadyExists);
  fs::remove_all(one);
  fs::remove_all(two);
}

TEST(FloorSession, RefusesWhatCannotBe) {
  const fs::path folder = NewFolder("refused");
  const auto refuse = [&](const auto& change) {
    SessionOptions options = SmallSession();
    change(&options);
    EXPECT_EQ(RenderSession(options, folder.string(), nullptr).code(),
              StatusCode::kInvalidArgument);
    EXPECT_FALSE(fs::exists(folder));
  };
  refuse([](SessionOptions* o) { o->photos = 0; });
  refuse([](SessionOptions* o) { o->floor.marker_count = kMarkerIdCount + 1; });
  refuse([](SessionOptions* o) { o->floor.bend_mm = -1; });
  refuse([](SessionOptions* o) { o->photo.blur_sigma_px = std::nan(""); });
  refuse([](SessionOptions* o) { o->jpeg_quality = 101; });
  refuse([](SessionOptions* o) { o->tilt_deg_max = 80; });
}

}  // namespace
}  // namespace veduta::floor
