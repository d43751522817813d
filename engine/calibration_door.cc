// SPDX-License-Identifier: Apache-2.0
#include "engine/engine.h"

#include <algorithm>
#include <filesystem>
#include <utility>

#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/camera_text.h"
#include "engine/camera/files/calibration_report.h"
#include "engine/camera/files/camera_file.h"
#include "engine/camera/files/points_file.h"
#include "engine/camera/markers/photo_markers.h"
#include "engine/camera/markers/sheet_pdf.h"
#include "engine/scene_calibration.h"
#include "storage/base/option_bounds.h"
#include "storage/base/thread_pool.h"
#include "storage/base/whole_file.h"
#include "storage/model/image_size.h"

namespace veduta {
namespace {

// The most threads that a request may ask for; chosen by hand.
constexpr uint32_t kThreadsMax = 256;

// What a calibration starts from.
struct Observed {
  CalibrationInput input;
  std::string from;                       // what it was read from, in words
  std::vector<CalibrationWarning> notes;  // on single photos, in the order of the photos
};

Status WithFile(const Status& status, const std::string& path) {
  return Status(status.code(), path + ": " + status.message());
}

// The failure, with a line for each note on a photo: they often say why it failed.
Status WithNotes(const Status& status, const std::vector<CalibrationWarning>& notes) {
  std::string message = status.message();
  for (const CalibrationWarning& note : notes) message += "\n  " + note.text;
  return Status(status.code(), std::move(message));
}

Result<Observed> ReadPhotos(const CalibrateRequest& request) {
  PhotoMarkersOptions options;
  options.markers.id_count = request.marker_count;
  ThreadPool pool(request.thread_count - 1);
  VEDUTA_ASSIGN_OR_RETURN(PhotoMarkers found, DetectInPhotos(request.photo_paths, options, &pool));
  Observed observed;
  observed.from = std::to_string(found.input.views.size()) + " photos of markers";
  for (const PhotoNote& note : found.notes) {
    const std::string& text = note.use == PhotoUse::kUsed ? note.advice : note.detail;
    if (text.empty()) continue;
    observed.notes.push_back({CalibrationAdvice::kPhotoQuality, note.name + ": " + text});
  }
  if (found.input.views.empty()) {
    return WithNotes(Status::InvalidArgument(
                         "no photo shows enough markers; print them with `veduta markers`, lay "
                         "them on a floor and photograph them"),
                     observed.notes);
  }
  observed.input = std::move(found.input);
  return observed;
}

Result<Observed> ReadPoints(const std::string& path) {
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path, kPointsFileBytesMax));
  Result<CalibrationInput> input = ParsePoints(text);
  if (!input.ok()) return WithFile(input.status(), path);
  return Observed{std::move(*input), std::filesystem::path(path).filename().string(), {}};
}

// A calibration, with what it was made from.
struct Made {
  Calibration calibration;
  std::string from;                       // in words
  std::vector<CalibrationWarning> notes;  // on single photos, before the calibration's own
};

Result<Made> MakeByScene(const CalibrateRequest& request) {
  std::vector<PhotoSource> photos;
  for (const std::string& path : request.photo_paths)
    photos.push_back({std::filesystem::path(path).filename().string(), path, {}});
  VEDUTA_ASSIGN_OR_RETURN(Calibration made, CalibrateByScene(photos, request.thread_count));
  std::string from = std::to_string(made.UsedPhotoCount()) + " photos of a place";
  return Made{std::move(made), std::move(from), {}};
}

Result<Made> MakeByTargets(const CalibrateRequest& request) {
  VEDUTA_ASSIGN_OR_RETURN(Observed observed, request.points_path.empty()
                                                 ? ReadPhotos(request)
                                                 : ReadPoints(request.points_path));
  Result<Calibration> made = CalibrateCamera(observed.input);
  if (!made.ok()) return WithNotes(made.status(), observed.notes);
  return Made{std::move(*made), std::move(observed.from), std::move(observed.notes)};
}

// The numbers of a calibration; the texts are added by Calibrate.
CalibrationAnswer AnswerOf(const Calibration& made, const std::string& from) {
  CalibrationAnswer answer;
  answer.from = from;
  answer.model = made.model;
  answer.is_good = made.status == CalibrationStatus::kGood;
  answer.intrinsics = IntrinsicsOf(made.model);
  for (size_t i = 0; i < kIntrinsicNames.size(); ++i) {
    answer.intrinsic_names[i] = kIntrinsicNames[i];
    answer.sigmas[i] = made.Sigma(static_cast<int>(i));
  }
  answer.error_px_mean = made.error_px_mean;
  answer.error_px_rms = made.error_px_rms;
  answer.distortion_sigma_px = made.distortion_sigma_px;
  answer.photos = static_cast<uint32_t>(made.photos.size());
  answer.photos_used = made.UsedPhotoCount();
  answer.has_square_pixels = !made.is_aspect_free;
  for (const CalibrationPhoto& photo : made.photos) {
    answer.calibrated_photos.push_back({photo.name, photo.used_count, photo.left_out_count,
                                        photo.error_px_rms, photo.why_left_out});
  }
  return answer;
}

}  // namespace

Status CalibrateRequest::Check() const {
  if (!photo_paths.empty() && !points_path.empty()) {
    return Status::InvalidArgument("calibrate takes photos or a points file, not both");
  }
  if (photo_paths.empty() && points_path.empty()) {
    return Status::InvalidArgument("calibrate wants photos or a points file; none are given");
  }
  if (is_scene && !points_path.empty())
    return Status::InvalidArgument("calibrate takes photos of a scene, not points of one");
  return OptionBounds()
      .Between("marker_count", marker_count, 1, kMarkerIdCount)
      .Between("thread_count", thread_count, 1, kThreadsMax)
      .status();
}

Result<CalibrationAnswer> Calibrate(const CalibrateRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  VEDUTA_ASSIGN_OR_RETURN(Made made,
                          request.is_scene ? MakeByScene(request) : MakeByTargets(request));
  Calibration& calibration = made.calibration;
  CalibrationAnswer answer = AnswerOf(calibration, made.from);
  for (const CalibrationWarning& note : made.notes)
    answer.messages.push_back({!note.IsNote(), true, note.text});
  for (const CalibrationWarning& w : calibration.warnings)
    answer.messages.push_back({!w.IsNote(), false, w.text});
  // In the files the calibration's own notes and warnings stand first.
  calibration.warnings.insert(calibration.warnings.end(), made.notes.begin(), made.notes.end());
  answer.camera_file = CameraFileText(calibration, made.from);
  answer.report_html = CalibrationReport(calibration, made.from);
  return answer;
}

Result<MarkerSheets> MakeMarkerSheets(std::string_view paper, uint32_t count) {
  const std::optional<Paper> known = PaperFromName(paper);
  if (!known) {
    return Status::InvalidArgument("paper '" + std::string(paper.substr(0, 20)) +
                                   "' is neither a4 nor letter");
  }
  VEDUTA_ASSIGN_OR_RETURN(const SheetLayout layout, LayOutSheets(*known, count));
  MarkerSheets sheets;
  sheets.sheet_count = static_cast<uint32_t>(layout.sheets.size());
  VEDUTA_ASSIGN_OR_RETURN(sheets.pdf, SheetPdf(layout));
  return sheets;
}

Result<CameraFromFile> ReadCameraFile(const std::string& path, std::optional<uint32_t> colmap_id) {
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(path, kCameraFileBytesMax));
  Result<CameraFromFile> camera = ParseCameraFile(text, colmap_id);
  if (!camera.ok()) return WithFile(camera.status(), path);
  return camera;
}

Result<CameraModel> ParseCamera(std::string_view size, std::string_view params) {
  VEDUTA_ASSIGN_OR_RETURN(const ImageSize parsed, ParseSize(size));
  return ParseCameraParams(params, parsed);
}

std::string CameraSizeText(const CameraModel& model) {
  return ImageSize{model.width_px, model.height_px}.Text();
}

// CameraParamsText is engine/camera/camera_text.h's.

}  // namespace veduta
