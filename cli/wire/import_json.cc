// SPDX-License-Identifier: Apache-2.0
#include "cli/wire/import_json.h"

#include "cli/wire/answers_json.h"

namespace veduta {

Json ToJson(const ImportedPhoto& photo) {
  return {{"image", photo.name},
          {"id", ToJson(photo.image)},
          {"was_given_pose", photo.was_given_pose},
          {"reconstruction", ToJson(photo.reconstruction)},
          {"why_not", photo.why_not.empty() ? Json() : Json(photo.why_not)}};
}

Json ToJson(const ImportAnswer& answer) {
  Json photos = Json::array();
  for (const ImportedPhoto& photo : answer.photos) photos.push_back(ToJson(photo));
  return {{"reconstruction", ToJson(answer.reconstruction)},
          {"points", answer.points},
          {"photos", std::move(photos)},
          {"messages", answer.messages}};
}

}  // namespace veduta
