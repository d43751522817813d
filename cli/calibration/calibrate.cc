// SPDX-License-Identifier: Apache-2.0
// veduta calibrate --points points.json --out camera.json [--report report.html] [--json]
#include <filesystem>
#include <fstream>

#include "cli/calibration/calibration_report.h"
#include "cli/calibration/camera_file.h"
#include "cli/calibration/points_file.h"
#include "cli/command.h"
#include "engine/camera/calibration/calibrator.h"

namespace veduta {
namespace {

struct CalibrateArguments {
  std::string points, out, report;
  bool json = false;
};

// What to calibrate from, and how to call it.
Result<CalibrationInput> ReadInput(const CalibrateArguments& arguments, std::string* from) {
  *from = std::filesystem::path(arguments.points).filename().string();
  VEDUTA_ASSIGN_OR_RETURN(const std::string text, ReadWholeFile(arguments.points, kJsonFileBytesMax));
  return ParsePoints(text);
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
    std::printf("%s %.*f +- %.*f%s\n", kIntrinsicNames[i], is_coefficient ? 6 : 3, values[i], is_coefficient ? 6 : 3,
                c.Sigma(static_cast<int>(i)), is_coefficient ? "" : " px");
  }
  size_t used = 0;
  for (const CalibrationPhoto& photo : c.photos) used += photo.why_left_out.empty();
  std::printf("reprojection error: mean %.3f px, RMS %.3f px, in %zu of %zu photos\n", c.error_px_mean, c.error_px_rms,
              used, c.photos.size());
  std::printf("distortion known to %.2f px all over the photo\n", c.distortion_sigma_px);
  std::printf("%s\n", c.status == CalibrationStatus::kGood ? "good" : "uncertain: see the warnings");
}

int Calibrate(const CalibrateArguments& arguments) {
  std::string from;
  const auto input = ReadInput(arguments, &from);
  if (!input.ok()) return Fail(input.status());
  const auto made = CalibrateCamera(*input);
  if (!made.ok()) return Fail(made.status());
  const std::string camera = CameraFileText(*made, from);
  if (const Status status = Write(arguments.out, camera); !status.ok()) return Fail(status);
  if (!arguments.report.empty()) {
    const Status status = Write(arguments.report, CalibrationReport(*made, from));
    if (!status.ok()) return Fail(status);
  }
  for (const CalibrationWarning& w : made->warnings) {
    std::fprintf(stderr, "veduta: %s: %s\n", w.IsNote() ? "note" : "warning", w.text.c_str());
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
  CLI::App* command = app->add_subcommand("calibrate", "Calibrate a camera from photos of flat targets on a floor");
  command->add_option("--points", arguments->points, "JSON file of points seen in the photos (docs/calibration.md)")
      ->required();
  command->add_option("--out", arguments->out, "Camera file to write; `camera add --from` reads it")->required();
  command->add_option("--report", arguments->report, "HTML file to write: pictures, what is known how well, advice");
  command->add_flag("--json", arguments->json, "Print the camera file");
  command->callback([=] { *exit_code = Calibrate(*arguments); });
}

}  // namespace veduta
