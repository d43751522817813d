// SPDX-License-Identifier: Apache-2.0
#include "storage/contributing_view.h"

#include <string>

#include "storage/record_finder.h"
#include "storage/records/contribution_record.h"
#include "storage/records/partial_upload_record.h"
#include "storage/records/record_parts.h"

namespace veduta {
namespace {

class ContributingView final : public ContributingReader {
 public:
  explicit ContributingView(const ValueReader& reader) : reader_(reader) {}

  Result<std::vector<PartialUploadRecord>> ListPartialUploads(bool have_arrived) const override {
    std::vector<PartialUploadRecord> all;
    VEDUTA_RETURN_IF_ERROR(
        reader_.Scan(Family::kContributions, PartialUploadPrefix(have_arrived), "",
                     [&](std::string_view key, std::string_view value, bool* /*more*/) {
                       PartialUploadRecord& partial = all.emplace_back();
                       VEDUTA_RETURN_IF_ERROR(ParsePartialUploadKey(key, &partial.id));
                       return Decode(value, &partial);
                     }));
    return all;
  }

  Result<std::optional<PartialUploadRecord>> FindPartialUpload(
      const PartialUploadId& id) const override {
    PartialUploadRecord partial;
    partial.id = id;
    VEDUTA_ASSIGN_OR_RETURN(std::optional<PartialUploadRecord> found,
                            FindRecord(reader_, Family::kContributions, PartialUploadKey(id),
                                       PartialUploadRecord(partial)));
    if (found) return found;
    return FindRecord(reader_, Family::kContributions, PartialUploadKey(id, true),
                      std::move(partial));
  }

  Result<std::vector<uint8_t>> GetPieces(const PartialUploadRecord& partial) const override {
    std::vector<uint8_t> bytes;
    for (uint32_t number = 0; number < partial.piece_count; ++number) {
      const std::string key = PieceKey(partial.id, number);
      std::string piece;
      VEDUTA_ASSIGN_OR_RETURN(const bool found, reader_.Copy(Family::kUploads, key, &piece));
      if (!found) return InValue(Family::kUploads, key, Status::Corruption("there is no value"));
      bytes.insert(bytes.end(), piece.begin(), piece.end());
    }
    if (bytes.size() == partial.received_bytes) return bytes;
    return InValue(
        Family::kUploads, PartialUploadKey(partial.id),
        Status::Corruption("its pieces have " + std::to_string(bytes.size()) +
                           " bytes instead of " + std::to_string(partial.received_bytes)));
  }

  Result<std::optional<ContributionRecord>> FindContribution(uint32_t number) const override {
    ContributionRecord contribution;
    contribution.number = number;
    return FindRecord(reader_, Family::kContributions, ContributionKey(number),
                      std::move(contribution));
  }

  Status ScanContributions(
      uint32_t first, const std::function<bool(const ContributionRecord&)>& visit) const override {
    return reader_.Scan(Family::kContributions, ContributionPrefix(), ContributionKey(first),
                        [&](std::string_view key, std::string_view value, bool* more) {
                          ContributionRecord contribution;
                          VEDUTA_RETURN_IF_ERROR(ParseContributionKey(key, &contribution));
                          VEDUTA_RETURN_IF_ERROR(Decode(value, &contribution));
                          *more = visit(contribution);
                          return Status::Ok();
                        });
  }

  Status ScanContributedPhotos(
      uint32_t contribution, uint64_t first,
      const std::function<bool(const ContributedPhoto&)>& visit) const override {
    return reader_.Scan(Family::kContributions, ContributedPhotoPrefix(contribution),
                        ContributedPhotoKey(contribution, first),
                        [&](std::string_view key, std::string_view value, bool* more) {
                          ContributedPhoto photo;
                          VEDUTA_RETURN_IF_ERROR(ParseContributedPhotoKey(key, &photo));
                          VEDUTA_RETURN_IF_ERROR(Decode(value, &photo));
                          *more = visit(photo);
                          return Status::Ok();
                        });
  }

  Result<uint32_t> LastContribution() const override {
    uint32_t last = 0;
    const auto decode = [&](std::string_view value) { return DecodeU32(value, &last); };
    VEDUTA_RETURN_IF_ERROR(
        reader_.Read(Family::kContributions, LastContributionKey(), decode).status());
    return last;
  }

 private:
  const ValueReader& reader_;
};

}  // namespace

std::unique_ptr<const ContributingReader> MakeContributingReader(const ValueReader& reader) {
  return std::make_unique<ContributingView>(reader);
}

}  // namespace veduta
