// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/rebuilding.h"

#include <map>
#include <string>

#include "engine/parts.h"

namespace veduta {
namespace {

// Photos that are in memory at a time. Chosen by hand; not measured.
constexpr size_t kPhotosAtOnce = 16;

struct PhotoToAdd {
  std::string name;
  ContentHash photo;
  uint64_t size_bytes = 0;  // 0: not known
  std::string camera, contributor;
};

// A step that fails is set aside by the engine, and the next program tries it again.
void IgnoreStep(const FollowUp& /*step*/) {}

// What people have forbidden of photos, by the photo that comes last of those that it is about.
using Statements = std::multimap<ContentHash, ForbidRequest>;

// States anew what needed that photo to be there.
Status Restate(const Statements& statements, const PhotoToAdd& photo, Engine* engine,
               std::vector<RepairNotes::Finding>* unkept) {
  const auto [begin, end] = statements.equal_range(photo.photo);
  for (auto statement = begin; statement != end; ++statement) {
    const Status stated = engine->Forbid(statement->second);
    // The photo was not stored, or was rejected.
    const bool is_lost =
        stated.code() == StatusCode::kNotFound || stated.code() == StatusCode::kInvalidArgument;
    if (!stated.ok() && !is_lost) return stated;
    if (is_lost)
      unkept->push_back({"what " + statement->second.actor + " has forbidden of '" + photo.name +
                             "' cannot be stated anew: " + stated.message(),
                         "it is left out"});
  }
  return Status::Ok();
}

// Adds the photos in batches; one ends with each photo that something is stated with.
Status AddAll(const std::vector<PhotoToAdd>& photos, const Salvage& source,
              const Statements& statements, Engine* engine,
              std::vector<RepairNotes::Finding>* unkept) {
  std::vector<PhotoSubmission> batch;
  for (size_t i = 0; i < photos.size(); ++i) {
    const PhotoToAdd& photo = photos[i];
    VEDUTA_ASSIGN_OR_RETURN(std::vector<uint8_t> bytes,
                            source.GetPhoto(photo.photo, photo.size_bytes));
    batch.push_back({{photo.name, "", std::move(bytes)}, photo.camera, photo.contributor});
    const bool is_full = batch.size() == kPhotosAtOnce || i + 1 == photos.size();
    if (!is_full && !statements.contains(photo.photo)) continue;
    VEDUTA_RETURN_IF_ERROR(engine->AddPhotos(batch, {}, {}, IgnoreStep));
    batch.clear();
    VEDUTA_RETURN_IF_ERROR(Restate(statements, photo, engine, unkept));
  }
  return Status::Ok();
}

// What is forbidden of photos that are there; the rest goes to `unkept`.
Result<Statements> StatementsOf(const HealingWork& healing,
                                std::vector<RepairNotes::Finding>* unkept) {
  Statements statements;
  const Result<std::vector<ForbiddenRecord>> all = healing.from().ListForbidden();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    return statements;  // the healing has said so
  }
  for (const ForbiddenRecord& forbidden : *all) {
    if (forbidden.kind == ForbiddenKind::kMerge) {
      const std::string reason = forbidden.reason.empty() ? "" : ": " + forbidden.reason;
      unkept->push_back(
          {forbidden.actor + " has forbidden that reconstructions " + std::to_string(forbidden.a) +
               " and " + std::to_string(forbidden.b) + " are merged" + reason,
           "a rebuild makes other reconstructions, so it is not kept: where two of the new ones "
           "must not be merged, state it with 'veduta forbid --reconstructions'"});
      continue;
    }
    const ImageRecord* const a = healing.FindPhoto(ImageId(forbidden.a));
    const ImageRecord* const b = healing.FindPhoto(ImageId(forbidden.b));
    if (a == nullptr || b == nullptr) continue;  // it went with the photo
    const bool is_pose = forbidden.kind == ForbiddenKind::kPose;
    // By their hashes: contributors may have given one name to several photos.
    statements.emplace(
        b->photo, ForbidRequest{is_pose ? ForbidKind::kPose : ForbidKind::kPair, a->photo.Hex(),
                                is_pose ? "" : b->photo.Hex(), forbidden.actor, forbidden.reason});
  }
  return statements;
}

// A rebuild gives photos other numbers.
void TellGroundPoints(const HealingWork& healing, std::vector<RepairNotes::Finding>* unkept) {
  const Result<std::vector<GroundPoint>> all = healing.from().ListGroundPoints();
  if (!all.ok() || all->empty()) return;  // what cannot be read the healing has told
  unkept->push_back({std::to_string(all->size()) + " surveyed points are stored",
                     "a rebuild does not keep them: read their file again with 'veduta "
                     "georeference'"});
}

void TellContributions(const HealingWork& healing, std::vector<RepairNotes::Finding>* unkept) {
  size_t count = 0;
  const Status scanned =
      healing.from().contributing().ScanContributions(1, [&](const ContributionRecord&) {
        ++count;
        return true;
      });
  if (!scanned.ok() || count == 0) return;  // what cannot be read the healing has told
  unkept->push_back({std::to_string(count) + " contributions are stored",
                     "a rebuild does not keep what was sent together, since photos get other "
                     "numbers; the photos stay"});
}

Status KeepTokens(const HealingWork& healing, Database* database) {
  const Result<std::vector<TokenRecord>> all = healing.from().ListTokens();
  if (!all.ok()) return IsDamage(all.status()) ? Status::Ok() : all.status();  // told already
  const auto transaction = database->BeginTransaction();
  for (const TokenRecord& token : *all) transaction->PutToken(token);
  return transaction->Commit();
}

// Hides photos anew, each by itself, since contributions are not kept; reports are lost.
Status HideAgain(const HealingWork& healing, Engine* engine,
                 std::vector<RepairNotes::Finding>* unkept) {
  const auto hidden = healing.from().moderation().ListHidden();
  if (!hidden.ok()) return IsDamage(hidden.status()) ? Status::Ok() : hidden.status();  // told
  for (const HiddenRecord& record : *hidden) {
    HideRequest request;
    request.actor = record.actor;
    request.reason = record.reason;
    for (const auto& [id, image] : healing.images) {
      const bool is_named = record.kind == HiddenKind::kImage ? id.value == record.number
                                                              : image.contribution == record.number;
      if (!is_named || healing.FindPhoto(id) == nullptr) continue;
      request.photos = {image.photo.Hex()};
      const Status done = engine->Hide(request);
      // The photo was not stored again.
      if (!done.ok() && done.code() != StatusCode::kNotFound) return done;
    }
  }
  const auto reports = healing.from().moderation().ListReports();
  if (reports.ok() && !reports->empty())
    unkept->push_back({std::to_string(reports->size()) + " reports of photos are stored",
                       "a rebuild does not keep them, since photos get other numbers"});
  return Status::Ok();
}

// Seals the originals of photos with filled areas anew. Where one is lost, its photo stays.
Status SealAgain(const HealingWork& healing, Database* database,
                 std::vector<RepairNotes::Finding>* unkept) {
  for (const auto& [id, image] : healing.images) {
    const Result<StoredBytes> original = healing.from().GetOriginal(id);
    if (original.status().code() == StatusCode::kNotFound) continue;
    if (!original.ok() && !IsDamage(original.status())) return original.status();
    if (!original.ok()) {
      unkept->push_back({"what was sealed of " + PhotoText(image) + " cannot be read",
                         "it is left out: the photo stays, with its areas filled"});
      continue;
    }
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<ImageId> stored,
                            database->GetSnapshot()->FindImageByPhoto(image.photo));
    if (!stored) {
      unkept->push_back({"what was sealed of " + PhotoText(image) + " belongs to no photo any more",
                         "it is left out, as the photo is"});
      continue;
    }
    const auto transaction = database->BeginTransaction();
    transaction->SealOriginal(*stored, original->bytes());
    VEDUTA_RETURN_IF_ERROR(transaction->Commit());
  }
  return Status::Ok();
}

std::vector<PhotoToAdd> LoosePhotosOf(const HealingWork& healing) {
  std::vector<PhotoToAdd> photos;
  for (const LoosePhoto& loose : healing.notes.loose) {
    if (!loose.camera.empty())
      photos.push_back({loose.name, loose.photo, 0, loose.camera, loose.contributor});
  }
  return photos;
}

}  // namespace

Status AddLoosePhotos(const HealingWork& healing, Engine* engine) {
  VEDUTA_RETURN_IF_ERROR(AddAll(LoosePhotosOf(healing), healing.source, {}, engine, nullptr));
  engine->Settle({}, IgnoreStep)
      .IgnoreBecause("a step that fails is tried again by the next program; verify comes after");
  return Status::Ok();
}

Result<std::vector<RepairNotes::Finding>> RebuildFromPhotos(const HealingWork& healing,
                                                            Engine* engine) {
  for (const auto& [id, camera] : healing.cameras) {
    CameraRecord added = camera;
    added.awaited = nullptr;
    VEDUTA_RETURN_IF_ERROR(EngineParts::Of(*engine).AddCamera(std::move(added)).status());
  }
  std::vector<PhotoToAdd> photos;
  for (const auto& [id, image] : healing.images) {
    if (healing.FindPhoto(id) == nullptr) continue;
    photos.push_back({image.name, image.photo, image.size_bytes,
                      healing.cameras.at(image.camera).name, image.contributor});
  }
  std::vector<RepairNotes::Finding> unkept;
  VEDUTA_ASSIGN_OR_RETURN(const Statements statements, StatementsOf(healing, &unkept));
  TellGroundPoints(healing, &unkept);
  TellContributions(healing, &unkept);
  VEDUTA_RETURN_IF_ERROR(AddAll(photos, healing.source, statements, engine, &unkept));
  VEDUTA_RETURN_IF_ERROR(HideAgain(healing, engine, &unkept));
  VEDUTA_RETURN_IF_ERROR(AddLoosePhotos(healing, engine));
  Database* const database = EngineParts::Of(*engine).database.get();
  VEDUTA_RETURN_IF_ERROR(SealAgain(healing, database, &unkept));
  RepairNotes told_already;
  VEDUTA_RETURN_IF_ERROR(HealUploads(healing.source, database, &told_already));
  VEDUTA_RETURN_IF_ERROR(KeepTokens(healing, database));
  return unkept;
}

}  // namespace veduta
