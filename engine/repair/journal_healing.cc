// SPDX-License-Identifier: Apache-2.0
// The journal: entries that are lost, and records that have come to say something else than it.
#include <algorithm>

#include "engine/journal/camera_entry.h"
#include "engine/journal/journal.h"
#include "engine/repair/healing.h"

namespace veduta {
namespace {

// Reads the journal from `first` up to the first entry that cannot be read, and says which one
// comes next; UINT64_MAX after the last.
uint64_t ReadEntries(const Snapshot& from, uint64_t first, std::map<uint64_t, JournalRecord>* all) {
  uint64_t next = first;
  const Status read = from.ScanJournal(first, [&](const JournalRecord& entry) {
    (*all)[entry.sequence] = entry;
    next = entry.sequence + 1;
    return true;
  });
  return read.ok() ? UINT64_MAX : next;
}

void Remember(const JournalRecord& entry, HealingWork* healing) {
  healing->told.Take(entry);
  if (entry.action == "add" && entry.image.valid()) healing->added.insert({entry.image, entry});
  if (entry.action != "camera") return;
  if (const auto camera = ParseCameraEntry(entry.detail))
    healing->told_cameras.insert_or_assign(camera->id, *camera);  // it may be refined later
}

JournalRecord LostEntry(uint64_t sequence) {
  JournalRecord entry;
  entry.sequence = sequence;
  entry.actor = "veduta";
  entry.action = "repair";
  entry.detail = "this entry was damaged";
  return entry;
}

Status Append(const std::string& actor, const std::string& action, ImageId image,
              ReconstructionId reconstruction, std::string detail, HealingWork* healing) {
  JournalRecord entry;
  entry.actor = actor;
  entry.action = action;
  entry.image = image;
  entry.reconstruction = reconstruction;
  entry.detail = std::move(detail);
  healing->told.Take(entry);
  if (healing->writer.target() == nullptr) return Status::Ok();
  return healing->writer.Put([&](Transaction& transaction) {
    AppendJournal(std::move(entry), &healing->state, &transaction);
  });
}

Status RestateImage(const ImageRecord& image, HealingWork* healing) {
  if (healing->told.AgreesWith(image)) return Status::Ok();
  const std::string before = image.verdict == Verdict::kRejected ? "rejected: " : "";
  VEDUTA_RETURN_IF_ERROR(
      Append(image.contributor, "repair", image.id, {}, before + image.detail, healing));
  if (healing->told.AgreesWith(image)) return Status::Ok();
  return Append("veduta", "propagate", image.id, {}, image.detail, healing);
}

Status RestateVocabulary(HealingWork* healing) {
  DatabaseState& state = healing->state;
  if (healing->state_is_lost && healing->vocabulary && healing->told.images_at_vocabulary) {
    state.images_at_vocabulary = static_cast<uint32_t>(*healing->told.images_at_vocabulary);
    state.vocabulary_imported = healing->told.vocabulary_imported;
  }
  if (healing->told.AgreesWith(state)) return Status::Ok();
  if (!healing->vocabulary) return Append("veduta", "vocabulary", {}, {}, "dropped", healing);
  const std::string how = state.vocabulary_imported ? "imported " : "trained ";
  return Append("veduta", "vocabulary", {}, {},
                how + std::to_string(healing->vocabulary->info().leaf_count) + " words for " +
                    std::to_string(state.images_at_vocabulary) + " images",
                healing);
}

}  // namespace

Status HealJournal(HealingWork* healing) {
  std::map<uint64_t, JournalRecord> all;
  for (uint64_t next = 1; next != UINT64_MAX;) {
    const uint64_t after = ReadEntries(healing->from(), next, &all);
    next = after == next ? next + 1 : after;
    const uint64_t end = std::max<uint64_t>(healing->state.next_journal,
                                            (all.empty() ? 0 : all.rbegin()->first) + kMissesMax);
    if (next >= end) break;
  }
  if (!all.empty())
    healing->state.next_journal = std::max(healing->state.next_journal, all.rbegin()->first + 1);
  uint64_t lost = 0;
  for (uint64_t sequence = 1; sequence < healing->state.next_journal; ++sequence) {
    const auto found = all.find(sequence);
    if (found == all.end()) ++lost;
    const JournalRecord entry = found == all.end() ? LostEntry(sequence) : found->second;
    Remember(entry, healing);
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.AddJournal(entry); }));
  }
  if (lost > 0) {
    healing->notes.Add(std::to_string(lost) + " entries of the journal cannot be read",
                       "entries that say so stand in their place");
  }
  return Status::Ok();
}

Status RestateJournal(HealingWork* healing) {
  for (const auto& [id, camera] : healing->cameras) {
    const auto told = healing->told_cameras.find(id);
    const bool is_told_so = told != healing->told_cameras.end() &&
                            told->second.model == camera.model &&
                            told->second.refined_from == camera.refined_from &&
                            told->second.is_refinable == camera.is_refinable;
    if (is_told_so && healing->told.cameras.contains(camera.name)) continue;
    VEDUTA_RETURN_IF_ERROR(Append("veduta", "camera", {}, {}, CameraEntry(camera), healing));
  }
  for (const auto& [id, image] : healing->images)
    VEDUTA_RETURN_IF_ERROR(RestateImage(image, healing));
  for (const auto& [id, record] : healing->reconstructions) {
    const bool is_due = record.images_at_adjustment == 0;
    if (is_due || healing->told.ImagesAtAdjustment(id) == record.images_at_adjustment) continue;
    VEDUTA_RETURN_IF_ERROR(Append("veduta", "repair", {}, id,
                                  std::to_string(record.images_at_adjustment) + " images",
                                  healing));
  }
  return RestateVocabulary(healing);
}

}  // namespace veduta
