// SPDX-License-Identifier: Apache-2.0
// Goal: distortion and its inverse agree over whole images, models that fold over are refused,
//   and rays and pixels match.
// Method: random models of every sign of k1 and k2 with random points; the fold is found again
//   by brute force along the radius; the border of the undistorted image by the definition,
//   pixel by pixel.
#include "engine/camera/projection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "storage/base/content_hash.h"

namespace veduta {
namespace {

CameraModel Pinhole() {
  CameraModel model;
  model.width_px = 640;
  model.height_px = 480;
  model.fx = 500;
  model.fy = 510;
  model.cx = model.u0 = 322.5;
  model.cy = model.v0 = 236.25;
  return model;
}

CameraModel RandomModel(SeededRandom& random) {
  CameraModel model;
  model.width_px = 100 + random.Below(4000);
  model.height_px = 100 + random.Below(4000);
  const double side = std::max(model.width_px, model.height_px);
  model.fx = side * (0.4 + 2.0 * random.Unit());
  model.fy = model.fx * (0.9 + 0.2 * random.Unit());
  model.cx = model.width_px * (0.4 + 0.2 * random.Unit());
  model.cy = model.height_px * (0.4 + 0.2 * random.Unit());
  model.u0 = model.cx + 0.05 * side * (random.Unit() - 0.5);
  model.v0 = model.cy + 0.05 * side * (random.Unit() - 0.5);
  model.k1 = 1.2 * (random.Unit() - 0.5);
  model.k2 = random.Below(4) == 0 ? 0.0 : 0.8 * (random.Unit() - 0.5);
  return model;
}

double Radial(const CameraModel& model, double r) {
  return r + model.k1 * r * r * r + model.k2 * std::pow(r, 5);
}

double FarthestCorner(const CameraModel& model) {
  double farthest = 0;
  for (const double u : {-0.5, model.width_px - 0.5}) {
    for (const double v : {-0.5, model.height_px - 0.5}) {
      farthest =
          std::max(farthest, std::hypot((u - model.u0) / model.fx, (v - model.v0) / model.fy));
    }
  }
  return farthest;
}

TEST(Distortion, RoundTripsOverRandomModels) {
  SeededRandom random(1);
  int model_count = 0;
  double error_max = 0;
  for (int i = 0; i < 3000; ++i) {
    const CameraModel model = RandomModel(random);
    if (!CheckCamera(model).ok()) continue;
    ++model_count;
    for (int k = 0; k < 40; ++k) {
      const Eigen::Vector2d px{random.Unit() * (model.width_px - 1),
                               random.Unit() * (model.height_px - 1)};
      // Close to a fold the inverse is ill-conditioned: what must be small is the error in the
      // photo.
      const auto undistorted = UndistortPixel(model, px);
      ASSERT_TRUE(undistorted) << "every pixel of the photo has one";
      const Eigen::Vector2d back = DistortPixel(model, *undistorted);
      const double error =
          std::hypot((back.x() - px.x()) / model.fx, (back.y() - px.y()) / model.fy);
      error_max = std::max(error_max, error);
      const double r = std::hypot((px.x() - model.u0) / model.fx, (px.y() - model.v0) / model.fy);
      const double slope = 1 + 3 * model.k1 * r * r + 5 * model.k2 * std::pow(r, 4);
      ASSERT_GT(slope, 0.0);
      if (slope < 1e-2) continue;
      const auto again = UndistortPixel(model, DistortPixel(model, px));
      ASSERT_TRUE(again);
      error_max = std::max(error_max, std::hypot((again->x() - px.x()) / model.fx,
                                                 (again->y() - px.y()) / model.fy));
    }
  }
  EXPECT_GT(model_count, 1000);
  EXPECT_LT(error_max, 1e-10);
}

TEST(Distortion, IsTheFormulaOfTheRecord) {
  CameraModel model = Pinhole();
  model.k1 = -0.2;
  model.k2 = 0.05;
  model.u0 = 300;
  model.v0 = 250;
  const double cx = (300 - 322.5) / 500, cy = (250 - 236.25) / 510;
  const double x = (600 - 322.5) / 500 - cx, y = (20 - 236.25) / 510 - cy;
  const double r2 = x * x + y * y;
  const double factor = 1 - 0.2 * r2 + 0.05 * r2 * r2;
  const Eigen::Vector2d distorted = DistortPixel(model, {600, 20});
  EXPECT_NEAR(distorted.x(), 500 * (cx + x * factor) + 322.5, 1e-9);
  EXPECT_NEAR(distorted.y(), 510 * (cy + y * factor) + 236.25, 1e-9);
}

TEST(Distortion, CenterAndPinholeStayPut) {
  CameraModel model = Pinhole();
  EXPECT_FALSE(IsDistorted(model));
  EXPECT_EQ(DistortPixel(model, {17.25, 400.5}), Eigen::Vector2d(17.25, 400.5));
  EXPECT_EQ(*UndistortPixel(model, {17.25, 400.5}), Eigen::Vector2d(17.25, 400.5));
  model.k1 = -0.1;
  EXPECT_TRUE(IsDistorted(model));
  EXPECT_NEAR(
      (*UndistortPixel(model, {model.u0, model.v0}) - Eigen::Vector2d(model.u0, model.v0)).norm(),
      0, 1e-12);
}

TEST(Distortion, SaysWhereNoInverseExists) {
  CameraModel model = Pinhole();
  model.k1 = -0.25;  // folds at r = 1.1547, where g = 0.7698: 384.9 px right of the centre
  EXPECT_TRUE(UndistortPixel(model, {322.5 + 384.8, 236.25}));
  EXPECT_FALSE(UndistortPixel(model, {322.5 + 385.0, 236.25}));
  EXPECT_FALSE(UndistortPixel(model, {std::nan(""), 0}));
  EXPECT_FALSE(UndistortPixel(model, {std::numeric_limits<double>::infinity(), 0}));
  // Just inside of the fold the answer is the smaller of the two solutions.
  const auto near_fold = UndistortPixel(model, {322.5 + 384.89, 236.25});
  ASSERT_TRUE(near_fold);
  EXPECT_LT((near_fold->x() - 322.5) / 500, 1.1547006);
  model.k1 = 0.3;
  EXPECT_TRUE(UndistortPixel(model, {1e7, -1e7})) << "g grows without bound";
}

TEST(CheckCamera, RefusesExactlyTheFoldsFoundByBruteForce) {
  SeededRandom random(2);
  int accepted = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const CameraModel model = RandomModel(random);
    const double corner = FarthestCorner(model);
    // Walks outwards: the radius must grow until past the corner's, and beyond the corner itself.
    bool folds = false;
    double margin = 1e9;  // how close it is to the other answer
    double previous = 0;
    for (int step = 1; step <= 20000; ++step) {
      const double r = step * corner * 10 / 20000;
      const double distorted = Radial(model, r);
      const double slope = 1 + 3 * model.k1 * r * r + 5 * model.k2 * std::pow(r, 4);
      if (distorted <= previous) {
        folds = true;
        margin = std::max(corner - r, corner - previous);
        break;
      }
      previous = distorted;
      if (r > corner && distorted > corner) {
        margin = std::min(margin, slope);
        break;
      }
      margin = std::min(margin, slope);
    }
    if (std::abs(margin) < 1e-2) continue;  // too close to call on this grid
    const Status status = CheckCamera(model);
    EXPECT_EQ(status.ok(), !folds)
        << model.k1 << " " << model.k2 << " corner " << corner << ": " << status.message();
    ++(folds ? refused : accepted);
  }
  EXPECT_GT(accepted, 500);
  EXPECT_GT(refused, 200);
}

TEST(CheckCamera, NamesFieldAndValue) {
  ASSERT_TRUE(CheckCamera(Pinhole()).ok()) << CheckCamera(Pinhole()).message();
  const double nan = std::nan(""), inf = std::numeric_limits<double>::infinity();
  const auto expect_refused = [](const CameraModel& model, const std::string& expected) {
    const Status status = CheckCamera(model);
    EXPECT_EQ(status.code(), StatusCode::kInvalidArgument) << expected;
    EXPECT_NE(status.message().find(expected), std::string::npos) << status.message();
  };
  const struct {
    double CameraModel::*field;
    const char* name;
  } fields[] = {{&CameraModel::fx, "fx"}, {&CameraModel::fy, "fy"}, {&CameraModel::cx, "cx"},
                {&CameraModel::cy, "cy"}, {&CameraModel::k1, "k1"}, {&CameraModel::k2, "k2"},
                {&CameraModel::u0, "u0"}, {&CameraModel::v0, "v0"}};
  for (const auto& field : fields) {
    for (const double value : {nan, inf, -inf, 1e300, -1e300}) {
      CameraModel model = Pinhole();
      model.*field.field = value;
      expect_refused(model, std::string(field.name) + " = ");
    }
  }
  CameraModel model = Pinhole();
  model.width_px = 0;
  expect_refused(model, "width = 0");
  model.width_px = 65536;
  expect_refused(model, "width = 65536");
  model = Pinhole();
  model.height_px = 4'000'000'000;
  expect_refused(model, "height = 4e+09");
  model = Pinhole();
  model.fx = 0;
  expect_refused(model, "fx = 0");
  model.fx = 1e-300;
  expect_refused(model, "fx = 1e-300");
  model = Pinhole();
  model.k1 = -0.6;
  expect_refused(model, "k1 = -0.6, k2 = 0: the distortion folds over");
  model.k1 = -0.42;  // folds at 0.891 beyond the corner at 0.8 or so, but reaches 0.594 only
  expect_refused(model, "no ray reaches the photo's farthest corner");
  model.k1 = 30;
  expect_refused(model, "times its radius");
}

TEST(Bearing, RoundTripsAndLooksForward) {
  SeededRandom random(3);
  const CameraModel model = Pinhole();
  for (int i = 0; i < 1000; ++i) {
    const Eigen::Vector2d px{random.Unit() * 640, random.Unit() * 480};
    const Eigen::Vector3d ray = BearingFromPixel(model, px);
    EXPECT_NEAR(ray.norm(), 1.0, 1e-14);
    EXPECT_GT(ray.z(), 0.0);
    const auto back = PixelFromBearing(model, ray * (0.1 + 10 * random.Unit()));
    ASSERT_TRUE(back);
    EXPECT_LT((*back - px).norm(), 1e-9);
  }
  EXPECT_EQ(BearingFromPixel(model, {model.cx, model.cy}), Eigen::Vector3d(0, 0, 1));
  EXPECT_GT(BearingFromPixel(model, {model.cx + 10, model.cy}).x(), 0.0);
  EXPECT_GT(BearingFromPixel(model, {model.cx, model.cy + 10}).y(), 0.0) << "y points down";
  EXPECT_FALSE(PixelFromBearing(model, {0, 0, -1}));
  EXPECT_FALSE(PixelFromBearing(model, {1, 0, 0}));
  EXPECT_FALSE(PixelFromBearing(model, {0, 0, std::nan("")}));
  EXPECT_FALSE(PixelFromBearing(model, {1e308, 0, 1e-300}));
}

TEST(IsInsidePhoto, KeepsItsDistanceFromTheArtificialBorder) {
  CameraModel model = Pinhole();
  model.width_px = 96;
  model.height_px = 64;
  model.fx = model.fy = 80;
  model.cx = model.u0 = 50;
  model.cy = model.v0 = 30;
  model.k1 = 0.3;  // the undistorted image looks past the photo's edge
  ASSERT_TRUE(CheckCamera(model).ok());
  const auto shows_photo = [&](int u, int v) {
    const Eigen::Vector2d p = DistortPixel(model, {u, v});
    return p.x() >= 0 && p.y() >= 0 && p.x() <= 95 && p.y() <= 63;
  };
  constexpr double kMargin = 4;
  std::vector<Eigen::Vector2d> black;
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 96; ++u) {
      if (!shows_photo(u, v)) black.emplace_back(u, v);
    }
  }
  int dropped = 0, kept = 0;
  for (int v = 0; v < 64; ++v) {
    for (int u = 0; u < 96; ++u) {
      EXPECT_EQ(IsInsidePhoto(model, {u, v}, 0), shows_photo(u, v));
      double nearest_black = 1e9;
      for (const Eigen::Vector2d& at : black) {
        nearest_black = std::min(nearest_black, std::hypot(at.x() - u, at.y() - v));
      }
      const bool is_inside = IsInsidePhoto(model, {u, v}, kMargin);
      if (nearest_black <= kMargin - 0.5) {
        EXPECT_FALSE(is_inside) << u << "," << v;
      }
      if (nearest_black > kMargin + 1.5) {
        EXPECT_TRUE(is_inside) << u << "," << v;
      }
      ++(is_inside ? kept : dropped);
    }
  }
  EXPECT_GT(dropped, 500);
  EXPECT_GT(kept, 1500);
}

TEST(IsInsidePhoto, IsTrueWhereNoBorderIsSeen) {
  CameraModel model = Pinhole();
  EXPECT_TRUE(IsInsidePhoto(model, {0, 0}, 10));
  EXPECT_TRUE(IsInsidePhoto(model, {639, 479}, 10));
  model.k1 = -0.1;  // barrel: the undistorted image lies within the photo
  EXPECT_TRUE(IsInsidePhoto(model, {0, 0}, 10));
  EXPECT_FALSE(IsInsidePhoto(model, {std::nan(""), 0}, 10));
}

}  // namespace
}  // namespace veduta
