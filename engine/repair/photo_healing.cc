// SPDX-License-Identifier: Apache-2.0
// Photos with their features and words: the photo is the only thing that cannot be made again.
#include "engine/repair/healing.h"

namespace veduta {
namespace {

// The photo is gone: its image stays as a rejected one, so that the file can be added again under
// its name.
void SetAside(const std::string& damage, const std::string& detail, ImageRecord* image,
              HealingWork* healing) {
  healing->notes.Add(PhotoText(*image) + ": " + damage, "it is set aside: " + detail);
  healing->notes.lost.push_back(image->name);
  image->verdict = Verdict::kRejected;
  image->reason = Reason::kUnreadable;
  image->detail = detail;
  image->feature_count = 0;
}

// A photo that is whole, of a camera that is lost.
void SetLoose(ImageRecord* image, HealingWork* healing) {
  healing->notes.loose.push_back({image->name, image->photo, "", image->contributor});
  image->verdict = Verdict::kRejected;
  image->reason = Reason::kUnreadable;
  image->detail = "its camera was damaged: add the camera, then the photo again";
  image->feature_count = 0;
}

// The features as they are stored, or else computed again. No features: the photo gives none any
// more, which is noted.
Result<std::optional<Features>> FeaturesOf(const std::vector<uint8_t>& bytes, ImageRecord* image,
                                           HealingWork* healing) {
  Result<Features> stored = healing->from().GetFeatures(image->photo);
  if (stored.ok() && stored->size() == image->feature_count)
    return std::optional(std::move(*stored));
  if (!stored.ok() && !IsDamage(stored.status())) return stored.status();
  const CameraModel& camera = healing->cameras.at(image->camera).extraction_model();
  PreparedPhoto photo =
      healing->preparer.Extract({image->name, "", bytes}, camera, StoredLayout(image->orientation));
  VEDUTA_RETURN_IF_ERROR(photo.failure);  // the memory was too short: nothing is lost
  if (photo.reason != Reason::kNone) {
    SetAside("its features cannot be read, and it gives none: " + photo.detail,
             "the features were damaged and could not be computed again", image, healing);
    return std::optional<Features>();
  }
  if (!stored.ok()) {
    healing->notes.Add(
        "the features of " + PhotoText(*image) + " cannot be read: " + stored.status().message(),
        "they are computed again from the photo");
  }
  const uint32_t count = static_cast<uint32_t>(photo.features.size());
  if (count != image->feature_count) {
    healing->notes.Add(PhotoText(*image) + " has " + std::to_string(count) + " features, not " +
                           std::to_string(image->feature_count),
                       "its record is corrected");
    image->feature_count = count;
  }
  return std::optional(std::move(photo.features));
}

Result<std::vector<WordId>> WordsOf(const ImageRecord& image, const Features& features,
                                    HealingWork* healing) {
  if (!healing->vocabulary) return std::vector<WordId>();
  if (healing->options.keeps_words) {
    const Result<std::vector<WordId>> stored =
        healing->from().GetWords(healing->state.vocabulary_generation, image.id);
    if (stored.ok() && !stored->empty()) return *stored;
    if (!stored.ok() && !IsDamage(stored.status())) return stored.status();
    healing->notes.Add("the words of " + PhotoText(image) + " cannot be read",
                       "they are looked up again in the vocabulary");
  }
  return DistinctWords(healing->vocabulary->QuantizeAll(features.descriptors));
}

Status WritePhoto(const ImageRecord& image, const std::vector<uint8_t>& bytes,
                  const Features& features, std::span<const WordId> words, HealingWork* healing) {
  Database* const target = healing->writer.target();
  if (target == nullptr) return Status::Ok();
  VEDUTA_RETURN_IF_ERROR(target->WritePhotoAhead(image.photo, bytes, features));
  const Result<StoredBytes> original = healing->from().GetOriginal(image.id);
  if (!original.ok() && original.status().code() != StatusCode::kNotFound) {
    if (!IsDamage(original.status())) return original.status();
    healing->notes.Add("what was sealed of " + PhotoText(image) + " cannot be read",
                       "it is left out: the photo stays, with its areas filled");
  }
  return healing->writer.Put([&](Transaction& transaction) {
    transaction.PutImage(image);
    if (original.ok()) transaction.SealOriginal(image.id, original->bytes());
    const uint32_t generation = healing->state.vocabulary_generation;
    if (!healing->vocabulary) return;
    transaction.PutWords(generation, image.id, words);
    transaction.AddPostings(generation, words, image.id);
  });
}

Status HealPhoto(ImageRecord* image, HealingWork* healing) {
  const Result<std::vector<uint8_t>> bytes =
      healing->source.GetPhoto(image->photo, image->size_bytes);
  if (!bytes.ok()) {
    if (!IsDamage(bytes.status())) return bytes.status();
    SetAside("its bytes cannot be read: " + bytes.status().message(),
             "the stored photo was damaged: add it again", image, healing);
  } else if (!healing->cameras.contains(image->camera)) {
    SetLoose(image, healing);
  } else {
    VEDUTA_ASSIGN_OR_RETURN(const std::optional<Features> features,
                            FeaturesOf(*bytes, image, healing));
    if (features) {
      VEDUTA_ASSIGN_OR_RETURN(const std::vector<WordId> words, WordsOf(*image, *features, healing));
      return WritePhoto(*image, *bytes, *features, words, healing);
    }
  }
  return healing->writer.Put([&](Transaction& transaction) { transaction.PutImage(*image); });
}

// By contributor.
using Names = std::set<std::pair<std::string, std::string>>;

// Two records may name one photo, or have one name, where an old record came back.
bool IsTakenAlready(const ImageRecord& image, Names* names, std::set<ContentHash>* photos) {
  if (!names->insert({image.contributor, image.name}).second) return true;
  return image.verdict != Verdict::kRejected && !photos->insert(image.photo).second;
}

}  // namespace

Status HealPhotos(HealingWork* healing) {
  Names names;
  std::set<ContentHash> photos;
  for (auto& [id, image] : healing->images) {
    if (IsTakenAlready(image, &names, &photos)) {
      healing->notes.Add(PhotoText(image) + " has the name or the photo of another image",
                         "its record is left out");
      healing->StandIn(image.id, {});
    }
    if (image.verdict != Verdict::kRejected) {
      VEDUTA_RETURN_IF_ERROR(HealPhoto(&image, healing));
    } else {
      VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
          [&image = image](Transaction& transaction) { transaction.PutImage(image); }));
    }
  }
  return Status::Ok();
}

}  // namespace veduta
