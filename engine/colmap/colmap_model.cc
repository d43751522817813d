// SPDX-License-Identifier: Apache-2.0
#include "engine/colmap/colmap_model.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <unordered_map>
#include <utility>

#include "engine/colmap/model_files.h"
#include "engine/colmap/seen_together.h"
#include "storage/base/median.h"

namespace veduta {
namespace {

// Chosen by hand: as many as retrieval ranks.
constexpr size_t kPartnersMax = 24;
// World units. Further away, differences between places are lost to rounding. Chosen by hand.
constexpr double kTranslationMax = 1e9;
// A model whose middle is so many times as far away as its cameras are from it is moved. Chosen by
// hand: single precision has seven digits, five of them for the model itself then.
constexpr double kFarTimes = 100;

Eigen::Vector3d MiddleOf(const std::vector<ModelImage>& images) {
  Eigen::Vector3d middle;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> values;
    for (const ModelImage& image : images) values.push_back(image.cam_from_world.Center()[axis]);
    middle[axis] = MedianOf(std::move(values));
  }
  return middle;
}

// Takes the middle from all positions where it is far away.
void MoveNear(ColmapModel* model) {
  if (model->images.empty()) return;
  const Eigen::Vector3d middle = MiddleOf(model->images);
  double extent = 0;
  for (const ModelImage& image : model->images)
    extent = std::max(extent, (image.cam_from_world.Center() - middle).norm());
  if (!(middle.norm() > kFarTimes * extent)) return;
  model->origin = middle.array().round();
  for (ModelImage& image : model->images) {
    Rigid3& pose = image.cam_from_world;
    pose.translation += pose.rotation * model->origin;
  }
}

Result<Rigid3> PoseOf(const ImageRow& image) {
  const auto& p = image.pose;
  if (!std::ranges::all_of(p, [](double number) { return std::isfinite(number); }))
    return Status::InvalidArgument("image " + std::to_string(image.id) +
                                   " has a pose that is not of finite numbers");
  const Eigen::Quaterniond rotation(p[0], p[1], p[2], p[3]);
  const Eigen::Vector3d translation(p[4], p[5], p[6]);
  if (!(std::abs(rotation.norm() - 1) < 1e-3))
    return Status::InvalidArgument("the rotation of image " + std::to_string(image.id) +
                                   " is not of unit length");
  if (!(translation.norm() < kTranslationMax))
    return Status::InvalidArgument("image " + std::to_string(image.id) +
                                   " is further than 1e9 units from the origin");
  return Rigid3{rotation.normalized(), translation};
}

class ModelReading final {
 public:
  Status AddCamera(const KnownColmapCamera& camera) {
    const std::string which = "camera " + std::to_string(camera.id);
    if (!camera_ids_.insert(camera.id).second)
      return Status::InvalidArgument(which + " is there twice");
    Result<ConvertedCamera> converted = ConvertCamera(camera.camera);
    if (!converted.ok()) {
      return Status::InvalidArgument(
          which + " cannot be taken over: " + converted.status().message() +
          "; or undistort the model (colmap image_undistorter), and import what that writes");
    }
    model_.cameras.push_back({camera.id, camera.model, converted->model, converted->residual});
    return Status::Ok();
  }

  Status AddImage(ImageRow image) {
    const std::string which = "image " + std::to_string(image.id);
    if (!camera_ids_.contains(image.camera))
      return Status::InvalidArgument(which + " has camera " + std::to_string(image.camera) +
                                     ", which the model does not have");
    if (image.name.empty() || image.name.size() > kModelNameBytesMax)
      return Status::InvalidArgument(which + " has no name, or one of more than " +
                                     std::to_string(kModelNameBytesMax) + " bytes");
    if (!names_.insert(image.name).second)
      return Status::InvalidArgument(which + " has the name of another one");
    VEDUTA_ASSIGN_OR_RETURN(const Rigid3 cam_from_world, PoseOf(image));
    model_.images.push_back({image.id, image.camera, std::move(image.name), cam_from_world, {}});
    return Status::Ok();
  }

  // To be called once all images are there. The first track does what is to be done then.
  Status AddTrack(std::span<const uint32_t> images) {
    VEDUTA_RETURN_IF_ERROR(SortImages());
    std::set<uint32_t> places;
    for (const uint32_t id : images) {
      if (const auto place = places_.find(id); place != places_.end()) places.insert(place->second);
    }
    const std::vector<uint32_t> once(places.begin(), places.end());
    seen_together_.AddPoint(once);
    return Status::Ok();
  }

  Result<ColmapModel> Finish() {
    VEDUTA_RETURN_IF_ERROR(SortImages());
    std::ranges::sort(model_.cameras, {}, &ModelCamera::id);
    std::vector<std::vector<uint32_t>> partners =
        seen_together_.EarlierPartners(model_.images.size(), kPartnersMax);
    for (size_t i = 0; i < partners.size(); ++i)
      model_.images[i].seen_with = std::move(partners[i]);
    MoveNear(&model_);
    return std::move(model_);
  }

 private:
  Status SortImages() {
    if (places_.size() == model_.images.size()) return Status::Ok();
    std::ranges::sort(model_.images, {}, &ModelImage::id);
    for (uint32_t i = 0; i < model_.images.size(); ++i) {
      if (!places_.emplace(model_.images[i].id, i).second)
        return Status::InvalidArgument("image " + std::to_string(model_.images[i].id) +
                                       " is there twice");
    }
    return Status::Ok();
  }

  ColmapModel model_;
  std::set<uint32_t> camera_ids_;
  std::set<std::string> names_;
  std::unordered_map<uint32_t, uint32_t> places_;  // of images, by their ids
  SeenTogether seen_together_;
};

}  // namespace

Result<ColmapModel> ReadColmapModel(const std::string& folder) {
  ModelReading reading;
  const ModelReceiver receiver{
      [&](const KnownColmapCamera& camera) { return reading.AddCamera(camera); },
      [&](ImageRow image) { return reading.AddImage(std::move(image)); },
      [&](std::span<const uint32_t> images) { return reading.AddTrack(images); }};
  std::error_code failure;
  const bool is_binary = std::filesystem::exists(folder + "/cameras.bin", failure);
  VEDUTA_RETURN_IF_ERROR(is_binary ? ReadBinaryFiles(folder, receiver)
                                   : ReadTextFiles(folder, receiver));
  VEDUTA_ASSIGN_OR_RETURN(ColmapModel model, reading.Finish());
  if (model.images.empty()) return Status::InvalidArgument(folder + ": the model has no image");
  return model;
}

}  // namespace veduta
