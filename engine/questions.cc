// SPDX-License-Identifier: Apache-2.0
#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <utility>

#include "engine/parts.h"
#include "engine/query/city_answers.h"
#include "engine/query/digest.h"
#include "engine/query/earth_answers.h"
#include "engine/query/find_image.h"
#include "engine/query/living.h"
#include "engine/query/pose_uncertainty.h"
#include "engine/query/ranking.h"

namespace veduta {

Questions::Questions(std::unique_ptr<View> view) : view_(std::move(view)) {}
Questions::~Questions() = default;
Questions::Questions(Questions&&) noexcept = default;
Questions& Questions::operator=(Questions&&) noexcept = default;

uint64_t Questions::snapshot() const {
  return view_->snapshot->sequence();
}

namespace {

StorageAnswer ToAnswer(const DatabaseStatistics& statistics) {
  return {.log_bytes = statistics.log_bytes,
          .flush_bytes = statistics.flush_bytes,
          .compaction_bytes = statistics.compaction_bytes,
          .blob_bytes = statistics.blob_bytes,
          .blob_copied_bytes = statistics.blob_copied_bytes,
          .cache_hits = statistics.cache_hits,
          .cache_misses = statistics.cache_misses};
}

}  // namespace

Status Questions::View::RefuseUnseen(ReconstructionId id) const {
  VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility().Sees(id));
  if (sees) return veduta::Status::Ok();
  return veduta::Status::NotFound("there is no reconstruction " + std::to_string(id.value));
}

Result<StatusAnswer> Questions::Status() const {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseSizes sizes, view_->parts->database->GetSizes());
  VEDUTA_ASSIGN_OR_RETURN(StatusAnswer answer,
                          StatusOf(*view_->snapshot, sizes, &view_->caches->unsure, view_->sight));
  answer.snapshot = snapshot();
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseStatistics statistics,
                          view_->parts->database->GetStatistics());
  answer.storage = ToAnswer(statistics);
  return answer;
}

bool Questions::TellsImagesAtOnce() const {
  return view_->caches->unsure.IsCurrent(*view_->snapshot);
}

Result<ImageAnswer> Questions::Image(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  VEDUTA_ASSIGN_OR_RETURN(ImageAnswer answer, ImageAnswerOf(*view_->snapshot, image,
                                                            &view_->caches->unsure, view_->sight));
  answer.snapshot = snapshot();
  return answer;
}

Result<std::optional<PoseUncertainty>> Questions::Uncertainty(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  return UncertaintyOf(*view_->snapshot, image.id, &view_->caches->unsure);
}

Result<std::vector<NeighborAnswer>> Questions::Neighbors(const std::string& name) const {
  VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(*view_->snapshot, name, view_->sight));
  return NeighborsOf(*view_->snapshot, image.id, view_->sight);
}

Result<std::vector<NeighborAnswer>> Questions::Rank(const PhotoSource& photo,
                                                    const std::string& camera,
                                                    uint32_t count_max) const {
  EngineParts& parts = *view_->parts;
  std::optional<CameraModel> model;
  if (!camera.empty()) {
    VEDUTA_ASSIGN_OR_RETURN(const CameraRecord record, FindCamera(*view_->snapshot, camera));
    model = record.extraction_model();
  }
  const PreparedPhoto prepared = parts.preparer->Extract(photo, model);
  VEDUTA_RETURN_IF_ERROR(prepared.failure);
  if (prepared.reason != Reason::kNone) {
    return veduta::Status::InvalidArgument(photo.path + ": " + prepared.detail);
  }
  VEDUTA_ASSIGN_OR_RETURN(
      const std::vector<RankedImage> ranked,
      RankFeatures(*view_->snapshot, prepared.features, count_max, &view_->caches->retrieval,
                   &view_->caches->features, parts.pool.get()));
  std::vector<NeighborAnswer> answers;
  for (const RankedImage& candidate : ranked) {
    VEDUTA_ASSIGN_OR_RETURN(ImageRecord image, view_->snapshot->GetImage(candidate.image));
    answers.push_back({image.id, std::move(image.name), image.verdict, 0, candidate.score});
  }
  VEDUTA_RETURN_IF_ERROR(view_->visibility().Keep(&NeighborAnswer::image, &answers));
  return answers;
}

Result<std::vector<ReconstructionAnswer>> Questions::Reconstructions() const {
  VEDUTA_ASSIGN_OR_RETURN(StatusAnswer status,
                          StatusOf(*view_->snapshot, {}, &view_->caches->unsure, view_->sight));
  return std::move(status.reconstructions);
}

Result<ReconstructionAnswer> Questions::Reconstruction(ReconstructionId id) const {
  VEDUTA_RETURN_IF_ERROR(view_->RefuseUnseen(id));
  VEDUTA_ASSIGN_OR_RETURN(const ReconstructionRecord record,
                          view_->snapshot->GetReconstruction(id));
  return ReconstructionAnswerOf(*view_->snapshot, record);
}

Result<std::vector<HypothesisAnswer>> Questions::Hypotheses(ReconstructionId id) const {
  return HypothesesOf(*view_->snapshot, id, view_->sight);
}

Result<std::vector<CameraAnswer>> Questions::Cameras() const {
  VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraAnswer> cameras, CamerasOf(*view_->snapshot));
  const Visibility visibility = view_->visibility();
  if (visibility.SeesWhole()) return cameras;
  std::set<CameraId> seen;
  veduta::Status failure;
  VEDUTA_RETURN_IF_ERROR(view_->snapshot->ScanImages([&](const ImageRecord& image) {
    const Result<bool> sees = visibility.Sees(image);
    failure = sees.status();
    if (sees.ok() && *sees) seen.insert(image.camera);
    return sees.ok();
  }));
  VEDUTA_RETURN_IF_ERROR(failure);
  std::erase_if(cameras, [&](const CameraAnswer& camera) { return !seen.contains(camera.id); });
  return cameras;
}

Result<CameraAnswer> Questions::Camera(const std::string& name) const {
  if (!view_->visibility().SeesWhole()) {
    VEDUTA_ASSIGN_OR_RETURN(std::vector<CameraAnswer> seen, Cameras());
    for (CameraAnswer& camera : seen) {
      if (camera.name == name) return std::move(camera);
    }
    return veduta::Status::NotFound("there is no camera '" + name + "'");
  }
  VEDUTA_ASSIGN_OR_RETURN(CameraRecord record, FindCamera(*view_->snapshot, name));
  return CameraAnswerOf(std::move(record));
}

Result<VocabularyAnswer> Questions::Vocabulary() const {
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const VocabularyTree> tree,
                          view_->caches->retrieval.ActiveTree(*view_->snapshot));
  if (tree == nullptr) {
    return veduta::Status::NotFound(
        "the database has no vocabulary yet; it trains one when it is large enough, or `veduta "
        "vocabulary train`");
  }
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, view_->snapshot->GetState());
  const VocabularyInfo& info = tree->info();
  return VocabularyAnswer{snapshot(),
                          state.vocabulary_generation,
                          info.branch,
                          info.depth,
                          info.leaf_count,
                          info.training_size,
                          state.images_at_vocabulary,
                          state.vocabulary_imported};
}

Status Questions::ExportVocabulary(const std::string& path) const {
  VEDUTA_RETURN_IF_ERROR(Vocabulary().status());
  VEDUTA_ASSIGN_OR_RETURN(const std::shared_ptr<const VocabularyTree> tree,
                          view_->caches->retrieval.ActiveTree(*view_->snapshot));
  const std::vector<uint8_t> bytes = tree->Serialize();
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()),
             static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (file) return veduta::Status::Ok();
  return veduta::Status::IoError("cannot write " + path + ": " + std::strerror(errno));
}

Result<std::vector<ForbiddenAnswer>> Questions::Forbidden() const {
  return ForbiddenOf(*view_->snapshot);
}

Result<GeoreferenceAnswer> Questions::Georeference() const {
  VEDUTA_ASSIGN_OR_RETURN(GeoreferenceAnswer answer, GeoreferenceOf(*view_->snapshot));
  const Visibility visibility = view_->visibility();
  if (!visibility.SeesWhole()) answer.ground_points.clear();
  for (GroundPointAnswer& told : answer.ground_points)
    VEDUTA_RETURN_IF_ERROR(visibility.Keep(&GroundSighting::image, &told.point.sightings));
  VEDUTA_RETURN_IF_ERROR(visibility.Keep(&EarthAnswer::reconstruction, &answer.reconstructions));
  return answer;
}

Result<std::vector<JournalAnswer>> Questions::Journal(uint64_t first, uint32_t count_max) const {
  return JournalOf(*view_->snapshot, first, count_max, view_->sight);
}

Result<std::string> Questions::Digest() const {
  VEDUTA_ASSIGN_OR_RETURN(const ContentHash digest, DigestOf(*view_->snapshot));
  return digest.Hex();
}

}  // namespace veduta
