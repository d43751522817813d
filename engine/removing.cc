// SPDX-License-Identifier: Apache-2.0
// The members of Engine that take photos out, and those by which people forbid and allow.
#include <charconv>
#include <filesystem>
#include <set>

#include "engine/engine.h"
#include "engine/ingest/forbidding.h"
#include "engine/journal/journal.h"
#include "engine/parts.h"
#include "engine/query/find_image.h"
#include "storage/base/option_bounds.h"

namespace veduta {
namespace {

// The images that are asked for, in the order of the request, each once.
Result<std::vector<ImageId>> ImagesToRemove(const Snapshot& snapshot,
                                            const RemoveRequest& request) {
  std::vector<ImageId> images;
  if (request.contribution != 0) {
    VEDUTA_RETURN_IF_ERROR(snapshot.contributing().ScanContributedPhotos(
        request.contribution, 0, [&](const ContributedPhoto& photo) {
          if (photo.fate == ContributionFate::kStored) images.push_back(photo.image);
          return true;
        }));
    // Some may have been removed before.
    Status failure;
    std::erase_if(images, [&](ImageId id) {
      const Status found = snapshot.GetImage(id).status();
      if (!found.ok() && found.code() != StatusCode::kNotFound) failure = found;
      return !found.ok();
    });
    if (!failure.ok()) return failure;
    return images;
  }
  if (!request.contributor.empty()) {
    VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
      if (image.contributor == request.contributor) images.push_back(image.id);
      return true;
    }));
    return images;
  }
  std::set<ImageId> once;
  for (const std::string& name : request.photos) {
    VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(snapshot, name));
    if (once.insert(image.id).second) images.push_back(image.id);
  }
  return images;
}

// Of one of whom there is no photo: kNotFound where nothing else tells that there was one, for a
// removal of somebody whose name is spelt wrongly must not look like one that was done.
Status CheckHasSent(const Snapshot& snapshot, const std::string& contributor) {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState state, snapshot.GetState());
  bool has_sent = state.removed_bytes_left;  // a removal was killed, and the rest is to be done
  VEDUTA_RETURN_IF_ERROR(
      snapshot.contributing().ScanContributions(1, [&](const ContributionRecord& record) {
        has_sent = has_sent || record.contributor == contributor;
        return !has_sent;
      }));
  if (has_sent) return Status::Ok();
  return Status::NotFound("there is no photo of '" + contributor + "'");
}

// Copies of the database that somebody made and that may still be there.
Result<std::vector<std::string>> CopiesOf(const Snapshot& snapshot, const std::string& path) {
  std::set<std::string> copies;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanJournal(1, [&](const JournalRecord& entry) {
    if (entry.action == kCopyMade) copies.insert(entry.detail);
    if (entry.action == kCopyDeleted) copies.erase(entry.detail);
    return true;
  }));
  // Beside the database, where repairs keep what they found: engine/repair/repair_folders.cc.
  namespace fs = std::filesystem;
  std::error_code failure;
  const fs::path database = fs::absolute(path, failure).lexically_normal();
  const std::string own = (database.has_filename() ? database : database.parent_path()).string();
  for (fs::directory_iterator entry(fs::path(own).parent_path(), failure), end;
       !failure && entry != end; entry.increment(failure)) {
    const std::string name = entry->path().string();
    if (name.starts_with(own + ".damaged-") && !name.ends_with(".txt")) copies.insert(name);
  }
  return std::vector<std::string>(copies.begin(), copies.end());
}

Result<ReconstructionId> ParseReconstruction(const std::string& text) {
  uint32_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number == 0)
    return Status::InvalidArgument("'" + text + "' is no number of a reconstruction");
  return ReconstructionId(number);
}

ForbiddenKind StoredKind(ForbidKind kind) {
  switch (kind) {
    case ForbidKind::kPair:
      return ForbiddenKind::kPair;
    case ForbidKind::kMerge:
      return ForbiddenKind::kMerge;
    case ForbidKind::kPose:
      break;
  }
  return ForbiddenKind::kPose;
}

// What a request names.
Result<ForbiddenRecord> RecordOf(const Snapshot& snapshot, const ForbidRequest& request) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  ForbiddenRecord record;
  record.kind = StoredKind(request.kind);
  record.actor = request.actor;
  record.reason = request.reason;
  const bool is_pose = request.kind == ForbidKind::kPose;
  uint32_t* const ids[] = {&record.a, &record.b};
  const std::string* const names[] = {&request.a, is_pose ? &request.a : &request.b};
  for (int i = 0; i < 2; ++i) {
    if (request.kind != ForbidKind::kMerge) {
      VEDUTA_ASSIGN_OR_RETURN(const ImageRecord image, FindImage(snapshot, *names[i]));
      *ids[i] = image.id.value;
    } else {
      VEDUTA_ASSIGN_OR_RETURN(const ReconstructionId id, ParseReconstruction(*names[i]));
      *ids[i] = id.value;
    }
  }
  return record;
}

}  // namespace

Status RemoveRequest::Check() const {
  if (!photos.empty() + !contributor.empty() + (contribution != 0) > 1)
    return Status::InvalidArgument("photos, a contributor and a contribution exclude each other");
  return Status::Ok();
}

Status ForbidRequest::Check() const {
  const bool is_pose = kind == ForbidKind::kPose;
  if (a.empty() || (b.empty() && !is_pose))
    return Status::InvalidArgument("a pair and a merge are of two: only one is given");
  if (is_pose && !b.empty())
    return Status::InvalidArgument("a pose is that of one photo: '" + b + "' is one too many");
  return Status::Ok();
}

// The dense pass reads photos for hours, and would store what it has made from a removed one.
Result<RemoveAnswer> Engine::Remove(const RemoveRequest& request, std::stop_token stop,
                                    const std::function<void(const RemovedPhoto&)>& report) {
  VEDUTA_RETURN_IF_ERROR(request.Check());
  const std::shared_ptr<EngineParts> parts = parts_;
  const std::optional<Claimable::Claim> alone = parts->dense_pass.TryClaim();
  if (!alone) {
    return Status::Busy("a dense pass or another removal is at work: wait for its end, or stop it");
  }
  RemoveAnswer answer;
  const bool is_of_many = !request.contributor.empty() || request.contribution != 0;
  if (request.contribution != 0)
    VEDUTA_RETURN_IF_ERROR(Ask().Contribution(request.contribution).status());
  if (is_of_many) {
    VEDUTA_ASSIGN_OR_RETURN(answer.uploads, parts->RemoveUploads(request));
  }
  // No snapshot is held: nothing can be purged that somebody reads.
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<ImageId> images,
                          ImagesToRemove(*parts->database->GetSnapshot(), request));
  if (!request.contributor.empty() && images.empty() && answer.uploads == 0)
    VEDUTA_RETURN_IF_ERROR(CheckHasSent(*parts->database->GetSnapshot(), request.contributor));
  for (const ImageId image : images) {
    if (stop.stop_requested()) {
      return Status::Cancelled("stopped after " + std::to_string(answer.removed.size()) + " of " +
                               std::to_string(images.size()) + " photos; " +
                               (is_of_many ? "run the same command again to go on"
                                           : "name those that are left to go on"));
    }
    {
      Writer::Turn turn = parts->writer->Take();
      VEDUTA_ASSIGN_OR_RETURN(answer.removed.emplace_back(),
                              parts->ingest->Remove(image, request.actor, request.why));
      parts->GetCaches()->surfaces.meshes.Clear();  // some may have its colours
    }
    if (report) report(answer.removed.back());
  }
  if (is_of_many) VEDUTA_RETURN_IF_ERROR(parts->RemoveContributions(request));
  VEDUTA_ASSIGN_OR_RETURN(answer.copies, CopiesOf(*parts->database->GetSnapshot(), parts->path));
  answer.purged = parts->PurgeRemoved();
  return answer;
}

Status EngineParts::NoteCopy(const std::string& action, const std::string& folder,
                             Writer::Turn* turn) {
  std::error_code failure;
  const std::filesystem::path where = std::filesystem::absolute(folder, failure);
  const std::unique_ptr<Transaction> transaction = turn->database().BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, transaction->base()->GetState());
  AppendJournal({0, 0, "veduta", action, {}, {}, failure ? folder : where.string()}, &state,
                transaction.get());
  transaction->PutState(state);
  return transaction->Commit();
}

// Compacts without a turn, so photos are added meanwhile; where others went meanwhile, their bytes
// are left to the next call. RocksDB's manifest may have the photos' names until it is written
// anew, which opening does.
Status EngineParts::PurgeRemoved() {
  VEDUTA_ASSIGN_OR_RETURN(const DatabaseState before, database->GetSnapshot()->GetState());
  if (!before.removed_bytes_left) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(database->PurgeDeleted());
  Writer::Turn turn = writer->Take();
  VEDUTA_RETURN_IF_ERROR(Reopen(&turn));
  const std::unique_ptr<Transaction> transaction = turn.database().BeginTransaction();
  VEDUTA_ASSIGN_OR_RETURN(DatabaseState state, transaction->base()->GetState());
  state.removed_bytes_left = false;
  VEDUTA_RETURN_IF_ERROR(
      transaction->base()->ScanJournal(before.next_journal, [&](const JournalRecord& entry) {
        state.removed_bytes_left = entry.action == "remove" || entry.action == "replace";
        return !state.removed_bytes_left;
      }));
  transaction->PutState(state);
  return transaction->Commit();
}

Status Engine::Forbid(const ForbidRequest& request) {
  Writer::Turn turn = parts_->writer->Take();
  WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(ForbiddenRecord record, RecordOf(*scope.base, request));
  if (record.kind == ForbiddenKind::kPose)
    return parts_->ingest->ForbidPose(ImageId(record.a), record.actor, record.reason);
  return veduta::Forbid(std::move(record), std::move(scope));
}

Status Engine::Allow(const ForbidRequest& request) {
  Writer::Turn turn = parts_->writer->Take();
  WriteScope scope = BeginWrite(&turn.database());
  VEDUTA_ASSIGN_OR_RETURN(const ForbiddenRecord record, RecordOf(*scope.base, request));
  return veduta::Allow(record.kind, record.a, record.b, record.actor, record.reason,
                       std::move(scope));
}

}  // namespace veduta
