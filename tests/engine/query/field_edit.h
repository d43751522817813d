// SPDX-License-Identifier: Apache-2.0
#pragma once
// A change of one field of a record to another value that looks as legal as the first.

#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "engine/query/stored_records.h"

namespace veduta {

struct FieldDamage {
  std::string field;
  // Another value for the key; none where the record has no such field, or cannot be changed so.
  std::function<std::optional<std::string>(const std::string& key, const std::string& value)> apply;
};

template <typename Record>
struct FieldEdit {
  const char* field;
  std::function<void(Record*)> edit;
};

// `edits` of a record that `read` decodes and `write` encodes.
template <typename Record, typename Read, typename Write>
std::vector<FieldDamage> DamagesOf(const std::vector<FieldEdit<Record>>& edits, Read read,
                                   Write write) {
  std::vector<FieldDamage> damages;
  for (const FieldEdit<Record>& edit : edits) {
    damages.push_back({edit.field,
                       [edit, read, write](const std::string& key,
                                           const std::string& value) -> std::optional<std::string> {
                         Record record;
                         if (!read(key, value, &record).ok()) return std::nullopt;
                         edit.edit(&record);
                         Result<std::string> encoded = write(record);
                         if (!encoded.ok() || *encoded == value) return std::nullopt;
                         return std::move(*encoded);
                       }});
  }
  return damages;
}

template <typename Record>
std::vector<FieldDamage> DamagesOf(const std::vector<FieldEdit<Record>>& edits) {
  const auto read = [](const std::string& key, const std::string& value, Record* record) {
    return ReadStored(key, value, record);
  };
  return DamagesOf(edits, read, [](const Record& record) { return Encode(record); });
}

}  // namespace veduta
