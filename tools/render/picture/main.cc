// SPDX-License-Identifier: Apache-2.0
// Draws a COLMAP text model (points3D.txt, images.txt) as a PNG: from above, and at a slant from
// behind the cameras. usage: veduta-picture MODEL OUT.png
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <vector>

namespace {

struct Point {
  Eigen::Vector3d position;
  cv::Vec3b bgr;
  size_t view_count = 0;
};

struct Camera {
  Eigen::Matrix3d world_from_cam;
  Eigen::Vector3d center;
};

std::vector<Point> ReadPoints(const std::string& path) {
  std::ifstream file(path);
  std::vector<Point> points;
  for (std::string line; std::getline(file, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream in(line);
    uint64_t id;
    Point p;
    int r, g, b;
    double error;
    if (in >> id >> p.position.x() >> p.position.y() >> p.position.z() >> r >> g >> b >> error) {
      for (uint64_t image, feature; in >> image >> feature;) ++p.view_count;
      p.bgr = cv::Vec3b(static_cast<uint8_t>(b), static_cast<uint8_t>(g), static_cast<uint8_t>(r));
      points.push_back(p);
    }
  }
  return points;
}

std::vector<Camera> ReadCameras(const std::string& path) {
  std::ifstream file(path);
  std::vector<Camera> cameras;
  bool is_pose = true;  // pose lines and lines of 2D points alternate
  for (std::string line; std::getline(file, line);) {
    if (!line.empty() && line[0] == '#') continue;
    if (is_pose) {
      std::istringstream in(line);
      uint64_t id;
      Eigen::Quaterniond q;
      Eigen::Vector3d t;
      if (in >> id >> q.w() >> q.x() >> q.y() >> q.z() >> t.x() >> t.y() >> t.z()) {
        const Eigen::Matrix3d r = q.normalized().toRotationMatrix().transpose();
        cameras.push_back({r, -r * t});
      }
    }
    is_pose = !is_pose;
  }
  return cameras;
}

// Right, up and back of a drawing in world coordinates; orthographic.
struct Drawing {
  Eigen::Matrix3d axes;  // rows
  cv::Mat image;
  Eigen::Vector2d middle = Eigen::Vector2d::Zero();
  double px_per_unit = 1;

  // Fits all cameras and the points, a point weighing as much as views see it, but for the
  // outermost 8 % on each side: a few always lie far away, and what is seen most is what the photos
  // are of.
  void Fit(const std::vector<Point>& points, const std::vector<Camera>& cameras) {
    for (int k = 0; k < 2; ++k) {
      std::vector<double> along;
      for (const Point& p : points)
        along.insert(along.end(), p.view_count, axes.row(k).dot(p.position));
      std::sort(along.begin(), along.end());
      double low = 1e300, high = -1e300;
      if (!along.empty()) {
        low = along[along.size() * 8 / 100];
        high = along[along.size() - 1 - along.size() * 8 / 100];
      }
      for (const Camera& c : cameras) {
        low = std::min(low, axes.row(k).dot(c.center));
        high = std::max(high, axes.row(k).dot(c.center));
      }
      middle[k] = (low + high) / 2;
      const double fit = 0.9 * (k == 0 ? image.cols : image.rows) / std::max(high - low, 1e-9);
      px_per_unit = k == 0 ? fit : std::min(px_per_unit, fit);
    }
  }
  cv::Point At(const Eigen::Vector3d& p) const {
    const double x = image.cols / 2.0 + px_per_unit * (axes.row(0).dot(p) - middle[0]);
    const double y = image.rows / 2.0 - px_per_unit * (axes.row(1).dot(p) - middle[1]);
    return {static_cast<int>(std::clamp(x, -1e6, 1e6)), static_cast<int>(std::clamp(y, -1e6, 1e6))};
  }
};

void Draw(Drawing* drawing, std::vector<Point> points, const std::vector<Camera>& cameras,
          double camera_size) {
  std::sort(points.begin(), points.end(), [&](const Point& a, const Point& b) {
    return drawing->axes.row(2).dot(a.position) <
           drawing->axes.row(2).dot(b.position);  // far ones first
  });
  for (const Point& p : points)
    cv::circle(drawing->image, drawing->At(p.position), 1, cv::Scalar(p.bgr), cv::FILLED);
  for (const Camera& c : cameras) {
    std::vector<cv::Point> corners;
    for (const auto& [x, y] : {std::pair(-0.6, -0.4), {0.6, -0.4}, {0.6, 0.4}, {-0.6, 0.4}}) {
      corners.push_back(
          drawing->At(c.center + camera_size * (c.world_from_cam * Eigen::Vector3d(x, y, 1))));
    }
    const cv::Scalar red(40, 40, 220);
    for (size_t i = 0; i < 4; ++i) {
      cv::line(drawing->image, drawing->At(c.center), corners[i], red, 1, cv::LINE_AA);
      cv::line(drawing->image, corners[i], corners[(i + 1) % 4], red, 1, cv::LINE_AA);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 3) {
    std::fprintf(stderr, "usage: veduta-picture MODEL OUT.png\n");
    return 2;
  }
  const std::vector<Point> points = ReadPoints(std::string(argv[1]) + "/points3D.txt");
  const std::vector<Camera> cameras = ReadCameras(std::string(argv[1]) + "/images.txt");
  if (points.empty() || cameras.empty()) {
    std::fprintf(stderr, "veduta-picture: %s holds no COLMAP text model with points and images\n",
                 argv[1]);
    return 1;
  }
  Eigen::Vector3d up = Eigen::Vector3d::Zero(), ahead = Eigen::Vector3d::Zero();
  for (const Camera& c : cameras) {
    up -= c.world_from_cam.col(1);
    ahead += c.world_from_cam.col(2);
  }
  up.normalize();
  ahead -= ahead.dot(up) * up;
  if (ahead.norm() < 1e-6 * static_cast<double>(cameras.size())) ahead = up.unitOrthogonal();
  ahead.normalize();
  const Eigen::Vector3d right = ahead.cross(up);
  const double slant = 0.45;  // radians below the horizontal that the second drawing looks
  const Eigen::Vector3d back = std::sin(slant) * up - std::cos(slant) * ahead;

  cv::Mat sheet(900, 1800, CV_8UC3, cv::Scalar(255, 255, 255));
  Drawing above{
      (Eigen::Matrix3d() << right.transpose(), ahead.transpose(), up.transpose()).finished(),
      sheet(cv::Rect(0, 0, 900, 900))};
  Drawing behind{
      (Eigen::Matrix3d() << right.transpose(), back.cross(right).transpose(), back.transpose())
          .finished(),
      sheet(cv::Rect(900, 0, 900, 900))};
  for (Drawing* drawing : {&above, &behind}) {
    drawing->Fit(points, cameras);
    Draw(drawing, points, cameras, 30 / drawing->px_per_unit);
  }
  if (!cv::imwrite(argv[2], sheet)) {
    std::fprintf(stderr, "veduta-picture: cannot write %s\n", argv[2]);
    return 1;
  }
  std::printf("%s: %zu points, %zu cameras, from above and from behind\n", argv[2], points.size(),
              cameras.size());
}
