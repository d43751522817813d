// SPDX-License-Identifier: Apache-2.0
#include "engine/query/told_by_journal.h"

#include <charconv>
#include <string_view>

#include "engine/journal/camera_entry.h"

namespace veduta {
namespace {

// A reconstruction is founded with three images.
constexpr uint64_t kImagesAtFounding = 3;

// The number before `suffix` at the end of a sentence.
std::optional<uint64_t> NumberBefore(std::string_view suffix, std::string_view text) {
  if (!text.ends_with(suffix)) return std::nullopt;
  text.remove_suffix(suffix.size());
  text.remove_prefix(text.find_last_of(' ') + 1);
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return number;
}

// The number that a sentence begins with.
std::optional<uint64_t> NumberAtFront(std::string_view text) {
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc()) return std::nullopt;
  return number;
}

// Images that others founded a reconstruction with, and those that wait, changed without an entry.
// One that lost its pose has an entry, until it was tried again.
bool HasItsOwnDetail(const ImageRecord& image) {
  return (image.verdict == Verdict::kPostponed && image.reason != Reason::kDoubted) ||
         (image.verdict == Verdict::kFounded && image.detail.starts_with("founded with image "));
}

}  // namespace

void ToldByJournal::Take(const JournalRecord& entry) {
  const bool restates = entry.action == "repair";
  if (entry.action == "add" || (restates && entry.image.valid()))
    images[entry.image] = {entry.actor, entry.detail, false};
  if (entry.action == "propagate") {
    images[entry.image].detail = entry.detail;
    images[entry.image].propagated = true;
  }
  if (entry.action == "import" && entry.image.valid()) {
    images[entry.image].detail = entry.detail;
    images[entry.image].propagated = false;
  }
  if (entry.action == "doubt") images[entry.image].detail = entry.detail;
  if (entry.action == "split") {
    // "5 images of reconstruction 1, whose frame it keeps"
    if (const auto count = NumberAtFront(entry.detail))
      images_at_adjustment[entry.reconstruction] = *count;
  }
  if (entry.action == "remove" && entry.image.valid()) {
    removed.insert(entry.image);
    images.erase(entry.image);
  }
  if (entry.action == "camera") {
    const std::optional<CameraRecord> camera = ParseCameraEntry(entry.detail);
    cameras.insert(camera ? camera->name : entry.detail);
  }
  if (entry.action == "adjust" || (restates && entry.reconstruction.valid())) {
    if (const auto count = NumberBefore(" images", entry.detail))
      images_at_adjustment[entry.reconstruction] = *count;
  }
  if (entry.action == "vocabulary") {
    images_at_vocabulary = NumberBefore(" images", entry.detail);
    vocabulary_imported = entry.detail.starts_with("imported");
  }
}

bool ToldByJournal::HasContributorOf(const ImageRecord& image) const {
  const auto found = images.find(image.id);
  return found != images.end() && found->second.contributor == image.contributor;
}

bool ToldByJournal::AgreesWith(const ImageRecord& image) const {
  if (!HasContributorOf(image)) return false;
  if (HasItsOwnDetail(image)) return true;
  const Image& told = images.at(image.id);
  const std::string before = image.verdict == Verdict::kRejected ? "rejected: " : "";
  const bool has_wrong_reason =
      image.verdict == Verdict::kPlaced && told.propagated != (image.reason == Reason::kPropagated);
  return !has_wrong_reason && told.detail == before + image.detail;
}

bool ToldByJournal::AgreesWith(const DatabaseState& state) const {
  return (state.vocabulary_generation != 0) == images_at_vocabulary.has_value() &&
         state.images_at_vocabulary == images_at_vocabulary.value_or(0) &&
         state.vocabulary_imported == vocabulary_imported;
}

uint64_t ToldByJournal::ImagesAtAdjustment(ReconstructionId id) const {
  const auto found = images_at_adjustment.find(id);
  return found == images_at_adjustment.end() ? kImagesAtFounding : found->second;
}

}  // namespace veduta
