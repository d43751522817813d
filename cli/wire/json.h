// SPDX-License-Identifier: Apache-2.0
#pragma once
// What the JSON shapes of docs/json.md are made with. One function ToJson stands for one struct of
// the door; the keys keep the order in which the function names them.

#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

using Json = nlohmann::ordered_json;

// The value as text on one line, without the line's end. A byte that is not UTF-8 becomes U+FFFD:
// names come from file systems, which do not promise UTF-8, and JSON has to be UTF-8.
std::string JsonLine(const Json& value);

// The number; null for an id that is not valid.
template <typename Tag, typename Integer>
Json ToJson(StrongId<Tag, Integer> id) {
  return id.valid() ? Json(id.value) : Json(nullptr);
}

// An array of what ToJson makes of each value; [] where there is none.
template <typename T>
Json ToJson(const std::vector<T>& values) {
  Json list = Json::array();
  for (const T& value : values) list.push_back(ToJson(value));
  return list;
}

// Null where there is no value.
template <typename T>
Json ToJson(const std::optional<T>& value) {
  return value ? ToJson(*value) : Json(nullptr);
}

}  // namespace veduta
