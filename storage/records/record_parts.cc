// SPDX-License-Identifier: Apache-2.0
#include "storage/records/record_parts.h"

#include <cmath>
#include <cstring>

namespace veduta {
namespace {

// How far from unit length a rotation may be. Chosen by hand, far above what rounding can add up
// to; not measured.
constexpr double kUnitNormSlack = 1e-3;

}  // namespace

Status Damaged(const Status& check) {
  return check.ok() ? check : Status::Corruption(check.message());
}

Status BadRows(std::string_view column) {
  return Status::Corruption(std::string(column) + " has a broken row");
}

Status Broken(std::string_view field, const std::string& value, std::string_view rule) {
  return Status::InvalidArgument(std::string(field) + " is " + value + ", but must be " +
                                 std::string(rule));
}

Status CheckFinite(std::initializer_list<std::pair<std::string_view, double>> numbers) {
  for (const auto& [field, value] : numbers) {
    if (!std::isfinite(value)) return Broken(field, value, "finite");
  }
  return Status::Ok();
}

bool IsRigid(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  return std::abs(rotation.norm() - 1.0) < kUnitNormSlack && translation.allFinite();
}

Status CheckTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  if (IsRigid(rotation, translation)) return Status::Ok();
  if (!translation.allFinite()) return Broken("translation", translation.sum(), "finite");
  return Broken("norm of the rotation", rotation.norm(), "1");
}

// Text may hold any bytes: names of files need not be UTF-8.
capnp::Text::Reader AsText(const std::string& text) {
  return {text.c_str(), text.size()};
}

std::string FromText(capnp::Text::Reader text) {
  return {text.begin(), text.size()};
}

void Fill(schema::Rigid::Builder to, const Eigen::Quaterniond& rotation,
          const Eigen::Vector3d& translation) {
  to.setQw(rotation.w());
  to.setQx(rotation.x());
  to.setQy(rotation.y());
  to.setQz(rotation.z());
  to.setTx(translation.x());
  to.setTy(translation.y());
  to.setTz(translation.z());
}

void Read(schema::Rigid::Reader from, Eigen::Quaterniond* rotation, Eigen::Vector3d* translation) {
  *rotation = Eigen::Quaterniond(from.getQw(), from.getQx(), from.getQy(), from.getQz());
  *translation = Eigen::Vector3d(from.getTx(), from.getTy(), from.getTz());
}

std::string EncodeU32(uint32_t value) {
  return {reinterpret_cast<const char*>(&value), sizeof(value)};
}

Status DecodeU32(std::string_view value, uint32_t* number) {
  if (value.size() != sizeof(*number))
    return Status::Corruption("a number of " + std::to_string(value.size()) + " bytes");
  std::memcpy(number, value.data(), sizeof(*number));
  return Status::Ok();
}

}  // namespace veduta
