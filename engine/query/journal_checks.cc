// SPDX-License-Identifier: Apache-2.0
// The journal, and what it says once more of things that nothing else determines: who contributed
// an image and why it is where it is, what a camera is called, when all of a reconstruction was
// last adjusted, how many images the vocabulary was made for.
#include <charconv>

#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"

namespace veduta {
namespace {

// The last that the journal says of each.
struct Told {
  struct Image {
    std::string contributor, detail;
    bool propagated = false;
  };
  std::map<ImageId, Image> images;
  std::map<ReconstructionId, uint64_t> images_at_adjustment;
  std::multiset<std::string> cameras;
  std::optional<uint64_t> images_at_vocabulary;
  bool vocabulary_imported = false;
};

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

// The name of a camera's entry, "NAME: SIZE PARAMS"; older programs wrote the name alone.
std::string CameraNameIn(const std::string& detail) {
  const size_t params = detail.rfind(' ');
  if (params == std::string::npos || params == 0) return detail;
  const size_t size = detail.rfind(' ', params - 1);
  if (size == std::string::npos || size == 0 || detail[size - 1] != ':') return detail;
  return detail.substr(0, size - 1);
}

void Take(const JournalRecord& entry, Told* told) {
  if (entry.action == "add") told->images[entry.image] = {entry.actor, entry.detail, false};
  if (entry.action == "propagate") {
    told->images[entry.image].detail = entry.detail;
    told->images[entry.image].propagated = true;
  }
  if (entry.action == "camera") told->cameras.insert(CameraNameIn(entry.detail));
  if (entry.action == "merge") told->images_at_adjustment[entry.reconstruction] = 0;
  if (entry.action == "adjust") {
    if (const auto count = NumberBefore(" images", entry.detail))
      told->images_at_adjustment[entry.reconstruction] = *count;
  }
  if (entry.action == "vocabulary") {
    told->images_at_vocabulary = NumberBefore(" images", entry.detail);
    told->vocabulary_imported = entry.detail.starts_with("imported");
  }
}

Status ReadJournal(const CheckedCity& city, Told* told, Violations* violations) {
  uint64_t expected = 1;
  VEDUTA_RETURN_IF_ERROR(WalkRecords<JournalRecord>(
      city.snapshot, Family::kJournal, violations, [&](const JournalRecord& entry) {
        violations->Expect(entry.sequence == expected,
                           [&] { return "the journal lacks entry " + std::to_string(expected); });
        expected = entry.sequence + 1;
        violations->Expect(
            (!entry.image.valid() || city.images.contains(entry.image)) &&
                (!entry.reconstruction.valid() ||
                 city.reconstructions.contains(entry.reconstruction)),
            [&] {
              return "entry " + std::to_string(entry.sequence) +
                     " of the journal names an image or a reconstruction that does not exist";
            });
        Take(entry, told);
      }));
  violations->Expect(expected == city.state.next_journal, [&] {
    return "the journal ends before entry " + std::to_string(city.state.next_journal);
  });
  return Status::Ok();
}

// Images that others founded a reconstruction with, and those that wait, changed without an entry.
bool HasItsOwnDetail(const ImageRecord& image) {
  return image.verdict == Verdict::kPostponed ||
         (image.verdict == Verdict::kFounded && image.detail.starts_with("founded with image "));
}

void CompareImages(const CheckedCity& city, const Told& told, Violations* violations) {
  for (const auto& [id, image] : city.images) {
    const auto found = told.images.find(id);
    violations->Expect(
        found != told.images.end() && found->second.contributor == image.contributor,
        [&, id = id] { return NameOf(id) + " is not in the journal as one of its contributor"; });
    if (found == told.images.end() || HasItsOwnDetail(image)) continue;
    const std::string before = image.verdict == Verdict::kRejected ? "rejected: " : "";
    const bool has_wrong_reason = image.verdict == Verdict::kPlaced &&
                                  found->second.propagated != (image.reason == Reason::kPropagated);
    violations->Expect(
        !has_wrong_reason && found->second.detail == before + image.detail,
        [&, id = id] { return NameOf(id) + " has another reason than the journal says"; });
  }
}

void CompareRest(const CheckedCity& city, const Told& told, Violations* violations) {
  std::multiset<std::string> names;
  for (const auto& [id, camera] : city.cameras) names.insert(camera.name);
  violations->Expect(names == told.cameras, "the cameras have other names than the journal says");
  for (const auto& [id, record] : city.reconstructions) {
    const auto found = told.images_at_adjustment.find(id);
    const uint64_t wanted = found == told.images_at_adjustment.end() ? 3 : found->second;
    // 0 makes the adjustment due, and the next one puts it right.
    const bool is_due = record.images_at_adjustment == 0;
    violations->Expect(is_due || record.images_at_adjustment == wanted, [&, id = id] {
      return NameOf(id) + " was last adjusted with " + std::to_string(wanted) +
             " images, and its record says " + std::to_string(record.images_at_adjustment);
    });
  }
  const bool has_vocabulary = city.state.vocabulary_generation != 0;
  violations->Expect(has_vocabulary == told.images_at_vocabulary.has_value() &&
                         city.state.images_at_vocabulary == told.images_at_vocabulary.value_or(0) &&
                         city.state.vocabulary_imported == told.vocabulary_imported,
                     "the state says something else of its vocabulary than the journal");
}

}  // namespace

Status CheckJournal(const CheckedCity& city, Violations* violations) {
  Told told;
  VEDUTA_RETURN_IF_ERROR(ReadJournal(city, &told, violations));
  CompareImages(city, told, violations);
  CompareRest(city, told, violations);
  return Status::Ok();
}

}  // namespace veduta
