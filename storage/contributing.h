// SPDX-License-Identifier: Apache-2.0
#pragma once
// Photos that arrive in parts, and contributions: photos that were sent together. None of it is a
// part of the city, or of its digest.

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "storage/base/status.h"
#include "storage/model/contribution.h"
#include "storage/model/partial_upload.h"

namespace veduta {

class ContributingReader {
 public:
  virtual ~ContributingReader() = default;

  // Those on their way, or those that have arrived and are still remembered; by their ids.
  virtual Result<std::vector<PartialUploadRecord>> ListPartialUploads(
      bool have_arrived = false) const = 0;
  // Of either kind.
  virtual Result<std::optional<PartialUploadRecord>> FindPartialUpload(
      const PartialUploadId& id) const = 0;
  // The bytes that have come. kCorruption where they are not there, or not as many as the record
  // says.
  virtual Result<std::vector<uint8_t>> GetPieces(const PartialUploadRecord& partial) const = 0;

  virtual Result<std::optional<ContributionRecord>> FindContribution(uint32_t number) const = 0;
  // Each calls visit in ascending numbers from `first` on, until it returns false.
  virtual Status ScanContributions(
      uint32_t first, const std::function<bool(const ContributionRecord&)>& visit) const = 0;
  virtual Status ScanContributedPhotos(
      uint32_t contribution, uint64_t first,
      const std::function<bool(const ContributedPhoto&)>& visit) const = 0;
  // The number that was given last; 0 where none was.
  virtual Result<uint32_t> LastContribution() const = 0;
};

}  // namespace veduta
