// SPDX-License-Identifier: Apache-2.0
// Goal: each thing that a calibration leaves too uncertain gets its own warning, with the words
// that
//   say what to photograph; what was left out gets a note; a good one gets nothing; the grid of the
//   coverage and the distortion's standard deviation are what their names say.
// Method: calibrations written by hand that are good but for one thing; a standard deviation beside
//   the move that an error of that size makes.
#include "engine/camera/calibration/calibration_advice.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "engine/camera/projection.h"

namespace veduta {
namespace {

// Ten photos from several distances, points in every part of the photo, small standard deviations.
Calibration Good() {
  Calibration c;
  c.model = {1600, 1200, 1500, 1500, 800, 600, -0.1, 0.02, 800, 600};
  c.covariance.setZero();
  c.covariance.diagonal() << 1, 1, 1, 1, 1e-8, 1e-8, 1, 1;
  c.error_px_mean = 0.1;
  c.error_px_rms = 0.12;
  c.distortion_sigma_px = 0.5;
  for (uint32_t photo = 0; photo < 10; ++photo) {
    c.photos.push_back(
        {"photo" + std::to_string(photo), "", 48, 0, 0.1, 10. + 4 * photo, 0.8 + 0.05 * photo});
    for (uint32_t i = 0; i < 48; ++i)
      c.residuals.push_back({photo, i, {100. + 200 * (i % 8), 100. + 200 * (i / 8)}, {0, 0}, true});
  }
  return c;
}

void ExpectOnly(const Calibration& c, CalibrationAdvice kind, const std::string& words) {
  const std::vector<CalibrationWarning> advice = Advise(c);
  ASSERT_EQ(advice.size(), 1u) << words;
  EXPECT_EQ(advice[0].kind, kind);
  EXPECT_NE(advice[0].text.find(words), std::string::npos) << advice[0].text;
  EXPECT_EQ(advice[0].IsNote(),
            kind == CalibrationAdvice::kPhotoLeftOut || kind == CalibrationAdvice::kPointsLeftOut);
}

TEST(Advice, NothingWhereAllIsGood) {
  EXPECT_TRUE(Advise(Good()).empty()) << Advise(Good()).front().text;
}

TEST(Advice, EachFaultHasItsOwn) {
  Calibration c = Good();
  c.covariance(0, 0) = std::pow(0.004 * c.model.fx, 2);
  ExpectOnly(c, CalibrationAdvice::kFocalLength, "from 10 to 46 degrees");
  c = Good();
  c.covariance(3, 3) = 17 * 17;
  ExpectOnly(c, CalibrationAdvice::kPrincipalPoint, "17 px");
  c = Good();
  c.distortion_sigma_px = 2;
  ExpectOnly(c, CalibrationAdvice::kDistortion, "2.0 px");
  c = Good();
  c.error_px_rms = 0.9;
  ExpectOnly(c, CalibrationAdvice::kResidual, "0.90 px");
  c = Good();
  c.photos[3].why_left_out = "it is blurred";
  ExpectOnly(c, CalibrationAdvice::kPhotoLeftOut, "photo3 was left out: it is blurred");
  c = Good();
  c.residuals[48 * 2 + 5].is_used = false;
  ExpectOnly(c, CalibrationAdvice::kPointsLeftOut, "point 5 in photo2");
  c = Good();
  c.residuals[48 * 2 + 5].is_used = c.residuals[48 * 4 + 5].is_used = false;
  ExpectOnly(c, CalibrationAdvice::kPointsLeftOut, "left out of photo2, photo4: points 5");
  c = Good();
  c.photos.resize(7);
  std::erase_if(c.residuals, [](const CalibrationResidual& r) { return r.photo >= 7; });
  ExpectOnly(c, CalibrationAdvice::kFewPhotos, "only 7 photos");
}

TEST(Advice, WarningsThatComeTogether) {
  Calibration c = Good();
  c.distortion_sigma_px = 2;
  for (CalibrationPhoto& photo : c.photos) photo.distance = 1;
  std::erase_if(c.residuals,
                [](const CalibrationResidual& r) { return r.px.x() < 400 && r.px.y() < 400; });
  const std::vector<CalibrationWarning> advice = Advise(c);
  ASSERT_EQ(advice.size(), 2u);
  EXPECT_NE(advice[0].text.find("the photo's top left corner"), std::string::npos);
  EXPECT_EQ(advice[1].kind, CalibrationAdvice::kOneDistance);
  // A quarter of the observations contradict the others, other points in each photo.
  c = Good();
  for (CalibrationResidual& r : c.residuals) r.is_used = (r.id + r.photo) % 4 != 0;
  const std::vector<CalibrationWarning> many = Advise(c);
  EXPECT_TRUE(std::any_of(many.begin(), many.end(), [](const CalibrationWarning& w) {
    return w.kind == CalibrationAdvice::kManyLeftOut;
  }));
}

TEST(Coverage, CountsTheCellsThatHoldAUsedPoint) {
  Calibration c = Good();
  EXPECT_EQ(CoveredShare(c), 1);
  std::erase_if(c.residuals, [](const CalibrationResidual& r) { return r.px.x() > 800; });
  EXPECT_EQ(CoveredShare(c), 0.5);
  const std::vector<bool> cells = CoveredCells(c);
  for (int i = 0; i < kCoverageAcross * kCoverageDown; ++i)
    EXPECT_EQ(cells[static_cast<size_t>(i)], i % kCoverageAcross < kCoverageAcross / 2) << i;
  for (CalibrationResidual& r : c.residuals) r.is_used = false;
  EXPECT_EQ(CoveredShare(c), 0);
}

TEST(LargestDistortionSigma, IsTheMoveThatAnErrorOfThatSizeMakes) {
  const CameraModel model = Good().model;
  Eigen::Matrix<double, 8, 8> covariance = Eigen::Matrix<double, 8, 8>::Zero();
  covariance(4, 4) = 1e-6;
  const double said = LargestDistortionSigma(model, covariance);
  // k1 alone: the corner moves most, by a multiple of k1's error.
  CameraModel more = model;
  more.k1 += 1e-3;
  const Eigen::Vector2d corner(0, 0);
  const double moved = (*UndistortPixel(more, corner) - *UndistortPixel(model, corner)).norm();
  EXPECT_NEAR(said / moved, 1, 0.02);
  EXPECT_EQ(LargestDistortionSigma(model, Eigen::Matrix<double, 8, 8>::Zero()), 0);
}

}  // namespace
}  // namespace veduta
