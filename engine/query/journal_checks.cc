// SPDX-License-Identifier: Apache-2.0
// The journal, and what it says once more of records: engine/query/told_by_journal.h.
#include <algorithm>

#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"
#include "engine/query/told_by_journal.h"

namespace veduta {
namespace {

std::string NamesNothing(uint64_t sequence) {
  return "entry " + std::to_string(sequence) +
         " of the journal names an image or a reconstruction that does not exist";
}

// Ids are given one after the other, and each image that has got one is there or was removed.
void CheckIds(const CheckedCity& city, const ToldByJournal& told, Violations* violations) {
  uint32_t last = city.images.empty() ? 0 : city.images.rbegin()->first.value;
  size_t count = city.images.size();
  for (const ImageId id : told.removed) {
    last = std::max(last, id.value);
    ++count;
    violations->Expect(!city.images.contains(id), [&] {
      return NameOf(id) + " was removed, as the journal says, and is there all the same";
    });
  }
  violations->Expect(count == last, [&] {
    return "there are " + std::to_string(city.images.size()) + " images besides " +
           std::to_string(told.removed.size()) + " that were removed, and the last is number " +
           std::to_string(last);
  });
  violations->Expect(last + 1 == city.state.next_image, [&] {
    return "the last of the images is number " + std::to_string(last) +
           ", and the state gives the next one number " + std::to_string(city.state.next_image);
  });
}

Status ReadJournal(const CheckedCity& city, ToldByJournal* told, Violations* violations) {
  uint64_t expected = 1;
  // The last entry that names an image: one that was removed is named by no later one.
  std::map<ImageId, uint64_t> last_named, removed_at;
  VEDUTA_RETURN_IF_ERROR(WalkRecords<JournalRecord>(
      city.snapshot, Family::kJournal, violations, [&](const JournalRecord& entry) {
        violations->Expect(entry.sequence == expected,
                           [&] { return "the journal lacks entry " + std::to_string(expected); });
        expected = entry.sequence + 1;
        violations->Expect(
            !entry.reconstruction.valid() || city.reconstructions.contains(entry.reconstruction),
            [&] { return NamesNothing(entry.sequence); });
        if (entry.image.valid()) last_named[entry.image] = entry.sequence;
        told->Take(entry);
        if (entry.image.valid() && told->removed.contains(entry.image))
          removed_at.insert({entry.image, entry.sequence});
      }));
  for (const auto& [id, sequence] : last_named) {
    const auto removed = removed_at.find(id);
    const bool is_gone = removed != removed_at.end() && removed->second == sequence;
    violations->Expect(is_gone || city.images.contains(id),
                       [&, sequence = sequence] { return NamesNothing(sequence); });
  }
  violations->Expect(expected == city.state.next_journal, [&] {
    return "the journal ends before entry " + std::to_string(city.state.next_journal);
  });
  return Status::Ok();
}

void CompareImages(const CheckedCity& city, const ToldByJournal& told, Violations* violations) {
  for (const auto& [id, image] : city.images) {
    violations->Expect(told.HasContributorOf(image), [&, id = id] {
      return NameOf(id) + " is not in the journal as one of its contributor";
    });
    violations->Expect(!told.HasContributorOf(image) || told.AgreesWith(image), [&, id = id] {
      return NameOf(id) + " has another reason than the journal says";
    });
  }
}

void CompareRest(const CheckedCity& city, const ToldByJournal& told, Violations* violations) {
  std::set<std::string> names;
  for (const auto& [id, camera] : city.cameras) names.insert(camera.name);
  violations->Expect(names == told.cameras, "the cameras have other names than the journal says");
  for (const auto& [id, record] : city.reconstructions) {
    const uint64_t wanted = told.ImagesAtAdjustment(id);
    // 0 makes the adjustment due: a merge may do so, and the next adjustment puts it right.
    const bool is_due = record.images_at_adjustment == 0;
    violations->Expect(
        is_due || record.images_at_adjustment == wanted, [&, id = id, &record = record] {
          return NameOf(id) + " was last adjusted with " + std::to_string(wanted) +
                 " images, and its record says " + std::to_string(record.images_at_adjustment);
        });
  }
  violations->Expect(told.AgreesWith(city.state),
                     "the state says something else of its vocabulary than the journal");
}

}  // namespace

Status CheckJournal(const CheckedCity& city, Violations* violations) {
  ToldByJournal told;
  VEDUTA_RETURN_IF_ERROR(ReadJournal(city, &told, violations));
  CheckIds(city, told, violations);
  CompareImages(city, told, violations);
  CompareRest(city, told, violations);
  return Status::Ok();
}

}  // namespace veduta
