// SPDX-License-Identifier: Apache-2.0
// Reconstructions: who is in them, and whether points, poses and what is seen of them agree.
#include <algorithm>
#include <cmath>

#include "engine/mapping/triangulation.h"
#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"

namespace veduta {
namespace {

// How far the error that a point has by its position and the poses may be from the one it records:
// 6e-8 px at most on fountain-P11 and castle-P19, the rounding of a float; merging carries points
// into another frame, which rounds them once more.
constexpr double kErrorSlackPx = 1e-4;
// Of rotations, whose norm is 1 up to rounding. Chosen by hand; not measured.
constexpr double kNormSlack = 1e-6;

struct Tally {
  uint32_t images = 0;
  uint64_t points = 0, observations = 0;
  double error_px_sum = 0;
};

class StructureChecker final {
 public:
  StructureChecker(const CheckedCity& city, Violations* violations)
      : city_(city), violations_(*violations) {}

  Status Run() {
    CheckPoses();
    VEDUTA_RETURN_IF_ERROR(
        WalkRecords<PointsEntry>(city_.snapshot, Family::kPoints, &violations_,
                                 [&](const PointsEntry& entry) { CheckBlock(entry); }));
    CheckReconstructions();
    return CheckObservations();
  }

 private:
  template <typename Text>
  void Expect(bool holds, Text&& text) {
    violations_.Expect(holds, std::forward<Text>(text));
  }

  bool IsIn(ImageId image, ReconstructionId reconstruction) const {
    const auto pose = city_.poses.find(image);
    return pose != city_.poses.end() && pose->second.reconstruction == reconstruction;
  }

  void CheckPoses() {
    for (const auto& [id, pose] : city_.poses) {
      const auto reconstruction = city_.reconstructions.find(pose.reconstruction);
      Expect(reconstruction != city_.reconstructions.end() && reconstruction->second.is_living(),
             [&, id = id, &pose = pose] {
               return NameOf(id) + " is placed in " + NameOf(pose.reconstruction) +
                      ", which does not live";
             });
      Expect(std::abs(pose.cam_from_world.rotation.norm() - 1) < kNormSlack, [&, id = id] {
        return NameOf(id) + ": the rotation of its pose is not of unit length";
      });
      Expect(city_.images.contains(id),
             [&, id = id] { return "a pose names " + NameOf(id) + ", which does not exist"; });
      ++tallies_[pose.reconstruction].images;
    }
    for (const auto& [id, image] : city_.images) {
      const bool says_placed =
          image.verdict != Verdict::kRejected && image.verdict != Verdict::kPostponed;
      Expect(says_placed == city_.poses.contains(id), [&, id = id] {
        return NameOf(id) + (says_placed ? " is said to be placed and has no pose"
                                         : " has a pose and is not said to be placed");
      });
    }
  }

  // Where the point is seen, against where its position and the poses put it.
  void CheckError(const PointRecord& point) {
    const std::optional<double> error_px = MeasureErrorPx(city_, city_.poses, point);
    Expect(!error_px || IsErrorRecorded(point, *error_px), [&] {
      return NameOf(point.id) + " is seen " + std::to_string(*error_px) +
             " px from where it should be, and its record says " + std::to_string(point.error_px);
    });
  }

  void CheckPoint(ReconstructionId reconstruction, const PointRecord& point) {
    for (const TrackElement& element : point.track) {
      Expect(IsIn(element.image, reconstruction), [&] {
        return NameOf(point.id) + " is seen in " + NameOf(element.image) + ", which is not in " +
               NameOf(reconstruction);
      });
      Expect(element.feature < city_.FeatureCount(element.image),
             [&] { return NameOf(point.id) + " is seen by a feature that does not exist"; });
      Expect(tracked_.emplace(std::make_pair(element.image, element.feature), point.id).second,
             [&] {
               return NameOf(point.id) + " shares a feature of " + NameOf(element.image) +
                      " with another point";
             });
    }
    CheckError(point);
  }

  void CheckBlock(const PointsEntry& entry) {
    const auto record = city_.reconstructions.find(entry.reconstruction);
    const bool is_current = record != city_.reconstructions.end() && record->second.is_living() &&
                            record->second.points_generation == entry.generation;
    if (!is_current) {
      Expect(city_.points_ahead.contains({entry.reconstruction, entry.generation}), [&] {
        return "points of generation " + std::to_string(entry.generation) + " of " +
               NameOf(entry.reconstruction) + " are stored, and nothing names them";
      });
      return;
    }
    Expect(IsIn(entry.block.home, entry.reconstruction), [&] {
      return NameOf(entry.block.home) + " is home to points of " + NameOf(entry.reconstruction) +
             " and not in it";
    });
    Tally& tally = tallies_[entry.reconstruction];
    for (const PointRecord& point : entry.block.points) {
      ++tally.points;
      tally.observations += point.track.size();
      tally.error_px_sum +=
          static_cast<double>(point.error_px) * static_cast<double>(point.track.size());
      CheckPoint(entry.reconstruction, point);
    }
  }

  // Where one was merged into, followed to the end, which lives or is dissolved; none where merges
  // lead nowhere or round in a circle.
  std::optional<ReconstructionId> EndOf(ReconstructionId id) const {
    ReconstructionId at = id;
    for (size_t step = 0; step <= city_.reconstructions.size(); ++step) {
      const auto found = city_.reconstructions.find(at);
      if (found == city_.reconstructions.end()) return std::nullopt;
      if (!found->second.merged_into.valid()) return at;
      at = found->second.merged_into;
    }
    return std::nullopt;
  }

  void CheckReconstruction(const ReconstructionRecord& record) {
    const std::string name = NameOf(record.id);
    const Tally& tally = tallies_[record.id];
    Expect(tally.images == record.image_count, [&] {
      return name + " has " + std::to_string(tally.images) + " images, its record says " +
             std::to_string(record.image_count);
    });
    Expect(tally.points == record.point_count, [&] {
      return name + " has " + std::to_string(tally.points) + " points, its record says " +
             std::to_string(record.point_count);
    });
    Expect(tally.observations == record.observation_count, [&] {
      return name + " has " + std::to_string(tally.observations) +
             " observations, its record says " + std::to_string(record.observation_count);
    });
    // The sum is kept up by additions and subtractions, which round.
    Expect(std::abs(tally.error_px_sum - record.reprojection_error_px_sum) <=
               1e-3 * (1 + tally.error_px_sum),
           [&] { return name + ": the sum of its errors is off"; });
    Expect(!record.is_living() || record.image_count >= 3,
           [&] { return name + " has fewer than three images"; });
    Expect(EndOf(record.id).has_value(),
           [&] { return name + " was merged into one that does not exist, or into itself"; });
    Expect(!record.is_dissolved || (!record.merged_into.valid() && record.image_count == 0),
           [&] { return name + " is said to be dissolved, and has images or was merged"; });
    Expect(record.is_living() || !record.georeference.place,
           [&] { return name + " does not live, and has a place on the earth"; });
    const Sim3& s = record.merged_from_this;
    Expect(std::abs(s.rotation.norm() - 1) < kNormSlack,
           [&] { return name + ": the rotation of its merge is not of unit length"; });
    const bool is_identity = s.scale == 1 && s.translation.isZero(0) &&
                             s.rotation.coeffs() == Eigen::Quaterniond::Identity().coeffs();
    Expect(record.merged_into.valid() || is_identity,
           [&] { return name + " was not merged, and says how it was moved into another"; });
  }

  void CheckForbiddenPose(ImageId image) {
    Expect(city_.HasFeatures(image),
           [&] { return "the pose of " + NameOf(image) + " is forbidden, and it does not exist"; });
    Expect(!city_.poses.contains(image),
           [&] { return NameOf(image) + " has a pose, and somebody has forbidden it"; });
  }

  void CheckForbidden(const ForbiddenRecord& forbidden) {
    if (forbidden.kind == ForbiddenKind::kPose) return CheckForbiddenPose(ImageId(forbidden.a));
    if (forbidden.kind == ForbiddenKind::kPair) {
      for (const ImageId id : {ImageId(forbidden.a), ImageId(forbidden.b)}) {
        Expect(city_.HasFeatures(id),
               [&] { return "a pair is forbidden with " + NameOf(id) + ", which does not exist"; });
      }
      return;
    }
    const auto a = EndOf(ReconstructionId(forbidden.a)), b = EndOf(ReconstructionId(forbidden.b));
    Expect(a && b && *a != *b, [&] {
      return NameOf(ReconstructionId(forbidden.a)) + " and " +
             NameOf(ReconstructionId(forbidden.b)) +
             " do not exist or are one, and somebody has forbidden that they are merged";
    });
  }

  // Whether somebody has forbidden that these two, or what has become of them, are merged.
  bool IsForbidden(ReconstructionId a, ReconstructionId b) const {
    return std::ranges::any_of(city_.forbidden, [&](const ForbiddenRecord& forbidden) {
      if (forbidden.kind != ForbiddenKind::kMerge) return false;
      const auto first = EndOf(ReconstructionId(forbidden.a)),
                 second = EndOf(ReconstructionId(forbidden.b));
      return (first == a && second == b) || (first == b && second == a);
    });
  }

  void CheckHypothesis(const HypothesisRecord& hypothesis) {
    const std::string merge = NameOf(hypothesis.a) + " and " + NameOf(hypothesis.b);
    for (const ReconstructionId id : {hypothesis.a, hypothesis.b}) {
      const auto found = city_.reconstructions.find(id);
      Expect(found != city_.reconstructions.end() && found->second.is_living(), [&] {
        return "a hypothesis says that " + merge + " are one, and " + NameOf(id) + " does not live";
      });
    }
    std::vector<ImageId> named = hypothesis.images;
    if (hypothesis.image.valid()) named.push_back(hypothesis.image);
    for (const ImageId image : named) {
      Expect(city_.HasFeatures(image), [&] {
        return "the hypothesis that " + merge + " are one names " + NameOf(image) +
               ", which does not exist";
      });
    }
    Expect(!IsForbidden(hypothesis.a, hypothesis.b), [&] {
      return "a hypothesis says that " + merge + " are one, and somebody has forbidden it";
    });
  }

  // That each image of a reconstruction which has submaps is in exactly one of them.
  void CheckSubmaps() {
    std::map<ImageId, SubmapId> parted;
    std::map<ReconstructionId, size_t> counts;
    for (const SubmapRecord& submap : city_.submaps) {
      const std::string name = "submap " + std::to_string(submap.id.value);
      counts[submap.reconstruction] += submap.images.size();
      for (const ImageId image : submap.images) {
        Expect(IsIn(image, submap.reconstruction), [&] {
          return name + " holds " + NameOf(image) + ", which is not in " +
                 NameOf(submap.reconstruction);
        });
        Expect(parted.emplace(image, submap.id).second,
               [&] { return name + " holds " + NameOf(image) + ", which another submap holds"; });
      }
    }
    for (const SubmapId border : city_.borders) {
      Expect(std::ranges::any_of(city_.submaps, [&](const auto& s) { return s.id == border; }),
             [&] {
               return "there is a border of submap " + std::to_string(border.value) +
                      ", and no such submap";
             });
    }
    for (const auto& [id, count] : counts) {
      const auto found = city_.reconstructions.find(id);
      Expect(found != city_.reconstructions.end() && found->second.image_count == count,
             [&, id = id] { return "not all images of " + NameOf(id) + " are in its submaps"; });
    }
  }

  void CheckGroundPoints() {
    for (const GroundPoint& point : city_.ground_points) {
      for (const GroundSighting& sighting : point.sightings) {
        Expect(city_.HasFeatures(sighting.image), [&] {
          return "surveyed point '" + point.name + "' is seen in " + NameOf(sighting.image) +
                 ", which does not exist";
        });
      }
    }
  }

  void CheckReconstructions() {
    for (const auto& [id, record] : city_.reconstructions) CheckReconstruction(record);
    for (const ForbiddenRecord& forbidden : city_.forbidden) CheckForbidden(forbidden);
    for (const HypothesisRecord& hypothesis : city_.hypotheses) CheckHypothesis(hypothesis);
    CheckSubmaps();
    CheckGroundPoints();
    std::set<ReconstructionId> named;
    for (const auto& [id, tally] : tallies_) {
      Expect(city_.reconstructions.contains(id),
             [&, id = id] { return NameOf(id) + " has images, and there is no such record"; });
    }
  }

  Status CheckObservations() {
    uint64_t observed = 0;
    VEDUTA_RETURN_IF_ERROR(WalkRecords<ObservationsEntry>(
        city_.snapshot, Family::kObservations, &violations_, [&](const ObservationsEntry& entry) {
          Expect(city_.poses.contains(entry.image) || entry.observations.empty(),
                 [&] { return NameOf(entry.image) + " observes points and has no pose"; });
          observed += entry.observations.size();
          for (const Observation& o : entry.observations) {
            const auto tracked = tracked_.find({entry.image, o.feature});
            Expect(tracked != tracked_.end() && tracked->second == o.point, [&] {
              return NameOf(entry.image) + " observes " + NameOf(o.point) +
                     " by a feature that its track does not hold";
            });
          }
        }));
    Expect(observed == tracked_.size(), [&] {
      return std::to_string(observed) + " observations and " + std::to_string(tracked_.size()) +
             " track elements";
    });
    return Status::Ok();
  }

  const CheckedCity& city_;
  Violations& violations_;
  std::map<ReconstructionId, Tally> tallies_;
  std::map<std::pair<ImageId, FeatureIndex>, PointId> tracked_;
};

}  // namespace

std::optional<double> MeasureErrorPx(const CheckedCity& city,
                                     const std::map<ImageId, PoseRecord>& poses,
                                     const PointRecord& point) {
  double sum = 0;
  for (const TrackElement& element : point.track) {
    const auto eye = city.EyeOf(element.image);
    const auto pose = poses.find(element.image);
    if (eye == nullptr || pose == poses.end()) return std::nullopt;
    if (element.feature >= eye->keypoints.size()) return std::nullopt;
    const Sighting seen{pose->second.cam_from_world, eye->camera,
                        eye->keypoints[element.feature].cast<double>()};
    sum += ReprojectionErrorPx(seen, point.position);
  }
  return sum / static_cast<double>(point.track.size());
}

bool IsErrorRecorded(const PointRecord& point, double error_px) {
  return std::abs(error_px - point.error_px) <= kErrorSlackPx;
}

Status CheckStructure(const CheckedCity& city, Violations* violations) {
  return StructureChecker(city, violations).Run();
}

}  // namespace veduta
