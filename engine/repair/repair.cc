// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/repair.h"

#include <algorithm>
#include <filesystem>

#include "engine/repair/healing.h"
#include "engine/repair/rebuilding.h"
#include "engine/repair/repair_folders.h"
#include "engine/repair/repair_report.h"
#include "storage/base/option_bounds.h"
#include "storage/folder_lock.h"

namespace veduta {
namespace {

// Contradictions that one repair tells of; more of them are no better understood. Chosen by hand.
constexpr uint32_t kViolationsMax = 100;

// How a new database is made, from the one that keeps most to the one that asks least of the
// records.
enum class Way { kHeal, kHealDerivingMore, kRebuild };

class Repairer final {
 public:
  Repairer(RepairFolders folders, const RepairRequest& request, const RepairWatch& watch)
      : folders_(std::move(folders)),
        request_(request),
        watch_(watch),
        tables_(EngineOptions().undistort_cache_bytes),
        preparer_(nullptr, &tables_, PrepareOptions()) {}

  Result<RepairAnswer> Run() {
    VEDUTA_ASSIGN_OR_RETURN(const FolderLock lock, FolderLock::Take(folders_.database, nullptr));
    VEDUTA_RETURN_IF_ERROR(DeleteLeftovers(folders_));
    const Status done = RunLocked();
    source_.reset();
    // A stop that stands for a kill leaves everything as it is.
    if (done.code() != StatusCode::kCancelled) {
      DeleteLeftovers(folders_).IgnoreBecause(
          "the next repair deletes what is left; nothing else looks at it");
    }
    VEDUTA_RETURN_IF_ERROR(done);
    return std::move(answer_);
  }

 private:
  Status RunLocked() {
    VEDUTA_ASSIGN_OR_RETURN(source_, Salvage::Open(folders_.database, folders_.source, {}));
    VEDUTA_RETURN_IF_ERROR(Pass(RepairStep::kSourceLinked));
    HealingWork examined(*source_, preparer_, nullptr, {});
    VEDUTA_RETURN_IF_ERROR(HealAll(&examined));
    VEDUTA_RETURN_IF_ERROR(AddViolations(&examined.notes));
    TakeNotes(examined.notes);
    answer_.is_sound = answer_.findings.empty();
    VEDUTA_RETURN_IF_ERROR(Pass(RepairStep::kExamined));
    if (answer_.is_sound || !request_.apply) return Status::Ok();
    VEDUTA_RETURN_IF_ERROR(CheckRoom(folders_));
    for (const Way way : {Way::kHeal, Way::kHealDerivingMore, Way::kRebuild}) {
      // Without any camera there is no image to keep.
      tries_rebuild_ = request_.may_rebuild || examined.cameras.empty();
      if (way == Way::kRebuild && !tries_rebuild_) break;
      VEDUTA_ASSIGN_OR_RETURN(const bool is_sound, Make(way, examined));
      if (!is_sound) continue;
      VEDUTA_RETURN_IF_ERROR(Pass(RepairStep::kWritten));
      return Switch();
    }
    return NothingSound();
  }

  Status NothingSound() const {
    const std::string what = "no sound database could be made of " + folders_.database;
    const std::string left = " (" + contradiction_ + "); it is unchanged";
    if (tries_rebuild_) return Status::Corruption(what + ", not even from its photos alone" + left);
    return Status::Corruption(
        what + " by leaving out what is damaged" + left +
        ". 'veduta repair --yes --rebuild' adds its photos to a new database instead: the images "
        "get new numbers, and the map is made anew");
  }

  Status Pass(RepairStep step) const {
    return !watch_ || watch_(step) ? Status::Ok() : Status::Cancelled("the repair was stopped");
  }

  // What contradicts each other, where everything can be read.
  Status AddViolations(RepairNotes* notes) {
    if (!notes->findings.empty()) return Status::Ok();
    if (source_->format() != 0 && source_->format() < kFormatVersion) {
      notes->Add(
          "the database has format " + std::to_string(source_->format()) + " of an earlier veduta",
          "the new one has format " + std::to_string(kFormatVersion) +
              "; where nothing is damaged, 'veduta settle' brings the old one to it");
      return Status::Ok();
    }
    EngineOptions options;
    options.read_only = true;
    options.thread_count = request_.thread_count;
    const auto engine = Engine::Open(folders_.source, options);
    const Result<std::vector<std::string>> violations =
        engine.ok() ? (*engine)->Ask().Verify({.count_max = kViolationsMax})
                    : Result<std::vector<std::string>>(engine.status());
    const std::string remedy = "what contradicts the photos is left out or derived again";
    if (!violations.ok()) {
      if (!IsDamage(violations.status())) return violations.status();
      notes->Add(violations.status().message(), remedy);
      return Status::Ok();
    }
    for (const std::string& violation : *violations) notes->Add(violation, remedy);
    return Status::Ok();
  }

  void TakeNotes(const RepairNotes& notes) {
    if (answer_.findings.empty()) {
      for (const RepairNotes::Finding& finding : notes.findings)
        answer_.findings.push_back({finding.damage, finding.remedy});
    }
    answer_.lost = notes.lost;
    answer_.retried = notes.retried;
    loose_ = notes.loose;
    answer_.written_out.clear();
    for (const LoosePhoto& loose : notes.loose) {
      if (loose.camera.empty()) answer_.written_out.push_back(loose.name);
    }
  }

  // Whether the new database is sound. A failure is one of the disk.
  Result<bool> Make(Way way, const HealingWork& examined) {
    std::error_code ignored;
    std::filesystem::remove_all(folders_.repairing, ignored);
    DatabaseOptions create;
    create.create = true;
    Status made;
    RepairNotes notes = examined.notes;
    if (way != Way::kRebuild) {
      VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Database> target,
                              Database::Open(folders_.repairing, create));
      const HealOptions options = way == Way::kHeal ? HealOptions() : HealOptions{false, false};
      HealingWork healing(*source_, preparer_, target.get(), options);
      made = HealAll(&healing);
      notes = healing.notes;
    }
    // A record may be refused where it is written, because it breaks an invariant.
    if (made.code() == StatusCode::kInvalidArgument) {
      contradiction_ = made.message();
      return false;
    }
    VEDUTA_RETURN_IF_ERROR(made);
    TakeNotes(notes);
    answer_.is_rebuilt = way == Way::kRebuild;
    if (way == Way::kHealDerivingMore) {  // a rebuild, which may follow, makes them anew as well
      answer_.findings.push_back({"words of photos or records of surfaces contradict other records",
                                  "words are looked up again, and 'veduta densify' makes the "
                                  "surfaces again"});
    }
    return Finish(way, examined, notes);
  }

  Result<bool> Finish(Way way, const HealingWork& examined, const RepairNotes& notes) {
    EngineOptions options;
    options.create = way == Way::kRebuild;
    options.thread_count = request_.thread_count;
    VEDUTA_ASSIGN_OR_RETURN(const std::unique_ptr<Engine> engine,
                            Engine::Open(folders_.repairing, options));
    if (way == Way::kRebuild) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<RepairNotes::Finding> unkept,
                              RebuildFromPhotos(examined, engine.get()));
      for (const RepairNotes::Finding& finding : unkept)
        answer_.findings.push_back({finding.damage, finding.remedy});
    } else if (!notes.loose.empty() || !notes.retried.empty()) {
      VEDUTA_RETURN_IF_ERROR(AddLoosePhotos(examined, engine.get()));
    }
    const auto violations = engine->Ask().Verify({.count_max = 1});
    if (!violations.ok() && !IsDamage(violations.status())) return violations.status();
    const bool is_sound = violations.ok() && violations->empty();
    if (!is_sound)
      contradiction_ = violations.ok() ? violations->front() : violations.status().message();
    return is_sound;
  }

  Status WriteOut() {
    for (const LoosePhoto& loose : loose_) {
      if (!loose.camera.empty()) continue;
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<uint8_t> bytes, source_->GetPhoto(loose.photo));
      const std::string prefix = loose.photo.Hex().substr(0, 16);
      VEDUTA_RETURN_IF_ERROR(WriteFileInside(folders_.photos, loose.name, prefix, bytes));
      answer_.photos_path = folders_.photos;
    }
    return Status::Ok();
  }

  Status Switch() {
    VEDUTA_RETURN_IF_ERROR(WriteOut());
    answer_.kept_path = folders_.kept;
    answer_.report_path = folders_.report;
    VEDUTA_RETURN_IF_ERROR(
        WriteTextDurably(folders_.report, RepairReport(folders_.database, answer_)));
    VEDUTA_RETURN_IF_ERROR(CompleteSwitch(folders_));
    VEDUTA_RETURN_IF_ERROR(Pass(RepairStep::kComplete));
    VEDUTA_RETURN_IF_ERROR(BeginSwitch(folders_));
    VEDUTA_RETURN_IF_ERROR(Pass(RepairStep::kMovedAway));
    VEDUTA_RETURN_IF_ERROR(FinishSwitch(folders_));
    answer_.is_repaired = true;
    return Status::Ok();
  }

  const RepairFolders folders_;
  const RepairRequest request_;
  const RepairWatch watch_;
  UndistortCache tables_;
  PhotoPreparer preparer_;
  std::unique_ptr<Salvage> source_;
  std::vector<LoosePhoto> loose_;
  RepairAnswer answer_;
  bool tries_rebuild_ = false;
  std::string contradiction_;  // of the last database that was made and is not sound
};

}  // namespace

Result<RepairAnswer> RunRepair(const std::string& path, const RepairRequest& request,
                               const RepairWatch& watch) {
  VEDUTA_RETURN_IF_ERROR(OptionBounds().Part("RepairRequest", request.Check()).status());
  const RepairFolders folders = RepairFoldersFor(path);
  const SwitchState state = FindSwitch(folders);
  const bool unfinished = state == SwitchState::kMovedAway || state == SwitchState::kExchanged;
  if (unfinished && !request.apply) {
    RepairAnswer answer;
    answer.findings.push_back({"a repair was interrupted when its new database was complete",
                               "the new database takes the place of the damaged one"});
    return answer;
  }
  if (unfinished) {
    // Another program may be about to do the last step.
    VEDUTA_ASSIGN_OR_RETURN(const FolderLock lock, FolderLock::Take(folders.repaired, nullptr));
    VEDUTA_RETURN_IF_ERROR(FinishSwitch(folders));
  }
  std::error_code error;
  if (!std::filesystem::is_directory(folders.database, error))
    return Status::NotFound("there is no database at " + path + ": create one with 'veduta init'");
  if (!HasFilesOfDatabase(folders.database))
    return Status::NotFound(path +
                            " is not a veduta database: it has no file VEDUTA, and no other "
                            "file of one");
  VEDUTA_RETURN_IF_ERROR(CheckCanBeRenamed(folders));
  return Repairer(RepairFoldersFor(path), request, watch).Run();
}

Result<RepairAnswer> Engine::Repair(const std::string& path, const RepairRequest& request) {
  return RunRepair(path, request, {});
}

}  // namespace veduta
