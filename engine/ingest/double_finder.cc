// SPDX-License-Identifier: Apache-2.0
#include "engine/ingest/double_finder.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "engine/camera/orientation.h"
#include "engine/camera/photo_decoder.h"
#include "engine/ingest/neighbor_finder.h"

namespace veduta {
namespace {

// All of these were chosen by hand; not measured. A copy of 192x144 px at JPEG quality 30 of a real
// photo of 640x480 is not known by them any more.
constexpr size_t kMatchesMin = 40;
constexpr double kErrorPxMax = 1.5;  // in the smaller picture
constexpr double kAgreeingShareMin = 0.9;
constexpr size_t kDecodedMax = 3;          // stored photos that a new one is compared with
constexpr int kSidePx = 128, kCellPx = 8;  // the size that pictures are compared at
constexpr double kMeanDifferenceMax = 4, kCellDifferenceMax = 12;  // of 255
constexpr double kGainMax = 1.25;                                  // and its inverse

// The picture in grey, upright; empty where it cannot be decoded.
Result<cv::Mat> GrayOf(const Snapshot& snapshot, const PhotoDecoder& decoder,
                       const ImageRecord& image) {
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes bytes, snapshot.GetPhoto(image.photo));
  const DecodedPhoto decoded =
      DecodePhoto(decoder, bytes.bytes(), decoder.Examine(bytes.bytes()).header, DecodeLimits(),
                  {{image.width_px, image.height_px}, StoredLayout(image.orientation)});
  if (decoded.outcome == DecodeOutcome::kNoMemory) return Status::NoMemory(decoded.detail);
  return decoded.gray.empty() ? cv::Mat() : Upright(decoded.gray, image.orientation);
}

// Whether both say when they were taken, and differ by more than a copy's rounding does.
bool AreOfDifferentTimes(const ImageRecord& a, const ImageRecord& b) {
  return a.taken && b.taken && std::abs(a.taken->local_unix_s - b.taken->local_unix_s) > 1;
}

}  // namespace

bool MatchAsOnePicture(const PictureCopy& first, const PictureCopy& second,
                       std::span<const FeatureMatch> matches) {
  if (matches.size() < kMatchesMin) return false;
  const ImageSize size = first.upright_size(), other = second.upright_size();
  const double across = static_cast<double>(size.width_px) / other.width_px,
               down = static_cast<double>(size.height_px) / other.height_px;
  const double width_px = std::min(size.width_px, other.width_px),
               height_px = std::min(size.height_px, other.height_px);
  // Both sides were rounded to whole pixels.
  if (std::abs(across / down - 1) > 1.5 / std::min(width_px, height_px)) return false;
  const auto agreeing = std::ranges::count_if(matches, [&](const FeatureMatch& match) {
    const Eigen::Vector2d off = PlaceInPicture(first, first.features.keypoints[match.a]) -
                                PlaceInPicture(second, second.features.keypoints[match.b]);
    return std::hypot(off.x() * width_px, off.y() * height_px) <= kErrorPxMax;
  });
  return static_cast<double>(agreeing) >= kAgreeingShareMin * static_cast<double>(matches.size());
}

bool ShowTheSame(const cv::Mat& first, const cv::Mat& second) {
  const double shrink = static_cast<double>(kSidePx) / std::max(first.cols, first.rows);
  const cv::Size size(std::max(kCellPx, static_cast<int>(std::lround(first.cols * shrink))),
                      std::max(kCellPx, static_cast<int>(std::lround(first.rows * shrink))));
  cv::Mat a, b;
  cv::resize(first, a, size, 0, 0, cv::INTER_AREA);
  cv::resize(second, b, size, 0, 0, cv::INTER_AREA);
  a.convertTo(a, CV_64F);
  b.convertTo(b, CV_64F);
  // b = gain a + offset, by least squares.
  const double mean_a = cv::mean(a)[0], mean_b = cv::mean(b)[0];
  const cv::Mat from_mean_a = a - mean_a, from_mean_b = b - mean_b;
  const double variance = from_mean_a.dot(from_mean_a);
  if (!(variance > 0)) return false;
  const double gain = from_mean_a.dot(from_mean_b) / variance;
  if (!(gain >= 1 / kGainMax && gain <= kGainMax)) return false;
  const cv::Mat difference = cv::abs(from_mean_b - gain * from_mean_a);
  if (cv::mean(difference)[0] > kMeanDifferenceMax) return false;
  for (int y = 0; y + kCellPx <= size.height; y += kCellPx) {
    for (int x = 0; x + kCellPx <= size.width; x += kCellPx) {
      if (cv::mean(difference(cv::Rect(x, y, kCellPx, kCellPx)))[0] > kCellDifferenceMax)
        return false;
    }
  }
  return true;
}

Result<std::optional<StoredDouble>> FindDouble(const Snapshot& snapshot,
                                               const PhotoDecoder& decoder,
                                               ImageFeatureCache* features, const NewPhoto& photo,
                                               std::span<const PairMatches> pairs) {
  std::vector<const PairMatches*> strongest;
  for (const PairMatches& pair : pairs) strongest.push_back(&pair);
  std::ranges::stable_sort(strongest, std::ranges::greater(),
                           [](const PairMatches* pair) { return pair->matches.size(); });
  size_t decoded = 0;
  for (const PairMatches* const pair : strongest) {
    if (decoded == kDecodedMax) break;
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord image, snapshot.GetImage(pair->other));
    if (AreOfDifferentTimes(photo.record, image)) continue;
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord camera, snapshot.GetCamera(image.camera));
    VEDUTA_ASSIGN_OR_RETURN(const auto other, features->Get(snapshot, image.id));
    const PictureCopy copy{photo.camera, *photo.features.features, photo.record.orientation},
        stored{camera.model, *other->features, image.orientation};
    if (!MatchAsOnePicture(copy, stored, pair->matches)) continue;
    ++decoded;
    const Result<cv::Mat> ours = GrayOf(snapshot, decoder, photo.record),
                          theirs = GrayOf(snapshot, decoder, image);
    if (!theirs.ok() && IsCandidateDamaged(theirs.status())) continue;
    VEDUTA_RETURN_IF_ERROR(ours.status());
    VEDUTA_RETURN_IF_ERROR(theirs.status());
    if (ours->empty() || theirs->empty() || !ShowTheSame(*ours, *theirs)) continue;
    const double scale =
        static_cast<double>(copy.upright_size().width_px) / stored.upright_size().width_px;
    return std::optional(StoredDouble{std::move(image), scale});
  }
  return std::optional<StoredDouble>();
}

}  // namespace veduta
