// SPDX-License-Identifier: Apache-2.0
#pragma once
// Reads one record of which it is not known whether it is there.

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "storage/value_reader.h"

namespace veduta {

// The record under the key, decoded into `record`, which has what the key says; nothing where the
// key is not there. Failures name family and key. Costs one read.
template <typename Record>
Result<std::optional<Record>> FindRecord(const ValueReader& reader, Family family,
                                         const std::string& key, Record record) {
  VEDUTA_ASSIGN_OR_RETURN(const bool found, reader.Read(family, key, [&](std::string_view value) {
    return Decode(value, &record);
  }));
  return found ? std::optional<Record>(std::move(record)) : std::nullopt;
}

// All entries of family `meta` with this prefix, in the order of their keys.
template <typename Record>
Result<std::vector<Record>> ListFacts(const ValueReader& reader, std::string_view prefix,
                                      Status (*parse_key)(std::string_view, Record*)) {
  std::vector<Record> all;
  VEDUTA_RETURN_IF_ERROR(reader.Scan(
      Family::kMeta, prefix, "", [&](std::string_view key, std::string_view value, bool* /*more*/) {
        Record& record = all.emplace_back();
        VEDUTA_RETURN_IF_ERROR(parse_key(key, &record));
        return Decode(value, &record);
      }));
  return all;
}

}  // namespace veduta
