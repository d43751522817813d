// SPDX-License-Identifier: Apache-2.0
#include "engine/engine.h"

#include <utility>

#include "engine/first_cameras.h"
#include "engine/parts.h"
#include "engine/photo_list.h"
#include "engine/query/city_answers.h"
#include "storage/base/plain_text.h"
#include "storage/base/whole_file.h"

namespace veduta {
namespace {

Result<VocabularyTree> ReadVocabulary(const std::string& path) {
  // The largest vocabulary that is read, in bytes; chosen by hand, not measured: 8 million words.
  constexpr size_t kVocabularyBytesMax = size_t{1} << 30;
  VEDUTA_ASSIGN_OR_RETURN(const std::string bytes, ReadWholeFile(path, kVocabularyBytesMax));
  Result<VocabularyTree> tree =
      VocabularyTree::Parse({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
  if (tree.ok()) return tree;
  return Status::InvalidArgument(path + " is not a vocabulary: " + tree.status().message());
}

}  // namespace

Engine::Engine() = default;

Engine::~Engine() {
  // Others may hold the parts for a while: Questions, and calls that are still running.
  if (parts_) parts_->scheduler->Close();
}

Result<std::unique_ptr<Engine>> Engine::Open(const std::string& path,
                                             const EngineOptions& options) {
  return EngineParts::Open(path, options, {});
}

Questions Engine::Ask(const Sight& sight) const {
  // The caches first: they may know less than the snapshot, never more.
  std::shared_ptr<EngineCaches> caches = parts_->GetCaches();
  return Questions(std::make_unique<Questions::View>(
      Questions::View{parts_, std::move(caches), parts_->database->GetSnapshot(), sight}));
}

std::pair<uint64_t, uint64_t> Engine::DecoderDeaths() const {
  const auto deaths = parts_->preparer->decoder().deaths();
  return {deaths.by_photos, deaths.by_others};
}

Result<CameraId> Engine::AddCamera(const std::string& name, const CameraModel& model,
                                   const std::string& source) {
  if (!IsPlainText(name, /*may_have_lines=*/false))
    return Status::InvalidArgument(
        "the name of a camera is UTF-8 without control characters, and this one is not");
  return parts_->AddCamera({{}, name, model, source});
}

Result<std::vector<FirstCamera>> Engine::CalibrateFirst(std::span<PhotoSubmission> photos,
                                                        std::stop_token stop) {
  return veduta::CalibrateFirst(parts_.get(), photos, std::move(stop));
}

Status Engine::AddPhotos(std::span<const PhotoSubmission> photos,
                         const std::function<void(const AddOutcome&)>& report, std::stop_token stop,
                         const std::function<void(const FollowUp&)>& followed) {
  const std::shared_ptr<EngineParts> parts = parts_;  // the engine may be closed meanwhile
  VEDUTA_RETURN_IF_ERROR(AddList(parts.get(), photos, {}, report, stop, followed));
  return photos.empty() ? Settle(stop, followed) : Status::Ok();
}

Status Engine::Settle(std::stop_token stop, const std::function<void(const FollowUp&)>& followed) {
  std::vector<FollowUp> steps;
  const std::shared_ptr<EngineParts> parts = parts_;  // the engine may be closed meanwhile
  const Status settled = parts->scheduler->Settle(std::move(stop), &steps);
  if (followed) {
    for (const FollowUp& step : steps) followed(step);
  }
  VEDUTA_RETURN_IF_ERROR(settled);
  // A removal was killed before it had rewritten the files; one that runs does it itself.
  const std::optional<Claimable::Claim> alone = parts->dense_pass.TryClaim();
  return alone ? parts->PurgeRemoved() : Status::Ok();
}

Status Engine::TrainVocabulary(const VocabularyRequest& request, std::stop_token stop) {
  Database* const database = parts_->database.get();
  const std::shared_ptr<EngineCaches> caches = parts_->GetCaches();
  VEDUTA_ASSIGN_OR_RETURN(Retrieval::Prepared prepared,
                          caches->retrieval.Train(database, parts_->pool.get(), request, stop));
  return parts_->Activate(caches, std::move(prepared));
}

Status Engine::ImportVocabulary(const std::string& path, std::stop_token stop) {
  VEDUTA_ASSIGN_OR_RETURN(VocabularyTree tree, ReadVocabulary(path));
  Database* const database = parts_->database.get();
  const std::shared_ptr<EngineCaches> caches = parts_->GetCaches();
  VEDUTA_ASSIGN_OR_RETURN(
      Retrieval::Prepared prepared,
      caches->retrieval.Import(database, std::move(tree), parts_->pool.get(), stop));
  return parts_->Activate(caches, std::move(prepared));
}

Status Engine::Reopen() {
  Writer::Turn turn = parts_->writer->Take();
  return parts_->Reopen(&turn);
}

}  // namespace veduta
