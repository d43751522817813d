// SPDX-License-Identifier: Apache-2.0
// veduta render DB OUT.png [--from IMAGE] [--compare] [--reconstruction ID] [--side
// front|left|right] [--points]
#include "cli/command.h"
#include "fusion/pass/dense_export.h"

namespace veduta {
namespace {

constexpr uint32_t kWidthPx = 1600, kHeightPx = 1200;  // of a picture that no photo gives a size

struct RenderArguments {
  std::string db, out, from, side = "front", shading = "color";
  uint32_t reconstruction = 0, size_px = 0;
  bool points = false, compare = false;
};

Drawn WhatToDraw(const RenderArguments& arguments) {
  return arguments.points ? Drawn::kPoints : Drawn::kSurfaceOrPoints;
}

RenderOptions OptionsOf(const RenderArguments& arguments) {
  RenderOptions options;
  if (arguments.shading == "clay") options.shading = Shading::kClay;
  if (arguments.shading == "normal") options.shading = Shading::kNormal;
  return options;
}

Result<ImageId> FindImage(const Snapshot& snapshot, const std::string& name) {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> image, snapshot.FindImageByName(name));
  if (image) return *image;
  return Status::NotFound("there is no image '" + name + "' in the database");
}

Status RenderFromPhoto(const Engine& engine, const RenderArguments& arguments) {
  const auto snapshot = engine.database()->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const ImageId image, FindImage(*snapshot, arguments.from));
  VEDUTA_ASSIGN_OR_RETURN(const ViewGeometry view,
                          PhotoGeometry(*snapshot, image, arguments.size_px));
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<PoseRecord> pose, snapshot->FindPose(image));
  VEDUTA_ASSIGN_OR_RETURN(Picture picture,
                          DrawReconstruction(*snapshot, pose->reconstruction, WhatToDraw(arguments),
                                             view, OptionsOf(arguments), *engine.pool()));
  if (arguments.compare) {
    VEDUTA_ASSIGN_OR_RETURN(const BalancedPhoto photo,
                            LoadBalancedPhoto(snapshot, image, arguments.size_px));
    VEDUTA_ASSIGN_OR_RETURN(const ReprojectedColor error,
                            CompareWithPhoto(picture, photo.view, photo.gain));
    std::printf("%s: covered %.1f %%, median absolute error %.1f of 255, exposure balanced %.1f\n",
                arguments.from.c_str(), 100 * error.covered_share, error.median_error,
                error.median_error_balanced);
    VEDUTA_ASSIGN_OR_RETURN(picture, SideBySide(picture, photo.view, photo.gain));
  }
  return WritePng(arguments.out, picture.width_px, picture.height_px, picture.rgb);
}

// The reconstruction named, or the largest.
Result<ReconstructionId> Choose(const Snapshot& snapshot, uint32_t wanted) {
  if (wanted != 0) return ReconstructionId(wanted);
  VEDUTA_ASSIGN_OR_RETURN(const auto records, snapshot.ListReconstructions());
  const ReconstructionRecord* largest = nullptr;
  for (const ReconstructionRecord& record : records) {
    if (record.merged_into.valid()) continue;
    if (!largest || record.image_count > largest->image_count) largest = &record;
  }
  if (!largest) return Status::NotFound("there is no reconstruction yet: add photos first");
  return largest->id;
}

Status RenderFromSide(const Engine& engine, const RenderArguments& arguments) {
  const auto snapshot = engine.database()->GetSnapshot();
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId id, Choose(*snapshot, arguments.reconstruction));
  VEDUTA_ASSIGN_OR_RETURN(const Eigen::AlignedBox3d box, BoxOf(*snapshot, id));
  std::vector<ViewGeometry> cameras;
  Eigen::Vector3d forward = Eigen::Vector3d::Zero();
  VEDUTA_RETURN_IF_ERROR(snapshot->ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction != id) return true;
    cameras.push_back({1, 1, {}, pose.cam_from_world});
    forward += pose.cam_from_world.rotation.conjugate() * Eigen::Vector3d::UnitZ();
    return true;
  }));
  const uint32_t width = arguments.size_px ? arguments.size_px : kWidthPx;
  VEDUTA_ASSIGN_OR_RETURN(const auto views, ThreeSides(box, MeanUp(cameras), forward, width,
                                                       width * kHeightPx / kWidthPx));
  const size_t side = arguments.side == "front" ? 0 : arguments.side == "left" ? 1 : 2;
  RenderOptions options = OptionsOf(arguments);
  options.back_faces = BackFaces::kCull;  // from outside one looks into a courtyard
  VEDUTA_ASSIGN_OR_RETURN(const Picture picture,
                          DrawReconstruction(*snapshot, id, WhatToDraw(arguments), views[side],
                                             options, *engine.pool()));
  return WritePng(arguments.out, picture.width_px, picture.height_px, picture.rgb);
}

int Render(const RenderArguments& arguments) {
  const auto engine = OpenToRead(arguments.db);
  if (!engine.ok()) return Fail(engine.status());
  const Status status = arguments.from.empty() ? RenderFromSide(**engine, arguments)
                                               : RenderFromPhoto(**engine, arguments);
  return status.ok() ? kDone : Fail(status);
}

}  // namespace

void RegisterRender(CLI::App* app, int* exit_code) {
  auto arguments = std::make_shared<RenderArguments>();
  CLI::App* command =
      app->add_subcommand("render", "A picture of a surface, or of points where there is none yet");
  command->add_option("DB", arguments->db, "Database")->required();
  command->add_option("OUT", arguments->out, "PNG file to write")->required();
  command->add_option("--from", arguments->from,
                      "Seen by this photo's camera, by the photo's name");
  command
      ->add_flag("--compare", arguments->compare,
                 "With --from: photo, picture and difference side by side, and the error")
      ->needs("--from");
  command
      ->add_option("--reconstruction", arguments->reconstruction,
                   "Without --from: which (default: the largest)")
      ->check(CLI::PositiveNumber)
      ->excludes("--from");
  command->add_option("--side", arguments->side, "Without --from: front, left or right")
      ->check(CLI::IsMember({"front", "left", "right"}))
      ->excludes("--from");
  command
      ->add_option("--size", arguments->size_px,
                   "Longer side of the picture, px (default: the photo's, or 1600)")
      ->check(CLI::Range(16, 16384));
  command->add_option("--shading", arguments->shading, "color, clay or normal")
      ->check(CLI::IsMember({"color", "clay", "normal"}));
  command->add_flag("--points", arguments->points,
                    "The sparse points, also where there is a surface");
  command->callback([=] { *exit_code = Render(*arguments); });
}

}  // namespace veduta
