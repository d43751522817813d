// SPDX-License-Identifier: Apache-2.0
#pragma once
// Fills the private areas of photos before anything else sees them.

#include <atomic>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "engine/door/submission.h"
#include "engine/photo/blur_command.h"
#include "engine/photo/photo_preparer.h"
#include "storage/database.h"

namespace veduta {

// What is to be stored of a photo.
struct BlurredPhoto {
  // False where the bytes are stored already, or are no photo that can be decoded: then nobody was
  // asked, and nothing may be stored.
  bool was_asked = false;
  // Where something is private: a JPEG in which that is filled and which names it
  // (private_areas.h), and the bytes as they came. Otherwise the photo is stored as it came.
  std::optional<std::vector<uint8_t>> filled = {};
  std::vector<uint8_t> original = {};
};

// Thread-safe.
class PhotoBlurrer final {
 public:
  // `program` as in EngineOptions::blur_command. Preparer and database must outlive it.
  PhotoBlurrer(std::string program, const PhotoPreparer* preparer, const Database* database,
               BlurCommandLimits limits = {})
      : program_(std::move(program)), preparer_(preparer), database_(database), limits_(limits) {}

  // Decodes the photo, and asks the program. An error says that the photo may not be stored now:
  // kBusy where the program fails; kNoMemory, kIoError, kNotFound.
  Result<BlurredPhoto> Blur(const PhotoSource& photo) const;
  // Ends the programs that run; all that is asked from then on fails with kBusy.
  void Stop() { is_stopped_ = true; }

 private:
  Result<BlurredPhoto> BlurBytes(std::vector<uint8_t> bytes) const;

  const std::string program_;
  const PhotoPreparer* const preparer_;
  const Database* const database_;
  const BlurCommandLimits limits_;
  std::atomic<bool> is_stopped_ = false;
};

}  // namespace veduta
