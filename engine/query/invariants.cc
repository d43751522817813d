// SPDX-License-Identifier: Apache-2.0
#include "engine/query/invariants.h"

#include <cmath>
#include <map>
#include <set>

#include "storage/record_counts.h"

namespace veduta {
namespace {

std::string Name(ImageId id) {
  return "image " + std::to_string(id.value);
}
std::string Name(PointId id) {
  return "point " + std::to_string(id.home.value) + "/" + std::to_string(id.ordinal);
}
std::string Name(ReconstructionId id) {
  return "reconstruction " + std::to_string(id.value);
}

std::string Text(const DatabaseCounts& counts) {
  return std::to_string(counts.images) + " images (" + std::to_string(counts.placed) + " placed, " +
         std::to_string(counts.postponed) + " postponed, " + std::to_string(counts.rejected) +
         " rejected) and " + std::to_string(counts.cameras) + " cameras";
}

class Checker {
 public:
  Checker(const Snapshot& snapshot, size_t count_max)
      : snapshot_(snapshot), count_max_(count_max) {}

  Status Run() {
    VEDUTA_ASSIGN_OR_RETURN(state_, snapshot_.GetState());
    VEDUTA_RETURN_IF_ERROR(LoadImages());
    VEDUTA_RETURN_IF_ERROR(CheckBlobs());
    VEDUTA_RETURN_IF_ERROR(CheckPairs());
    VEDUTA_RETURN_IF_ERROR(CheckPoses());
    VEDUTA_RETURN_IF_ERROR(CheckPoints());
    VEDUTA_RETURN_IF_ERROR(CheckVocabulary());
    return CheckJournal();
  }
  std::vector<std::string> Take() { return std::move(violations_); }

 private:
  void Expect(bool holds, const std::string& violation) {
    if (!holds && violations_.size() < count_max_) violations_.push_back(violation);
  }

  // The counts that `status` answers by, against the records.
  Status CheckCounts() {
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseCounts counts, snapshot_.GetCounts());
    VEDUTA_ASSIGN_OR_RETURN(const DatabaseCounts found, CountRecords(snapshot_));
    Expect(counts == found, "the state counts " + Text(counts) + ", and there are " + Text(found));
    return Status::Ok();
  }

  Status LoadImages() {
    std::set<std::string> names;
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanImages([&](const ImageRecord& image) {
      images_[image.id] = image;
      Expect(names.insert(image.name).second,
             Name(image.id) + " shares its name " + image.name + " with another");
      Expect(image.id.value < state_.next_image,
             Name(image.id) + " is not below the next id " + std::to_string(state_.next_image));
      return true;
    }));
    VEDUTA_RETURN_IF_ERROR(CheckCounts());
    uint32_t retrievable = 0;
    for (const auto& [id, image] : images_) {
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> by_name,
                              snapshot_.FindImageByName(image.name));
      Expect(by_name == id, Name(id) + " is not found by its name " + image.name);
      if (image.verdict == Verdict::kRejected) continue;
      ++retrievable;
      VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> by_photo,
                              snapshot_.FindImageByPhoto(image.photo));
      Expect(by_photo == id, Name(id) + " is not found by its photo's hash");
      const Result<CameraRecord> camera = snapshot_.GetCamera(image.camera);
      Expect(camera.ok(), Name(id) + " has no camera: " + camera.status().message());
    }
    Expect(retrievable == state_.retrievable_image_count,
           std::to_string(retrievable) + " images have features, the state says " +
               std::to_string(state_.retrievable_image_count));
    return Status::Ok();
  }

  Status CheckBlobs() {
    std::set<ContentHash> wanted, stored_photos, stored_features;
    for (const auto& [id, image] : images_) {
      if (image.verdict == Verdict::kRejected) continue;
      wanted.insert(image.photo);
      const Result<StoredBytes> photo = snapshot_.GetPhoto(image.photo);
      Expect(photo.ok(), Name(id) + ": " + photo.status().message());
      if (photo.ok())
        Expect(HashContent(photo->bytes()) == image.photo,
               Name(id) + ": the stored photo has another hash");
      const Result<Features> stored = snapshot_.GetFeatures(image.photo);
      Expect(stored.ok(), Name(id) + ": " + stored.status().message());
      if (stored.ok()) {
        Expect(stored->size() == image.feature_count,
               Name(id) + " has " + std::to_string(stored->size()) + " features, not " +
                   std::to_string(image.feature_count));
      }
    }
    const auto collect = [](std::set<ContentHash>* keys) {
      return [keys](const ContentHash& hash) { return keys->insert(hash).second; };
    };
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPhotoKeys(collect(&stored_photos)));
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanFeatureKeys(collect(&stored_features)));
    Expect(stored_photos == stored_features,
           "some photo is stored without its features, or the other way round");
    for (const ContentHash& hash : stored_photos) {
      if (wanted.contains(hash)) continue;
      VEDUTA_ASSIGN_OR_RETURN(const bool is_coming, snapshot_.IsWrittenAhead(hash));
      Expect(is_coming, "photo " + hash.Hex() + " belongs to no image");
    }
    return Status::Ok();
  }

  uint32_t FeatureCount(ImageId id) const {
    const auto it = images_.find(id);
    return it == images_.end() || it->second.verdict == Verdict::kRejected
               ? 0
               : it->second.feature_count;
  }

  Status CheckPairs() {
    for (const auto& [id, image] : images_) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> neighbors,
                              snapshot_.ListNeighbors(id));
      for (const PairNeighbor& neighbor : neighbors) {
        const std::string pair_name =
            "pair " + std::to_string(id.value) + "-" + std::to_string(neighbor.image.value);
        Expect(FeatureCount(neighbor.image) > 0,
               pair_name + " names an image that has no features");
        VEDUTA_ASSIGN_OR_RETURN(const PairRecord pair, snapshot_.GetPair(id, neighbor.image));
        Expect(pair.matches.size() == neighbor.match_count,
               pair_name + ": the two directions disagree");
        if (neighbor.image < id) continue;
        for (const FeatureMatch& m : pair.matches) {
          Expect(m.a < FeatureCount(pair.a) && m.b < FeatureCount(pair.b),
                 pair_name + " matches a feature that does not exist");
        }
        VEDUTA_ASSIGN_OR_RETURN(const std::vector<PairNeighbor> back,
                                snapshot_.ListNeighbors(neighbor.image));
        bool mirrored = false;
        for (const PairNeighbor& b : back) mirrored |= b.image == id;
        Expect(mirrored, pair_name + " is known in one direction only");
      }
    }
    return Status::Ok();
  }

  Status CheckPoses() {
    VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> all,
                            snapshot_.ListReconstructions());
    for (const ReconstructionRecord& record : all) reconstructions_[record.id] = record;
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPoses([&](const PoseRecord& pose) {
      const auto reconstruction = reconstructions_.find(pose.reconstruction);
      Expect(reconstruction != reconstructions_.end() && reconstruction->second.is_living(),
             Name(pose.image) + " is placed in " + Name(pose.reconstruction) +
                 ", which does not live");
      poses_[pose.image] = pose;
      ++members_[pose.reconstruction];
      return true;
    }));
    for (const auto& [id, image] : images_) {
      const bool says_placed =
          image.verdict != Verdict::kRejected && image.verdict != Verdict::kPostponed;
      Expect(says_placed == poses_.contains(id),
             Name(id) + (says_placed ? " is said to be placed and has no pose"
                                     : " has a pose and is not said to be placed"));
    }
    for (const auto& [id, pose] : poses_)
      Expect(images_.contains(id), "a pose names " + Name(id) + ", which does not exist");
    for (const auto& [id, record] : reconstructions_) {
      Expect(members_[id] == record.image_count, Name(id) + " has " + std::to_string(members_[id]) +
                                                     " images, its record says " +
                                                     std::to_string(record.image_count));
      Expect(!record.is_living() || record.image_count >= 3,
             Name(id) + " has fewer than three images");
      Expect(record.is_living() || reconstructions_.contains(record.merged_into),
             Name(id) + " was merged into one that does not exist");
    }
    return Status::Ok();
  }

  void CheckPoint(const ReconstructionRecord& record, const PointRecord& point) {
    Expect(point.track.size() >= 2, Name(point.id) + " is seen in fewer than two images");
    for (size_t i = 0; i < point.track.size(); ++i) {
      const TrackElement& element = point.track[i];
      const auto pose = poses_.find(element.image);
      Expect(i == 0 || point.track[i - 1].image < element.image,
             Name(point.id) + ": its track is not in order");
      Expect(pose != poses_.end() && pose->second.reconstruction == record.id,
             Name(point.id) + " is seen in " + Name(element.image) + ", which is not in " +
                 Name(record.id));
      Expect(element.feature < FeatureCount(element.image),
             Name(point.id) + " is seen by a feature that does not exist");
      Expect(
          tracked_.emplace(std::make_pair(element.image, element.feature), point.id).second,
          Name(point.id) + " shares a feature of " + Name(element.image) + " with another point");
    }
  }

  Status CheckPoints() {
    for (const auto& [id, record] : reconstructions_) {
      uint64_t points = 0, observations = 0;
      double error_sum = 0;
      VEDUTA_RETURN_IF_ERROR(
          snapshot_.ScanPointBlocks(id, record.points_generation, [&](const PointBlock& block) {
            const auto home = poses_.find(block.home);
            Expect(home != poses_.end() && home->second.reconstruction == id,
                   Name(block.home) + " is home to points of " + Name(id) + " and not in it");
            for (const PointRecord& point : block.points) {
              ++points;
              observations += point.track.size();
              error_sum +=
                  static_cast<double>(point.error_px) * static_cast<double>(point.track.size());
              CheckPoint(record, point);
            }
            return true;
          }));
      Expect(points == record.point_count, Name(id) + " has " + std::to_string(points) +
                                               " points, its record says " +
                                               std::to_string(record.point_count));
      Expect(observations == record.observation_count,
             Name(id) + " has " + std::to_string(observations) + " observations, its record says " +
                 std::to_string(record.observation_count));
      Expect(std::abs(error_sum - record.reprojection_error_px_sum) <= 1e-3 * (1 + error_sum),
             Name(id) + ": the sum of its errors is off");
    }
    uint64_t observed = 0;
    for (const auto& [id, image] : images_) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<Observation> observations,
                              snapshot_.GetObservations(id));
      observed += observations.size();
      for (const Observation& o : observations) {
        const auto tracked = tracked_.find({id, o.feature});
        Expect(
            tracked != tracked_.end() && tracked->second == o.point,
            Name(id) + " observes " + Name(o.point) + " by a feature that its track does not hold");
      }
    }
    Expect(observed == tracked_.size(), std::to_string(observed) + " observations and " +
                                            std::to_string(tracked_.size()) + " track elements");
    return Status::Ok();
  }

  Status CheckVocabulary() {
    const uint32_t generation = state_.vocabulary_generation;
    if (generation == 0) return Status::Ok();
    const Result<StoredBytes> tree = snapshot_.GetVocabulary(generation);
    Expect(tree.ok(), "vocabulary: " + tree.status().message());
    std::map<WordId, std::set<ImageId>> expected;
    for (const auto& [id, image] : images_) {
      if (image.verdict == Verdict::kRejected) continue;
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words, snapshot_.GetWords(generation, id));
      Expect(!words.empty(), Name(id) + " has no words");
      for (const WordId word : words) expected[word].insert(id);
    }
    uint64_t lists = 0;
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanPostings(generation, [&](WordId word,
                                                                  std::span<const ImageId> images) {
      ++lists;
      const auto list = expected.find(word);
      Expect(list != expected.end() && std::vector(list->second.begin(), list->second.end()) ==
                                           std::vector(images.begin(), images.end()),
             "the postings of word " + std::to_string(word) + " are not the images that have it");
      return true;
    }));
    Expect(lists == expected.size(), std::to_string(lists) + " posting lists for " +
                                         std::to_string(expected.size()) + " words in use");
    return Status::Ok();
  }

  Status CheckJournal() {
    uint64_t expected = 1;
    VEDUTA_RETURN_IF_ERROR(snapshot_.ScanJournal(1, [&](const JournalRecord& record) {
      Expect(record.sequence == expected, "the journal lacks entry " + std::to_string(expected));
      expected = record.sequence + 1;
      return true;
    }));
    Expect(expected == state_.next_journal,
           "the journal ends before entry " + std::to_string(state_.next_journal));
    return Status::Ok();
  }

  const Snapshot& snapshot_;
  const size_t count_max_;
  DatabaseState state_;
  std::map<ImageId, ImageRecord> images_;
  std::map<ReconstructionId, ReconstructionRecord> reconstructions_;
  std::map<ReconstructionId, uint32_t> members_;
  std::map<ImageId, PoseRecord> poses_;
  std::map<std::pair<ImageId, FeatureIndex>, PointId> tracked_;
  std::vector<std::string> violations_;
};

}  // namespace

Result<std::vector<std::string>> FindViolations(const Snapshot& snapshot, size_t count_max) {
  Checker checker(snapshot, count_max);
  const Status run = checker.Run();
  std::vector<std::string> violations = checker.Take();
  // A value that cannot be read ends the walk; it is a violation like the others.
  if (run.code() == StatusCode::kCorruption || run.code() == StatusCode::kNotFound) {
    violations.push_back(run.message());
  } else if (!run.ok()) {
    return run;
  }
  return violations;
}

}  // namespace veduta
