// SPDX-License-Identifier: Apache-2.0
#pragma once
// Heals a database by writing a new one, record by record: what can be read is taken over, what is
// derived from it is derived again, and the rest is named. Indexes, counts, posting lists and both
// directions of pairs are always written anew, so nothing that contradicts them comes along.

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "engine/photo/photo_preparer.h"
#include "engine/query/told_by_journal.h"
#include "engine/repair/healed_writer.h"
#include "index/vocabulary_tree.h"
#include "storage/salvage.h"

namespace veduta {

// A photo that is whole, and whose record is not.
struct LoosePhoto {
  std::string name;
  ContentHash photo;
  std::string camera;  // the name of the camera to add it with; empty where nobody can tell
  std::string contributor;
};

// What a repair has found and what it does about it. Sentences are for people.
struct RepairNotes {
  struct Finding {
    std::string damage, remedy;
  };
  std::vector<Finding> findings;
  std::vector<std::string> lost;     // names of photos whose bytes are gone
  std::vector<std::string> retried;  // names of photos that have lost their pose
  std::vector<LoosePhoto> loose;

  void Add(std::string damage, std::string remedy) {
    findings.push_back({std::move(damage), std::move(remedy)});
  }
};

struct HealOptions {
  bool keeps_words = true;  // false: the words of all images are computed again
  bool keeps_dense = true;  // false: nothing of the dense pass is taken over
};

// What the steps of one healing share. The maps hold what the new database will hold.
struct HealingWork {
  // A null target: nothing is written.
  HealingWork(const Salvage& from, const PhotoPreparer& preparing, Database* target,
              const HealOptions& wanted)
      : source(from), preparer(preparing), options(wanted), writer(target) {}

  const Salvage& source;
  const PhotoPreparer& preparer;
  const HealOptions options;
  HealedWriter writer;
  RepairNotes notes;

  DatabaseState state;
  bool state_is_lost = false;
  std::optional<VocabularyTree> vocabulary;
  std::map<CameraId, CameraRecord> cameras;
  std::map<ImageId, ImageRecord> images;
  std::map<ReconstructionId, ReconstructionRecord> reconstructions;  // merged ones too
  std::map<ReconstructionId, std::set<ImageId>> members;             // that keep their poses
  std::map<ImageId, JournalRecord> added;         // the journal's entry about each photo
  std::map<CameraId, CameraRecord> told_cameras;  // as the journal describes them
  ToldByJournal told;

  const Snapshot& from() const { return source.snapshot(); }
  // The image where it has a photo, else null.
  const ImageRecord* FindPhoto(ImageId id) const;
  // Whether the reconstruction will be there, not merged away.
  bool IsLiving(ReconstructionId id) const;
  // An image of which nothing is left but its number: a rejected one, for numbers have no gaps.
  // What is not known of its name is empty.
  void StandIn(ImageId id, const PhotoName& name);
  // The photo is tried again by whoever opens the database next.
  Status TryAgain(ImageId id);
};

// Whether the failure is about what is stored: the record is damaged, or it or its file is gone.
// Other failures are about the machine, such as a disk that does not answer or too many open files:
// a record that cannot be read now may be whole, and the repair ends.
bool IsDamage(const Status& status);
// "photo 'walk/1.jpg' (image 7)"
std::string PhotoText(const ImageRecord& image);

// The steps, in this order. Each is O(what it is about); a failure is one of the new database, or a
// lack of memory.
Status HealState(HealingWork* healing);
Status HealJournal(HealingWork* healing);
Status HealCameras(HealingWork* healing);
Status HealImages(HealingWork* healing);
Status HealPhotos(HealingWork* healing);
Status HealPairs(HealingWork* healing);
Status HealMap(HealingWork* healing);
Status HealSubmaps(HealingWork* healing);
Status HealDense(HealingWork* healing);
// What was sent together; to come before the photos that wait.
Status HealContributions(HealingWork* healing);
// What curators have hidden and people reported; what tokens have used is forgotten.
Status HealModeration(HealingWork* healing);
// Takes over the photos that wait for their turn, and those that arrive in parts. `target`, unless
// null, is the new database, with whatever it holds already.
Status HealUploads(const Salvage& source, Database* target, RepairNotes* notes);
// New entries, where records have come to say something else than the journal does.
Status RestateJournal(HealingWork* healing);

// All of them. `target` is a database that was just created; null: nothing is written. Afterwards
// `healing` says what was found.
Status HealAll(HealingWork* healing);

// Calls visit on the ids of a kind that may be there: those below `next`, and where that number
// cannot be trusted, on more of them until many in a row were not there. visit says whether one
// was.
template <typename Id, typename Visit>
Status VisitIds(const HealingWork& healing, decltype(Id::value) next, Visit&& visit);

// Ids that are probed in a row where nobody knows how many there are. Chosen by hand; not measured.
inline constexpr uint32_t kMissesMax = 1000;

template <typename Id, typename Visit>
Status VisitIds(const HealingWork& healing, decltype(Id::value) next, Visit&& visit) {
  const bool probes = healing.state_is_lost || healing.source.is_pieced_together();
  uint32_t misses = 0;
  for (decltype(Id::value) id = 1; id < next || (probes && misses < kMissesMax); ++id) {
    Result<bool> found = visit(Id(id));
    if (!found.ok()) return found.status();
    misses = *found ? 0 : misses + 1;
  }
  return Status::Ok();
}

}  // namespace veduta
