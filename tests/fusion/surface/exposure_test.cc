// SPDX-License-Identifier: Apache-2.0
// Goal: the gains that were put into colours of points come out again, past outliers, and fixed
//   ones stand.
// Method: points of random light seen by a chain of photos with random gains and noise; groups
//   that share nothing; observations shuffled.
#include "fusion/surface/exposure.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "fusion/surface/color_view.h"
#include "storage/base/content_hash.h"

namespace veduta {
namespace {

struct Session {
  std::map<ImageId, Eigen::Vector3f> gains;  // mean log gain 0 per channel
  std::vector<ColorObservation> observations;
};

Session Take(uint32_t images, uint32_t points, double outliers, bool is_grey, uint64_t seed) {
  SeededRandom random(seed);
  Session session;
  std::vector<Eigen::Vector3d> logs;
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (uint32_t i = 0; i < images; ++i) {
    const double all = 0.7 * (random.Unit() - 0.5);
    logs.push_back(Eigen::Vector3d::Constant(all));
    for (int c = 0; c < 3 && !is_grey; ++c) logs.back()[c] += 0.2 * (random.Unit() - 0.5);
    mean += logs.back() / images;
  }
  for (uint32_t i = 0; i < images; ++i)
    session.gains[ImageId(i + 1)] = (logs[i] - mean).array().exp().cast<float>();
  for (uint32_t p = 0; p < points; ++p) {
    const uint32_t first = random.Below(images);
    const Eigen::Vector3d light{0.05 + 0.4 * random.Unit(), 0.05 + 0.4 * random.Unit(),
                                0.05 + 0.4 * random.Unit()};
    for (uint32_t i = first; i < std::min(images, first + 4); ++i) {
      ColorObservation o = {ImageId(i + 1), {ImageId(first + 1), p}, {}};
      for (int c = 0; c < 3; ++c) {
        const double seen =
            light[c] / session.gains[ImageId(i + 1)][c] * (1 + 0.05 * (random.Unit() - 0.5));
        o.rgb[c] = SrgbFromLight(
            static_cast<float>(random.Unit() < outliers ? 0.02 + 0.5 * random.Unit() : seen));
      }
      session.observations.push_back(o);
    }
  }
  return session;
}

double LargestError(const std::map<ImageId, Eigen::Vector3f>& gains,
                    const std::map<ImageId, Eigen::Vector3f>& truth) {
  double error = 0;
  for (const auto& [image, gain] : truth) {
    error =
        std::max(error, double{(gains.at(image).array() / gain.array()).log().abs().maxCoeff()});
  }
  return error;
}

TEST(Exposure, GainsComeOutAgain) {
  for (const bool is_grey : {false, true}) {
    const Session session = Take(12, 3000, 0, is_grey, 1);
    ExposureOptions options;
    options.per_channel = !is_grey;
    const auto gains = SolveExposures(session.observations, {}, options);
    ASSERT_TRUE(gains.ok());
    EXPECT_LT(LargestError(*gains, session.gains), 0.01);
    EXPECT_EQ(gains->begin()->second.x() == gains->begin()->second.z(), is_grey);
  }
}

TEST(Exposure, OutliersDoNotMoveThem) {
  const Session session = Take(12, 3000, 0.15, false, 2);
  const auto robust = SolveExposures(session.observations, {}, {}).value();
  EXPECT_LT(LargestError(robust, session.gains), 0.02);
  ExposureOptions squares;
  squares.residual_scale = 10;  // next to plain least squares
  const auto plain = SolveExposures(session.observations, {}, squares).value();
  EXPECT_LT(LargestError(robust, session.gains), 0.5 * LargestError(plain, session.gains));
}

TEST(Exposure, FixedGainsStandAndOthersFollow) {
  const Session session = Take(12, 3000, 0.05, false, 3);
  std::map<ImageId, Eigen::Vector3f> fixed, truth = session.gains;
  for (auto& [image, gain] : truth) gain *= 1.7f;  // published when the mean was another
  fixed[ImageId(4)] = truth[ImageId(4)];
  fixed[ImageId(9)] = truth[ImageId(9)];
  const auto gains = SolveExposures(session.observations, fixed, {}).value();
  EXPECT_EQ(gains.at(ImageId(4)), fixed[ImageId(4)]);
  EXPECT_EQ(gains.at(ImageId(9)), fixed[ImageId(9)]);
  EXPECT_LT(LargestError(gains, truth), 0.02);
}

TEST(Exposure, GroupsHaveTheirOwnMean) {
  const Session a = Take(6, 1200, 0, false, 4), b = Take(5, 1000, 0, false, 5);
  std::vector<ColorObservation> both = a.observations;
  std::map<ImageId, Eigen::Vector3f> truth = a.gains;
  for (ColorObservation o : b.observations) {
    o.image = ImageId(o.image.value + 100);
    o.point.home = ImageId(o.point.home.value + 100);
    both.push_back(o);
  }
  for (const auto& [image, gain] : b.gains) truth[ImageId(image.value + 100)] = gain;
  // A photo that shares too little, and one whose colours are at the end of their range: nothing is
  // known of them.
  both.push_back({ImageId(300), both[0].point, {90, 90, 90}});
  for (uint32_t p = 0; p < 50; ++p)
    both.push_back({ImageId(301), both[3 * p].point, {255, 255, 255}});
  const auto gains = SolveExposures(both, {}, {}).value();
  EXPECT_EQ(gains.size(), 13u);
  EXPECT_LT(LargestError(gains, truth), 0.01);
  EXPECT_EQ(gains.at(ImageId(300)), Eigen::Vector3f(Eigen::Vector3f::Ones()));
  EXPECT_EQ(gains.at(ImageId(301)), Eigen::Vector3f(Eigen::Vector3f::Ones()));
}

TEST(Exposure, OrderDoesNotMatter) {
  Session session = Take(8, 500, 0.1, false, 6);
  const auto first = SolveExposures(session.observations, {}, {}).value();
  SeededRandom random(1);
  for (size_t i = session.observations.size(); i > 1; --i) {
    std::swap(session.observations[i - 1],
              session.observations[random.Below(static_cast<uint32_t>(i))]);
  }
  session.observations.push_back(session.observations.front());  // said twice
  EXPECT_EQ(SolveExposures(session.observations, {}, {}).value(), first);
}

TEST(Exposure, SaysWhatIsWrong) {
  EXPECT_TRUE(SolveExposures({}, {}, {}).value().empty());
  const std::map<ImageId, Eigen::Vector3f> bad = {{ImageId(7), {1, 0, 1}}};
  EXPECT_NE(SolveExposures({}, bad, {}).status().message().find("image 7"), std::string::npos);
  ExposureOptions options;
  options.residual_scale = 0;
  EXPECT_EQ(SolveExposures({}, {}, options).status().code(), StatusCode::kInvalidArgument);
  options = {};
  options.views_per_point_max = 1;
  EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument);
  options = {};
  options.bright = options.dark;
  EXPECT_EQ(options.Check().code(), StatusCode::kInvalidArgument);
}

}  // namespace
}  // namespace veduta
