// SPDX-License-Identifier: Apache-2.0
#pragma once
// Which of many photos show one place, before there is a city that could say it.

#include <cstdint>
#include <span>
#include <stop_token>
#include <vector>

#include "engine/camera/decoder.h"
#include "engine/door/submission.h"
#include "storage/base/thread_pool.h"

namespace veduta {

class AlikePhotos final {
 public:
  // Matches the strongest few features of each two of the photos; of the first 1,500, where there
  // are more. Photos that cannot be read look like none. kCancelled after a stop request.
  // Deterministic, whatever the number of threads. About 10 ms of one thread for each photo of half
  // a megapixel, and 20 us for each two.
  static Result<AlikePhotos> Look(std::span<const PhotoSource> photos, const PhotoDecoder& decoder,
                                  ThreadPool* pool, const std::stop_token& stop);

  // Of the photos in `among` (ascending) up to so many that look most like each other, ascending:
  // the one that looks most like others, and one after the other those most like what is chosen
  // already. Fewer where no other looks like any of them; none where no two are alike.
  // O(count_max * size of among).
  std::vector<size_t> Choose(std::span<const size_t> among, size_t count_max) const;

 private:
  struct Alike {
    uint32_t photo = 0, likeness = 0;
  };
  explicit AlikePhotos(size_t count) : alike_(count) {}

  std::vector<std::vector<Alike>> alike_;  // of each photo
};

}  // namespace veduta
