// SPDX-License-Identifier: Apache-2.0
#include "engine/first_cameras.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <utility>

#include "engine/scene_calibration.h"
#include "engine/unnamed_camera.h"

namespace veduta {
namespace {

// Standard deviation of the focal length over itself, up to which a city begins with a camera:
// without one it cannot begin. Chosen by hand; not measured.
constexpr double kFocalShareMax = 0.01;
// Pixels: photos of one size that several cameras took fit a common one worse. Chosen by hand; not
// measured.
constexpr double kErrorPxMax = 1.5;

// Photos that one camera took, as far as they say.
struct Group {
  std::string name;  // CameraGroupOf; empty where they do not tell
  std::vector<size_t> photos;
};

// By what the photos say of themselves, otherwise by their size: who sends photos together that
// tell nothing has mostly taken them with one camera. In the order of their first photos. A photo
// whose camera is known already, or that cannot be read, is in none.
Result<std::vector<Group>> GroupPhotos(EngineParts* parts,
                                       std::span<const PhotoSubmission> photos) {
  std::vector<PhotoFacts> facts(photos.size());
  parts->pool->ParallelFor(photos.size(), [&](size_t i) {
    if (!photos[i].camera.empty()) return;
    Result<PhotoFacts> looked = parts->preparer->Look(photos[i].photo);
    if (looked.ok()) facts[i] = *std::move(looked);  // if not, adding the photo says why
  });
  std::vector<Group> groups;
  std::map<std::string, size_t> index;
  for (size_t i = 0; i < photos.size(); ++i) {
    if (facts[i].shape.empty()) continue;
    VEDUTA_ASSIGN_OR_RETURN(const auto known, FindUnnamedCamera(parts, facts[i]));
    if (known) continue;
    const std::string key = facts[i].camera_group + "\n" + facts[i].shape;
    const auto [at, is_new] = index.try_emplace(key, groups.size());
    if (is_new) groups.push_back({facts[i].camera_group, {}});
    groups[at->second].photos.push_back(i);
  }
  return groups;
}

std::string SourceOf(const Calibration& made) {
  char share[32];
  std::snprintf(share, sizeof(share), "%.2g", 100 * made.Sigma(0) / made.model.fx);
  return "calibrated by " + std::to_string(made.UsedPhotoCount()) +
         " photos together, its focal length to " + share + " %";
}

// Adds it under the group's name, or under one that says its size and is free.
Result<std::string> Add(EngineParts* parts, const Group& group, const Calibration& made) {
  std::string name = group.name;
  if (name.empty()) {
    name = "photos of " + std::to_string(made.model.width_px) + "x" +
           std::to_string(made.model.height_px);
  }
  for (;; name += "'") {
    const Result<CameraId> id = parts->AddCamera(name, made.model, SourceOf(made));
    if (id.ok()) return name;
    if (id.status().code() != StatusCode::kAlreadyExists) return id.status();
  }
}

Result<FirstCamera> CalibrateGroup(EngineParts* parts, const Group& group,
                                   std::span<PhotoSubmission> photos, std::stop_token stop) {
  FirstCamera first;
  first.photos = static_cast<uint32_t>(group.photos.size());
  const size_t used = std::min<size_t>(group.photos.size(), SceneCalibrationOptions().photos_max);
  std::vector<PhotoSource> sources;
  for (size_t i = 0; i < used; ++i) sources.push_back(photos[group.photos[i]].photo);
  SceneCalibrationOptions options;
  options.decoder = parts->tuning.decoder;
  const Result<Calibration> made = CalibrateByScene(
      sources, static_cast<uint32_t>(parts->pool->thread_count() + 1), stop, options);
  if (made.status().code() == StatusCode::kCancelled) return made.status();
  if (!made.ok()) {
    first.why_not = made.status().message();
  } else if (made->Sigma(0) > kFocalShareMax * made->model.fx) {
    first.why_not = made->warnings.back().text;
  } else if (made->error_px_rms > kErrorPxMax) {
    first.why_not = "no one camera explains them; name the camera of each";
  }
  if (!first.why_not.empty()) return first;
  VEDUTA_ASSIGN_OR_RETURN(first.name, Add(parts, group, *made));
  first.model = made->model;
  first.focal_stddev_share = made->Sigma(0) / made->model.fx;
  for (const size_t i : group.photos) photos[i].camera = first.name;
  return first;
}

}  // namespace

Result<std::vector<FirstCamera>> CalibrateFirst(EngineParts* parts,
                                                std::span<PhotoSubmission> photos,
                                                std::stop_token stop) {
  VEDUTA_ASSIGN_OR_RETURN(const auto reconstructions,
                          parts->database->GetSnapshot()->ListReconstructions());
  if (std::ranges::any_of(reconstructions, &ReconstructionRecord::is_living))
    return std::vector<FirstCamera>();
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<Group> groups, GroupPhotos(parts, photos));
  std::vector<FirstCamera> cameras;
  for (const Group& group : groups) {
    if (group.photos.size() < SceneCalibrationOptions().images_min) continue;
    VEDUTA_ASSIGN_OR_RETURN(FirstCamera first, CalibrateGroup(parts, group, photos, stop));
    cameras.push_back(std::move(first));
  }
  return cameras;
}

}  // namespace veduta
