// SPDX-License-Identifier: Apache-2.0
#include "fusion/pass/scene.h"

#include <string>

#include "engine/camera/projection.h"

namespace veduta {

Result<Scene> LoadScene(const Snapshot& snapshot, ReconstructionId reconstruction) {
  Scene scene;
  VEDUTA_ASSIGN_OR_RETURN(scene.reconstruction, snapshot.GetReconstruction(reconstruction));
  if (scene.reconstruction.is_dissolved) {
    return Status::InvalidArgument("reconstruction " + std::to_string(reconstruction.value) +
                                   " was dissolved: all its images have lost their poses");
  }
  if (!scene.reconstruction.is_living()) {
    return Status::InvalidArgument(
        "reconstruction " + std::to_string(reconstruction.value) + " was merged into " +
        std::to_string(scene.reconstruction.merged_into.value) + ": name that one");
  }
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPoses([&](const PoseRecord& pose) {
    if (pose.reconstruction == reconstruction)
      scene.images[pose.image].cam_from_world = pose.cam_from_world;
    return true;
  }));
  std::map<CameraId, CameraModel> cameras;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> records, snapshot.ListCameras());
  for (const CameraRecord& camera : records) cameras[camera.id] = camera.model;
  for (auto& [id, image] : scene.images) {
    VEDUTA_ASSIGN_OR_RETURN(image.record, snapshot.GetImage(id));
    const auto camera = cameras.find(image.record.camera);
    if (camera == cameras.end())
      return Status::Corruption("image " + image.record.name + " has no camera");
    if (const Status usable = CheckCamera(camera->second); !usable.ok()) {
      return Status::Corruption("family cameras: the camera of image " + image.record.name + ": " +
                                usable.message());
    }
    image.camera = camera->second;
  }
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanPointBlocks(
      reconstruction, scene.reconstruction.points_generation, [&](const PointBlock& block) {
        for (const PointRecord& point : block.points) {
          const uint32_t index = static_cast<uint32_t>(scene.points.size());
          scene.points.push_back({point.id, point.position, {}});
          for (const TrackElement& element : point.track) {
            const auto image = scene.images.find(element.image);
            if (image == scene.images.end()) continue;
            scene.points.back().track.push_back(element.image);
            image->second.observations.push_back({index, element.feature});
          }
        }
        return true;
      }));
  return scene;
}

}  // namespace veduta
