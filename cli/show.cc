// SPDX-License-Identifier: Apache-2.0
// veduta show DB IMAGE [--json]; veduta pose DB IMAGE [--geopose] [--json]
#include <functional>

#include "cli/command.h"
#include "cli/earth_pose_text.h"
#include "cli/hypotheses.h"
#include "cli/wire/answers_json.h"
#include "cli/wire/earth_json.h"

namespace veduta {
namespace {

struct ImageArguments {
  std::string db, image;
  bool json = false;
};

std::string VerdictWithReason(const ImageAnswer& image) {
  return VerdictWord(image.verdict) + ", " + Printable(ReasonSentence(image.reason, image.detail));
}

std::string MayStandIn(const ImageAnswer& image) {
  std::string others;
  for (const ReconstructionId other : image.may_stand_in)
    others += (others.empty() ? "" : " or ") +
              std::string(other == image.reconstruction ? "elsewhere in " : "") +
              "reconstruction " + std::to_string(other.value);
  return "it may stand in " + others +
         " as well, where places look alike: no pose is told until it is sure";
}

void PrintDeviations(const PoseUncertainty& uncertainty) {
  PrintLine(
      "standard deviation of the centre %.3g, of the rotation %.3g degrees, with the poses of %u "
      "images held",
      uncertainty.center_stddev, uncertainty.rotation_stddev_deg, uncertainty.images_held);
}

void PrintImage(const ImageAnswer& image) {
  PrintLine("%s (#%u): %s", Printable(image.name).c_str(), image.id.value,
            VerdictWithReason(image).c_str());
  std::string of_reconstruction;
  if (image.reconstruction.valid()) {
    of_reconstruction = " of reconstruction " + std::to_string(image.reconstruction.value);
  }
  PrintLine("%ux%u px, %u features, %u of them see points%s", image.width_px, image.height_px,
            image.features, image.observations, of_reconstruction.c_str());
  if (image.is_hidden) PrintLine("hidden: the daemon shows it to curators alone");
  if (!image.may_stand_in.empty()) PrintLine("%s", MayStandIn(image).c_str());
  if (image.on_earth) PrintEarthPose(*image.on_earth, "");
  if (image.uncertainty) PrintDeviations(*image.uncertainty);
  if (image.depth_map) {
    std::string sensors;
    for (const std::string& name : image.depth_map->sensors) sensors += " " + Printable(name);
    PrintLine("depth map of %ux%u px, %.1f %% of it known, from%s", image.depth_map->width_px,
              image.depth_map->height_px, 100 * image.depth_map->known_share, sensors.c_str());
  }
  for (const HypothesisAnswer& hypothesis : image.hypotheses) PrintHypothesis(hypothesis);
  for (const NeighborAnswer& neighbor : image.neighbors) {
    PrintLine("  %6u matches with %s (#%u, %s)", neighbor.matches, Printable(neighbor.name).c_str(),
              neighbor.image.value, VerdictWord(neighbor.verdict).c_str());
  }
}

int Show(const ImageAnswer& image, bool json) {
  if (json) {
    PrintJson(ToJson(image));
  } else {
    PrintImage(image);
  }
  return kDone;
}

// As OGC's GeoPose has it.
int PrintGeoPose(const ImageAnswer& image) {
  if (!image.on_earth) {
    return Fail(Status::NotFound(image.name + (image.cam_from_world
                                                   ? ": the place of its reconstruction on the "
                                                     "earth is not known"
                                                   : " has no pose that could be told")));
  }
  PrintJson(GeoPoseJson(*image.on_earth));
  return kDone;
}

int PrintPose(const ImageAnswer& image, bool json) {
  if (!image.may_stand_in.empty())
    return Fail(Status::NotFound(image.name + " has no sure pose: " + MayStandIn(image)));
  if (!image.cam_from_world) {
    return Fail(Status::NotFound(image.name + " has no pose: it is " + VerdictWithReason(image)));
  }
  if (json) {
    PrintJson(PoseJson(image));
    return kDone;
  }
  const auto& [q, t, c] = *image.cam_from_world;
  PrintLine("reconstruction %u", image.reconstruction.value);
  PrintLine("cam_from_world rotation (w x y z) %.12g %.12g %.12g %.12g", q[0], q[1], q[2], q[3]);
  PrintLine("translation %.12g %.12g %.12g", t[0], t[1], t[2]);
  PrintLine("centre %.12g %.12g %.12g", c[0], c[1], c[2]);
  if (image.on_earth) PrintEarthPose(*image.on_earth, "");
  if (image.uncertainty) {
    PrintDeviations(*image.uncertainty);
    PrintLine("covariance of rotation (x y z of the camera, radians) and centre (x y z)");
    for (const std::array<double, 6>& row : image.uncertainty->covariance) {
      PrintLine("  %12.5g %12.5g %12.5g %12.5g %12.5g %12.5g", row[0], row[1], row[2], row[3],
                row[4], row[5]);
    }
  }
  return kDone;
}

CLI::App* RegisterImageCommand(CLI::App* app, const char* name, const char* help,
                               const std::function<int(const ImageAnswer&, bool json)>& print,
                               int* exit_code) {
  auto arguments = std::make_shared<ImageArguments>();
  CLI::App* command = app->add_subcommand(name, help);
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("IMAGE", arguments->image, kPhotoHelp)->required();
  command->add_flag("--json", arguments->json, "JSON");
  command->callback([=] {
    const auto engine = OpenToRead(arguments->db);
    if (!engine.ok()) {
      *exit_code = Fail(engine.status());
      return;
    }
    const Questions questions = (*engine)->Ask();
    Result<ImageAnswer> image = questions.Image(arguments->image);
    if (!image.ok()) {
      *exit_code = Fail(image.status());
      return;
    }
    // What is damaged in other images does not hide what is known of this one.
    auto uncertainty = questions.Uncertainty(arguments->image);
    if (uncertainty.ok()) image->uncertainty = *uncertainty;
    *exit_code = print(*image, arguments->json);
    if (!uncertainty.ok()) *exit_code = Fail(uncertainty.status());
  });
  return command;
}

}  // namespace

void RegisterShow(CLI::App* app, int* exit_code) {
  RegisterImageCommand(app, "show", "One photo: verdict, reason, reconstruction, neighbours", Show,
                       exit_code);
}

void RegisterPose(CLI::App* app, int* exit_code) {
  auto geopose = std::make_shared<bool>(false);
  const auto print = [geopose](const ImageAnswer& image, bool json) {
    return *geopose ? PrintGeoPose(image) : PrintPose(image, json);
  };
  CLI::App* command =
      RegisterImageCommand(app, "pose", "Where a photo was taken", print, exit_code);
  command->add_flag("--geopose", *geopose, "On the earth, as a GeoPose of OGC (JSON)");
}

}  // namespace veduta
