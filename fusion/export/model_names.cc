// SPDX-License-Identifier: Apache-2.0
#include "fusion/export/model_names.h"

#include <set>
#include <vector>

namespace veduta {

std::map<ImageId, std::string> ModelNames(std::span<const ImageRecord* const> images) {
  std::map<std::string, uint32_t> counts;
  for (const ImageRecord* image : images) ++counts[image->name];
  std::map<ImageId, std::string> names;
  std::set<std::string> taken;
  for (const ImageRecord* image : images) {
    if (counts.at(image->name) == 1) taken.insert(names[image->id] = image->name);
  }
  for (const ImageRecord* image : images) {
    if (names.contains(image->id)) continue;
    std::string name = image->contributor + "/" + image->name;
    if (taken.contains(name)) name = "#" + std::to_string(image->id.value) + "/" + image->name;
    while (!taken.insert(name).second) name = "#" + name;
    names[image->id] = name;
  }
  return names;
}

std::map<ImageId, std::string> ModelNames(const Scene& scene) {
  std::vector<const ImageRecord*> images;
  for (const auto& [id, image] : scene.images) images.push_back(&image.record);
  return ModelNames(images);
}

}  // namespace veduta
