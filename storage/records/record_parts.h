// SPDX-License-Identifier: Apache-2.0
#pragma once
// What several records have in common: rules that a field keeps to, text, transforms, single
// numbers.
//
// Each record has a file of its own with its keys, its codec and its rules:
//   Check   kInvalidArgument naming the field and its value. Linear in the record's size.
//   Encode  checks, then gives the value; equal records give equal bytes. What the key says is
//           not in the value.
//   Decode  kCorruption when the value is no message of its kind, is cut short, or breaks a
//           rule; the record is then in an unspecified state. Allocates no more than a small
//           multiple of the value's size.
// So a value that could not be read back is never stored, and a damaged one is never handed out.
// All are pure and thread-safe.
//
// A new record is a file here, a struct in schema.capnp, its family's line in families.cc and a
// section of FORMAT.md.

#include <capnp/blob.h>
#include <capnp/common.h>

#include <cstdint>
#include <initializer_list>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

#include "storage/base/ids.h"
#include "storage/base/status.h"
#include "storage/base/transform.h"
#include "storage/records/schema.capnp.h"

namespace veduta {

// What Check has found, for who reads: damage.
Status Damaged(const Status& check);
Status BadRows(std::string_view column);

// `field` is `value`, but must be `rule`.
Status Broken(std::string_view field, const std::string& value, std::string_view rule);
template <typename Number>
requires std::is_arithmetic_v<Number> Status Broken(std::string_view field, Number value,
                                                    std::string_view rule) {
  return Broken(field, std::to_string(value), rule);
}

template <typename Tag, typename Integer>
Status CheckId(std::string_view field, StrongId<Tag, Integer> id) {
  return id.valid() ? Status::Ok() : Broken(field, 0, "a valid id");
}
Status CheckFinite(std::initializer_list<std::pair<std::string_view, double>> numbers);
bool IsRigid(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation);
Status CheckTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation);

template <typename T, typename Less>
bool StrictlyAscending(std::span<const T> rows, Less less) {
  for (size_t i = 1; i < rows.size(); ++i) {
    if (!less(rows[i - 1], rows[i])) return false;
  }
  return true;
}

// Text may hold any bytes: names of files need not be UTF-8.
capnp::Text::Reader AsText(const std::string& text);
std::string FromText(capnp::Text::Reader text);

void Fill(schema::Rigid::Builder to, const Eigen::Quaterniond& rotation,
          const Eigen::Vector3d& translation);
void Read(schema::Rigid::Reader from, Eigen::Quaterniond* rotation, Eigen::Vector3d* translation);

// A value that is one number, little-endian.
std::string EncodeU32(uint32_t value);
Status DecodeU32(std::string_view value, uint32_t* number);

}  // namespace veduta
