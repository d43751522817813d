// SPDX-License-Identifier: Apache-2.0
#pragma once
// Families `vocabulary` (the tree, as index/ serializes it), `words` and `postings`, by generation.
// FORMAT.md, section "vocabulary_record".

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "storage/base/ids.h"
#include "storage/base/status.h"

namespace veduta {

std::string VocabularyKey(uint32_t generation);  // also the prefix of its words and postings
std::string WordsKey(uint32_t generation, ImageId image);
std::string PostingsKey(uint32_t generation, WordId word);

// Raw arrays, without a message around them: ascending, each once; ids of images are valid.
Status CheckWords(std::span<const WordId> words);
Result<std::string> EncodeWords(std::span<const WordId> words);
Status DecodeWords(std::string_view value, std::vector<WordId>* words);
Status CheckImages(std::span<const ImageId> images);
Result<std::string> EncodeImages(std::span<const ImageId> images);
Status DecodeImages(std::string_view value, std::vector<ImageId>* images);
// An operand for family `postings` that takes the image out of a list.
std::string EncodePostingsRemoval(ImageId image);

}  // namespace veduta
