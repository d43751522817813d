// SPDX-License-Identifier: Apache-2.0
#include "storage/record_counts.h"

#include <algorithm>

namespace veduta {
namespace {

// The counter of images that have this verdict.
uint64_t DatabaseCounts::*CounterOf(Verdict verdict) {
  switch (verdict) {
    case Verdict::kPlaced:
    case Verdict::kMerged:
    case Verdict::kFounded:
      return &DatabaseCounts::placed;
    case Verdict::kPostponed:
      return &DatabaseCounts::postponed;
    case Verdict::kRejected:
      return &DatabaseCounts::rejected;
  }
  return &DatabaseCounts::rejected;  // no such verdict is ever stored (Check of an ImageRecord)
}

}  // namespace

Result<DatabaseCounts> CountRecords(const Snapshot& snapshot) {
  DatabaseCounts counts;
  VEDUTA_RETURN_IF_ERROR(snapshot.ScanImages([&](const ImageRecord& image) {
    ++counts.images;
    ++(counts.*CounterOf(image.verdict));
    if (image.gps) ++counts.located;
    return true;
  }));
  VEDUTA_ASSIGN_OR_RETURN(const std::vector<CameraRecord> cameras, snapshot.ListCameras());
  counts.cameras = cameras.size();
  return counts;
}

Status CountChanges::Note(const Snapshot& base, ImageId id, std::optional<Counted> after) {
  const auto known = images_.find(id);
  if (known != images_.end()) {
    known->second.after = after;
    return Status::Ok();
  }
  const Result<ImageRecord> stored = base.GetImage(id);
  if (!stored.ok() && stored.status().code() != StatusCode::kNotFound) return stored.status();
  std::optional<Counted> before;
  if (stored.ok()) before = Counted{stored->verdict, stored->gps.has_value()};
  images_.insert({id, {before, after}});
  return Status::Ok();
}

Status CountChanges::NotePut(const Snapshot& base, const ImageRecord& image) {
  return Note(base, image.id, Counted{image.verdict, image.gps.has_value()});
}

Status CountChanges::NoteRemoval(const Snapshot& base, ImageId image) {
  return Note(base, image, std::nullopt);
}

Status CountChanges::NotePut(const Snapshot& base, const CameraRecord& camera) {
  const Status stored = base.GetCamera(camera.id).status();
  if (stored.code() == StatusCode::kNotFound) {
    new_cameras_.insert(camera.id);
    return Status::Ok();
  }
  return stored;
}

bool CountChanges::empty() const {
  return new_cameras_.empty() && std::ranges::all_of(images_, [](const auto& entry) {
           const Change& change = entry.second;
           if (!change.before || !change.after) return change.before == change.after;
           return CounterOf(change.before->verdict) == CounterOf(change.after->verdict) &&
                  change.before->is_located == change.after->is_located;
         });
}

std::optional<DatabaseCounts> CountChanges::ApplyTo(
    const std::optional<DatabaseCounts>& base) const {
  if (!base) return std::nullopt;
  DatabaseCounts counts = *base;
  counts.cameras += new_cameras_.size();
  for (const auto& [id, change] : images_) {
    if (change.after) {
      ++counts.images;
      ++(counts.*CounterOf(change.after->verdict));
      if (change.after->is_located) ++counts.located;
    }
    if (!change.before) continue;
    uint64_t& left = counts.*CounterOf(change.before->verdict);
    if (left == 0 || counts.images == 0) return std::nullopt;
    if (change.before->is_located && counts.located-- == 0) return std::nullopt;
    --counts.images;
    --left;
  }
  return counts;
}

}  // namespace veduta
