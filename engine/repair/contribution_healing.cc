// SPDX-License-Identifier: Apache-2.0
// Photos that were sent together: what is known of each is taken over, or lost.
#include "engine/repair/healing.h"

namespace veduta {
Status HealContributions(HealingWork* healing) {
  const ContributingReader& from = healing->from().contributing();
  size_t lost = 0;
  std::vector<ContributionRecord> records;
  Status scanned = from.ScanContributions(1, [&](const ContributionRecord& record) {
    records.push_back(record);
    return true;
  });
  if (!scanned.ok() && !IsDamage(scanned)) return scanned;
  if (!scanned.ok()) ++lost;
  for (ContributionRecord& record : records) {
    std::vector<ContributedPhoto> photos;
    scanned = from.ScanContributedPhotos(record.number, 0, [&](const ContributedPhoto& photo) {
      photos.push_back(photo);
      return true;
    });
    if (!scanned.ok() && !IsDamage(scanned)) return scanned;
    if (!scanned.ok()) ++lost;
    record.photo_count = 0;
    for (const ContributedPhoto& photo : photos) {
      // One that waits is entered again with its upload.
      if (photo.fate == ContributionFate::kWaiting) continue;
      ++record.photo_count;
      VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
          [&](Transaction& transaction) { transaction.PutContributedPhoto(photo); }));
    }
    VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
        [&](Transaction& transaction) { transaction.PutContribution(record); }));
  }
  VEDUTA_RETURN_IF_ERROR(healing->writer.Commit());  // HealUploads looks for them
  if (lost > 0) {
    healing->notes.Add("some contributions cannot be read: " + scanned.message(),
                       "they are left out from there on; their photos stay");
  }
  return Status::Ok();
}

}  // namespace veduta
