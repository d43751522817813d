// SPDX-License-Identifier: Apache-2.0
// veduta calibrate PHOTO|FOLDER... --out camera.json [--report report.html] [--markers N]
//                  [--threads N] [--json]
// veduta calibrate --scene PHOTO|FOLDER... --out camera.json [--report report.html] [--threads N]
//                  [--json]
// veduta calibrate --points points.json --out camera.json [--report report.html] [--json]
#include "cli/command.h"
#include "cli/photos/photo_list.h"
#include "cli/result_file.h"
#include "cli/wire/answers_json.h"

namespace veduta {
namespace {

struct CalibrateArguments {
  std::vector<std::string> photos;  // files and folders
  std::string out, report;
  CalibrateRequest request;
  bool json = false;
};

void PrintCalibration(const CalibrationAnswer& answer) {
  for (size_t i = 0; i < answer.intrinsics.size(); ++i) {
    const std::string& name = answer.intrinsic_names[i];
    const bool is_coefficient = name == "k1" || name == "k2";
    const int digits = is_coefficient ? 6 : 3;
    PrintLine("%s %.*f +- %.*f%s", name.c_str(), digits, answer.intrinsics[i], digits,
              answer.sigmas[i], is_coefficient ? "" : " px");
  }
  PrintLine("reprojection error: mean %.3f px, RMS %.3f px, in %u of %u photos",
            answer.error_px_mean, answer.error_px_rms, answer.photos_used, answer.photos);
  PrintLine("distortion known to %.2f px all over the photo", answer.distortion_sigma_px);
  PrintLine("%s", answer.is_good ? "good" : "uncertain: see the warnings");
}

int RunCalibrate(const CalibrateArguments& arguments) {
  CalibrateRequest request = arguments.request;
  const auto listed = ListPhotosAndWarn(arguments.photos);
  if (!listed.ok()) return Fail(listed.status());
  for (const ListedPhoto& photo : *listed) request.photo_paths.push_back(photo.path);
  const Result<CalibrationAnswer> answer = Calibrate(request);
  if (!answer.ok()) {  // a line for each photo
    std::fprintf(stderr, "veduta: %s\n", PrintableLines(answer.status().message()).c_str());
    return ExitCodeOf(answer.status());
  }
  for (const CalibrationMessage& message : answer->messages) {
    std::fprintf(stderr, "veduta: %s: %s\n", message.is_warning ? "warning" : "note",
                 Printable(message.text).c_str());
  }
  Status written = WriteResultFile(arguments.out, answer->camera_file);
  if (written.ok() && !arguments.report.empty()) {
    written = WriteResultFile(arguments.report, answer->report_html);
  }
  if (!written.ok()) return Fail(written);
  if (arguments.json) {
    PrintJson(CameraFileJson(*answer));
  } else {
    PrintCalibration(*answer);
  }
  return kDone;
}

}  // namespace

void RegisterCalibrate(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<CalibrateArguments>();
  CalibrateRequest& request = arguments->request;
  CLI::App* command = app->add_subcommand(
      "calibrate", "Calibrate a camera from photos of flat targets on a floor, or of a scene");
  CLI::Option* photos = command->add_option("PHOTO", arguments->photos,
                                            "Photos, or folders of them, of printed markers");
  CLI::Option* points =
      command->add_option("--points", request.points_path,
                          "Instead: JSON file of points seen in the photos (docs/calibration.md)");
  points->excludes(photos);
  CLI::Option* markers =
      command->add_option("--markers", request.marker_count, "How many markers were printed (96)")
          ->check(CLI::Range(1u, kMarkerCountMax));
  command
      ->add_flag("--scene", request.is_scene,
                 "The photos show any place, ten of them or more from different places, and no "
                 "markers: less exact, and nothing to print")
      ->excludes(points)
      ->excludes(markers);
  command->add_option("--threads", request.thread_count, "Photos looked at side by side (1)")
      ->check(CLI::Range(1, 256));
  command->add_option("--out", arguments->out, "Camera file to write; `camera add --from` reads it")
      ->required();
  command->add_option("--report", arguments->report,
                      "HTML file to write: pictures, what is known how well, advice");
  command->add_flag("--json", arguments->json, "Print the camera file");
  command->callback([=] {
    if (arguments->photos.empty() && arguments->request.points_path.empty()) {
      throw CLI::RequiredError("PHOTO or --points");
    }
    *exit_code = RunCalibrate(*arguments);
  });
}

}  // namespace veduta
