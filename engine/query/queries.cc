// SPDX-License-Identifier: Apache-2.0
#include "engine/query/queries.h"

#include <algorithm>
#include <charconv>

#include "engine/matching/mutual_matcher.h"

namespace veduta {

Result<CityStatus> Queries::Status() const {
  CityStatus status;
  VEDUTA_RETURN_IF_ERROR(snapshot_->ScanImages([&](const ImageRecord& image) {
    ++status.images;
    status.rejected += image.verdict == Verdict::kRejected;
    status.postponed += image.verdict == Verdict::kPostponed;
    return true;
  }));
  status.placed = status.images - status.rejected - status.postponed;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras, snapshot_->ListCameras());
  status.cameras = cameras.size();
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot_->GetState());
  status.backlog = state.pending_propagation.size();
  status.vocabulary_generation = state.vocabulary_generation;
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ReconstructionRecord> all,
                          snapshot_->ListReconstructions());
  for (const ReconstructionRecord& record : all) {
    if (!record.merged_into.valid()) status.reconstructions.push_back(record);
  }
  std::stable_sort(status.reconstructions.begin(), status.reconstructions.end(),
                   [](const auto& a, const auto& b) { return a.image_count > b.image_count; });
  return status;
}

Result<ImageRecord> Queries::FindImage(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> id, snapshot_->FindImageByName(name));
  if (id) return snapshot_->GetImage(*id);
  uint32_t number = 0;
  if (name.size() > 1 && name[0] == '#') {
    const auto [end, error] = std::from_chars(name.data() + 1, name.data() + name.size(), number);
    if (error == std::errc() && end == name.data() + name.size())
      return snapshot_->GetImage(ImageId(number));
  }
  return veduta::Status::NotFound("there is no image '" + name + "' in the database");
}

Result<std::vector<PairNeighbor>> Queries::Neighbors(ImageId image) const {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<PairNeighbor> neighbors, snapshot_->ListNeighbors(image));
  std::stable_sort(
      neighbors.begin(), neighbors.end(),
      [](const PairNeighbor& a, const PairNeighbor& b) { return a.match_count > b.match_count; });
  return neighbors;
}

Result<std::vector<RankedImage>> Queries::RankFeatures(const Features& features, uint32_t count_max,
                                                       ThreadPool* pool) const {
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words, retrieval_->Words(*snapshot_, features));
  if (!words.empty()) return retrieval_->RankWords(*snapshot_, words, count_max);
  VEDUTA_ASSIGN_OR_RETURN(const PackedDescriptors packed,
                          PackedDescriptors::Pack(features, features_->matched_count_max()));
  VEDUTA_ASSIGN_OR_RETURN(std::vector<RankedImage> ranked,
                          retrieval_->Candidates(*snapshot_, features));
  std::vector<veduta::Status> failures(ranked.size());
  MatchOptions options;
  options.ratio_max = 0.85;
  pool->ParallelFor(ranked.size(), [&](size_t i) {
    const auto stored = features_->Get(*snapshot_, ranked[i].image);
    if (!stored.ok()) {
      failures[i] = stored.status();
      return;
    }
    const size_t matches = MatchMutual(packed, (*stored)->packed, options).size();
    ranked[i].score = static_cast<double>(matches) / std::max<double>(1, packed.count());
  });
  for (const veduta::Status& failure : failures) VEDUTA_RETURN_IF_ERROR(failure);
  std::stable_sort(ranked.begin(), ranked.end(), [](const RankedImage& a, const RankedImage& b) {
    return a.score != b.score ? a.score > b.score : a.image < b.image;
  });
  if (ranked.size() > count_max) ranked.resize(count_max);
  return ranked;
}

}  // namespace veduta
