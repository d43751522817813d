// SPDX-License-Identifier: Apache-2.0
// Photos that wait for their turn: each is whole, and has a number that was given. Photos that
// arrive in parts: the bytes of each are those that it has received.
#include <map>

#include "engine/query/checked_city.h"
#include "engine/query/stored_records.h"
#include "storage/records/partial_upload_record.h"
#include "storage/records/sealed_record.h"
#include "storage/records/upload_record.h"

namespace veduta {
namespace {

struct StoredUploads {
  std::map<uint64_t, UploadRecord> records;
  std::map<uint64_t, ContentHash> photos;  // as they lie there
  std::map<ImageId, ContentHash> originals;
  uint64_t last_number = 0;
  struct Pieces {
    uint32_t count = 0;
    uint64_t bytes = 0;
  };
  std::map<PartialUploadId, PartialUploadRecord> partial;
  std::map<PartialUploadId, Pieces> pieces;
};

Status ReadEntry(std::string_view key, std::string_view value, StoredUploads* stored) {
  UploadEntry entry{};
  uint64_t number = 0;
  VEDUTA_RETURN_IF_ERROR(ParseUploadKey(key, &entry, &number));
  switch (entry) {
    case UploadEntry::kRecord:
      return Decode(value, number, &stored->records[number]);
    case UploadEntry::kBytes:
      stored->photos[number] =
          HashContent({reinterpret_cast<const uint8_t*>(value.data()), value.size()});
      return Status::Ok();
    case UploadEntry::kPiece: {
      PartialUploadId id{};
      uint32_t piece = 0;
      VEDUTA_RETURN_IF_ERROR(ParsePieceKey(key, &id, &piece));
      StoredUploads::Pieces& pieces = stored->pieces[id];
      pieces.bytes += value.size();
      // They come in their order: one that is missing makes the others too many.
      pieces.count = piece == pieces.count ? piece + 1 : UINT32_MAX;
      return Status::Ok();
    }
    case UploadEntry::kOriginal: {
      ImageId image;
      if (!ParseOriginalKey(key, &image)) return Status::Corruption("a key with image id 0");
      stored->originals[image] =
          HashContent({reinterpret_cast<const uint8_t*>(value.data()), value.size()});
      return Status::Ok();
    }
    case UploadEntry::kLastNumber:
      break;
  }
  return DecodeLastUpload(value, &stored->last_number);
}

Status ReadPartial(std::string_view key, std::string_view value, StoredUploads* stored) {
  PartialUploadRecord partial;
  VEDUTA_RETURN_IF_ERROR(ParsePartialUploadKey(key, &partial.id));
  VEDUTA_RETURN_IF_ERROR(Decode(value, &partial));
  if (key != PartialUploadKey(partial.id, partial.upload != 0))
    return Status::Corruption("it lies among those that are on their way otherwise");
  stored->partial[partial.id] = std::move(partial);
  return Status::Ok();
}

bool IsPartial(std::string_view key) {
  return key.starts_with(PartialUploadPrefix(false)) || key.starts_with(PartialUploadPrefix(true));
}

std::string NameOf(uint64_t number) {
  return "upload " + std::to_string(number);
}

// What was sealed belongs to an image that has a photo, and is found by its hash.
void CheckOriginals(const CheckedCity& city, const std::map<ImageId, ContentHash>& originals,
                    Violations* violations) {
  for (const auto& [image, original] : originals) {
    violations->Expect(city.HasFeatures(image), [&, image = image] {
      return "an original is sealed of image " + std::to_string(image.value) +
             ", which is rejected or does not exist";
    });
    const auto found = city.sealed.find(original);
    violations->Expect(found != city.sealed.end() && found->second == image, [&, image = image] {
      return "the original of image " + std::to_string(image.value) + " is not found by its hash";
    });
  }
  for (const auto& [original, image] : city.sealed) {
    violations->Expect(originals.contains(image), [&, image = image] {
      return "no original is sealed of image " + std::to_string(image.value) +
             ", which is found by the hash of one";
    });
  }
}

}  // namespace

Status CheckUploads(const CheckedCity& city, Violations* violations) {
  StoredUploads stored;
  const auto take = [&](std::string_view key, std::string_view value) {
    const Status read = ReadEntry(key, value, &stored);
    if (!read.ok()) violations->Add(PlaceOf(Family::kUploads, key) + ": " + read.message());
  };
  VEDUTA_RETURN_IF_ERROR(WalkStored(city.snapshot, Family::kUploads, violations, take));
  const auto take_partial = [&](std::string_view key, std::string_view value) {
    const Status read = IsPartial(key) ? ReadPartial(key, value, &stored) : Status::Ok();
    if (!read.ok()) violations->Add(PlaceOf(Family::kContributions, key) + ": " + read.message());
  };
  VEDUTA_RETURN_IF_ERROR(
      WalkStored(city.snapshot, Family::kContributions, violations, take_partial));
  for (const auto& [number, upload] : stored.records) {
    const auto photo = stored.photos.find(number);
    violations->Expect(photo != stored.photos.end() && photo->second == upload.photo,
                       [&, number = number] { return NameOf(number) + " has not its photo"; });
    violations->Expect(number <= stored.last_number, [&, number = number] {
      return NameOf(number) + " has a number that was not given yet";
    });
  }
  for (const auto& [id, partial] : stored.partial) {
    const StoredUploads::Pieces& pieces = stored.pieces[id];
    const uint64_t bytes = partial.upload == 0 ? partial.received_bytes : 0;
    violations->Expect(pieces.count == partial.piece_count && pieces.bytes == bytes,
                       [&, key = PartialUploadKey(id)] {
                         return PlaceOf(Family::kContributions, key) +
                                ": its pieces are not the bytes that it has received";
                       });
  }
  for (const auto& [id, pieces] : stored.pieces) {
    violations->Expect(stored.partial.contains(id) || pieces.count == 0, [&, id = id] {
      return PlaceOf(Family::kUploads, PieceKey(id, 0)) + ": a piece of no upload";
    });
  }
  CheckOriginals(city, stored.originals, violations);
  for (const auto& [number, photo] : stored.photos) {
    violations->Expect(stored.records.contains(number), [&, number = number] {
      return NameOf(number) + " has a photo, and nothing else is known of it";
    });
  }
  return Status::Ok();
}

}  // namespace veduta
