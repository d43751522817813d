// SPDX-License-Identifier: Apache-2.0
#include "engine/repair/healing.h"

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "engine/journal/journal.h"

namespace veduta {
namespace {

// The newest vocabulary that can be read, where the state does not say which one it was.
constexpr uint32_t kGenerationMax = 1000;  // far more than are ever trained; chosen by hand

Status FindVocabulary(HealingWork* healing) {
  DatabaseState& state = healing->state;
  for (uint32_t generation = kGenerationMax; generation > 0; --generation) {
    const Result<StoredBytes> tree = healing->from().GetVocabulary(generation);
    if (!tree.ok() && !IsDamage(tree.status())) return tree.status();
    if (!tree.ok()) continue;
    state.vocabulary_generation = generation;
    return Status::Ok();  // how many images it was made for, the journal tells: RestateJournal
  }
  return Status::Ok();
}

Status HealVocabulary(HealingWork* healing) {
  DatabaseState& state = healing->state;
  if (healing->state_is_lost) VEDUTA_RETURN_IF_ERROR(FindVocabulary(healing));
  if (state.vocabulary_generation == 0) return Status::Ok();
  Status damage;
  const Result<StoredBytes> bytes = healing->from().GetVocabulary(state.vocabulary_generation);
  if (bytes.ok()) {
    Result<VocabularyTree> tree = VocabularyTree::Parse(bytes->bytes());
    damage = tree.status();
    if (tree.ok()) healing->vocabulary = std::move(*tree);
  } else {
    damage = bytes.status();
  }
  Database* const target = healing->writer.target();
  if (healing->vocabulary) {
    return target == nullptr
               ? Status::Ok()
               : target->WriteVocabularyAhead(state.vocabulary_generation, bytes->bytes());
  }
  if (!IsDamage(damage)) return damage;
  healing->notes.Add("the vocabulary cannot be read: " + damage.message(),
                     state.vocabulary_imported
                         ? "all photos are compared until one is trained: it had been imported, so "
                           "import it again"
                         : "all photos are compared until it is trained again");
  state.vocabulary_generation = state.images_at_vocabulary = 0;
  state.vocabulary_imported = false;
  return Status::Ok();
}

// The state as the records have turned out to be, with a word in the journal.
Status WriteState(HealingWork* healing) {
  DatabaseState& state = healing->state;
  uint32_t retrievable = 0;
  for (const auto& [id, image] : healing->images) {
    state.next_image = std::max(state.next_image, id.value + 1);
    if (image.verdict != Verdict::kRejected) ++retrievable;
  }
  if (!healing->told.removed.empty())
    state.next_image = std::max(state.next_image, healing->told.removed.rbegin()->value + 1);
  state.removed_bytes_left = false;  // the files are new
  if (!healing->cameras.empty())
    state.next_camera = std::max(state.next_camera, healing->cameras.rbegin()->first.value + 1);
  state.retrievable_image_count = retrievable;
  std::set<ImageId> once;
  std::erase_if(state.pending_propagation, [&](ImageId id) {
    return healing->FindPhoto(id) == nullptr || !once.insert(id).second;
  });
  return healing->writer.Put([&](Transaction& transaction) {
    JournalRecord entry;
    entry.actor = "veduta";
    entry.action = "repair";
    entry.detail = std::to_string(healing->notes.findings.size()) + " damages, " +
                   std::to_string(healing->notes.lost.size()) + " photos lost";
    AppendJournal(std::move(entry), &state, &transaction);
    transaction.PutState(state);
  });
}

}  // namespace

bool IsDamage(const Status& status) {
  if (status.code() == StatusCode::kCorruption || status.code() == StatusCode::kNotFound)
    return true;
  // A file of the database that is gone. RocksDB has no code of its own for it.
  return status.code() == StatusCode::kIoError &&
         status.message().find(std::strerror(ENOENT)) != std::string::npos;
}

std::string PhotoText(const ImageRecord& image) {
  return "photo '" + image.name + "' (image " + std::to_string(image.id.value) + ")";
}

const ImageRecord* HealingWork::FindPhoto(ImageId id) const {
  const auto found = images.find(id);
  return found == images.end() || found->second.verdict == Verdict::kRejected ? nullptr
                                                                              : &found->second;
}

bool HealingWork::IsLiving(ReconstructionId id) const {
  const auto found = reconstructions.find(id);
  return found != reconstructions.end() && found->second.is_living();
}

void HealingWork::StandIn(ImageId id, const PhotoName& name) {
  if (cameras.empty()) return;  // no image can be without one
  ImageRecord& image = images[id];
  image = {};
  image.id = id;
  image.name = name.name.empty() ? "lost/" + std::to_string(id.value) : name.name;
  const std::string_view text = image.name;
  image.photo = HashContent({reinterpret_cast<const uint8_t*>(text.data()), text.size()});
  image.camera = cameras.begin()->first;
  const auto told_of_it = told.images.find(id);
  image.contributor = name.contributor;
  if (image.contributor.empty())
    image.contributor = told_of_it == told.images.end() ? "veduta" : told_of_it->second.contributor;
  image.verdict = Verdict::kRejected;
  image.reason = Reason::kUnreadable;
  image.detail = "its record was damaged";
}

Status HealingWork::TryAgain(ImageId id) {
  ImageRecord& image = images.at(id);
  image.verdict = Verdict::kPostponed;
  image.reason = Reason::kResectionFailed;
  image.detail = "its place was damaged, and it is tried again";
  notes.retried.push_back(image.name);
  if (std::ranges::find(state.pending_propagation, id) == state.pending_propagation.end())
    state.pending_propagation.push_back(id);
  return writer.Put([&](Transaction& transaction) { transaction.PutImage(image); });
}

Status HealState(HealingWork* healing) {
  Result<DatabaseState> state = healing->from().GetState();
  if (state.ok()) {
    healing->state = std::move(*state);
  } else {
    if (!IsDamage(state.status())) return state.status();
    healing->state_is_lost = true;
    healing->notes.Add("the state cannot be read: " + state.status().message(),
                       "it is derived from the records");
  }
  return HealVocabulary(healing);
}

namespace {

// The one that it has become by merges; not valid() where they lead nowhere.
ReconstructionId MergedEndOf(const HealingWork& healing, ReconstructionId id) {
  for (size_t step = 0; step <= healing.reconstructions.size(); ++step) {
    const auto found = healing.reconstructions.find(id);
    if (found == healing.reconstructions.end()) break;
    if (!found->second.merged_into.valid()) return id;
    id = found->second.merged_into;
  }
  return {};
}

bool AreTwo(const HealingWork& healing, ReconstructionId a, ReconstructionId b) {
  const ReconstructionId end_a = MergedEndOf(healing, a), end_b = MergedEndOf(healing, b);
  return end_a.valid() && end_b.valid() && end_a != end_b;
}

bool StillHolds(const HealingWork& healing, const ForbiddenRecord& forbidden) {
  if (forbidden.kind == ForbiddenKind::kMerge)
    return AreTwo(healing, ReconstructionId(forbidden.a), ReconstructionId(forbidden.b));
  return healing.FindPhoto(ImageId(forbidden.a)) != nullptr &&
         healing.FindPhoto(ImageId(forbidden.b)) != nullptr;
}

// Those whose photos are there, and those whose reconstructions are there and are two.
Status HealForbidden(HealingWork* healing) {
  const Result<std::vector<ForbiddenRecord>> all = healing->from().ListForbidden();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add("what people have forbidden cannot be read: " + all.status().message(),
                       "nothing is forbidden any more: `veduta journal` tells what was");
    return Status::Ok();
  }
  for (const ForbiddenRecord& forbidden : *all) {
    if (!StillHolds(*healing, forbidden)) continue;
    VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
        [&](Transaction& transaction) { transaction.PutForbidden(forbidden); }));
  }
  return Status::Ok();
}

// With the sightings whose photos are there.
Status HealGroundPoints(HealingWork* healing) {
  Result<std::vector<GroundPoint>> all = healing->from().ListGroundPoints();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add("the surveyed points cannot be read: " + all.status().message(),
                       "there are none any more: read their file again with 'veduta georeference'");
    return Status::Ok();
  }
  for (GroundPoint& point : *all) {
    std::erase_if(point.sightings, [&](const GroundSighting& sighting) {
      return healing->FindPhoto(sighting.image) == nullptr;
    });
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.PutGroundPoint(point); }));
  }
  return Status::Ok();
}

Status HealTokens(HealingWork* healing) {
  const Result<std::vector<TokenRecord>> all = healing->from().ListTokens();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add("the tokens cannot be read: " + all.status().message(),
                       "there are none any more: make new ones with 'veduta token create'");
    return Status::Ok();
  }
  for (const TokenRecord& token : *all) {
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.PutToken(token); }));
  }
  return Status::Ok();
}

bool IsMergeForbidden(const HealingWork& healing, std::span<const ForbiddenRecord> forbidden,
                      const HypothesisRecord& hypothesis) {
  return std::ranges::any_of(forbidden, [&](const ForbiddenRecord& record) {
    if (record.kind != ForbiddenKind::kMerge) return false;
    const ReconstructionId a = MergedEndOf(healing, ReconstructionId(record.a)),
                           b = MergedEndOf(healing, ReconstructionId(record.b));
    return (a == hypothesis.a && b == hypothesis.b) || (a == hypothesis.b && b == hypothesis.a);
  });
}

// Leaves out the photos that the hypothesis names and that are not there. Whether there were any.
bool MendHypothesis(const HealingWork& healing, HypothesisRecord* hypothesis) {
  const auto is_missing = [&](ImageId image) { return healing.FindPhoto(image) == nullptr; };
  const bool lost_proposer = hypothesis->image.valid() && is_missing(hypothesis->image);
  if (lost_proposer) hypothesis->image = {};
  const bool lost_images = std::erase_if(hypothesis->images, is_missing) > 0;
  std::erase_if(hypothesis->unsure, is_missing);
  hypothesis->is_due = hypothesis->is_due || lost_images;
  return lost_proposer || lost_images;
}

// Those whose reconstructions live and whose photos are there; the rest is proposed anew.
Status HealHypotheses(HealingWork* healing) {
  const Result<std::vector<HypothesisRecord>> all = healing->from().ListHypotheses();
  if (!all.ok()) {
    if (!IsDamage(all.status())) return all.status();
    healing->notes.Add("the hypotheses cannot be read: " + all.status().message(),
                       "there are none any more: later photos propose them anew");
    return Status::Ok();
  }
  const Result<std::vector<ForbiddenRecord>> forbidden = healing->from().ListForbidden();
  size_t left_out = 0, mended = 0;
  for (HypothesisRecord hypothesis : *all) {
    const bool was_mended = MendHypothesis(*healing, &hypothesis);
    const bool holds = healing->IsLiving(hypothesis.a) && healing->IsLiving(hypothesis.b) &&
                       !hypothesis.images.empty() &&
                       !(forbidden.ok() && IsMergeForbidden(*healing, *forbidden, hypothesis));
    if (!holds) {
      ++left_out;
      continue;
    }
    if (was_mended) ++mended;
    VEDUTA_RETURN_IF_ERROR(healing->writer.Put(
        [&](Transaction& transaction) { transaction.PutHypothesis(hypothesis); }));
  }
  if (mended > 0) {
    healing->notes.Add(std::to_string(mended) + " hypotheses name photos that are not there",
                       "those are left out, and the hypotheses are judged anew");
  }
  if (left_out > 0) {
    healing->notes.Add(std::to_string(left_out) + " hypotheses are of what is not there",
                       "they are left out: later photos propose them anew");
  }
  return Status::Ok();
}

}  // namespace

Status HealAll(HealingWork* healing) {
  for (const std::string& damage : healing->source.damage())
    healing->notes.Add(damage, "what the other files hold is read past it");
  VEDUTA_RETURN_IF_ERROR(HealState(healing));
  VEDUTA_RETURN_IF_ERROR(HealJournal(healing));
  VEDUTA_RETURN_IF_ERROR(HealCameras(healing));
  VEDUTA_RETURN_IF_ERROR(HealImages(healing));
  VEDUTA_RETURN_IF_ERROR(HealPhotos(healing));
  VEDUTA_RETURN_IF_ERROR(HealPairs(healing));
  VEDUTA_RETURN_IF_ERROR(HealMap(healing));
  VEDUTA_RETURN_IF_ERROR(HealSubmaps(healing));
  VEDUTA_RETURN_IF_ERROR(HealDense(healing));
  VEDUTA_RETURN_IF_ERROR(HealForbidden(healing));
  VEDUTA_RETURN_IF_ERROR(HealGroundPoints(healing));
  VEDUTA_RETURN_IF_ERROR(HealTokens(healing));
  VEDUTA_RETURN_IF_ERROR(HealHypotheses(healing));
  VEDUTA_RETURN_IF_ERROR(HealContributions(healing));
  VEDUTA_RETURN_IF_ERROR(HealModeration(healing));
  VEDUTA_RETURN_IF_ERROR(HealUploads(healing->source, healing->writer.target(), &healing->notes));
  VEDUTA_RETURN_IF_ERROR(RestateJournal(healing));
  VEDUTA_RETURN_IF_ERROR(WriteState(healing));
  return healing->writer.Commit();
}

}  // namespace veduta
