// SPDX-License-Identifier: Apache-2.0
// Pairs of images. Each is written with both of its directions.
#include <algorithm>

#include "engine/query/checked_city.h"
#include "engine/repair/healing.h"

namespace veduta {
namespace {

// Pairs that may be there, with both images in the city.
Result<std::set<std::pair<ImageId, ImageId>>> FindPairs(const HealingWork& healing,
                                                        uint32_t* unreadable) {
  std::set<std::pair<ImageId, ImageId>> pairs;
  for (const auto& [id, image] : healing.images) {
    if (healing.FindPhoto(id) == nullptr) continue;
    const Result<std::vector<PairNeighbor>> neighbors = healing.from().ListNeighbors(id);
    if (neighbors.ok()) {
      for (const PairNeighbor& neighbor : *neighbors) pairs.insert(std::minmax(id, neighbor.image));
      continue;
    }
    if (!IsDamage(neighbors.status())) return neighbors.status();
    ++*unreadable;
    // The list cannot be read: any other image may be in it.
    for (const auto& [other, ignored] : healing.images) {
      if (other != id) pairs.insert(std::minmax(id, other));
    }
  }
  std::erase_if(pairs, [&](const auto& pair) {
    return healing.FindPhoto(pair.first) == nullptr || healing.FindPhoto(pair.second) == nullptr;
  });
  return pairs;
}

bool NamesFeatures(const PairRecord& pair, const HealingWork& healing) {
  const uint32_t count_a = healing.FindPhoto(pair.a)->feature_count;
  const uint32_t count_b = healing.FindPhoto(pair.b)->feature_count;
  return std::ranges::all_of(pair.matches, [&](const FeatureMatch& match) {
    return match.a < count_a && match.b < count_b;
  });
}

// What verify would say against the pair; empty where it would say nothing.
std::string ObjectionTo(const PairRecord& pair, const CheckedCity& city) {
  Violations violations(1);
  CheckPair(city, pair, &violations);
  const std::vector<std::string> found = violations.Take();
  return found.empty() ? "" : found.front();
}

void NoteLosses(uint32_t unreadable, uint32_t lost, const std::vector<std::string>& objections,
                RepairNotes* notes) {
  if (unreadable > 0) {
    notes->Add("the lists of neighbors of " + std::to_string(unreadable) + " photos cannot be read",
               "they are made again from the records of pairs");
  }
  const std::string remedy = "they are left out: the photos stay, with fewer neighbors";
  if (lost > 0) notes->Add(std::to_string(lost) + " pairs of photos cannot be read", remedy);
  if (objections.empty()) return;
  notes->Add(std::to_string(objections.size()) +
                 " pairs of photos contradict their features, the first: " + objections.front(),
             remedy);
}

}  // namespace

Status HealPairs(HealingWork* healing) {
  uint32_t unreadable = 0, lost = 0;
  std::vector<std::string> objections;
  CheckedCity city(healing->from(), /*is_deep=*/false, /*prepares=*/nullptr);
  city.cameras = healing->cameras;
  city.images = healing->images;
  VEDUTA_ASSIGN_OR_RETURN(const auto pairs, FindPairs(*healing, &unreadable));
  for (const auto& [a, b] : pairs) {
    const Result<PairRecord> pair = healing->from().GetPair(a, b);
    if (!pair.ok() && !IsDamage(pair.status())) return pair.status();
    if (!pair.ok()) {
      if (pair.status().code() != StatusCode::kNotFound) ++lost;
      continue;
    }
    std::string objection = NamesFeatures(*pair, *healing)
                                ? ObjectionTo(*pair, city)
                                : "a match names a feature that does not exist";
    if (!objection.empty()) {
      objections.push_back(std::move(objection));
      continue;
    }
    VEDUTA_RETURN_IF_ERROR(
        healing->writer.Put([&](Transaction& transaction) { transaction.PutPair(*pair); }));
  }
  NoteLosses(unreadable, lost, objections, &healing->notes);
  return Status::Ok();
}

}  // namespace veduta
