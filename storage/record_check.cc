// SPDX-License-Identifier: Apache-2.0
#include "storage/record_check.h"

#include <cmath>
#include <functional>
#include <initializer_list>
#include <string>
#include <type_traits>
#include <utility>

namespace veduta {
namespace {

// A rotation further from unit length than any sum of rounding errors could bring it.
constexpr double kUnitNormSlack = 1e-3;

Status Broken(std::string_view field, const std::string& value, std::string_view rule) {
  return Status::InvalidArgument(std::string(field) + " is " + value + ", but must be " +
                                 std::string(rule));
}

template <typename Number>
requires std::is_arithmetic_v<Number> Status Broken(std::string_view field, Number value,
                                                    std::string_view rule) {
  return Broken(field, std::to_string(value), rule);
}

template <typename Tag, typename Integer>
Status CheckId(std::string_view field, StrongId<Tag, Integer> id) {
  return id.valid() ? Status::Ok() : Broken(field, 0, "a valid id");
}

Status CheckFinite(std::initializer_list<std::pair<std::string_view, double>> numbers) {
  for (const auto& [field, value] : numbers) {
    if (!std::isfinite(value)) return Broken(field, value, "finite");
  }
  return Status::Ok();
}

Status CheckTransform(const Eigen::Quaterniond& rotation, const Eigen::Vector3d& translation) {
  const double norm = rotation.norm();
  if (!(std::abs(norm - 1.0) < kUnitNormSlack)) return Broken("norm of the rotation", norm, "1");
  if (!translation.allFinite()) return Broken("translation", translation.sum(), "finite");
  return Status::Ok();
}

// No default in these switches: the compiler names an enumerator that was forgotten.
bool Known(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPlaced:
    case Verdict::kMerged:
    case Verdict::kFounded:
    case Verdict::kPostponed:
    case Verdict::kRejected:
      return true;
  }
  return false;
}

bool Known(Reason reason) {
  switch (reason) {
    case Reason::kNone:
    case Reason::kRegistered:
    case Reason::kJoinedReconstructions:
    case Reason::kGoodTriple:
    case Reason::kPropagated:
    case Reason::kNoCandidates:
    case Reason::kNoVerifiedNeighbor:
    case Reason::kTooFewStructurePoints:
    case Reason::kResectionFailed:
    case Reason::kNoGoodTriple:
    case Reason::kContradictsNeighbors:
    case Reason::kTooFewFeatures:
    case Reason::kUnreadable:
    case Reason::kUnsupportedFormat:
    case Reason::kTooLarge:
    case Reason::kWrongSize:
    case Reason::kNoTexture:
    case Reason::kEmptyFile:
    case Reason::kNameTaken:
      return true;
  }
  return false;
}

bool Known(PairGeometry geometry) {
  switch (geometry) {
    case PairGeometry::kGeneral:
    case PairGeometry::kPlanar:
    case PairGeometry::kRotation:
      return true;
  }
  return false;
}

template <typename T, typename Less>
bool StrictlyAscending(std::span<const T> rows, Less less) {
  for (size_t i = 1; i < rows.size(); ++i) {
    if (!less(rows[i - 1], rows[i])) return false;
  }
  return true;
}

Status CheckPoint(const PointRecord& point, ImageId home, uint32_t next_ordinal) {
  if (point.id.home != home) return Broken("point's home", point.id.home.value, "the block's");
  if (point.id.ordinal == 0 || point.id.ordinal >= next_ordinal) {
    return Broken("point's ordinal", point.id.ordinal,
                  "from 1 up and below next_ordinal " + std::to_string(next_ordinal));
  }
  if (!point.position.allFinite())
    return Broken("point's position", point.position.sum(), "finite");
  if (!std::isfinite(point.error_px)) return Broken("point's error_px", point.error_px, "finite");
  if (point.track.size() < 2)
    return Broken("point's track length", point.track.size(), "2 or more");
  for (size_t i = 0; i < point.track.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(CheckId("image in a track", point.track[i].image));
    if (i > 0 && point.track[i].image <= point.track[i - 1].image) {
      return Broken("image in a track", point.track[i].image.value, "ascending");
    }
  }
  return Status::Ok();
}

}  // namespace

Status Check(const DatabaseState& state) {
  if (state.next_image == 0) return Broken("next_image", 0, "1 or more");
  if (state.next_camera == 0) return Broken("next_camera", 0, "1 or more");
  if (state.next_reconstruction == 0) return Broken("next_reconstruction", 0, "1 or more");
  for (const ImageId image : state.pending_propagation) {
    VEDUTA_RETURN_IF_ERROR(CheckId("image in pending_propagation", image));
  }
  return Status::Ok();
}

Status Check(const CameraRecord& camera) {
  VEDUTA_RETURN_IF_ERROR(CheckId("camera", camera.id));
  const CameraModel& m = camera.model;
  return CheckFinite({{"fx", m.fx},
                      {"fy", m.fy},
                      {"cx", m.cx},
                      {"cy", m.cy},
                      {"k1", m.k1},
                      {"k2", m.k2},
                      {"u0", m.u0},
                      {"v0", m.v0}});
}

Status Check(const ImageRecord& image) {
  VEDUTA_RETURN_IF_ERROR(CheckId("image", image.id));
  if (!Known(image.verdict))
    return Broken("verdict", static_cast<uint64_t>(image.verdict), "a known one");
  if (!Known(image.reason))
    return Broken("reason", static_cast<uint64_t>(image.reason), "a known one");
  return Status::Ok();
}

Status Check(const Features& features) {
  if (features.descriptors.size() != features.keypoints.size() * kDescriptorSize) {
    return Broken(
        "size of the descriptors", features.descriptors.size(),
        "128 times the number of keypoints, " + std::to_string(features.keypoints.size()));
  }
  for (const Keypoint& k : features.keypoints) {
    // One sum instead of five tests: it is finite only if all are (they are far from overflowing a
    // double).
    const double sum = double{k.x_px} + double{k.y_px} + double{k.scale_px} + double{k.angle_deg} +
                       double{k.response};
    if (!std::isfinite(sum)) return Broken("keypoint", sum, "finite");
  }
  return Status::Ok();
}

Status Check(const PairRecord& pair) {
  VEDUTA_RETURN_IF_ERROR(CheckId("pair's a", pair.a));
  if (!(pair.a < pair.b))
    return Broken("pair's b", pair.b.value, "greater than a, " + std::to_string(pair.a.value));
  if (!Known(pair.geometry))
    return Broken("pair's geometry", static_cast<uint64_t>(pair.geometry), "a known one");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(pair.b_from_a.rotation, pair.b_from_a.translation));
  const auto less = [](const FeatureMatch& x, const FeatureMatch& y) { return x.a < y.a; };
  if (!StrictlyAscending(std::span<const FeatureMatch>(pair.matches), less)) {
    return Broken("order of the matches", "wrong", "strictly ascending in a");
  }
  return Status::Ok();
}

Status Check(const PairNeighbor& neighbor) {
  VEDUTA_RETURN_IF_ERROR(CheckId("neighbour", neighbor.image));
  if (Known(neighbor.geometry)) return Status::Ok();
  return Broken("pair's geometry", static_cast<uint64_t>(neighbor.geometry), "a known one");
}

Status Check(const ReconstructionRecord& reconstruction) {
  VEDUTA_RETURN_IF_ERROR(CheckId("reconstruction", reconstruction.id));
  if (reconstruction.merged_into == reconstruction.id) {
    return Broken("merged_into", reconstruction.id.value, "another reconstruction");
  }
  const Sim3& s = reconstruction.merged_from_this;
  if (!(std::isfinite(s.scale) && s.scale > 0))
    return Broken("scale of merged_from_this", s.scale, "finite and above 0");
  VEDUTA_RETURN_IF_ERROR(CheckTransform(s.rotation, s.translation));
  return CheckFinite({{"reprojection_error_px_sum", reconstruction.reprojection_error_px_sum}});
}

Status Check(const PoseRecord& pose) {
  VEDUTA_RETURN_IF_ERROR(CheckId("pose's image", pose.image));
  VEDUTA_RETURN_IF_ERROR(CheckId("pose's reconstruction", pose.reconstruction));
  return CheckTransform(pose.cam_from_world.rotation, pose.cam_from_world.translation);
}

Status Check(std::span<const Observation> observations) {
  for (size_t i = 0; i < observations.size(); ++i) {
    const Observation& o = observations[i];
    VEDUTA_RETURN_IF_ERROR(CheckId("home of an observed point", o.point.home));
    if (o.point.ordinal == 0) return Broken("ordinal of an observed point", 0, "1 or more");
    if (i > 0 && o.feature <= observations[i - 1].feature)
      return Broken("observed feature", o.feature, "ascending");
  }
  return Status::Ok();
}

Status Check(const PointBlock& block) {
  VEDUTA_RETURN_IF_ERROR(CheckId("block's home", block.home));
  if (block.next_ordinal == 0) return Broken("next_ordinal", 0, "1 or more");
  for (size_t i = 0; i < block.points.size(); ++i) {
    VEDUTA_RETURN_IF_ERROR(CheckPoint(block.points[i], block.home, block.next_ordinal));
    if (i > 0 && block.points[i].id.ordinal <= block.points[i - 1].id.ordinal) {
      return Broken("point's ordinal", block.points[i].id.ordinal, "ascending");
    }
  }
  return Status::Ok();
}

Status Check(const JournalRecord& journal) {
  if (journal.sequence == 0) return Broken("journal's sequence", 0, "1 or more");
  return Status::Ok();
}

Status CheckWords(std::span<const WordId> words) {
  if (StrictlyAscending(words, std::less<>())) return Status::Ok();
  return Broken("order of the words", "wrong", "strictly ascending");
}

Status CheckImages(std::span<const ImageId> images) {
  if (!images.empty()) VEDUTA_RETURN_IF_ERROR(CheckId("image", images.front()));
  if (StrictlyAscending(images, std::less<>())) return Status::Ok();
  return Broken("order of the images", "wrong", "strictly ascending");
}

}  // namespace veduta
