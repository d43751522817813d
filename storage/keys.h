// SPDX-License-Identifier: Apache-2.0
#pragma once
// Keys of every family. Integers are big-endian, so that keys sort as their numbers do and a scan
// over one image, one image's neighbours or one generation is one run of neighbouring keys.
// Grammar: storage/FORMAT.md.

#include <cstdint>
#include <string>
#include <string_view>

#include "storage/base/content_hash.h"
#include "storage/base/ids.h"

namespace veduta {

// Keys of `meta`.
inline constexpr std::string_view kFormatKey = "format";
inline constexpr std::string_view kStateKey = "state";

// First byte of a key in `pairs`: two kinds of entry share the family. Never renumbered.
enum class PairEntry : uint8_t {
  kNeighbor = 1,  // image, other: under both orders, a few bytes
  kRecord = 2,    // smaller, larger: everything, with the matches
};

// First byte of a key in `queue`: what was written ahead of its commit. Never renumbered.
enum class MarkKind : uint8_t {
  kPhoto = 1,        // content hash
  kPointBlocks = 2,  // reconstruction, generation
  kVocabulary = 3,   // generation
};

void AppendBigEndian32(std::string* key, uint32_t value);
void AppendBigEndian64(std::string* key, uint64_t value);
// The number at the front of `key`, which is taken off; false, and nothing taken, when it is too
// short.
bool TakeBigEndian32(std::string_view* key, uint32_t* value);
bool TakeBigEndian64(std::string_view* key, uint64_t* value);

std::string CameraKey(CameraId id);
std::string ImageKey(ImageId id);  // images, poses, observations
std::string ReconstructionKey(ReconstructionId id);
std::string HashKey(const ContentHash& hash);  // photos, features, hashes
bool ParseHashKey(std::string_view key, ContentHash* hash);

std::string NeighborPrefix(ImageId image);
std::string NeighborKey(ImageId image, ImageId other);
std::string PairKey(ImageId smaller, ImageId larger);

std::string PointBlockPrefix(ReconstructionId reconstruction, uint32_t generation);
std::string PointBlockKey(ReconstructionId reconstruction, uint32_t generation, ImageId home);

std::string VocabularyKey(
    uint32_t generation);  // also the prefix of a generation's words and postings
std::string WordsKey(uint32_t generation, ImageId image);
std::string PostingsKey(uint32_t generation, WordId word);

std::string JournalKey(uint64_t sequence);

std::string PhotoMarkKey(const ContentHash& photo);
bool ParsePhotoMarkKey(std::string_view key, ContentHash* photo);  // false: another mark
std::string PointBlocksMarkKey(ReconstructionId reconstruction, uint32_t generation);
std::string VocabularyMarkKey(uint32_t generation);

// The smallest key that is greater than every key of ours that starts with `prefix`.
std::string PrefixEnd(std::string_view prefix);

// For messages: printable keys as they are, others in hexadecimal.
std::string KeyText(std::string_view key);

}  // namespace veduta
