// SPDX-License-Identifier: Apache-2.0
// Goal: cameras of COLMAP and OpenCV come over with the right conventions, the residual said is
//   the true one, and any bytes are answered by a camera or a message.
// Method: cameras written by hand, OpenCV's own projection beside ours, mutations of good
//   files.
#include "engine/camera/calibration/known_camera.h"

#include <gtest/gtest.h>

#include <cmath>

#include "engine/camera/projection.h"
#include "tests/engine/camera/mutated_text.h"

namespace veduta {
namespace {

constexpr const char* kColmap =
    "# Camera list with one line of data per camera:\n"
    "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n"
    "# Number of cameras: 5\n"
    "1 PINHOLE 640 480 500 510 320.5 240.5\n"
    "2 SIMPLE_RADIAL 640 480 500 320 240 -0.1\n"
    "7 RADIAL 640 480 500 320 240 -0.1 0.02\r\n"
    "8 OPENCV 640 480 500 510 320 240 -0.1 0.02 0.001 -0.0005\n"
    "9 SIMPLE_PINHOLE 640 480 500 320 240\n";

constexpr const char* kOpenCv =
    "%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: !!opencv-matrix\n   rows: "
    "3\n   cols: 3\n"
    "   dt: d\n   data: [ 533.5, 0., 341.6, 0., 534.25, 232.9, 0., 0., 1. "
    "]\ndistortion_coefficients: !!opencv-matrix\n"
    "   rows: 5\n   cols: 1\n   dt: d\n   data: [ -0.28, 0.025, 0.0012, -0.00014, 0.01 ]\n";

TEST(KnownCamera, ColmapsHalfPixelAndModels) {
  const auto cameras = ParseColmapCameras(kColmap);
  ASSERT_TRUE(cameras.ok()) << cameras.status().message();
  ASSERT_EQ(cameras->size(), 5u);
  const auto pinhole = ConvertCamera((*cameras)[0].camera);
  ASSERT_TRUE(pinhole.ok());
  EXPECT_EQ(pinhole->model, (CameraModel{640, 480, 500, 510, 320, 240, 0, 0, 320, 240}));
  const auto simple = ConvertCamera((*cameras)[1].camera);
  ASSERT_TRUE(simple.ok());
  EXPECT_EQ(simple->model, (CameraModel{640, 480, 500, 500, 319.5, 239.5, -0.1, 0, 319.5, 239.5}));
  const auto radial = ConvertCamera((*cameras)[2].camera);
  ASSERT_TRUE(radial.ok());
  EXPECT_EQ(radial->model.k2, 0.02);
  EXPECT_EQ(radial->residual.largest_px, 0);
  EXPECT_EQ((*cameras)[2].id, 7u);
  EXPECT_EQ((*cameras)[4].camera.coefficients.size(), 0u);
}

TEST(KnownCamera, TangentialDistortionByACenterOfItsOwn) {
  const KnownCamera known = (*ParseColmapCameras(kColmap))[3].camera;
  const auto made = ConvertCamera(known);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_NE(made->model.u0, made->model.cx);
  EXPECT_EQ(made->model.cx, known.cx);
  EXPECT_LT(made->residual.largest_px, 0.3);
  EXPECT_GT(made->residual.largest_px, made->residual.mean_px);
  // The residual by COLMAP's formula, at rays of our own choice.
  double largest = 0;
  for (double u = 0; u <= 639; u += 7) {
    for (double v = 0; v <= 479; v += 7) {
      const Eigen::Vector2d ours_px(u, v), undistorted = *UndistortPixel(made->model, ours_px);
      const double x = (undistorted.x() - known.cx) / known.fx,
                   y = (undistorted.y() - known.cy) / known.fy;
      const double r2 = x * x + y * y, radial = -0.1 * r2 + 0.02 * r2 * r2, p1 = 0.001,
                   p2 = -0.0005;
      const Eigen::Vector2d theirs(
          known.cx + known.fx * (x + x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)),
          known.cy + known.fy * (y + y * radial + 2 * p2 * x * y + p1 * (r2 + 2 * y * y)));
      largest = std::max(largest, (theirs - ours_px).norm());
    }
  }
  EXPECT_NEAR(largest, made->residual.largest_px, 0.1 * largest + 1e-3);
}

TEST(KnownCamera, OpenCvYaml) {
  const auto known = ParseOpenCvCamera(kOpenCv);
  ASSERT_TRUE(known.ok()) << known.status().message();
  EXPECT_EQ(known->size, (ImageSize{640, 480}));
  EXPECT_EQ(known->fy, 534.25);
  EXPECT_EQ(known->coefficients, (std::vector<double>{-0.28, 0.025, 0.0012, -0.00014, 0.01}));
  const auto made = ConvertCamera(*known);
  ASSERT_TRUE(made.ok()) << made.status().message();
  EXPECT_LT(made->residual.largest_px, 2);  // at a corner: no centre does all that p1, p2 and k3 do
  EXPECT_LT(made->residual.mean_px, 0.4);
  const auto plain = ParseOpenCvCamera(
      "image_width: 640\nimage_height: 480\ncamera_matrix:\n  rows: 3\n  cols: 3\n"
      "  data: [500, 0, 320, 0, 500, 240, 0, 0, 1]\ndistortion_coefficients:\n  data: [0, 0, 0, 0, "
      "0]\n");
  ASSERT_TRUE(plain.ok()) << plain.status().message();
  EXPECT_TRUE(plain->coefficients.empty());
}

constexpr const char* kOpenCvXml =
    "<?xml version=\"1.0\"?>\n<opencv_storage>\n<image_width>640</image_width>\n<image_height>480"
    "</image_height>\n<camera_matrix type_id=\"opencv-matrix\">\n<rows>3</rows>\n<cols>3</cols>\n"
    "<dt>d</dt>\n<data>\n  533.5 0. 341.6 0. 534.25\n  232.9 0. 0. 1.</data></camera_matrix>\n"
    "<distortion_coefficients type_id=\"opencv-matrix\"><rows>1</rows><cols>4</cols><dt>d</dt>"
    "<data>-2.8e-01 0.025 0. 0.</data></distortion_coefficients>\n</opencv_storage>\n";

TEST(KnownCamera, OpenCvXmlAndJson) {
  const auto xml = ParseOpenCvCamera(kOpenCvXml);
  ASSERT_TRUE(xml.ok()) << xml.status().message();
  const auto json = ParseOpenCvCamera(
      "{\"image_width\":640,\"image_height\":480,\"camera_matrix\":{\"type_id\":"
      "\"opencv-matrix\",\"rows\":3,\"cols\":3,\"dt\":\"d\",\"data\":[533.5,0.0,341.6,0.0,"
      "534.25,232.9,0.0,0.0,1.0]},\"distortion_coefficients\":[-0.28,0.025,0,0]}");
  ASSERT_TRUE(json.ok()) << json.status().message();
  for (const KnownCamera& known : {*xml, *json}) {
    EXPECT_EQ(known.size, (ImageSize{640, 480}));
    EXPECT_EQ(known.fy, 534.25);
    EXPECT_EQ(known.cx, 341.6);
    EXPECT_EQ(known.coefficients, (std::vector<double>{-0.28, 0.025}));
  }
}

// OpenCV's own reader of XML reads past the end of these.
TEST(KnownCamera, XmlCutAnywhereIsAnswered) {
  const std::string whole = kOpenCvXml;
  const size_t end = whole.rfind('>');
  for (size_t length = 0; length < end; ++length)
    EXPECT_FALSE(ParseOpenCvCamera(whole.substr(0, length)).ok()) << length;
  SeededRandom random(2);
  for (int i = 0; i < 3000; ++i) {
    const auto known = ParseOpenCvCamera(testing::MutatedText(kOpenCvXml, &random));
    EXPECT_TRUE(!known.ok() || !known->size.empty());
  }
  EXPECT_FALSE(ParseOpenCvCamera("<a>" + std::string(100'000, '<')).ok());
  EXPECT_FALSE(ParseOpenCvCamera(std::string(100'000, '[')).ok());
}

TEST(KnownCamera, AModelThatOursCannotExpress) {
  KnownCamera known{{640, 480}, 300, 300, 320, 240, {-0.3, 0.1, 0.03, 0.03}};
  const auto strong = ConvertCamera(known);
  ASSERT_FALSE(strong.ok());
  EXPECT_NE(strong.status().message().find("cannot be expressed"), std::string::npos)
      << strong.status().message();
  known.coefficients.assign(14, 0.1);
  EXPECT_FALSE(ConvertCamera(known).ok());
  known.coefficients = {std::nan("")};
  EXPECT_FALSE(ConvertCamera(known).ok());
  known.coefficients = {-5};  // folds over
  EXPECT_FALSE(ConvertCamera(known).ok());
  known = {{640, 480}, -300, 300, 320, 240, {}};
  EXPECT_FALSE(ConvertCamera(known).ok());
}

TEST(KnownCamera, MessagesNameTheFault) {
  for (const auto& [text, words] : {std::pair("", "no camera"),
                                    {"# nothing\n", "no camera"},
                                    {"1 FISHEYE 640 480 1 2 3", "'FISHEYE'"},
                                    {"1 PINHOLE 640 480 500 510 320", "4 parameters, not 3"},
                                    {"\n\n1 PINHOLE 640 480 500 510 320 x", "line 3: 'x'"},
                                    {"1 PINHOLE 640 480 500 510 320 nan", "'nan'"},
                                    {"1 PINHOLE 640.5 480 500 510 320 240", "CAMERA_ID MODEL"},
                                    {"one PINHOLE 640 480 500 510 320 240", "CAMERA_ID MODEL"},
                                    {"1 PINHOLE 70000 480 500 510 320 240", "CAMERA_ID MODEL"}}) {
    const auto cameras = ParseColmapCameras(text);
    ASSERT_FALSE(cameras.ok()) << text;
    EXPECT_NE(cameras.status().message().find(words), std::string::npos)
        << cameras.status().message();
  }
  for (const auto& [text, words] :
       {std::pair("", "camera"),
        {"%YAML:1.0\n---\nimage_width: 640\n", "image_height"},
        {"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\n", "camera_matrix"},
        {"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [1, 2]\n",
         "9 numbers"},
        {"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [1, 0, 1, 0, 1, 1, "
         "0, 0, 2]\n",
         "fx 0 cx"},
        {"%YAML:1.0\n---\nimage_width: 640\nimage_height: 480\ncamera_matrix: [5, 0, 1, 0, 5, 1, "
         "0, 0, 1]\n",
         "distortion_coefficients"}}) {
    const auto known = ParseOpenCvCamera(text);
    ASSERT_FALSE(known.ok()) << text;
    EXPECT_NE(known.status().message().find(words), std::string::npos) << known.status().message();
  }
}

TEST(KnownCamera, AnyBytesAreAnswered) {
  SeededRandom random(1);
  uint32_t accepted = 0, refused = 0;
  for (int i = 0; i < 3000; ++i) {
    const auto known = ParseOpenCvCamera(testing::MutatedText(kOpenCv, &random));
    const auto cameras = ParseColmapCameras(testing::MutatedText(kColmap, &random));
    accepted += known.ok() + cameras.ok();
    refused += !known.ok() + !cameras.ok();
    if (i % 20 == 0 && known.ok()) {
      const auto made = ConvertCamera(*known);
      EXPECT_TRUE(!made.ok() || CheckCamera(made->model).ok());
    }
  }
  EXPECT_GT(accepted, 100u);
  EXPECT_GT(refused, 100u);
}

}  // namespace
}  // namespace veduta
