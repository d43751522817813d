// SPDX-License-Identifier: Apache-2.0
#pragma once
// Finds what belongs to an image by two array accesses. The map of a city is asked for its images
// and points millions of times in one adjustment, where a search tree takes most of the time.

#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "storage/base/ids.h"

namespace veduta {

// Pointers to things that others own, by image id. Ids are given out in ascending order from 1, so
// the ids that are held lie on few pages. A page takes 8 KiB, and an id that is not held none.
// Copies would point to the owner of the original, so there are none. Not thread-safe; const
// functions may run in parallel.
template <typename T>
class ImageTable final {
 public:
  ImageTable() = default;
  ImageTable(ImageTable&&) = default;
  ImageTable& operator=(ImageTable&&) = default;

  // Null where nothing is held.
  T* Find(ImageId id) const {
    const size_t page = id.value / kPageSize;
    if (page >= pages_.size() || pages_[page] == nullptr) return nullptr;
    return (*pages_[page])[id.value % kPageSize];
  }

  void Set(ImageId id, T* thing) {
    const size_t page = id.value / kPageSize;
    if (page >= pages_.size()) pages_.resize(page + 1);
    if (pages_[page] == nullptr) pages_[page] = std::make_unique<Page>();
    (*pages_[page])[id.value % kPageSize] = thing;
  }

  void Erase(ImageId id) {
    if (Find(id) != nullptr) Set(id, nullptr);
  }

  void Clear() { pages_.clear(); }

 private:
  static constexpr size_t kPageSize = 1024;  // ids on a page; chosen by hand, not measured
  using Page = std::array<T*, kPageSize>;

  std::vector<std::unique_ptr<Page>> pages_;
};

}  // namespace veduta
