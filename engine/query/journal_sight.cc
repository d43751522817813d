// SPDX-License-Identifier: Apache-2.0
#include "engine/query/journal_sight.h"

#include <charconv>
#include <map>
#include <optional>

namespace veduta {
namespace {

// Takes the number from the front of the text; nothing where it does not begin with one.
std::optional<uint32_t> TakeNumber(std::string_view* text) {
  uint32_t number = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), number);
  if (error != std::errc()) return std::nullopt;
  text->remove_prefix(end - text->data());
  return number;
}

std::vector<ImageId> ImagesNamedIn(std::string_view text) {
  constexpr std::string_view kNoun = "image", kAnd = " and ";
  std::vector<ImageId> named;
  for (size_t at = text.find(kNoun); at != std::string_view::npos; at = text.find(kNoun)) {
    text.remove_prefix(at + kNoun.size());
    const bool is_plural = text.starts_with("s ");
    if (!is_plural && !text.starts_with(" ")) continue;
    text.remove_prefix(is_plural ? 2 : 1);
    std::optional<uint32_t> number = TakeNumber(&text);
    while (number) {
      named.push_back(ImageId(*number));
      if (!is_plural || !text.starts_with(kAnd)) break;
      text.remove_prefix(kAnd.size());
      number = TakeNumber(&text);
    }
  }
  return named;
}

constexpr std::string_view kOfCurators[] = {"hide", "unhide", "report", "dismiss"};

// The number of the contribution that such an entry is about, which its detail ends with; 0 where
// it does not.
uint32_t ContributionOf(std::string_view detail) {
  detail.remove_prefix(detail.find_last_of(' ') + 1);
  uint32_t number = 0;
  std::from_chars(detail.data(), detail.data() + detail.size(), number);
  return number;
}

Result<bool> MayTell(const Visibility& visibility, const JournalAnswer& entry) {
  for (const std::string_view action : kOfCurators) {
    if (entry.action == action) return false;
  }
  // It is about two reconstructions, of which the other one may be out of sight.
  if (entry.action == "hypothesis" && !visibility.SeesWhole()) return false;
  if (entry.image.valid()) return visibility.Sees(entry.image);
  if (entry.action != "contribution") return visibility.SeesWhole();
  return visibility.SeesContribution(ContributionOf(entry.detail));
}

// The detail of an entry that may be told names other reconstructions, and other images.
Result<bool> MayTellDetail(const Visibility& visibility, const JournalAnswer& entry) {
  if (entry.action == "contribution") return true;  // it names itself alone
  if (!visibility.SeesWhole()) return false;
  return SeesNamed(visibility, entry.detail);
}

// Takes out of entries that may be told what else they name.
class Cutter final {
 public:
  explicit Cutter(const Visibility& visibility) : visibility_(visibility) {}

  Status Cut(JournalAnswer* entry) {
    VEDUTA_ASSIGN_OR_RETURN(const bool may_tell, MayTellDetail(visibility_, *entry));
    if (!may_tell) entry->detail.clear();
    if (visibility_.SeesWhole() || !entry->reconstruction.valid()) return Status::Ok();
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, Sees(entry->reconstruction));
    if (!sees) entry->reconstruction = {};
    return Status::Ok();
  }

 private:
  // Entries are about few reconstructions, and one look may read a whole contribution.
  Result<bool> Sees(ReconstructionId reconstruction) {
    const auto found = seen_.find(reconstruction);
    if (found != seen_.end()) return found->second;
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility_.Sees(reconstruction));
    seen_.emplace(reconstruction, sees);
    return sees;
  }

  const Visibility& visibility_;
  std::map<ReconstructionId, bool> seen_;
};

}  // namespace

Result<bool> SeesNamed(const Visibility& visibility, std::string_view text) {
  if (visibility.SeesAll()) return true;
  for (const ImageId image : ImagesNamedIn(text)) {
    VEDUTA_ASSIGN_OR_RETURN(const bool sees, visibility.Sees(image));
    if (!sees) return false;
  }
  return true;
}

Status MaskEntries(const Visibility& visibility, std::vector<JournalAnswer>* entries) {
  if (visibility.SeesAll()) return Status::Ok();
  Cutter cutter(visibility);
  for (JournalAnswer& entry : *entries) {
    VEDUTA_ASSIGN_OR_RETURN(const bool may_tell, MayTell(visibility, entry));
    if (may_tell) {
      VEDUTA_RETURN_IF_ERROR(cutter.Cut(&entry));
      continue;
    }
    JournalAnswer masked;
    masked.sequence = entry.sequence;
    masked.time_unix_s = entry.time_unix_s;
    masked.action = std::move(entry.action);
    entry = std::move(masked);
  }
  return Status::Ok();
}

}  // namespace veduta
