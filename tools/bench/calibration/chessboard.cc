// SPDX-License-Identifier: Apache-2.0
// Turns photos of a chessboard into points for `veduta calibrate --points`, by OpenCV's detector.
// usage: veduta-chessboard --board COLUMNSxROWS --out points.json PHOTO|FOLDER...   (inner corners,
// 9x6 say) Prints what OpenCV's calibrateCamera makes of the same corners, to compare with.
#include <algorithm>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tools/bench/calibration/chessboard_points.h"
#include "tools/bench/calibration/opencv_calibration.h"

namespace {

namespace fs = std::filesystem;

std::vector<std::string> PhotosOf(const std::vector<std::string>& given) {
  std::vector<std::string> photos;
  for (const std::string& path : given) {
    if (!fs::is_directory(path)) {
      photos.push_back(path);
      continue;
    }
    std::vector<std::string> inside;
    for (const auto& entry : fs::directory_iterator(path)) {
      if (entry.is_regular_file()) inside.push_back(entry.path().string());
    }
    std::sort(inside.begin(), inside.end());
    photos.insert(photos.end(), inside.begin(), inside.end());
  }
  return photos;
}

nlohmann::ordered_json PointsJson(const veduta::CalibrationInput& input) {
  nlohmann::ordered_json views = nlohmann::ordered_json::array();
  for (const veduta::ViewObservations& view : input.views) {
    nlohmann::ordered_json points = nlohmann::ordered_json::array();
    for (const auto& p : view.points)
      points.push_back({{"id", p.id}, {"x", p.px.x()}, {"y", p.px.y()}});
    views.push_back({{"name", view.name}, {"points", points}});
  }
  const veduta::ImageSize size = input.views.front().size;
  return {{"width", size.width_px}, {"height", size.height_px}, {"views", views}};
}

int Usage() {
  std::fprintf(stderr,
               "usage: veduta-chessboard --board COLUMNSxROWS --out points.json PHOTO|FOLDER...\n");
  return 2;
}

}  // namespace

int main(int argc, char** argv) {
  cv::Size board;
  std::string out;
  std::vector<std::string> given;
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--board") && i + 1 < argc) {
      if (std::sscanf(argv[++i], "%dx%d", &board.width, &board.height) != 2) return Usage();
    } else if (!std::strcmp(argv[i], "--out") && i + 1 < argc) {
      out = argv[++i];
    } else {
      given.push_back(argv[i]);
    }
  }
  if (board.width < 3 || board.height < 3 || out.empty() || given.empty()) return Usage();
  veduta::CalibrationInput input;
  for (const std::string& path : PhotosOf(given)) {
    veduta::ViewObservations view;
    if (veduta::FindChessboard(path, board, &view)) {
      input.views.push_back(std::move(view));
    } else {
      std::fprintf(stderr, "%s: no chessboard of %dx%d inner corners found\n", path.c_str(),
                   board.width, board.height);
    }
  }
  if (input.views.empty()) return 1;
  for (const veduta::ViewObservations& view : input.views) {
    if (view.size == input.views.front().size) continue;
    std::fprintf(stderr, "%s is of another size than %s\n", view.name.c_str(),
                 input.views.front().name.c_str());
    return 1;
  }
  std::ofstream file(out);
  file << PointsJson(input).dump() << "\n";
  if (!file.flush()) {
    std::fprintf(stderr, "cannot write %s\n", out.c_str());
    return 1;
  }
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < board.area(); ++i) points.emplace_back(i % board.width, i / board.width, 0);
  const auto print = [&](const char* how, veduta::OpenCvTarget target) {
    const auto theirs = veduta::CalibrateWithOpenCv(input, points, target, board.width);
    const std::vector<double>& d = theirs.distortion;
    std::printf(
        "%s: fx %.2f fy %.2f cx %.2f cy %.2f, k1 %.4f k2 %.4f p1 %.5f p2 %.5f k3 %.4f, RMS %.4f "
        "px\n",
        how, theirs.fx, theirs.fy, theirs.cx, theirs.cy, d[0], d[1], d[2], d[3], d[4],
        theirs.error_px_rms);
  };
  std::printf("%zu photos with the board\n", input.views.size());
  print("OpenCV's calibrateCamera, an exact grid", veduta::OpenCvTarget::kFlat);
  print("OpenCV's calibrateCameraRO, its points free", veduta::OpenCvTarget::kFree);
}
