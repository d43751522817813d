// SPDX-License-Identifier: Apache-2.0
// veduta calibrate PHOTO|FOLDER... --out camera.json [--report report.html] [--markers N]
// [--threads N] [--json] veduta calibrate --points points.json --out camera.json [--report
// report.html] [--json]
#include <filesystem>
#include <fstream>

#include "cli/calibration/calibration_report.h"
#include "cli/calibration/camera_file.h"
#include "cli/calibration/points_file.h"
#include "cli/command.h"
#include "cli/photo_list.h"
#include "engine/camera/calibration/calibrator.h"
#include "engine/camera/markers/photo_markers.h"

namespace veduta {
namespace {

struct CalibrateArguments {
  std::vector<std::string> photos;
  std::string points, out, report;
  uint32_t marker_count = 96, threads = 1;
  bool json = false;
};

struct Observed {
  CalibrationInput input;
  std::string from;                       // how to call it
  std::vector<CalibrationWarning> notes;  // on single photos
};

// The markers in the photos; what is wrong with one of them goes to standard error at once.
Result<Observed> ReadPhotos(const CalibrateArguments& arguments) {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ListedPhoto> listed, ListPhotos(arguments.photos));
  std::vector<std::string> paths;
  for (const ListedPhoto& photo : listed) paths.push_back(photo.path);
  PhotoMarkersOptions options;
  options.markers.id_count = arguments.marker_count;
  ThreadPool pool(arguments.threads - 1);
  VEDUTA_ASSIGN_OR_RETURN(const PhotoMarkers found, DetectInPhotos(paths, options, &pool));
  Observed observed = {
      found.input, std::to_string(found.input.views.size()) + " photos of markers", {}};
  for (const PhotoNote& note : found.notes) {
    const std::string& text = note.use == PhotoUse::kUsed ? note.advice : note.detail;
    if (text.empty()) continue;
    observed.notes.push_back({CalibrationAdvice::kPhotoQuality, note.name + ": " + text});
    std::fprintf(stderr, "veduta: %s\n", observed.notes.back().text.c_str());
  }
  if (found.input.views.empty()) {
    return Status::InvalidArgument(
        "no photo shows enough markers; print them with `veduta markers`, lay them on a "
        "floor and photograph them");
  }
  return observed;
}

Result<Observed> ReadInput(const CalibrateArguments& arguments) {
  if (arguments.points.empty()) return ReadPhotos(arguments);
  VEDUTA_ASSIGN_OR_RETURN(const std::string text,
                          ReadWholeFile(arguments.points, kJsonFileBytesMax));
  Result<CalibrationInput> input = ParsePoints(text);
  if (!input.ok())
    return Status(input.status().code(), arguments.points + ": " + input.status().message());
  return Observed{
      std::move(*input), std::filesystem::path(arguments.points).filename().string(), {}};
}

Status Write(const std::string& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.close();
  return file ? Status::Ok() : Status::IoError("cannot write " + path);
}

void Print(const Calibration& c) {
  const std::array<double, 8> values = IntrinsicsOf(c.model);
  for (size_t i = 0; i < values.size(); ++i) {
    const bool is_coefficient = i == 4 || i == 5;
    std::printf("%s %.*f +- %.*f%s\n", kIntrinsicNames[i], is_coefficient ? 6 : 3, values[i],
                is_coefficient ? 6 : 3, c.Sigma(static_cast<int>(i)), is_coefficient ? "" : " px");
  }
  size_t used = 0;
  for (const CalibrationPhoto& photo : c.photos) used += photo.why_left_out.empty();
  std::printf("reprojection error: mean %.3f px, RMS %.3f px, in %zu of %zu photos\n",
              c.error_px_mean, c.error_px_rms, used, c.photos.size());
  std::printf("distortion known to %.2f px all over the photo\n", c.distortion_sigma_px);
  std::printf("%s\n",
              c.status == CalibrationStatus::kGood ? "good" : "uncertain: see the warnings");
}

int Calibrate(const CalibrateArguments& arguments) {
  const auto observed = ReadInput(arguments);
  if (!observed.ok()) return Fail(observed.status());
  auto made = CalibrateCamera(observed->input);
  if (!made.ok()) return Fail(made.status());
  for (const CalibrationWarning& w : made->warnings) {
    std::fprintf(stderr, "veduta: %s: %s\n", w.IsNote() ? "note" : "warning", w.text.c_str());
  }
  made->warnings.insert(made->warnings.end(), observed->notes.begin(), observed->notes.end());
  const std::string camera = CameraFileText(*made, observed->from);
  if (const Status status = Write(arguments.out, camera); !status.ok()) return Fail(status);
  if (!arguments.report.empty()) {
    const Status status = Write(arguments.report, CalibrationReport(*made, observed->from));
    if (!status.ok()) return Fail(status);
  }
  if (arguments.json) {
    std::printf("%s", camera.c_str());
  } else {
    Print(*made);
  }
  return kDone;
}

}  // namespace

void RegisterCalibrate(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CLI::App* command =
      app->add_subcommand("calibrate", "Calibrate a camera from photos of flat targets on a floor");
  CLI::Option* photos = command->add_option("PHOTO", arguments->photos,
                                            "Photos, or folders of them, of printed markers");
  CLI::Option* points =
      command->add_option("--points", arguments->points,
                          "Instead: JSON file of points seen in the photos (docs/calibration.md)");
  points->excludes(photos);
  command->add_option("--markers", arguments->marker_count, "How many markers were printed (96)")
      ->check(CLI::Range(1u, kMarkerIdCount));
  command->add_option("--threads", arguments->threads, "Photos looked at side by side (1)")
      ->check(CLI::Range(1, 256));
  command->add_option("--out", arguments->out, "Camera file to write; `camera add --from` reads it")
      ->required();
  command->add_option("--report", arguments->report,
                      "HTML file to write: pictures, what is known how well, advice");
  command->add_flag("--json", arguments->json, "Print the camera file");
  command->callback([=] {
    if (arguments->photos.empty() && arguments->points.empty()) {
      throw CLI::RequiredError("PHOTO or --points");
    }
    *exit_code = Calibrate(*arguments);
  });
}

}  // namespace veduta
