// SPDX-License-Identifier: Apache-2.0
// Rectified pairs. A pixel counts where its true disparity is known and it is not occluded: its
// match lies in the right photo, and no pixel of the same row with a disparity larger by more than
// 1 px lands within half a px of it. Both methods' invalid pixels are filled from the farther of
// the two nearest valid pixels in their row.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "fusion/depth/depth_consistency.h"
#include "tools/bench/dense/depth_benchmark.h"

namespace veduta {
namespace {

struct Pair {
  std::string name;
  cv::Mat left, right;  // gray
  cv::Mat truth;        // float, px; 0: not known
  cv::Mat counts;       // uint8: known and not occluded
  int disparity_max = 0;
};

struct BadPixels {
  double over_1px = 0, over_2px = 0;  // percent
};

cv::Mat NotOccluded(const cv::Mat& truth) {
  cv::Mat out(truth.size(), CV_8U, cv::Scalar(0));
  for (int y = 0; y < truth.rows; ++y) {
    const float* d = truth.ptr<float>(y);
    std::vector<float> front(static_cast<size_t>(truth.cols),
                             0);  // greatest disparity that lands on a column
    const auto column = [&](int x) {
      return static_cast<int>(std::lround(static_cast<float>(x) - d[x]));
    };
    for (int x = 0; x < truth.cols; ++x) {
      if (d[x] > 0 && column(x) >= 0)
        front[static_cast<size_t>(column(x))] =
            std::max(front[static_cast<size_t>(column(x))], d[x]);
    }
    for (int x = 0; x < truth.cols; ++x) {
      if (d[x] <= 0 || column(x) < 0) continue;
      out.at<uint8_t>(y, x) = front[static_cast<size_t>(column(x))] <= d[x] + 1;
    }
  }
  return out;
}

Result<Pair> ReadPair(const std::string& folder, const std::string& name, const std::string& left,
                      const std::string& right, const std::string& truth, double scale) {
  Pair pair;
  pair.name = name;
  const std::string at = folder + "/" + name + "/";
  pair.left = cv::imread(at + left, cv::IMREAD_GRAYSCALE);
  pair.right = cv::imread(at + right, cv::IMREAD_GRAYSCALE);
  const cv::Mat map = cv::imread(at + truth, cv::IMREAD_GRAYSCALE);
  if (pair.left.empty() || pair.right.empty() || map.empty())
    return Status::IoError(at + " cannot be read");
  map.convertTo(pair.truth, CV_32F, 1 / scale);
  pair.counts = NotOccluded(pair.truth);
  double greatest = 0;
  cv::minMaxLoc(pair.truth, nullptr, &greatest);
  pair.disparity_max = (static_cast<int>(greatest * 1.05) + 16) / 16 * 16;
  return pair;
}

BadPixels Compare(const cv::Mat& disparity, const Pair& pair) {
  int count = 0, over_1px = 0, over_2px = 0;
  for (int y = 0; y < pair.truth.rows; ++y) {
    for (int x = 0; x < pair.truth.cols; ++x) {
      if (!pair.counts.at<uint8_t>(y, x)) continue;
      const float error = std::abs(disparity.at<float>(y, x) - pair.truth.at<float>(y, x));
      ++count;
      over_1px += !(error <= 1);
      over_2px += !(error <= 2);
    }
  }
  return {100.0 * over_1px / count, 100.0 * over_2px / count};
}

// Invalid: <= 0.
void FillRows(cv::Mat* disparity) {
  for (int y = 0; y < disparity->rows; ++y) {
    float* d = disparity->ptr<float>(y);
    for (int x = 0; x < disparity->cols;) {
      if (d[x] > 0) {
        ++x;
        continue;
      }
      int end = x;
      while (end < disparity->cols && d[end] <= 0) ++end;
      const float left = x > 0 ? d[x - 1] : -1, right = end < disparity->cols ? d[end] : -1;
      std::fill(d + x, d + end,
                left > 0 && right > 0 ? std::min(left, right) : std::max(left, right));
      x = end;
    }
  }
}

View MakeView(const cv::Mat& gray, double center_x) {
  View view;
  view.geometry.width_px = static_cast<uint32_t>(gray.cols);
  view.geometry.height_px = static_cast<uint32_t>(gray.rows);
  view.geometry.camera.fx = view.geometry.camera.fy = 1000;
  view.geometry.camera.cx = gray.cols / 2.0;
  view.geometry.camera.cy = gray.rows / 2.0;
  view.geometry.cam_from_world.translation.x() = -center_x;
  view.gray.assign(gray.datastart, gray.dataend);
  return view;
}

void WritePicture(const BenchmarkSetting& setting, const Pair& pair, const std::string& what,
                  const cv::Mat& disparity) {
  if (setting.pictures.empty()) return;
  cv::Mat gray, color;
  disparity.convertTo(gray, CV_8U, 255.0 / pair.disparity_max);
  cv::applyColorMap(gray, color, cv::COLORMAP_JET);
  cv::imwrite(setting.pictures + "/" + pair.name + "_" + what + ".png", color);
}

Result<BadPixels> RunOurs(const Pair& pair, const BenchmarkSetting& setting, double* seconds) {
  const View left = MakeView(pair.left, 0), right = MakeView(pair.right, 1);
  const DepthRange range{1000.0 / pair.disparity_max, 1000.0 / 1};  // disparity = 1000 / z
  const auto start = std::chrono::steady_clock::now();
  VEDUTA_ASSIGN_OR_RETURN(const DepthMap a, EstimateDepth(left, {&right, 1}, range, setting.depth,
                                                          setting.device, *setting.pool));
  *seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  VEDUTA_ASSIGN_OR_RETURN(const DepthMap b, EstimateDepth(right, {&left, 1}, range, setting.depth,
                                                          setting.device, *setting.pool));
  const NeighborDepth neighbor{right.geometry, &b};
  ConsistencyOptions options;
  options.depth_error_max = 0.1;
  options.pixel_error_max = 1;
  VEDUTA_ASSIGN_OR_RETURN(const DepthMap map, CheckConsistency(a, left.geometry, {&neighbor, 1},
                                                               options, *setting.pool));
  cv::Mat disparity(pair.left.size(), CV_32F, cv::Scalar(0));
  int valid = 0;
  for (int y = 0; y < disparity.rows; ++y) {
    for (int x = 0; x < disparity.cols; ++x) {
      const float z = map.at(static_cast<uint32_t>(x), static_cast<uint32_t>(y));
      if (z > 0) disparity.at<float>(y, x) = 1000 / z;
      valid += z > 0;
    }
  }
  WritePicture(setting, pair, "ours", disparity);
  FillRows(&disparity);
  WritePicture(setting, pair, "filled", disparity);
  WritePicture(setting, pair, "truth", pair.truth);
  return Compare(disparity, pair);
}

struct SgbmSetting {
  int block = 3, p1 = 8, p2 = 32, uniqueness = 10, cap = 63;
};

BadPixels RunSgbm(const Pair& pair, const SgbmSetting& s) {
  const auto sgbm = cv::StereoSGBM::create(0, pair.disparity_max, s.block, s.p1 * s.block * s.block,
                                           s.p2 * s.block * s.block, 1, s.cap, s.uniqueness, 100, 2,
                                           cv::StereoSGBM::MODE_HH);
  // Columns on the left, so that disparities up to the greatest can be found there too.
  cv::Mat left, right, fixed, disparity;
  cv::copyMakeBorder(pair.left, left, 0, 0, pair.disparity_max, 0, cv::BORDER_REPLICATE);
  cv::copyMakeBorder(pair.right, right, 0, 0, pair.disparity_max, 0, cv::BORDER_REPLICATE);
  sgbm->compute(left, right, fixed);
  fixed.colRange(pair.disparity_max, fixed.cols).convertTo(disparity, CV_32F, 1 / 16.0);
  FillRows(&disparity);
  return Compare(disparity, pair);
}

// One setting for all pairs, as for ours: the best mean of both rates.
std::vector<BadPixels> SearchSgbm(const std::vector<Pair>& pairs, SgbmSetting* best) {
  std::vector<BadPixels> rates;
  double best_sum = 1e9;
  const auto attempt = [&](const SgbmSetting& s) {
    std::vector<BadPixels> now;
    double sum = 0;
    for (const Pair& pair : pairs) {
      now.push_back(RunSgbm(pair, s));
      sum += now.back().over_1px + now.back().over_2px;
    }
    if (sum >= best_sum) return;
    best_sum = sum;
    rates = now;
    *best = s;
  };
  for (const int block : {1, 3, 5, 7}) {
    for (const int p1 : {2, 4, 8, 16}) {
      for (const int p2 : {16, 32, 64, 96}) attempt({block, p1, p2, 5, 63});
    }
  }
  const SgbmSetting found = *best;
  for (const int uniqueness : {0, 2, 10, 15})
    attempt({found.block, found.p1, found.p2, uniqueness, found.cap});
  for (const int cap : {15, 31}) attempt({found.block, found.p1, found.p2, best->uniqueness, cap});
  return rates;
}

}  // namespace

Status RunPairs(const std::string& folder, bool with_sgbm, const BenchmarkSetting& setting) {
  std::vector<Pair> pairs;
  const struct {
    const char *name, *left, *right, *truth;
    double scale;
  } list[] = {{"Cones", "im2.png", "im6.png", "disp2.png", 4},
              {"Cloth3", "view1.png", "view5.png", "disp1.png", 2},
              {"Wood2", "view1.png", "view5.png", "disp1.png", 2},
              {"Aloe", "aloeL.jpg", "aloeR.jpg", "aloeGT.png", 1}};
  for (const auto& l : list) {
    VEDUTA_ASSIGN_OR_RETURN(Pair pair, ReadPair(folder, l.name, l.left, l.right, l.truth, l.scale));
    pairs.push_back(std::move(pair));
  }
  std::vector<BadPixels> theirs;
  SgbmSetting best;
  if (with_sgbm) {
    theirs = SearchSgbm(pairs, &best);
    std::printf(
        "StereoSGBM, mode HH: block %d, P1 %d, P2 %d (times block^2), uniqueness %d, cap %d\n",
        best.block, best.p1, best.p2, best.uniqueness, best.cap);
  }
  BadPixels our_mean, their_mean;
  for (size_t i = 0; i < pairs.size(); ++i) {
    double seconds = 0;
    VEDUTA_ASSIGN_OR_RETURN(const BadPixels ours, RunOurs(pairs[i], setting, &seconds));
    our_mean.over_1px += ours.over_1px / static_cast<double>(pairs.size());
    our_mean.over_2px += ours.over_2px / static_cast<double>(pairs.size());
    std::printf("%-7s %4dx%d, %3d disparities: bad 1 px %5.2f %%, 2 px %5.2f %% (%.2f s)",
                pairs[i].name.c_str(), pairs[i].left.cols, pairs[i].left.rows,
                pairs[i].disparity_max, ours.over_1px, ours.over_2px, seconds);
    if (with_sgbm) {
      std::printf("; SGBM %5.2f %%, %5.2f %%", theirs[i].over_1px, theirs[i].over_2px);
      their_mean.over_1px += theirs[i].over_1px / static_cast<double>(pairs.size());
      their_mean.over_2px += theirs[i].over_2px / static_cast<double>(pairs.size());
    }
    std::printf("\n");
  }
  std::printf("mean: bad 1 px %.2f %%, 2 px %.2f %%", our_mean.over_1px, our_mean.over_2px);
  if (with_sgbm) std::printf("; SGBM %.2f %%, %.2f %%", their_mean.over_1px, their_mean.over_2px);
  std::printf("\n");
  return Status::Ok();
}

}  // namespace veduta
