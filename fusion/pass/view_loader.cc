// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/view_loader.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "engine/camera/gray_image.h"
#include "engine/camera/photo_decoder.h"
#include "engine/camera/projection.h"

namespace veduta {
namespace {

// Chosen by hand; no measurement is recorded.
constexpr double kBorderPx =
    1.5;  // undistorted pixels nearer to the photo's edge are blended with black
constexpr int kBorderStepPx = 8;  // between looks along an edge: it bends slowly

// What a pixel of a photo takes while it is made a view: decoding takes up to 16 bytes
// (DecodeLimits), then it is straightened, scaled, grey, and in the other order of colours. Counted
// from the buffers; not measured.
constexpr uint64_t kBytesPerPixel = 26;

// The pixels that remain, [left, right] and [top, bottom].
struct Crop {
  int left = 0, top = 0, right = 0, bottom = 0;
};

// Moves in whichever edges look past the photo, until none does.
Crop CropOf(const CameraModel& model) {
  Crop crop{0, 0, static_cast<int>(model.width_px) - 1, static_cast<int>(model.height_px) - 1};
  if (!IsDistorted(model)) return crop;
  const auto is_outside = [&](int x, int y) {
    return !IsInsidePhoto(model, Eigen::Vector2d(x, y), kBorderPx);
  };
  const auto column_is_outside = [&](int x) {
    for (int y = crop.top; y < crop.bottom; y += kBorderStepPx) {
      if (is_outside(x, y)) return true;
    }
    return is_outside(x, crop.bottom);
  };
  const auto row_is_outside = [&](int y) {
    for (int x = crop.left; x < crop.right; x += kBorderStepPx) {
      if (is_outside(x, y)) return true;
    }
    return is_outside(crop.right, y);
  };
  for (bool moved = true; moved && crop.left + 2 < crop.right && crop.top + 2 < crop.bottom;) {
    moved = false;
    // The edges' middles first: corners go with whichever edge is nearer to them.
    if (column_is_outside(crop.left)) ++crop.left, moved = true;
    if (column_is_outside(crop.right)) --crop.right, moved = true;
    if (row_is_outside(crop.top)) ++crop.top, moved = true;
    if (row_is_outside(crop.bottom)) --crop.bottom, moved = true;
  }
  return crop;
}

ViewGeometry GeometryOf(const SceneImage& image, const Crop& crop, uint32_t side_px) {
  const double width = crop.right - crop.left + 1, height = crop.bottom - crop.top + 1;
  const double longer = std::max(width, height);
  const double scale = side_px == 0 || side_px >= longer ? 1 : side_px / longer;
  ViewGeometry geometry;
  geometry.width_px = std::max(1u, static_cast<uint32_t>(std::lround(width * scale)));
  geometry.height_px = std::max(1u, static_cast<uint32_t>(std::lround(height * scale)));
  const double sx = geometry.width_px / width, sy = geometry.height_px / height;
  geometry.camera.fx = image.camera.fx * sx;
  geometry.camera.fy = image.camera.fy * sy;
  geometry.camera.cx = (image.camera.cx - crop.left + 0.5) * sx - 0.5;
  geometry.camera.cy = (image.camera.cy - crop.top + 0.5) * sy - 0.5;
  geometry.cam_from_world = image.cam_from_world;
  return geometry;
}

// Not 0 where a pixel of the photo as it was taken is not to be seen.
cv::Mat FilledOf(const DecodedPhoto& photo) {
  cv::Mat filled = cv::Mat::zeros(photo.bgr.size(), CV_8UC1);
  for (const PixelArea& area : photo.private_areas)
    filled(cv::Rect(area.x, area.y, area.width, area.height)).setTo(255);
  return filled;
}

}  // namespace

ViewGeometry ViewGeometryOf(const SceneImage& image, uint32_t side_px) {
  return GeometryOf(image, CropOf(image.camera), side_px);
}

Result<std::shared_ptr<const View>> ViewLoader::Load(const SceneImage& image) {
  const auto make = [&]() -> Result<std::shared_ptr<const View>> {
    VEDUTA_ASSIGN_OR_RETURN(View view, Make(image));
    return std::make_shared<const View>(std::move(view));
  };
  return views_.GetOrMake(image.record.id.value, make, [](const auto& view) {
    return uint64_t{view->gray.size() + view->rgb.size() + view->filled.size()};
  });
}

Result<View> ViewLoader::Make(const SceneImage& image) {
  VEDUTA_ASSIGN_OR_RETURN(const StoredBytes bytes, snapshot_->GetPhoto(image.record.photo));
  const uint64_t pixel_count = uint64_t{image.camera.width_px} * image.camera.height_px;
  MemoryBudget::Share share;
  if (tools_.take_memory) {
    share = tools_.take_memory(kBytesPerPixel * pixel_count +
                               tools_.decoder.HandoverBytes(bytes.bytes().size(), pixel_count));
  }
  const DecodedPhoto photo = DecodePhoto(
      tools_.decoder, bytes.bytes(), tools_.decoder.Examine(bytes.bytes()).header, DecodeLimits(),
      {{image.camera.width_px, image.camera.height_px}, StoredLayout(image.record.orientation)});
  if (photo.outcome == DecodeOutcome::kNoMemory) {
    return Status::NoMemory(image.record.name + ": " + photo.detail);
  }
  if (photo.outcome != DecodeOutcome::kDecoded) {
    return Status::Corruption("the stored photo " + image.record.name +
                              " cannot be decoded: " + photo.detail);
  }
  const Crop crop = CropOf(image.camera);
  View view{image.record.id, GeometryOf(image, crop, side_px_), {}, {}};
  // The photo, or another picture of its size, without lens and border and of the view's size.
  const auto as_view = [&](cv::Mat picture) -> Result<cv::Mat> {
    if (IsDistorted(image.camera)) {
      VEDUTA_ASSIGN_OR_RETURN(picture, tables().Undistort(image.camera, picture));
    }
    picture = picture(
        cv::Rect(crop.left, crop.top, crop.right - crop.left + 1, crop.bottom - crop.top + 1));
    const cv::Size size(static_cast<int>(view.geometry.width_px),
                        static_cast<int>(view.geometry.height_px));
    cv::Mat scaled = picture.clone();
    if (size != picture.size()) cv::resize(picture, scaled, size, 0, 0, cv::INTER_AREA);
    return scaled;
  };
  VEDUTA_ASSIGN_OR_RETURN(const cv::Mat scaled, as_view(photo.bgr));
  const cv::Mat gray = GrayFromBgr(scaled);
  cv::Mat rgb;
  cv::cvtColor(scaled, rgb, cv::COLOR_BGR2RGB);
  view.gray.assign(gray.datastart, gray.dataend);
  view.rgb.assign(rgb.datastart, rgb.dataend);
  if (photo.private_areas.empty()) return view;
  VEDUTA_ASSIGN_OR_RETURN(const cv::Mat filled, as_view(FilledOf(photo)));
  // A pixel that a filled one has a share of shows less than the place it stands for.
  cv::Mat grown;
  cv::dilate(filled, grown, cv::Mat::ones(3, 3, CV_8UC1));
  view.filled.assign(grown.datastart, grown.dataend);
  return view;
}

}  // namespace veduta
