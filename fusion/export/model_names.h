// SPDX-License-Identifier: Apache-2.0
#pragma once
// What images are called in models for other programs, which know them by their names alone.

#include <map>
#include <span>
#include <string>

#include "fusion/pass/scene.h"
#include "storage/model/image.h"

namespace veduta {

// Each image's name; where several of these images have it, the contributor, a slash and the name;
// where that is taken, too, "#", the number, a slash and the name, with more "#" before it until no
// other is called so. O(images).
std::map<ImageId, std::string> ModelNames(std::span<const ImageRecord* const> images);
std::map<ImageId, std::string> ModelNames(const Scene& scene);

}  // namespace veduta
