// SPDX-License-Identifier: Apache-2.0
#include "storage/records/vocabulary_record.h"

#include <functional>

#include "storage/records/key_bytes.h"
#include "storage/records/message.h"
#include "storage/records/record_parts.h"

namespace veduta {
namespace {

static_assert(sizeof(ImageId) == 4);  // rows are copied as they lie

}  // namespace

std::string VocabularyKey(uint32_t generation) {
  return Key32(generation);
}

std::string WordsKey(uint32_t generation, ImageId image) {
  return Key32x2(generation, image.value);
}

std::string PostingsKey(uint32_t generation, WordId word) {
  return Key32x2(generation, word);
}

Status CheckWords(std::span<const WordId> words) {
  if (StrictlyAscending(words, std::less<>())) return Status::Ok();
  return Broken("order of the words", "wrong", "strictly ascending");
}

Result<std::string> EncodeWords(std::span<const WordId> words) {
  VEDUTA_RETURN_IF_ERROR(CheckWords(words));
  return std::string(reinterpret_cast<const char*>(words.data()), words.size_bytes());
}

Status DecodeWords(std::string_view value, std::vector<WordId>* words) {
  if (!CopyRows(value.data(), value.size(), words)) return BadRows("words");
  return Damaged(CheckWords(*words));
}

Status CheckImages(std::span<const ImageId> images) {
  if (!images.empty()) VEDUTA_RETURN_IF_ERROR(CheckId("image", images.front()));
  if (StrictlyAscending(images, std::less<>())) return Status::Ok();
  return Broken("order of the images", "wrong", "strictly ascending");
}

Result<std::string> EncodeImages(std::span<const ImageId> images) {
  VEDUTA_RETURN_IF_ERROR(CheckImages(images));
  return std::string(reinterpret_cast<const char*>(images.data()), images.size_bytes());
}

std::string EncodePostingsRemoval(ImageId image) {
  return EncodeU32(0) + EncodeU32(image.value);
}

Status DecodeImages(std::string_view value, std::vector<ImageId>* images) {
  if (!CopyRows(value.data(), value.size(), images)) return BadRows("images");
  return Damaged(CheckImages(*images));
}

}  // namespace veduta
