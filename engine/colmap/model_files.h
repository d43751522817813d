// SPDX-License-Identifier: Apache-2.0
#pragma once
// The three files of a model, record by record. Nothing in them is believed: counts are compared
// with what the file has, and lengths are bounded.

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

#include "engine/camera/calibration/known_camera.h"
#include "storage/base/status.h"

namespace veduta {

inline constexpr uint64_t kModelCamerasMax = 100'000;   // chosen by hand
inline constexpr uint64_t kModelImagesMax = 1'000'000;  // chosen by hand
inline constexpr size_t kModelNameBytesMax = 4096;      // of a photo; the longest path of Linux

// An image as its record has it, unchecked.
struct ImageRow {
  uint32_t id = 0, camera = 0;
  std::array<double, 7> pose = {};  // quaternion w, x, y, z and translation, of cam_from_world
  std::string name;
};

// What the records are given to; an error ends the reading and comes back, with the file's name.
struct ModelReceiver {
  std::function<Status(const KnownColmapCamera& camera)> camera;
  std::function<Status(ImageRow image)> image;
  // The images that see a point, as its record has them.
  std::function<Status(std::span<const uint32_t> images)> track;
};

// kNotFound, kInvalidArgument, kIoError; each names the file.
Status ReadBinaryFiles(const std::string& folder, const ModelReceiver& receiver);
Status ReadTextFiles(const std::string& folder, const ModelReceiver& receiver);

}  // namespace veduta
